"""Judges of Table I and of the errors of Tests A to D, IV-A.7 to 13."""

from __future__ import annotations

from itertools import product, starmap

import numpy as np

from amiri2026.extremes import largest, largest_of, least
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.paper.drawn import (
    FORCE_ON_UAV,
    MOMENT_ON_UAV,
    MOST,
    RANGES,
    error_under_a_moment,
)
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.errors import (
    BLOCKS,
    BLOCKS_IN_UNITS,
    DRAWN,
    ELEMENTS,
    FITS,
    IN_UNITS,
    NORMALISED,
    TABLE_VEHICLE,
    Errors,
    TipErrors,
    ablation,
    as_cases,
    by_elements,
    by_printed_formula,
    tip_errors,
)
from amiri2026.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from amiri2026.sensitivity.findings import listed
from amiri2026.table.printed import GRAVITY
from amiri2026.table.study import PRINTED, factor
from amiri2026.verdicts import (
    Case,
    Judgement,
    judged,
    judged_alike,
    or_misprint,
    over_cases,
)
from continuair.analysis import nrmse, percent, samples
from continuair.kernels import PLANTS

Array = np.ndarray

START_BEND = 0.1
"""Of all tests [1/m]."""

LARGEST = {"position": 0.36, "rotation": 1.04}
"""The errors that IV-A.9 names."""


def metric(evidence: Evidence) -> Judgement:
    """Judge IV-A.7: can the printed NRMSE be what the table lists?"""
    table = evidence.table
    pooled = ablation(table, metric="pooled", axes="xyz")
    plane, joint = ablation(table, metric="pooled"), ablation(table, range="joint")
    fall = 0.5 * GRAVITY
    needed = float(PRINTED[0, 1]) * fall
    longest = RANGES["arm.length"][1]
    reach = 0.5 * START_BEND * longest**2
    return or_misprint(
        judged(
            needed <= reach and pooled["factor"] <= FITS,
            "over x, y and z the printed formula divides by all ranges, among them the fall of "
            f"{fall:.3g} m. 0.2378 in Test B would need an error of {needed:.3g} m, while the tip "
            f"of an arm of {longest:g} m starts {reach:.2g} m off its axis. For "
            f"`table1` it gives {listed(pooled['ours'][0])} in position, a factor of "
            f"{pooled['factor']:.3g} from the table. The text does not say which run's range is "
            f"taken: with the sum outside the fraction that of both runs gives a factor of "
            f"{joint['factor']:.3g}",
            needed_error_test_b_m=needed,
            tip_off_axis_at_start_m=reach,
        ),
        "the sum over components stands outside the fraction: √(Σ_i (RMSE_i / range_i)²), i over x "
        "and y, or over roll, pitch and yaw. Largest factor from the eight numbers for `table1`: "
        f"{pooled['factor']:.3g} as printed over x, y and z, {plane['factor']:.3g} as printed over "
        f"x and y, {table['factor']:.3g} so",
    )


def nrmse_of(evidence: Evidence, test: str, scale: float = 1.0) -> float:
    """Return the printed metric of the tip's position, with lengths times a scale."""
    flights = evidence.open_loop.datasets[test]
    coupled, decoupled = (
        scale * samples(flights.sel(model=model), "tip_position", "axis") for model in PLANTS
    )
    return float(nrmse(coupled, decoupled))


def units_of_the_table(evidence: Evidence) -> Judgement:
    """Judge IV-A.8: has the printed metric the units of the table?"""
    once, doubled = nrmse_of(evidence, "B"), nrmse_of(evidence, "B", 2.0)
    table = evidence.table
    units = ablation(table, metric="rmse", axes="xyz")
    return or_misprint(
        judged(
            abs(doubled / once - 2.0) < 1e-9,
            "the metric divides metres by metres, and has no unit: with all lengths doubled it "
            f"keeps its value ({once:.3g} for {evidence.vehicle.name} in Test B). The table lists "
            "it in m and rad",
            nrmse_t_test_b=once,
        ),
        "the rows of the table have no unit. Largest factor from the eight numbers for `table1`: "
        f"{units['factor']:.3g} in m and rad, {table['factor']:.3g} as shares of a range",
    )


def table(evidence: Evidence) -> Judgement:
    """Judge IV-A.T1: does a vehicle give the eight numbers under one reading?"""
    given = evidence.table
    readings = {
        NORMALISED: given,
        IN_UNITS: ablation(given, metric="rmse", axes="xyz"),
        f"{ELEMENTS}, the printed, pooled formula": ablation(given, metric="pooled", axes="xyz"),
        f"{BLOCKS}, Remark 1 as printed, errors over the range of each axis": ablation(
            given, decoupled="block"
        ),
    }
    cases = [
        Case(TABLE_VEHICLE, reading, eight_numbers(np.array(found["ours"])))
        for reading, found in readings.items()
    ]
    for found in (by_elements(evidence), by_printed_formula(evidence), tip_errors(evidence)[-1]):
        numbers = np.array([list(found.position.values()), list(found.rotation.values())])
        cases.append(Case(found.vehicle, found.reading, eight_numbers(numbers)))
    return over_cases(
        cases,
        "`table1` was fitted to the table with values that the paper names; it is not known to be "
        "the authors' vehicle",
    )


def eight_numbers(ours: Array) -> Judgement:
    """Return whether numbers (2, 4) are those of the table, each within a factor FITS."""
    ratios = ours / PRINTED
    apart = factor(ours)
    within = int((np.exp(np.abs(np.log(ratios))) <= FITS).sum())
    return judged(
        apart <= FITS,
        f"translation {listed(ours[0])}, rotation {listed(ours[1])}; {within} of 8 within a factor "
        f"of {FITS:g}, the worst at {apart:.3g}",
        largest_factor=apart,
    )


def largest_errors(evidence: Evidence) -> Judgement:
    """Judge IV-A.9: are the largest errors 0.36 m and 1.04 rad?"""

    def printed(position: Errors, rotation: Errors) -> bool:
        return same(largest(position.values()), LARGEST["position"]) and same(
            largest(rotation.values()), LARGEST["rotation"]
        )

    def view(found: TipErrors) -> Judgement:
        far, wide = (largest_of(each) for each in (found.position, found.rotation))
        moved = found.position[far] / LARGEST["position"]
        turned = found.rotation[wide] / LARGEST["rotation"]
        return judged_alike(
            starmap(printed, product(found.positions, found.rotations)),
            f"the largest errors are {found.moved(far)} in position (Test {far}) and "
            f"{found.turned(wide)} in rotation (Test {wide}), {moved:.2g} and {turned:.2g} times "
            "those of the sentence",
            **found.position_numbers(far),
            **found.rotation_numbers(wide),
        )

    return over_cases(as_cases(tip_errors(evidence), view))


def same(ours: float, printed: float) -> bool:
    """Return whether a number is that of the sentence."""
    return abs(ours / printed - 1.0) <= SAME


def position_by_test(evidence: Evidence) -> Judgement:
    """Judge IV-A.10: is the error in position largest in C and negligible in A?"""

    def view(found: TipErrors) -> Judgement:
        share = found.position["A"] / found.position["C"]
        return judged_alike(
            (
                largest_of(each) == "C"
                and each["A"] == least(each.values())
                and each["A"] <= NEGLIGIBLE * each["C"]
                for each in found.positions
            ),
            f"the error in position is {found.moved()} in Tests A to D, largest in "
            f"{largest_of(found.position)}; that of A is {share:.2g} of that of C",
            **found.position_numbers(),
        )

    flown = [*tip_errors(evidence), by_printed_formula(evidence)]
    return over_cases([*as_cases(flown, view), _drawn_positions(evidence)])


def _drawn_positions(evidence: Evidence) -> Case:
    drawn = evidence.drawn
    position = stacked(drawn.position)
    first = drawn.share(np.argmax(position, axis=0) == OPEN_LOOP_TESTS.index("C"))
    least_in_a = np.argmin(position, axis=0) == OPEN_LOOP_TESTS.index("A")
    last = drawn.share(least_in_a & (drawn.position["A"] <= NEGLIGIBLE * drawn.position["C"]))
    return Case(
        DRAWN,
        BLOCKS_IN_UNITS,
        judged(
            first > MOST and last > MOST,
            f"the error in position is largest in C for {percent(first)} of them, and negligible "
            f"in A for {percent(last)}",
            share_largest_in_c=first,
            share_negligible_in_a=last,
        ),
    )


def actuated_uav(evidence: Evidence) -> Judgement:
    """Judge IV-A.11: does actuating the UAV alone hardly change the tip's position?"""

    def view(found: TipErrors) -> Judgement:
        share = found.position["A"] / found.scale
        told = f", {percent(share)} of the arm's length" if found.units[0] else ""
        return judged_alike(
            (each["A"] <= NEGLIGIBLE * found.scale for each in found.positions),
            f"with 100 N on the UAV the error is {found.moved('A')}{told}",
            **found.position_numbers("A"),
        )

    cases = as_cases(tip_errors(evidence), view)
    return over_cases([*cases, _moment(evidence), *_drawn_actuations(evidence)])


def _moment(evidence: Evidence) -> Case:
    turned = error_under_a_moment(evidence.vehicle) / float(evidence.vehicle.arm.length)
    found = judged(
        turned <= NEGLIGIBLE,
        f"the error is {percent(turned)} of the arm's length",
        error_over_length=turned,
    )
    return Case(evidence.vehicle.name, f"{BLOCKS}, a moment of 1 N m on the UAV", found)


def _drawn_actuations(evidence: Evidence) -> list[Case]:
    drawn, cases = evidence.drawn, []
    for name, load in (("A", "100 N on the UAV"), (MOMENT_ON_UAV, "a moment of 1 N m on the UAV")):
        small = drawn.share(drawn.position[name] <= NEGLIGIBLE * drawn.length)
        found = judged(
            small > MOST,
            f"the error is at most a tenth of the arm's length for {percent(small)} of them",
            share_of_vehicles=small,
        )
        cases.append(Case(DRAWN, f"{BLOCKS}, {load}", found))
    return cases


def external_force(evidence: Evidence) -> Judgement:
    """Judge IV-A.12: does an external force make the coupling matter?"""

    def view(found: TipErrors) -> Judgement:
        D, A = found.position["D"], found.position["A"]
        told = f", {percent(D / found.scale)} of the arm's length" if found.units[0] else ""
        return judged_alike(
            (
                each["D"] > NEGLIGIBLE * found.scale and each["D"] >= PRONOUNCED * each["A"]
                for each in found.positions
            ),
            f"with the force on the tip the error is {found.moved('D')}{told}, {D / A:.2g} times "
            "that of Test A",
            **found.position_numbers("AD"),
        )

    drawn = evidence.drawn
    D, A = drawn.position["D"], drawn.position["A"]
    share = drawn.share((NEGLIGIBLE * drawn.length < D) & (D >= PRONOUNCED * A))
    of_tip = judged(
        share > MOST,
        "with the force on the tip the error is above a tenth of the arm's length and at least "
        f"twice that of Test A for {percent(share)} of them",
        share_of_vehicles=share,
    )
    cases = as_cases(tip_errors(evidence), view)
    return over_cases(
        [*cases, Case(DRAWN, BLOCKS_IN_UNITS, of_tip), _force_on_the_uav(evidence)],
        "The sentence says that the force acts on the UAV; that of Test D acts on the tip",
    )


def _force_on_the_uav(evidence: Evidence) -> Case:
    drawn = evidence.drawn
    factors = drawn.position[FORCE_ON_UAV] / drawn.position["B"]
    more = drawn.share(factors >= PRONOUNCED)
    found = judged(
        more > MOST,
        "the force of Test D on the UAV changes the error of a free fall by a factor of "
        f"{np.median(factors):.2g} in the median, and at least doubles it for {percent(more)} of "
        "them",
        median_factor=float(np.median(factors)),
        share_doubled=more,
    )
    return Case(DRAWN, f"{BLOCKS}, the force on the UAV", found)


def rotation_by_test(evidence: Evidence) -> Judgement:
    """Judge IV-A.13: is the error in rotation largest where the UAV is actuated, Test A?"""

    def view(found: TipErrors) -> Judgement:
        return judged_alike(
            (largest_of(each) == "A" for each in found.rotations),
            f"the error in rotation is {found.turned()} in Tests A to D, largest in "
            f"{largest_of(found.rotation)}",
            **found.rotation_numbers(),
        )

    drawn = evidence.drawn
    first = drawn.share(np.argmax(stacked(drawn.rotation), axis=0) == OPEN_LOOP_TESTS.index("A"))
    of_drawn = judged(
        first > MOST,
        f"the error in rotation is largest in A for {percent(first)} of them",
        share_largest_in_a=first,
    )
    cases = as_cases([*tip_errors(evidence), by_elements(evidence)], view)
    return over_cases(
        [*cases, Case(DRAWN, BLOCKS_IN_UNITS, of_drawn)],
        "With every off-diagonal element zero, the 100 N of Test A do not pitch the decoupled UAV",
    )


def stacked(by_test: dict[str, Array]) -> Array:
    """Return errors (tests, vehicles) of Tests A to D, or those of them that are given."""
    return np.stack([by_test[test] for test in OPEN_LOOP_TESTS if test in by_test])


JUDGES = {
    "IV-A.7": metric,
    "IV-A.8": units_of_the_table,
    "IV-A.T1": table,
    "IV-A.9": largest_errors,
    "IV-A.10": position_by_test,
    "IV-A.11": actuated_uav,
    "IV-A.12": external_force,
    "IV-A.13": rotation_by_test,
}
"""Judge of every sentence on these errors, by its id."""
