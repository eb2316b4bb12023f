"""Judges of the sections on open-loop results, IV and IV-A."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.scenario.paper_tests import bend_torques
from continuair.studies.open_loop.study import PRINTED
from continuair.studies.paper.drawn import FORCE_ON_UAV, MOMENT_ON_UAV, MOST
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.words import NEGLIGIBLE, PRONOUNCED, SAME
from continuair.studies.tables import percent
from continuair.studies.verdicts import Judgement, all_of, judged

Array = np.ndarray
Errors = dict[str, float]

TESTS = "ABCD"


def identical_conditions(evidence: Evidence) -> Judgement:
    """IV.2: is what halving a common step changes small beside the difference of the models?"""
    results = evidence.open_loop.results
    changes, steps = {}, {}
    for letter, entries in results["tests"].items():
        first = (results["coarser_steps"][letter] or [entries])[0]["decoupled"]
        changes[letter], steps[letter] = first["step_halving_error"], first["step_s"]
    worst = max(changes, key=lambda letter: changes[letter])
    others = max(changes[letter] for letter in changes if letter != worst)
    return judged(
        changes[worst] < NEGLIGIBLE,
        f"halving a step of {1e3 * steps[worst]:g} ms changes the difference of the models by up "
        f"to {percent(changes[worst])}, in Test {worst}, where Q_ψa is divided by a bend that "
        f"passes near 0, and by at most {percent(others)} otherwise",
        **{f"change at half the step, Test {letter}": changes[letter] for letter in "ABD"},
    )


def impulse_and_chirp(_: Evidence) -> Judgement:
    """IV.3: is one input an impulse, and does the frequency of one change within its test?"""
    first, last = frequency_of_test_d(0.0), frequency_of_test_d(1.0)
    return judged(
        False,
        "no input of Tests A to D is an impulse, and the frequency of Test D is "
        f"{first:g} Hz at its start and {last:g} Hz at its end, as f0 = f1",
        start_hz=first,
        end_hz=last,
    )


def frequency_of_test_d(time: float, f0: float = 1.0, f1: float = 1.0, T: float = 10.0) -> float:
    """The frequency [Hz] of Test D's printed force: the derivative of f0 t + (f1 - f0) t²/(2T)."""
    return f0 + (f1 - f0) * time / T


def excitation_of_the_arm(evidence: Evidence) -> Judgement:
    """IV-A.5: are both of Test C's inputs torques in N m, and on the arm alone?"""
    arm = evidence.vehicle.arm
    on_uav = max(abs(value) for t in np.linspace(0.0, 1.0, 101) for value in bend_torques(t)[:6])
    # The power of Q_κ is Q_κ κ̇ with κ̇ in 1/(m s): only a Q_κ in N m² gives watts.
    static = 0.1 / (arm.bending_stiffness * arm.length)
    return judged(
        False,
        f"the rows of the UAV are {on_uav:g}, but κ is in 1/m, and what works on it is in N m², "
        f"not N m; read so, the amplitude of 0.1 bends this arm by {static:.2g} 1/m at rest",
        static_bend_1_m=static,
    )


def chirp_at_the_tip(_: Evidence) -> Judgement:
    """IV-A.6: does the frequency of the force on the tip go from f0 to f1?"""
    first, last = frequency_of_test_d(0.0), frequency_of_test_d(1.0)
    return judged(
        first != last,
        f"with f0 = f1 the printed force keeps {first:g} Hz, and the 1 s of the test is a tenth of "
        "T; F_e in inertial axes also needs J_t in those axes, which the text calls expressed in "
        "the tip frame",
        start_hz=first,
        end_hz=last,
    )


def metric(evidence: Evidence) -> Judgement:
    """IV-A.7: does the printed NRMSE have the units of the table?"""
    entry = evidence.open_loop.results["tests"]["B"]["decoupled"]
    return judged(
        False,
        "the sum of squares is divided by a sum of squared ranges, so the expression has no unit, "
        "where the table prints m and rad; nor does the text say which run's range is meant. In "
        f"Test B it is {entry['nrmse_t']:.3g} for the position, where the RMSE is "
        f"{entry['rmse_t_m']:.3g} m",
        nrmse_t_test_b=entry["nrmse_t"],
        rmse_t_test_b_m=entry["rmse_t_m"],
    )


def table(evidence: Evidence) -> Judgement:
    """IV-A.T1: does this vehicle give the eight numbers under one reading of the metric?"""
    tests = evidence.open_loop.results["tests"]
    readings = {
        "NRMSE as printed": ("nrmse_t", "nrmse_r"),
        "RMSE": ("rmse_t_m", "rmse_r_rad"),
        "RMSE and the angle between attitudes": ("rmse_t_m", "angle_rad"),
    }
    hits = {
        name: sum(
            abs(tests[letter]["decoupled"][key] / PRINTED[letter][printed] - 1.0) <= SAME
            for letter in TESTS
            for key, printed in zip(keys, ("nrmse_t", "nrmse_r"), strict=True)
        )
        for name, keys in readings.items()
    }
    best = max(hits, key=lambda name: hits[name])
    return judged(
        hits[best] == 8,
        f"read as {best}, {hits[best]} of the eight numbers come out within 10 %; the paper does "
        "not print its vehicle, and a search over thousands of vehicles found none that gives all "
        "eight (docs/identify.md)",
        **{f"numbers within 10 %, {name}": float(count) for name, count in hits.items()},
    )


def largest_errors(evidence: Evidence) -> Judgement:
    """IV-A.9: are the largest errors 0.36 m and 1.04 rad?"""
    position, rotation = errors(evidence, "rmse_t_m"), errors(evidence, "rmse_r_rad")
    of, by = max(position.values()), max(rotation.values())
    return judged(
        abs(of / 0.36 - 1) <= SAME and abs(by / 1.04 - 1) <= SAME,
        f"the largest RMSE of the four tests is {of:.3g} m in position and {by:.3g} rad in "
        "rotation; the paper prints neither its vehicle nor what its cumulative error is",
        largest_rmse_t_m=of,
        largest_rmse_r_rad=by,
    )


def position_by_test(evidence: Evidence) -> Judgement:
    """IV-A.10: is the error in position largest in C and negligible in A?"""
    ours = errors(evidence, "rmse_t_m")
    drawn = evidence.drawn
    first = drawn.share(np.argmax(stacked(drawn.position), axis=0) == TESTS.index("C"))
    last = drawn.share(drawn.position["A"] <= NEGLIGIBLE * drawn.position["C"])
    return all_of(
        [
            judged(
                max(ours, key=lambda test: ours[test]) == "C" and first > MOST,
                f"the error is {listed(ours)} m in Tests A to D, largest in C for "
                f"{percent(first)} of the vehicles drawn",
                **{f"RMSE, Test {test} [m]": value for test, value in ours.items()},
                share_largest_in_c=first,
            ),
            judged(
                ours["A"] <= NEGLIGIBLE * ours["C"] and last > MOST,
                f"that of A is {ours['A'] / ours['C']:.2g} of that of C, and at most a tenth for "
                f"{percent(last)} of the vehicles drawn",
                share_negligible_in_a=last,
            ),
        ]
    )


def actuated_uav(evidence: Evidence) -> Judgement:
    """IV-A.11: does actuating the UAV alone hardly change the tip's position?"""
    length, drawn = evidence.vehicle.arm.length, evidence.drawn
    ours = errors(evidence, "rmse_t_m")
    small = {
        name: drawn.share(drawn.position[name] <= NEGLIGIBLE * drawn.length)
        for name in ("A", MOMENT_ON_UAV)
    }
    return judged(
        ours["A"] <= NEGLIGIBLE * length and all(share > MOST for share in small.values()),
        f"with 100 N on the UAV the error is {ours['A'] / length:.2g} of the arm's length (free "
        f"fall without any input: {ours['B'] / length:.2g}); of the vehicles drawn it is at most a "
        f"tenth for {percent(small['A'])}, and with a moment of 1 N m on the UAV for "
        f"{percent(small[MOMENT_ON_UAV])}",
        error_over_length_test_a=ours["A"] / length,
        share_of_vehicles_force=small["A"],
        share_of_vehicles_moment=small[MOMENT_ON_UAV],
    )


def external_force(evidence: Evidence) -> Judgement:
    """IV-A.12: does an external force on the UAV make the coupling matter?"""
    drawn = evidence.drawn
    pushed, fallen = drawn.position[FORCE_ON_UAV], drawn.position["B"]
    raised = drawn.share((pushed >= PRONOUNCED * fallen) & (pushed > NEGLIGIBLE * drawn.length))
    at_tip = drawn.share(drawn.position["D"] >= PRONOUNCED * fallen)
    middle = float(np.median(pushed / fallen))
    return judged(
        raised > MOST,
        "no test of the paper has an external force on the UAV. The force of Test D there changes "
        f"the error of a free fall by a factor of {middle:.2g} in the middle, and at least doubles "
        f"it to more than a tenth of the arm for {percent(raised)} of the vehicles drawn; at the "
        f"tip, where the paper has it, it doubles the error for {percent(at_tip)}",
        median_factor=middle,
        share_of_vehicles_uav=raised,
        share_of_vehicles_tip=at_tip,
    )


def rotation_by_test(evidence: Evidence) -> Judgement:
    """IV-A.13: is the error in rotation mostly that of the actuated UAV, Test A?"""
    ours, drawn = errors(evidence, "rmse_r_rad"), evidence.drawn
    others = stacked({test: drawn.rotation[test] for test in "BCD"}).max(axis=0)
    share = drawn.share(drawn.rotation["A"] >= PRONOUNCED * others)
    first = drawn.share(drawn.rotation["A"] > others)
    return judged(
        ours["A"] >= PRONOUNCED * max(ours[test] for test in "BCD") and share > MOST,
        f"the error in rotation is {listed(ours)} rad in Tests A to D; A has the largest for "
        f"{percent(first)} of the vehicles drawn, and twice the next for {percent(share)}",
        **{f"RMSE, Test {test} [rad]": value for test, value in ours.items()},
        share_largest_in_a=first,
        share_twice_in_a=share,
    )


def errors(evidence: Evidence, key: str) -> Errors:
    """A metric of the decoupled model in Tests A to D."""
    tests: dict[str, Any] = evidence.open_loop.results["tests"]
    return {letter: float(tests[letter]["decoupled"][key]) for letter in TESTS}


def stacked(by_test: dict[str, Array]) -> Array:
    """Errors (tests, vehicles) of Tests A to D, or those of them that are given."""
    return np.stack([by_test[test] for test in TESTS if test in by_test])


def listed(values: Errors) -> str:
    """Numbers as evidence prints them."""
    return ", ".join(f"{value:.3g}" for value in values.values())


JUDGES = {
    "IV.2": identical_conditions,
    "IV.3": impulse_and_chirp,
    "IV-A.5": excitation_of_the_arm,
    "IV-A.6": chirp_at_the_tip,
    "IV-A.7": metric,
    "IV-A.T1": table,
    "IV-A.9": largest_errors,
    "IV-A.10": position_by_test,
    "IV-A.11": actuated_uav,
    "IV-A.12": external_force,
    "IV-A.13": rotation_by_test,
}
"""Judge of every sentence of these sections, by its id."""
