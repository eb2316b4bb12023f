"""Judges of Assumption 1 of III-C: contributions of disks to the energies and the coupling."""

from __future__ import annotations

import math

import numpy as np

from amiri2026.extremes import largest
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.agreement import random_states
from amiri2026.paper.judges.coupling_elements import significant, uav_arm_block
from amiri2026.paper.judges.disks import (
    MASS,
    RADII,
    SPACING,
    errors_of_tests,
    shares_of_energy,
    states_of_tests,
    with_disks,
)
from amiri2026.paper.judges.errors import TABLE_VEHICLE
from amiri2026.paper.judges.words import NEGLIGIBLE
from amiri2026.verdicts import UNDECIDED, Case, Judgement, all_of, judged, over_cases
from continuair import Vehicle, load_vehicle
from continuair.analysis import percent

Array = np.ndarray

_DISKS = (
    f"Disks of {1e3 * MASS:.1f} g every {SPACING:.2f} m, of a published arm with a backbone radius "
    "of 0.7 mm; the paper prints none"
)


def assumption_on_disks(evidence: Evidence) -> Judgement:
    """Judge III-C.15: do disks count for little in the energies of the arm?"""
    radii = sorted({evidence.vehicle.arm.radius, *RADII})
    vehicles = dict.fromkeys([load_vehicle(TABLE_VEHICLE), *of_radii(evidence.vehicle, radii)])
    return over_cases([_energies(each) for each in vehicles], _DISKS)


def of_radii(vehicle: Vehicle, radii: list[float]) -> list[Vehicle]:
    """Return the vehicle with radii of its arm [m], but none thicker than it is long."""
    thin = [radius for radius in radii if 2.0 * radius <= vehicle.arm.length]
    return [vehicle.replace({"arm.radius": radius}) for radius in thin]


def _energies(vehicle: Vehicle) -> Case:
    """Return whether disks make up little of both energies of the arm in Tests A to D."""
    shares = {test: shares_of_energy(vehicle, test) for test in OPEN_LOOP_TESTS}
    worst = largest(of_arm.larger for of_arm, _ in shares.values())
    of_arm, of_all = (each.kinetic for each in shares["B"])
    found = judged(
        worst < NEGLIGIBLE,
        f"disks make up at most {percent(worst)} of an energy of the arm in Tests A to D, and "
        f"{percent(of_all)} of the vehicle's kinetic energy in Test B",
        **{"share of the arm's kinetic energy in Test B": of_arm},
    )
    return Case(vehicle.name, _radius(vehicle), found)


def _radius(vehicle: Vehicle) -> str:
    return f"arm radius {1e3 * vehicle.arm.radius:g} mm"


def effect_of_disks(evidence: Evidence) -> Judgement:
    """Judge III-C.16: do disks only amplify the coupling, and leave the order of the errors?"""
    own = evidence.vehicle
    radii = list(dict.fromkeys([own.arm.radius, RADII[0]]))
    cases = []
    for vehicle in of_radii(own, radii):
        elements = growth(vehicle, states_of_tests(vehicle))
        order = order_by_error(errors_of_tests(vehicle), errors_of_tests(with_disks(vehicle)))
        reading = f"{_radius(vehicle)}, states of Tests A to D"
        cases.append(Case(vehicle.name, reading, all_of([elements, order])))
    anywhere = np.array([q for q, _ in random_states(own.arm.length)])
    reading = f"{_radius(own)}, random states with bends up to 3 rad"
    cases.append(Case(own.name, reading, growth(own, anywhere)))
    return over_cases(cases, _DISKS)


def growth(vehicle: Vehicle, states: Array) -> Judgement:
    """Return whether disks let every UAV-arm element grow at states q (n, 8)."""
    factors = [factors_of_disks(vehicle, q) for q in states]
    least, most = (np.array([extreme(each) for each in factors]) for extreme in (np.min, np.max))
    middle = float(np.median(np.concatenate(factors)))
    smaller = least <= 1.0
    where = "at every state"
    if smaller.any():
        bends = np.abs(states[smaller, 6]) * vehicle.arm.length
        where = (
            f"but in {percent(float(smaller.mean()))} of the states, bent by {bends.min():.2g} rad "
            "or more, one shrinks or changes its sign"
        )
    return judged(
        not smaller.any(),
        f"with disks the UAV-arm elements of M grow by a factor of {middle:.2f} in the median "
        f"({least.min():.2f} to {most.max():.2f}), {where}",
        median_factor=middle,
        smallest_factor=float(least.min()),
        largest_factor=float(most.max()),
    )


def factors_of_disks(vehicle: Vehicle, q: Array) -> Array:
    """Return the factors by which disks change the UAV-arm elements above 1 % of the largest."""
    bare = vehicle.replace({"arm.kappa_s": 0.0})
    before, after = uav_arm_block(bare, q), uav_arm_block(with_disks(bare), q)
    large = significant(before)
    return np.asarray(after[large] / before[large])


def order_by_error(bare: dict[str, float], full: dict[str, float]) -> Judgement:
    """Return whether errors of tests without and with disks have one order."""
    ended = [test for test in OPEN_LOOP_TESTS if math.isnan(bare[test] + full[test])]
    if ended:
        evidence = f"flights of Test {', '.join(ended)} end early and have no place in an order"
        return Judgement(UNDECIDED, evidence)
    before, after = ("".join(sorted(OPEN_LOOP_TESTS, key=of.__getitem__)) for of in (bare, full))
    change = largest(abs(full[test] / bare[test] - 1.0) for test in OPEN_LOOP_TESTS)
    return judged(
        before == after,
        f"the order of Tests A to D by the decoupled model's error is {before} without disks and "
        f"{after} with them; an error changes by at most {percent(change)}",
        largest_change_of_an_error=change,
    )


JUDGES = {
    "III-C.15": assumption_on_disks,
    "III-C.16": effect_of_disks,
}
"""Judge of every sentence of Assumption 1, by its id."""
