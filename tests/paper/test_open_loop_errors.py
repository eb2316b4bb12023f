"""Judges of Table I and of errors in Tests A to D: other errors turn their verdicts."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026.open_loop.study import OpenLoop
from amiri2026.paper.drawn import (
    FORCE_ON_UAV,
    MOMENT_ON_UAV,
    RANGES,
    Drawn,
    _rotation,
)
from amiri2026.paper.judges import (
    conclusions,
    open_loop,
    open_loop_errors,
    summary,
)
from amiri2026.sensitivity.study import Sensitivity
from amiri2026.table.study import ABLATIONS, PRINTED
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, MISPRINT, UNDECIDED
from tests.paper import given
from tests.paper.test_summary import swept, unsettled

Array = np.ndarray

ZERO_BLOCKS, POOLED = (
    next(name for name, change in ABLATIONS.items() if change == of)
    for of in ({"decoupled": "block"}, {"metric": "pooled", "axes": "xyz"})
)

HELD = np.array([[0.012, 0.24, 0.36, 0.25], [1.04, 0.28, 0.54, 0.3]])
"""Errors for which all that IV-A says of Table I holds, in units and over ranges."""


def of_table(numbers: Array = HELD) -> Any:
    """What `Evidence.printed` gives of a vehicle with these errors."""
    return lambda vehicle, reading: SimpleNamespace(table=lambda reading: numbers)


def test_discrepancies_are_pronounced_only_if_torques_and_arm_tell_most() -> None:
    torques = given.open_loop_of({"A": 0.01, "B": 0.1, "C": 0.3, "D": 0.2})
    force = given.open_loop_of({"A": 0.01, "B": 0.1, "C": 0.2, "D": 0.3})
    of_arm, of_uav = swept(arm_length=(1.0, 3.0)), swept(UAV_mass=(1.0, 3.0))

    def judged(open_loop: OpenLoop, sensitivity: Sensitivity, **of: Any) -> str:
        study = given.table(HELD, **of)
        found = given.evidence(open_loop=open_loop, sensitivity=sensitivity, table=study)
        return summary.discrepancies(found).verdict

    assert judged(torques, of_arm) == HOLDS
    assert judged(force, of_arm) == judged(torques, of_uav) == DEPENDS
    # Of Table I in metres, too, C has to be largest, and above a tenth of the arm.
    in_metres = {"A": 0.3, "B": 0.002, "C": 0.02, "D": 0.1}
    assert judged(torques, of_arm, position_m=in_metres) == DEPENDS
    assert judged(torques, of_arm, length=4.0) == DEPENDS
    # Where what has not converged may be otherwise, nothing is known.
    assert judged(given.hanging(torques, "C", 0.15), of_arm) == HOLDS
    assert judged(given.hanging(torques, "C", 0.5), of_arm) == UNDECIDED
    assert judged(torques, unsettled(of_arm, "arm length")) == UNDECIDED


def test_actuation_is_judged_by_both_vehicles_and_by_most_that_are_drawn() -> None:
    def judged(turned: float, moved: float, of_drawn: float, table: Array = HELD) -> str:
        one = np.ones(10)
        drawn = Drawn({"A": one, "C": of_drawn * one}, {"A": of_drawn * one, "C": one}, one)
        study = given.open_loop_of(
            {"A": 1.0, "B": 0.1, "C": moved, "D": 1.0}, {"A": turned, "B": 0.1, "C": 1.0, "D": 0.1}
        )
        found = given.evidence(
            open_loop=study, drawn=drawn, table=given.table(HELD), printed=of_table(table)
        )
        return conclusions.modes_of_actuation(found).verdict

    assert judged(1.5, 3.0, 3.0) == HOLDS
    assert judged(0.9, 3.0, 3.0) == judged(1.5, 1.5, 3.0) == judged(1.5, 3.0, 0.5) == DEPENDS
    assert judged(1.5, 3.0, 3.0, HELD[:, ::-1]) == DEPENDS
    # What the vehicle does in the model as printed is not known if a flight ended early.
    assert judged(1.5, 3.0, 3.0, HELD * np.nan) == UNDECIDED


def test_what_hangs_on_a_test_that_has_not_converged_is_not_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """IV-A.9 to 13 and V.12 with a Test C that has not converged."""
    one = np.ones(10)
    position = {"A": 0.1 * one, "B": one, "C": 3.0 * one, "D": 2.0 * one}
    turned = position | {"A": 9.0 * one}
    loads = {MOMENT_ON_UAV: 0.05 * one, FORCE_ON_UAV: 3.0 * one}
    drawn = Drawn(position | loads, turned, 10.0 * one)
    study = given.open_loop_of(
        {"A": 0.01, "B": 0.1, "C": 0.36, "D": 0.2}, {"A": 1.04, "B": 0.1, "C": 0.9, "D": 0.1}
    )
    held: dict[str, Any] = {"drawn": drawn, "table": given.table(HELD), "printed": of_table()}

    def judged(judge: Any, share: float = 0.0) -> str:
        flown = given.hanging(study, "C", share)
        return str(judge(given.evidence(open_loop=flown, **held)).verdict)

    for judge, share in (
        (open_loop_errors.largest_errors, 0.4),
        (open_loop_errors.position_by_test, 0.6),
        (open_loop_errors.rotation_by_test, 0.25),
        (conclusions.modes_of_actuation, 0.25),
    ):
        assert (judged(judge), judged(judge, share)) == (HOLDS, UNDECIDED)
        # A finer flight that ends early tells nothing.
        assert judged(judge, np.inf) == UNDECIDED
    # What does not ask for Test C is known.
    assert judged(open_loop_errors.actuated_uav, 9.0) == HOLDS
    assert judged(open_loop_errors.external_force, 9.0) == HOLDS
    # A is not last, a moment on the vehicle itself is not harmless.
    study = given.open_loop_of({"A": 0.03, "B": 0.01, "C": 0.36, "D": 0.2})
    found = given.evidence(open_loop=study, **held)
    assert open_loop_errors.position_by_test(found).verdict == DEPENDS
    monkeypatch.setattr(open_loop_errors, "error_under_a_moment", lambda vehicle: 0.5)
    assert open_loop_errors.actuated_uav(found).verdict == DEPENDS


def test_sentences_on_the_errors_fail_where_metres_say_otherwise_than_ranges() -> None:
    """Flights of 16 m make an error of a third of a metre a small share of their range."""
    one = np.ones(10)
    position = {"A": 0.1 * one, "B": one, "C": 3.0 * one, "D": 2.0 * one}
    drawn = Drawn(
        position | {MOMENT_ON_UAV: 0.05 * one, FORCE_ON_UAV: 3.0 * one}, position, 10.0 * one
    )
    in_metres = {"A": 0.33, "B": 0.002, "C": 0.02, "D": 0.1}
    study = given.open_loop_of({"A": 0.01, "B": 0.1, "C": 0.36, "D": 0.2})
    table = given.table(HELD, position_m=in_metres, angle_rad={**in_metres, "A": 1.3}, length=0.3)
    found = given.evidence(open_loop=study, drawn=drawn, table=table, printed=of_table())
    for judge in (
        open_loop_errors.largest_errors,
        open_loop_errors.position_by_test,
        open_loop_errors.actuated_uav,
        open_loop_errors.external_force,
        conclusions.modes_of_actuation,
    ):
        by_range, in_units, *_ = judge(found).cases
        assert (by_range.found.verdict, in_units.found.verdict) == (HOLDS, FAILS)
    by_range, in_units, *_ = open_loop_errors.rotation_by_test(found).cases
    assert by_range.found.verdict == in_units.found.verdict == HOLDS


def test_the_table_is_given_if_all_eight_numbers_are_near_the_printed_ones() -> None:
    assert open_loop_errors.eight_numbers(1.14 * PRINTED).verdict == HOLDS
    assert open_loop_errors.eight_numbers(PRINTED / 1.14).verdict == HOLDS
    one_off = PRINTED.copy()
    one_off[0, 0] *= 1.2
    found = open_loop_errors.eight_numbers(one_off)
    assert found.verdict == FAILS and "7 of 8" in found.evidence
    assert open_loop_errors.eight_numbers(PRINTED * np.nan).verdict == UNDECIDED
    study = given.open_loop_of(dict(zip("ABCD", PRINTED[0], strict=True)),
                         dict(zip("ABCD", PRINTED[1], strict=True)))  # fmt: skip
    printed = of_table(PRINTED)
    everywhere = given.evidence(open_loop=study, table=given.table(), printed=printed)
    assert open_loop_errors.table(everywhere).verdict == HOLDS
    blocks = given.table(changed={ZERO_BLOCKS: 2.0 * PRINTED})
    other = given.evidence(open_loop=study, table=blocks, printed=printed)
    assert open_loop_errors.table(other).verdict == DEPENDS


def test_the_printed_formula_needs_an_error_that_no_arm_of_the_paper_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pooled = given.table(changed={POOLED: 100.0 * PRINTED})
    for table in (pooled, given.table()):
        found = open_loop_errors.metric(given.evidence(table=table))
        assert found.verdict == MISPRINT
        assert found.numbers["needed_error_test_b_m"] == pytest.approx(0.2378 * 4.905)
    correction = open_loop_errors.metric(given.evidence(table=pooled)).correction
    assert "100 as printed over x, y and z" in correction and correction.endswith("1 so")
    monkeypatch.setitem(RANGES, "arm.length", (0.5, 5.0))
    assert open_loop_errors.metric(given.evidence(table=given.table())).verdict == HOLDS
    assert open_loop_errors.metric(given.evidence(table=pooled)).verdict == MISPRINT


def test_what_is_conjugate_to_a_curvature_has_another_unit_than_to_an_angle() -> None:
    power = open_loop.metres_in_the_force_on_bend
    vehicle = ca.load_vehicle("paper")
    assert power(vehicle, open_loop.CURVATURE) == pytest.approx(2.0)
    assert power(vehicle, open_loop.BEND_ANGLE) == pytest.approx(1.0)
    found = open_loop.excitation_of_the_arm(given.evidence(table=given.table()))
    assert found.verdict == DEPENDS
    assert [case.found.verdict for case in found.cases] == [HOLDS, FAILS, HOLDS]


def test_a_chirp_changes_its_frequency(monkeypatch: pytest.MonkeyPatch) -> None:
    found = open_loop.announced_excitations(given.evidence())
    assert found.verdict == MISPRINT and "an impulse and a chirp" in found.evidence
    monkeypatch.setattr(open_loop, "frequency_of_test_d", lambda time, **_: 1.0 + time)
    assert "of the four: an impulse." in open_loop.announced_excitations(given.evidence()).evidence


def test_turns_whose_angles_are_lost_are_judged_by_the_angle_between_tips() -> None:
    """A number that is none is no largest one."""
    few, lost = np.full(10, 0.5), np.full(10, np.nan)
    euler = {"A": lost, "B": few, "C": few, "D": few}
    angle = {"A": 0.1 * few, "B": few, "C": few, "D": 2.0 * few}
    np.testing.assert_array_equal(list(_rotation(euler, angle).values()), list(angle.values()))
    whole = {"A": few, "B": few, "C": few, "D": few}
    np.testing.assert_array_equal(list(_rotation(whole, whole).values()), list(whole.values()))
    # Nor one that ten times the angle is.
    np.testing.assert_array_equal(list(_rotation(whole, angle).values()), list(angle.values()))
