"""Judges of statements in III-C on the coupling elements of M, and of Appendix B.

The threshold of Remark 1 is off, as it would end every series in κ, and the backbone has no disks.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.agreement import (
    AGREES,
    SLOPES_AGREE,
    as_formula,
    largest_gap,
    lowest_powers,
    natural_units,
    powers,
    random_states,
)
from amiri2026.verdicts import Judgement, judged, or_misprint
from continuair import Vehicle, equations

Array = np.ndarray

ELEMENT = 0.01
"""Relative difference up to which an expression is an element of M."""

LINEAR = 1e-3
"""Distance from the chord, as a share of the largest value, from which on a term is not linear."""

ATTITUDES = 4
"""At which series in κ are taken."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)

_MEANINGS = ("a curvature", "the total angle")
_PLACES = ("at the tip", "integrated")


def printed_elements(vehicle: Vehicle, q: Array, κ: str, s: str) -> Array:
    """(M17, M18) of Appendix B, the printed κ and s read as the words of _MEANINGS and _PLACES.

    If κ is an angle, the elements are those of coordinates that have it for the curvature.
    """
    length = vehicle.arm.length
    # appendix_b inserts the angle κ l for the printed κ.
    inserted = q if κ == "the total angle" else _with_bend(q, q[6] / length)
    if s == "at the tip":
        return np.array(equations.appendix_b(vehicle, inserted, length))
    places: Any = 0.5 * length * (1.0 + _NODES)
    values = np.array(equations.appendix_b(vehicle, inserted, places))
    return 0.5 * length * values @ _WEIGHTS


def elements(vehicle: Vehicle, q: Array, κ: str = "a curvature") -> Array:
    """Return elements 17 and 18 of the mass matrix, with κ or the angle κ l as coordinate 7."""
    row = equations.mass_matrix(vehicle, q)[0, 6:]
    return row / np.array([vehicle.arm.length if κ == "the total angle" else 1.0, 1.0])


def gaps(vehicle: Vehicle, κ: str, s: str) -> Array:
    """Relative differences of the printed elements from M's, (arms, states, 2), in a reading.

    At random states, of the vehicle's arm and one 1.5 times as long: at a length of 1 m a
    curvature and a total angle are the same number.
    """
    arms = [
        _regular(vehicle).replace({"arm.length": factor * vehicle.arm.length})
        for factor in (1.0, 1.5)
    ]
    found = [
        [
            np.abs(printed_elements(arm, q, κ, s) / elements(arm, q, κ) - 1.0)
            for q, _ in random_states(arm.arm.length)
        ]
        for arm in arms
    ]
    return np.array(found)


def both_elements(evidence: Evidence) -> Judgement:
    """Judge III-C.7: is Appendix B elements 17 and 18 in some reading, and are they nonlinear?"""
    vehicle = evidence.vehicle
    worst = {(κ, s): gaps(vehicle, κ, s).max() for κ in _MEANINGS for s in _PLACES}
    fits = [reading for reading, gap in worst.items() if gap <= ELEMENT]
    κ, s = min(worst, key=lambda reading: worst[reading])
    bare = _regular(vehicle)
    length = vehicle.arm.length
    least = distances_from_chords(lambda q: printed_elements(bare, q, κ, s), length).min()
    return judged(
        bool(fits) and least > LINEAR,
        f"{len(fits)} of four readings gives both elements, to {max(worst[κ, s], AGREES):.0e} for "
        f"two arm lengths: κ is {κ} of the bend, and s is {s} along the arm (App-B.1). Over ±0.5 "
        f"rad of κ l or of an angle each element leaves its chord by at least {least:.2g} of its "
        "largest value",
        readings_that_fit=float(len(fits)),
        least_distance_from_a_chord=float(least),
    )


def distances_from_chords(function: Callable[[Array], Array], length: float) -> Array:
    """Largest distance of a function of q from its chords over ±0.5, by variable and component.

    Variables: the angles φ, θ, ψ, the bend κ l of an arm of that length [m], and ψa; as shares of
    the largest value.
    """
    found, top = np.zeros((5, 2)), np.zeros(2)
    steps = 0.5 * np.diag(natural_units(length))
    for q, _ in random_states(length):
        middle = function(q)
        top = np.maximum(top, np.abs(middle))
        for row, index in enumerate(range(3, 8)):
            chord = 0.5 * (function(q + steps[index]) + function(q - steps[index]))
            found[row] = np.maximum(found[row], np.abs(middle - chord))
    return found / top


def appendix_b(evidence: Evidence) -> Judgement:
    """App-B.1: are the expressions the elements 17 and 18, with κ the curvature of the text?"""
    found = {s: gaps(evidence.vehicle, "a curvature", s) for s in _PLACES}
    # Of the arm that differs more: the other may be 1 m long.
    median = {s: np.median(gap, axis=1).max(axis=0) for s, gap in found.items()}
    tip, along = median["at the tip"], median["integrated"]
    angle = float(gaps(evidence.vehicle, "the total angle", "integrated").max())
    right = max(angle, AGREES)
    view = judged(
        any(gap.max() <= ELEMENT for gap in found.values()),
        f"with κ in 1/m the expressions differ from M17 and M18 by {tip[0]:.2g} and {tip[1]:.2g} "
        f"of them at s = l, and by {along[0]:.2g} and {along[1]:.2g} integrated along the arm "
        "(median; arms of two lengths, the worse one). For an arm of 1 m a curvature in 1/m and a "
        "bend angle are the same number",
        **{
            f"median relative difference of {name}, {s}": float(median[s][column])
            for s in _PLACES
            for column, name in enumerate(("M17", "M18"))
        },
        largest_relative_difference_of_the_integral_for_the_bend_angle=right,
    )
    return or_misprint(
        view,
        "κ is the total bend angle κl (to which the N m of IV-A.5 belong too), and the expressions "
        f"are integrated over s from 0 to l. The median difference is {along[0]:.2g} (M17) and "
        f"{along[1]:.2g} (M18) with κ in 1/m, and the largest {right:.0e} with the bend angle",
    )


def scaling(evidence: Evidence) -> Judgement:
    """Judge III-C.8: do the coupling elements grow as radius squared and as density?"""
    vehicle = _regular(evidence.vehicle)
    length = vehicle.arm.length
    # From 1 to 10 mm, as the paper, of an arm of 1 m; no arm may be thicker than long.
    radii = (0.001 * length, 0.010 * length)
    thin, thick = (vehicle.replace({"arm.radius": radius}) for radius in radii)
    heavy = thin.replace({"arm.density": 2.0 * thin.arm.density})
    of_two, by_radius = [], []
    for q, _ in random_states(length):
        first, larger, denser = (uav_arm_block(each, q) for each in (thin, thick, heavy))
        by_radius.append(np.log10((larger / first)[significant(first)]))
        radius, density = np.log10(larger[0] / first[0]), np.log2(denser[0] / first[0])
        of_two += [float(np.abs(radius - 2.0).max()), float(np.abs(density - 1.0).max())]
    worst = largest_gap(of_two, SLOPES_AGREE)
    every = np.concatenate(by_radius)
    return judged(
        worst <= SLOPES_AGREE,
        f"M17 and M18 scale with r_a² and with ρ, to {worst:.0e} in the exponents. From "
        f"{1e3 * radii[0]:g} to {1e3 * radii[1]:g} mm the exponents in r_a of the other UAV-arm "
        f"elements are {every.min():.4f} to {every.max():.4f}: the rotary inertia of the sections, "
        "in the rows of the UAV's rotation, scales with r_a⁴",
        largest_difference_of_an_exponent_of_M17_and_M18=worst,
        smallest_exponent_of_radius=float(every.min()),
        largest_exponent_of_radius=float(every.max()),
    )


def near_the_base(evidence: Evidence) -> Judgement:
    """Judge III-C.10: do M17 and M18 of Appendix B vanish as s² at least?"""
    vehicle = _regular(evidence.vehicle)
    radius = 0.1 * vehicle.arm.length
    lowest = np.array(
        [
            lowest_powers(partial(_printed_at, vehicle, q), radius)
            for q, _ in random_states(vehicle.arm.length)
        ]
    )
    return judged(
        bool(np.nanmin(lowest) >= 2),
        f"the lowest power of s in Appendix B at {len(lowest)} random states is "
        f"{np.nanmin(lowest[:, 0]):g} in M17 and {np.nanmin(lowest[:, 1]):g} in M18",
        lowest_power_in_M17=float(np.nanmin(lowest[:, 0])),
        lowest_power_in_M18=float(np.nanmin(lowest[:, 1])),
    )


def limit_of_m17(evidence: Evidence) -> Judgement:
    """Judge III-C.11: does M17 tend to a value without κ, in proportion to ρ r_a²?"""
    vehicle = _regular(evidence.vehicle)
    lowest = _lowest_powers_of_kappa(vehicle, 0)
    arm = vehicle.arm
    wider = vehicle.replace({"arm.radius": 0.5 * arm.radius})
    denser = vehicle.replace({"arm.density": 2.0 * arm.density})
    ratios = np.array(
        [
            [_limit(other, q) / _limit(vehicle, q) for other in (wider, denser)]
            for q, _ in random_states(vehicle.arm.length, ATTITUDES)
        ]
    )
    gap = largest_gap(np.abs(ratios / [0.25, 2.0] - 1.0).ravel(), SLOPES_AGREE)
    return judged(
        bool((lowest == 0.0).all()) and gap <= SLOPES_AGREE,
        "the lowest power of κ in M17 is 0 at general attitudes, in Appendix B and in the element "
        f"of M. Its coefficient is proportional to ρ and r_a² to {gap:.0e}",
        largest_lowest_power_of_kappa=float(lowest.max()),
    )


def _limit(vehicle: Vehicle, q: Array) -> float:
    """Return the value of M17 at κ = 0, from its series."""
    terms = powers(lambda κ: elements(vehicle, _with_bend(q, κ))[0], 0.5 / vehicle.arm.length)
    return float(terms[0].real)


def curvature_in_m18(evidence: Evidence) -> Judgement:
    """Judge III-C.12: does the leading term of M18 hold κ?"""
    lowest = _lowest_powers_of_kappa(_regular(evidence.vehicle), 1)
    return judged(
        bool((lowest != 0.0).all()),
        f"the lowest power of κ in M18 is {lowest.min():g} at general attitudes, in Appendix B and "
        "in the element of M",
        lowest_power_of_kappa=float(lowest.min()),
    )


def order_of_m18(evidence: Evidence) -> Judgement:
    """Judge III-C.13: is cos(κs/l) - 1 of second and M18 of first order in κ?"""
    vehicle = _regular(evidence.vehicle)
    cosine = float(lowest_powers(lambda x: np.cos(x) - 1.0, 0.5))
    lowest = _lowest_powers_of_kappa(vehicle, 1)
    angles = np.geomspace(1e-3, 1e-1, 9)
    slopes = np.concatenate(
        [slopes_of_m18(vehicle, q, angles) for q, _ in random_states(vehicle.arm.length, ATTITUDES)]
    )
    gap = float(np.abs(slopes - 1.0).max())
    return judged(
        cosine == 2.0 and bool((lowest == 1.0).all()) and gap <= ELEMENT,
        f"the lowest power of κ is {cosine:g} in cos(κs/l) − 1 and {lowest.max():g} in M18. The "
        f"slope of log M18 over log κ is 1 to {gap:.1g} for κl up to 0.1 rad",
        lowest_power_in_the_cosine=cosine,
        lowest_power_in_M18=float(lowest.max()),
        largest_distance_of_the_slope_from_1=gap,
    )


def slopes_of_m18(vehicle: Vehicle, q: Array, angles: Array) -> Array:
    """Return slopes of log |M18| between bends κ l (n,), of Appendix B at the tip: (n - 1,)."""
    length = vehicle.arm.length
    values = [equations.appendix_b(vehicle, _with_bend(q, x / length), length)[1] for x in angles]
    return np.diff(np.log(np.abs(values))) / np.diff(np.log(angles))


def entry_dependence(evidence: Evidence) -> Judgement:
    """Judge III-C.14: do the coupling elements have different leading powers of κ?"""
    vehicle = _regular(evidence.vehicle)
    found: set[float] = set()
    for q, _ in random_states(vehicle.arm.length, ATTITUDES):
        lowest = lowest_powers(partial(_block_at, vehicle, q), 0.5 / vehicle.arm.length)
        found |= set(lowest[np.isfinite(lowest)].tolist())
    listed = " and ".join(f"{power:g}" for power in sorted(found))
    return judged(
        len(found) >= 2,
        f"the leading powers of κ among the UAV-arm elements of M at general attitudes are "
        f"{listed}",
        different_leading_powers=float(len(found)),
    )


def _lowest_powers_of_kappa(vehicle: Vehicle, column: int) -> Array:
    """Lowest powers of κ in M17 or M18, of Appendix B at the tip and of M, at some attitudes."""
    radius = 0.5 / vehicle.arm.length
    return np.array(
        [
            lowest_powers(partial(_both_at, vehicle, q, column), radius)
            for q, _ in random_states(vehicle.arm.length, ATTITUDES)
        ]
    )


def _printed_at(vehicle: Vehicle, q: Array, s: Any) -> Array:
    """Return (M17, M18) as printed, as a function of s."""
    return np.array(equations.appendix_b(vehicle, q, s))


def _both_at(vehicle: Vehicle, q: Array, column: int, κ: Any) -> Array:
    """Return M17 or M18 as printed at the tip, and the element of M, as a function of κ."""
    bent = _with_bend(q, κ)
    printed = equations.appendix_b(vehicle, bent, vehicle.arm.length)
    return np.array([printed[column], elements(vehicle, bent)[column]])


def _block_at(vehicle: Vehicle, q: Array, κ: Any) -> Array:
    """Return UAV-arm elements (6, 2) of M, as a function of κ."""
    return equations.mass_matrix(vehicle, _with_bend(q, κ))[:6, 6:]


def uav_arm_block(vehicle: Vehicle, q: Array) -> Array:
    """Return UAV-arm elements (6, 2) of M in multiples of the arm's length, all in kg m²."""
    units = natural_units(vehicle.arm.length)
    return (units[:, None] * equations.mass_matrix(vehicle, q) * units)[:6, 6:]


def significant(block: Array) -> Array:
    """Which elements are above 1 % of the largest."""
    return np.abs(block) > ELEMENT * np.abs(block).max()


def _with_bend(q: Array, κ: Any) -> Array:
    """Return coordinates with another bend, complex or not."""
    bent = q.astype(np.result_type(q, type(κ)))
    bent[6] = κ
    return bent


def _regular(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle without Remark 1 and without disks, as the paper's Assumption 1 has it."""
    return vehicle.replace({"arm.kappa_s": 0.0, "arm.disks": ()})


JUDGES = {
    "III-C.7": as_formula(both_elements),
    "III-C.8": as_formula(scaling),
    "III-C.10": as_formula(near_the_base),
    "III-C.11": as_formula(limit_of_m17),
    "III-C.12": as_formula(curvature_in_m18),
    "III-C.13": as_formula(order_of_m18),
    "III-C.14": as_formula(entry_dependence),
    "App-B.1": appendix_b,
}
"""Judge of every sentence of these, by its id."""
