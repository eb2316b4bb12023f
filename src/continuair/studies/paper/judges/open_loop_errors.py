"""Judges of the errors of Tests A to D by test, IV-A.9 to 13."""

from __future__ import annotations

from itertools import product, starmap

import numpy as np

from continuair.analysis.shares import percent
from continuair.scenario.paper_tests import OPEN_LOOP_TESTS
from continuair.studies.extremes import largest, largest_of, least
from continuair.studies.paper.drawn import (
    FORCE_ON_UAV,
    MOMENT_ON_UAV,
    MOST,
    error_under_a_moment,
)
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.errors import (
    Errors,
    errors,
    possible,
    possible_rotations,
    rotations,
)
from continuair.studies.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from continuair.studies.sensitivity.findings import listed
from continuair.studies.verdicts import Judgement, all_of, judged_alike

Array = np.ndarray


def largest_errors(evidence: Evidence) -> Judgement:
    """IV-A.9: are the largest errors 0.36 m and 1.04 rad?"""
    rotation, kind = rotations(evidence)
    of, by = largest(errors(evidence).values()), largest(rotation.values())

    def printed(position: Errors, turned: Errors) -> bool:
        far, wide = largest(position.values()), largest(turned.values())
        return abs(far / 0.36 - 1) <= SAME and abs(wide / 1.04 - 1) <= SAME

    return judged_alike(
        starmap(printed, product(possible(evidence), possible_rotations(evidence))),
        f"the largest RMSE of the four tests is {of:.3g} m in position and {by:.3g} rad in "
        f"rotation{kind}; the paper prints neither its vehicle nor what its cumulative error is",
        largest_rmse_t_m=of,
        largest_rmse_r_rad=by,
    )


def position_by_test(evidence: Evidence) -> Judgement:
    """IV-A.10: is the error in position largest in C and negligible in A?"""
    ours, drawn = errors(evidence), evidence.drawn
    every = list(possible(evidence))
    first = drawn.share(np.argmax(stacked(drawn.position), axis=0) == OPEN_LOOP_TESTS.index("C"))
    least_in_a = np.argmin(stacked(drawn.position), axis=0) == OPEN_LOOP_TESTS.index("A")
    last = drawn.share(least_in_a & (drawn.position["A"] <= NEGLIGIBLE * drawn.position["C"]))

    def negligible_in_a(each: Errors) -> bool:
        return each["A"] == least(each.values()) and each["A"] <= NEGLIGIBLE * each["C"]

    return all_of(
        [
            judged_alike(
                (largest_of(each) == "C" and first > MOST for each in every),
                f"the error is {listed(ours.values())} m in Tests A to D, largest in C for "
                f"{percent(first)} of the vehicles drawn",
                **{f"RMSE, Test {test} [m]": value for test, value in ours.items()},
                share_largest_in_c=first,
            ),
            judged_alike(
                (negligible_in_a(each) and last > MOST for each in every),
                f"that of A is {ours['A'] / ours['C']:.2g} of that of C, and the least and at most "
                f"a tenth for {percent(last)} of the vehicles drawn",
                share_negligible_in_a=last,
            ),
        ]
    )


def actuated_uav(evidence: Evidence) -> Judgement:
    """IV-A.11: does actuating the UAV alone hardly change the tip's position?"""
    length, drawn = evidence.vehicle.arm.length, evidence.drawn
    ours = errors(evidence)
    small = {
        name: drawn.share(drawn.position[name] <= NEGLIGIBLE * drawn.length)
        for name in ("A", MOMENT_ON_UAV)
    }
    turned = error_under_a_moment(evidence.vehicle)
    usual = turned <= NEGLIGIBLE * length and all(share > MOST for share in small.values())
    return judged_alike(
        (each["A"] <= NEGLIGIBLE * length and usual for each in possible(evidence)),
        f"with 100 N on the UAV the error is {ours['A'] / length:.2g} of the arm's length, and "
        f"with a moment of 1 N m on it {turned / length:.2g} (free fall without any input: "
        f"{ours['B'] / length:.2g}); of the vehicles drawn it is at most a "
        f"tenth for {percent(small['A'])}, and with a moment of 1 N m on the UAV for "
        f"{percent(small[MOMENT_ON_UAV])}",
        error_over_length_test_a=ours["A"] / length,
        error_over_length_moment=turned / length,
        share_of_vehicles_force=small["A"],
        share_of_vehicles_moment=small[MOMENT_ON_UAV],
    )


def external_force(evidence: Evidence) -> Judgement:
    """IV-A.12: does an external force make the coupling matter?"""
    ours, drawn, length = errors(evidence), evidence.drawn, evidence.vehicle.arm.length
    D, A = drawn.position["D"], drawn.position["A"]
    share = drawn.share((NEGLIGIBLE * drawn.length < D) & (D >= PRONOUNCED * A))
    on_uav = float(np.median(drawn.position[FORCE_ON_UAV] / drawn.position["B"]))

    def matters(each: Errors) -> bool:
        return each["D"] > NEGLIGIBLE * length and each["D"] >= PRONOUNCED * each["A"]

    return judged_alike(
        (matters(each) and share > MOST for each in possible(evidence)),
        f"with the force on the tip the error is {ours['D'] / length:.2g} of the arm's length and "
        f"{ours['D'] / ours['A']:.3g} times that of Test A; above a tenth and at least twice for "
        f"{percent(share)} of the vehicles drawn. The same force on the UAV, as the sentence has "
        f"it, changes the error of a free fall by a factor of {on_uav:.2g} in the median",
        error_over_length_test_d=ours["D"] / length,
        share_of_vehicles=share,
        median_factor_on_uav=on_uav,
    )


def rotation_by_test(evidence: Evidence) -> Judgement:
    """IV-A.13: is the error in rotation largest where the UAV is actuated, Test A?"""
    (ours, kind), drawn = rotations(evidence), evidence.drawn
    first = drawn.share(np.argmax(stacked(drawn.rotation), axis=0) == OPEN_LOOP_TESTS.index("A"))
    return judged_alike(
        (largest_of(each) == "A" and first > MOST for each in possible_rotations(evidence)),
        f"the error in rotation{kind} is {listed(ours.values())} rad in Tests A to D; A has "
        f"the largest for {percent(first)} of the vehicles drawn",
        **{f"RMSE, Test {test} [rad]": value for test, value in ours.items()},
        share_largest_in_a=first,
    )


def stacked(by_test: dict[str, Array]) -> Array:
    """Errors (tests, vehicles) of Tests A to D, or those of them that are given."""
    return np.stack([by_test[test] for test in OPEN_LOOP_TESTS if test in by_test])


JUDGES = {
    "IV-A.9": largest_errors,
    "IV-A.10": position_by_test,
    "IV-A.11": actuated_uav,
    "IV-A.12": external_force,
    "IV-A.13": rotation_by_test,
}
"""Judge of every sentence on these errors, by its id."""
