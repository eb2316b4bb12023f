"""Judges of the sections on open-loop results, IV and IV-A.3 to 5."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.extremes import largest, largest_of
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS, bend_torques, open_loop_test
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.errors import (
    BLOCKS,
    ELEMENTS,
    TABLE_VEHICLE,
    ablation,
)
from amiri2026.paper.judges.kept import FINE, UNRESOLVED, is_unresolved
from amiri2026.paper.judges.words import NEGLIGIBLE, PRONOUNCED
from amiri2026.sensitivity.task import PARAMETERS
from amiri2026.table.printed import GRAVITY
from amiri2026.table.study import READING, fly_tests
from amiri2026.verdicts import UNDECIDED, Case, Judgement, judged, or_misprint, over_cases
from continuair import Vehicle, load_vehicle, simulate
from continuair.analysis import centre_of_mass, mass_distribution, percent, samples
from continuair.equations import elastic_vector
from continuair.vehicle import FIELDS
from continuair.warning import untold

Array = np.ndarray

DURATION = 1.0
"""Of each test [s]."""

CURVATURE, BEND_ANGLE = "κ in 1/m", "κ as the bend angle κ l of Appendix B"

_UNITS = {1: "N m", 2: "N m²"}
"""By the power of the metre."""

LOOSE = 1e-3
"""A tolerance that programs take where none is named."""

_FALLS = 1e-6
"""Arm lengths within which the centre of mass falls as it does free."""

_PLACES = ("position", "attitude", "bend")

ANNOUNCED = {
    "arm length",
    "arm radius",
    "Young's modulus",
    "UAV mass",
    "initial bend",
    "initial roll",
}
"""Parameters that IV-B varies, according to section IV."""


def identical_conditions(evidence: Evidence) -> Judgement:
    """Judge IV.2: is what the tolerance changes small beside the difference of the models?"""
    study = evidence.open_loop.results
    cases = [
        Case(evidence.vehicle.name, BLOCKS, _finer_tolerance(study)),
        *_tolerances(evidence.table),
    ]
    return over_cases(cases, "The paper prints neither solver nor step")


def _finer_tolerance(study: Mapping[str, Any]) -> Judgement:
    """Whether a tenth of the tolerance changes every sample of the difference little beside its
    RMS."""
    changes = {
        letter: np.nan if np.isnan(found["rmse_t_m"]) else found["relative_error"]
        for letter, found in ((each, of["decoupled"]) for each, of in study["tests"].items())
    }
    worst = largest_of(changes)
    return judged(
        changes[worst] < NEGLIGIBLE,
        f"a tenth of the tolerance {study['rtol']:g} changes the difference of the models by up to "
        f"{percent(changes[worst])} of its RMS, in Test {worst}",
    )


def _tolerances(table: Mapping[str, Any]) -> list[Case]:
    """Return whether the numbers of `table1` keep with a longer tolerance."""
    ours = np.array(table["ours"])
    by_tolerance = {name: np.array(rows) for name, rows in table["ours_by_tolerance"].items()}
    loose = fly_tests(load_vehicle(TABLE_VEHICLE), tolerance=LOOSE).table(READING)
    names = list(by_tolerance)
    flown = {f"tolerances {names[0]} to {names[-1]}": list(by_tolerance.values()),
             f"tolerance {LOOSE:g}": [loose]}  # fmt: skip
    cases = []
    for name, tables in flown.items():
        change = largest(float(np.abs(rows / ours - 1.0).max()) for rows in tables)
        found = judged(
            change < NEGLIGIBLE,
            f"the eight numbers differ by up to {percent(change)} from those at "
            f"{table['tolerance']:g}",
        )
        cases.append(Case(TABLE_VEHICLE, f"{ELEMENTS}, {name}", found))
    return cases


def announced_excitations(evidence: Evidence) -> Judgement:
    """Judge IV.3: are an impulse, a chirp, an external wrench and a free fall among the inputs?"""
    first, last = frequency_of_test_d(0.0), frequency_of_test_d(DURATION)
    tests = {letter: open_loop_test(letter) for letter in OPEN_LOOP_TESTS}
    found = {
        "an impulse": any(test.jumps for test in tests.values()),
        "a chirp": first != last,
        "an external wrench": tests["D"].tip_wrench is not None,
        "a free fall": all(getattr(tests["B"], name) is None for name in FIELDS),
    }
    missing = [name for name, there in found.items() if not there]
    rises = {T: frequency_of_test_d(DURATION, f1=10.0, T=T) - 1.0 for T in (10.0, DURATION)}
    return or_misprint(
        judged(
            not missing,
            f"missing of the four: {' and '.join(missing) or 'none'}. Every input of Tests A to D "
            f"lasts the whole test, and the frequency of Test D is {first:g} Hz at its start and "
            f"{last:g} Hz at its end, as f0 = f1",
            start_hz=first,
            end_hz=last,
        ),
        f"a chirp needs f1 ≠ f0: as printed the frequency changes by {last - first:g} Hz in the "
        f"{DURATION:g} s flown; with f1 = 10 Hz it changes by {rises[10.0]:g} Hz, and with T = "
        f"{DURATION:g} s, the flight's length, by {rises[DURATION]:g} Hz. An impulse would be a "
        "force that ends long before the flight does, such as 100 N for 10 ms, 1 N s; that of Test "
        f"A acts for {DURATION:g} s",
    )


def frequency_of_test_d(time: float, f0: float = 1.0, f1: float = 1.0, T: float = 10.0) -> float:
    """The frequency [Hz] of Test D's printed force: the derivative of f0 t + (f1 - f0) t²/(2T)."""
    return f0 + (f1 - f0) * time / T


def varied_parameters(_: Evidence) -> Judgement:
    """Judge IV.4: does IV-B vary each of the six parameters?"""
    return judged(
        {parameter.name for parameter in PARAMETERS.values()} == ANNOUNCED,
        f"section IV-B varies {', '.join(PARAMETERS)}, and so does the study of sensitivity here",
        parameters=float(len(PARAMETERS)),
    )


def strong_actuation(evidence: Evidence) -> Judgement:
    """Judge IV-A.3: is Test A's input a strong constant force on the UAV in world x alone?"""
    tau = np.asarray(open_loop_test("A").tau, float)

    def view(vehicle: Vehicle) -> Judgement:
        ratio = float(tau[0]) / (vehicle.mass * GRAVITY)
        # τ is conjugate to q: its power is τ q̇, whatever the attitude.
        return judged(
            np.flatnonzero(tau).tolist() == [0] and ratio >= PRONOUNCED,
            f"the force of {tau[0]:g} N has the power {tau[0]:g} N times ẋ at every attitude, "
            f"reaches no other row, and is {ratio:.3g} times the weight",
            force_over_weight=ratio,
        )

    return over_cases([Case(each.name, "coupled model", view(each)) for each in _both(evidence)])


def _both(evidence: Evidence) -> list[Vehicle]:
    return [load_vehicle(TABLE_VEHICLE), evidence.vehicle]


def free_fall(evidence: Evidence) -> Judgement:
    """Judge IV-A.4: does the centre of mass fall by ½ g t² in Test B?"""
    return over_cases([Case(each.name, "coupled model", _falls(each)) for each in _both(evidence)])


@untold("error_estimate")
def _falls(vehicle: Vehicle) -> Judgement:
    flight = simulate(vehicle, open_loop_test("B"), variables=_PLACES, rtol=FINE, check=True)
    off = off_free_fall(vehicle, flight.expand_dims("run"))
    share = off / vehicle.arm.length
    if is_unresolved(share, _FALLS, float(flight["error_estimate"])):
        return Judgement(UNDECIDED, UNRESOLVED)
    return judged(
        share < _FALLS,
        f"the common centre of mass falls by ½ g t² within {max(off, 1e-9):.1g} m; the bent arm "
        "swings inside the vehicle",
    )


def off_free_fall(vehicle: Vehicle, flight: xr.Dataset) -> float:
    """Return the deviation of the centre of mass of a flight (one, time) from free fall [m]."""
    com, _ = mass_distribution(vehicle, samples(flight, "bend", "bend_axis"))
    (places,), time = centre_of_mass(flight, com), flight["time"].to_numpy()
    fall = np.outer(time**2, [0.0, 0.0, -0.5 * GRAVITY])
    return float(np.abs(places - places[:1] - fall).max())


def excitation_of_the_arm(evidence: Evidence) -> Judgement:
    """Judge IV-A.5: are both of Test C's inputs torques in N m, and on the arm alone?"""
    arm, name = evidence.vehicle.arm, evidence.vehicle.name
    inputs = np.array([bend_torques(time) for time in np.linspace(0.0, DURATION, 101)])
    rows = judged(
        bool((inputs[:, :6] == 0.0).all() and inputs[:, 6:].any()),
        "both inputs reach the arm alone, with 20 rad/s",
    )
    static = 0.1 / (arm.bending_stiffness * arm.length)
    told = {
        CURVATURE: (static, "1/m"),
        BEND_ANGLE: (0.1 * arm.length / arm.bending_stiffness, "rad"),
    }
    cases = [Case(name, "τ of Test C", rows)]
    for kappa, (bend, unit) in told.items():
        power = metres_in_the_force_on_bend(evidence.vehicle, kappa)
        found = judged(
            abs(power - 1.0) < 1e-6,
            f"what is conjugate to κ is in {_UNITS.get(round(power), 'another unit')}, and an "
            f"amplitude of 0.1 bends the arm by {bend:.2g} {unit} at rest, without weight",
            power_of_the_metre=power,
        )
        cases.append(Case(name, kappa, found))
    table = evidence.table
    angle = ablation(table, kappa="bend angle")
    return over_cases(
        cases,
        f"Table I does not decide: `table1` gives it within a factor of {table['factor']:.3g} with "
        f"κ in 1/m and of {angle['factor']:.3g} with the bend angle",
    )


def metres_in_the_force_on_bend(vehicle: Vehicle, kappa: str = CURVATURE) -> float:
    """Return the power of the metre, beside the newton, in what is conjugate to κ: from E I l κ.

    Measured: with all lengths doubled and forces kept, a force in N mⁿ grows by 2ⁿ. What is
    conjugate to the bend angle κ l is 1/l of what is conjugate to κ.
    """
    arm, q = vehicle.arm, np.array([0, 0, 0, 0, 0, 0, 0.1, 0.0])
    doubled = vehicle.replace(
        {
            "arm.length": 2.0 * arm.length,
            "arm.radius": 2.0 * arm.radius,
            "arm.youngs_modulus": arm.youngs_modulus / 4.0,
        }
    )
    small, large = elastic_vector(vehicle, q)[6], elastic_vector(doubled, q / 2.0)[6]
    if kappa == BEND_ANGLE:
        small, large = small / arm.length, large / doubled.arm.length
    return float(np.log2(large / small))


JUDGES = {
    "IV.2": identical_conditions,
    "IV.3": announced_excitations,
    "IV.4": varied_parameters,
    "IV-A.3": strong_actuation,
    "IV-A.4": free_fall,
    "IV-A.5": excitation_of_the_arm,
}
"""Judge of every sentence of these sections, by its id."""
