"""Verdicts from times: a clear saving counts, and noise decides nothing."""

import pytest

from continuair import equations
from continuair.equations import dynamics
from continuair.studies.paper.judges import closed_loop, summary
from continuair.studies.paper.judges.times import cheaper
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, UNDECIDED
from tests.paper import given


@pytest.mark.parametrize(
    ("decoupled", "verdict"),
    [(0.70, REPRODUCED), (0.97, UNDECIDED), (1.03, UNDECIDED), (1.2, NOT_REPRODUCED)],
)
def test_only_a_saving_beyond_noise_makes_a_plant_cheaper(decoupled: float, verdict: str) -> None:
    cost = given.cost((1.0, 0.0, 0.0), (decoupled, 0.0, 0.0))
    assert cheaper(given.evidence(cost=cost)).verdict == verdict


def test_the_printed_ratio_is_reproduced_by_22_to_32_and_not_by_equal_times() -> None:
    verdicts = [
        closed_loop.sampling_instants(given.evidence(cost=given.cost((32, 0, 0), taken))).verdict
        for taken in ((22, 0, 0), (24.5, 0, 0), (32, 0, 0))
    ]
    assert verdicts == [REPRODUCED, UNDECIDED, NOT_REPRODUCED]


def test_a_saving_in_the_camera_is_noise_and_not_one_of_dropped_coupling_terms() -> None:
    """V.5: what the dynamics lack, put back, has to make up for the whole saving."""
    of_dynamics = given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4)))
    of_camera = given.evidence(cost=given.cost((1.0, 0.6, 0.4), (0.9, 0.1, 0.4)))
    assert summary.what_is_saved(of_dynamics).verdict == REPRODUCED
    assert summary.what_is_saved(of_camera).verdict == UNDECIDED
    noisy = given.evidence(cost=given.cost((1.0, 0.6, 0.4), (1.02, 0.4, 0.4)))
    assert cheaper(noisy).verdict == UNDECIDED


def test_a_compiled_model_without_other_elements_than_the_blocks_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    masks = equations.masks
    monkeypatch.setattr(dynamics, "masks", lambda n: masks(n) | {"block": masks(n)["diagonal"]})
    found = given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4)))
    assert summary.what_is_saved(found).verdict == NOT_REPRODUCED


def test_times_are_told_apart_from_numbers_that_another_machine_must_find() -> None:
    found = cheaper(given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4))))
    assert not found.numbers
    assert found.times["sampling instant, coupled [s]"] == pytest.approx(1.8e-6)
