"""Verdicts from times: a clear saving counts, and noise decides nothing."""

import pytest

from amiri2026.paper.judges import closed_loop, summary
from amiri2026.paper.judges.times import cheaper
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, UNDECIDED, UNTESTABLE
from continuair import equations
from continuair.equations import dynamics
from tests.paper import given


@pytest.mark.parametrize(
    ("decoupled", "verdict"),
    [(0.70, HOLDS), (0.97, UNDECIDED), (1.03, UNDECIDED), (1.2, FAILS)],
)
def test_only_a_saving_beyond_noise_makes_a_plant_cheaper(decoupled: float, verdict: str) -> None:
    cost = given.cost((1.0, 0.0, 0.0), (decoupled, 0.0, 0.0))
    assert cheaper(given.evidence(cost=cost)).verdict == verdict


@pytest.mark.parametrize("decoupled", [22.0, 24.5, 32.0])
def test_times_of_simulink_cannot_be_tested_whatever_ours_are(decoupled: float) -> None:
    given_times = given.evidence(cost=given.cost((32, 0, 0), (decoupled, 0, 0)))
    found = closed_loop.JUDGES["IV-C.16"](given_times)
    assert found.verdict == UNTESTABLE and f"{decoupled / 32.0:.2f}" in found.evidence


@pytest.mark.parametrize("decoupled", [0.5, 0.97, 1.5])
def test_times_do_not_decide_which_model_is_more_complex(decoupled: float) -> None:
    found = summary.more_complex(given.evidence(cost=given.cost((1, 0, 0), (decoupled, 0, 0))))
    assert [case.found.verdict for case in found.cases] == [HOLDS, FAILS]
    assert found.verdict == DEPENDS and found.times and not any("[s]" in n for n in found.numbers)


def test_a_saving_in_the_camera_is_noise_and_not_one_of_dropped_coupling_terms() -> None:
    """V.5: what the dynamics lack, put back, has to make up for the whole saving."""
    of_dynamics = given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4)))
    of_camera = given.evidence(cost=given.cost((1.0, 0.6, 0.4), (0.9, 0.1, 0.4)))
    assert summary.what_is_saved(of_dynamics).verdict == HOLDS
    assert summary.what_is_saved(of_camera).verdict == UNDECIDED
    noisy = given.evidence(cost=given.cost((1.0, 0.6, 0.4), (1.02, 0.4, 0.4)))
    assert cheaper(noisy).verdict == UNDECIDED


def test_a_compiled_model_without_other_elements_than_the_blocks_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    masks = equations.masks
    monkeypatch.setattr(dynamics, "masks", lambda n: masks(n) | {"block": masks(n)["diagonal"]})
    found = given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4)))
    assert summary.what_is_saved(found).verdict == DEPENDS


def test_times_are_told_apart_from_numbers_that_another_machine_must_find() -> None:
    found = cheaper(given.evidence(cost=given.cost((1.0, 0.4, 0.4), (0.7, 0.4, 0.4))))
    assert not found.numbers
    assert found.times["sampling instant, coupled [s]"] == pytest.approx(1.8e-6)
