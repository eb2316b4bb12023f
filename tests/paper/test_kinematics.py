"""Judges of III-A, III-B and Appendix A: corrected formulas turn their verdicts."""

from typing import Any

import mpmath
import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import as_printed, kinematics, near_straight
from continuair.studies.paper.judges.agreement import partial, random_states
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, Judgement

VEHICLE = ca.load_vehicle("paper")

FOUND = {
    "III-A.4": REPRODUCED,
    "III-A.6": REPRODUCED,
    "III-A.7": NOT_REPRODUCED,
    "III-A.8": NOT_REPRODUCED,
    "III-A.10": REPRODUCED,
    "III-A.11": REPRODUCED,
    "III-A.13": REPRODUCED,
    "III-B.3": NOT_REPRODUCED,
    "III-B.4": NOT_REPRODUCED,
    "III-B.5": REPRODUCED,
    "App-A.1": REPRODUCED,
}


def judged(name: str, **changes: Any) -> Judgement:
    vehicle = VEHICLE.replace({field.replace("__", "."): to for field, to in changes.items()})
    return kinematics.JUDGES[name](Evidence(vehicle, quick=True))


@pytest.mark.parametrize("name", FOUND)
def test_verdict_does_not_hang_on_the_arm(name: str) -> None:
    assert judged(name).verdict == FOUND[name]
    assert judged(name, arm__length=0.6, arm__radius=0.002).verdict == FOUND[name]


def test_every_sentence_of_these_sections_has_its_judge() -> None:
    assert set(kinematics.JUDGES) == set(FOUND)


def test_a_curve_of_another_curvature_is_not_the_arc(monkeypatch: pytest.MonkeyPatch) -> None:
    right = as_printed.position
    monkeypatch.setattr(as_printed, "position", lambda o, s, κ, ψ: right(o, s, κ * 1.00001, ψ))
    assert judged("III-A.4").verdict == NOT_REPRODUCED


def test_a_sum_of_partial_derivatives_that_lacks_one_is_not_the_velocity(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "continuair.studies.paper.judges.kinematics.partial",
        lambda f, q, i: partial(f, q, i) * (i == 6),
    )
    assert judged("III-A.6").verdict == NOT_REPRODUCED
    assert judged("III-A.8").numbers["largest_relative_difference"] > 0.1


def test_equation_2_of_a_hanging_arm_has_appendix_a_as_its_jacobian(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = as_printed.position
    hanging = np.array([1.0, 1.0, -1.0])
    monkeypatch.setattr(as_printed, "position", lambda *at: right(*at) * hanging)
    found = judged("III-A.7")
    assert found.verdict == REPRODUCED
    assert found.numbers["entries_that_agree"] == 6


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.0])
def test_the_rate_of_a_rotation_is_skew_only_where_the_rotation_is_none(angle: float) -> None:
    """About one axis the symmetric part of Ṙ = R S is sin(angle) of it."""
    sine, cosine = np.sin(angle), np.cos(angle)
    R = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    S = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    assert kinematics._symmetric_share(R @ S) == pytest.approx(abs(sine), abs=1e-15)


def test_columns_that_mix_two_frames_are_the_spin_of_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = as_printed.rotational_columns
    mirror = np.array([1.0, -1.0])
    monkeypatch.setattr(as_printed, "rotational_columns", lambda s, ψ: right(s, ψ) * mirror)
    assert judged("III-A.10").verdict == NOT_REPRODUCED


def test_columns_of_the_hanging_arm_are_a_spin_too(monkeypatch: pytest.MonkeyPatch) -> None:
    right = as_printed.rotational_columns
    turned = np.array([-1.0, 1.0])
    monkeypatch.setattr(as_printed, "rotational_columns", lambda s, ψ: right(s, ψ) * turned)
    found = judged("III-A.10")
    assert found.verdict == REPRODUCED
    assert found.numbers["largest relative difference, frenet frame, arm down"] == 1e-9


def test_without_a_threshold_the_kinematics_stays_singular(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(near_straight, "KAPPA_S", (0.0, 0.0, 0.0))
    assert judged("III-A.11").verdict == NOT_REPRODUCED


def test_rank_is_lost_where_the_arm_closes_to_a_circle() -> None:
    length = VEHICLE.arm.length
    assert near_straight.rank_share(VEHICLE, length, 2 * np.pi / length) < 1e-15
    assert near_straight.rank_share(VEHICLE, length, 3.0 / length) > 0.1


@pytest.mark.parametrize("kappa_s", [1e-6, 0.1])
def test_a_threshold_may_be_too_small_or_too_large(
    monkeypatch: pytest.MonkeyPatch, kappa_s: float
) -> None:
    monkeypatch.setattr(near_straight, "KAPPA_S", (kappa_s,))
    assert judged("III-A.13").verdict == NOT_REPRODUCED


@pytest.mark.parametrize("kappa", [1e-5, 1e-3, 0.05, 0.3, 2.0])
def test_rounding_error_is_that_against_many_digits(kappa: float) -> None:
    vehicle = VEHICLE.replace({"arm.kappa_s": 0.0, "arm.length": 0.7})
    printed = near_straight._in_arm_lengths(vehicle, kappa)
    with mpmath.workdps(50):
        x = mpmath.mpf(kappa) * mpmath.mpf(0.7)
        sine, cosine = mpmath.sin(x), mpmath.cos(x)
        exact = [(1 - cosine) / x, 0, sine / x, (cosine - 1) / x**2 + sine / x, 0,
                 sine / x**2 - cosine / x, 0, (1 - cosine) / x, 0]  # fmt: skip
    worst = np.abs(printed - np.array([float(each) for each in exact])).max()
    assert near_straight.rounding_error(vehicle, kappa) == pytest.approx(worst, abs=2e-15)


@pytest.mark.parametrize("name", ["III-B.3", "III-B.4"])
def test_with_the_mapping_itself_for_its_inverse_the_jacobians_are_right(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    right = kinematics.READINGS_OF_T_E["T_e in axes of the world"]
    monkeypatch.setitem(kinematics.READINGS_OF_T_E, "T_e⁻¹ in axes of the world", right)
    assert judged(name).verdict == REPRODUCED


def test_a_mapping_in_other_axes_is_not_what_the_jacobians_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = equations.euler_rate_matrix
    monkeypatch.setattr(
        equations, "euler_rate_matrix", lambda q: equations.rotation(q).T @ right(q)
    )
    assert judged("III-B.5").verdict == NOT_REPRODUCED


def test_level_the_printed_inverse_is_no_error() -> None:
    """T_e is 1 without roll, pitch and yaw: the misprint shows only in attitudes."""
    q = random_states(1)[0][0]
    q[3:6] = 0.0
    for reading in kinematics.READINGS_OF_T_E.values():
        np.testing.assert_allclose(reading(q), np.eye(3), rtol=0, atol=1e-15)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (1, 1), (2, 0)])
def test_any_wrong_entry_of_appendix_a_is_seen(
    monkeypatch: pytest.MonkeyPatch, row: int, column: int
) -> None:
    right = equations.arm_jacobian

    def wrong(*at: Any) -> Any:
        linear, angular = right(*at)
        linear = linear.copy()
        linear[row, column] *= 1.0001
        return linear, angular

    monkeypatch.setattr(equations, "arm_jacobian", wrong)
    assert judged("App-A.1").verdict == NOT_REPRODUCED
