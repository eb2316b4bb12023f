"""Judges of III-A, III-B and Appendix A: corrected formulas turn their verdicts."""

from typing import Any

import mpmath
import numpy as np
import pytest

import continuair as ca
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import as_printed, kinematics, near_straight, regularised
from amiri2026.paper.judges.agreement import partial, random_states
from amiri2026.table.compiled import Job, fly
from amiri2026.table.printed import GRAVITY
from amiri2026.table.reading import Reading
from amiri2026.verdicts import HOLDS, MISPRINT, Judgement
from continuair import equations

VEHICLE = ca.load_vehicle("paper")

FOUND = {
    "III-A.4": HOLDS,
    "III-A.6": HOLDS,
    "III-A.7": MISPRINT,
    "III-A.8": MISPRINT,
    "III-A.10": HOLDS,
    "III-A.11": HOLDS,
    "III-A.13": HOLDS,
    "III-B.3": MISPRINT,
    "III-B.5": HOLDS,
    "App-A.1": HOLDS,
}


def judged(name: str, **changes: Any) -> Judgement:
    vehicle = VEHICLE.replace({field.replace("__", "."): to for field, to in changes.items()})
    return kinematics.JUDGES[name](Evidence(vehicle, quick=True))


@pytest.mark.long
@pytest.mark.parametrize("name", FOUND)
def test_verdict_does_not_hang_on_the_arm(name: str) -> None:
    found = judged(name)
    assert found.verdict == FOUND[name]
    assert bool(found.correction) == (found.verdict == MISPRINT)
    assert judged(name, arm__length=0.6, arm__radius=0.002).verdict == FOUND[name]


def test_every_sentence_of_these_sections_has_its_judge() -> None:
    assert set(kinematics.JUDGES) == set(FOUND)


def test_a_curve_of_another_curvature_is_not_the_arc(monkeypatch: pytest.MonkeyPatch) -> None:
    right = as_printed.position
    monkeypatch.setattr(as_printed, "position", lambda o, s, κ, ψ: right(o, s, κ * 1.00001, ψ))
    assert judged("III-A.4").verdict == MISPRINT


def test_a_sum_of_partial_derivatives_that_lacks_one_is_not_the_velocity(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "amiri2026.paper.judges.kinematics.partial",
        lambda f, q, i: partial(f, q, i) * (i == 6),
    )
    assert judged("III-A.6").verdict == MISPRINT
    assert judged("III-A.8").numbers["largest_relative_difference"] > 0.1


def test_equation_2_of_a_hanging_arm_has_appendix_a_as_its_jacobian(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = as_printed.position
    hanging = np.array([1.0, 1.0, -1.0])
    monkeypatch.setattr(as_printed, "position", lambda *at: right(*at) * hanging)
    found = judged("III-A.7")
    assert found.verdict == HOLDS
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
    assert judged("III-A.10").verdict == MISPRINT


def test_columns_of_the_hanging_arm_are_a_spin_too(monkeypatch: pytest.MonkeyPatch) -> None:
    right = as_printed.rotational_columns
    turned = np.array([-1.0, 1.0])
    monkeypatch.setattr(as_printed, "rotational_columns", lambda s, ψ: right(s, ψ) * turned)
    found = judged("III-A.10")
    assert found.verdict == HOLDS
    assert found.numbers["largest relative difference, frenet frame, arm down"] == 1e-9


def test_without_a_threshold_the_kinematics_stays_singular(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(near_straight, "ANGLES", (0.0, 0.0, 0.0))
    assert judged("III-A.11").verdict == MISPRINT


def test_rank_is_lost_where_the_arm_closes_to_a_circle() -> None:
    length = VEHICLE.arm.length
    assert near_straight.rank_share(length, 2 * np.pi / length) < 1e-15
    assert near_straight.rank_share(length, 3.0 / length) > 0.1


@pytest.mark.long
@pytest.mark.parametrize("angle", [1e-6, 0.1])
def test_a_threshold_may_be_too_small_or_too_large(
    monkeypatch: pytest.MonkeyPatch, angle: float
) -> None:
    monkeypatch.setattr(near_straight, "ANGLES", (angle,))
    assert judged("III-A.13").verdict == MISPRINT


@pytest.mark.parametrize("kappa", [1e-5, 1e-3, 0.05, 0.3, 2.0])
def test_rounding_error_is_that_against_many_digits(kappa: float) -> None:
    printed = near_straight._in_arm_lengths(0.7, kappa)
    with mpmath.workdps(50):
        x = mpmath.mpf(kappa) * mpmath.mpf(0.7)
        sine, cosine = mpmath.sin(x), mpmath.cos(x)
        exact = [(1 - cosine) / x, 0, sine / x, (cosine - 1) / x**2 + sine / x, 0,
                 sine / x**2 - cosine / x, 0, (1 - cosine) / x, 0]  # fmt: skip
    worst = np.abs(printed - np.array([float(each) for each in exact])).max()
    assert near_straight.rounding_error(0.7, kappa) == pytest.approx(worst, abs=2e-15)


def test_the_recorded_rounding_is_that_of_the_printed_formulas() -> None:
    """(cos κs - 1)/κ² loses half of all digits at 1e-6 rad, where 2 sin²(κs/2) loses none."""
    assert 1e-6 < near_straight.rounding_error(1.0, 1e-6) < 1e-3
    assert near_straight.rounding_error(1.0, 1e-3) < 1e-9


def test_equation_6_keeps_a_larger_curvature_and_replaces_both_signs_of_a_smaller_one() -> None:
    kept = [as_printed.regularised(κ, 0.01) for κ in (-0.02, -0.01, 0.0, 0.01, 0.02)]
    assert kept == [-0.02, 0.01, 0.01, 0.01, 0.02]


@pytest.mark.long
def test_a_threshold_that_no_flight_reaches_changes_none() -> None:
    """In Test C |κ| of the preset stays above 1e-5 1/m."""
    found = regularised.fly_with(VEHICLE, "C", 1e-6)
    assert found.tip < 1e-6 and found.drift < 1e-6 and not found.ended


@pytest.mark.long
def test_a_threshold_that_the_arm_swings_through_changes_momentum_only_out_of_plane() -> None:
    in_plane, free = (regularised.fly_with(VEHICLE, test, 1e-3) for test in "BC")
    assert 0.0 < in_plane.drift < 1e-3 and in_plane.tip < 1e-3
    assert free.drift > 0.3 and free.tip > 0.5
    assert free.errors[0] == pytest.approx(0.052, rel=0.01)
    assert free.errors[1] == pytest.approx(0.94, rel=0.01)


def test_the_centre_of_mass_falls_freely_without_a_threshold() -> None:
    bare = VEHICLE.replace({"arm.kappa_s": 0.0})
    (flight,) = fly([Job(bare, Reading(remark1=False), "C", "coupled")])
    path = regularised.centre_of_mass(bare, flight)
    fall = path[0] - 0.5 * GRAVITY * flight.time[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(path, fall, rtol=0, atol=1e-7)


@pytest.mark.long
def test_kinematics_are_judged_of_an_arm_too_stiff_to_be_flown() -> None:
    found = judged("III-A.13", arm__length=0.05, arm__radius=0.01)
    assert found.verdict == HOLDS
    assert "step limit" in found.evidence
    assert not any("RMSE" in name for name in found.numbers)


def test_with_the_mapping_itself_for_its_inverse_the_jacobians_are_right(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = kinematics.READINGS_OF_T_E["T_e in axes of the world"]
    monkeypatch.setitem(kinematics.READINGS_OF_T_E, "T_e⁻¹ in axes of the world", right)
    assert judged("III-B.3").verdict == HOLDS


def test_a_mapping_in_other_axes_is_not_what_the_jacobians_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = equations.euler_rate_matrix
    monkeypatch.setattr(
        equations, "euler_rate_matrix", lambda q: equations.rotation(q).T @ right(q)
    )
    assert judged("III-B.5").verdict == MISPRINT


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
    right = as_printed.appendix_a

    def wrong(*at: Any) -> Any:
        columns = right(*at)
        columns[row, column] *= 1.0001
        return columns

    monkeypatch.setattr(as_printed, "appendix_a", wrong)
    assert judged("App-A.1").verdict == MISPRINT
