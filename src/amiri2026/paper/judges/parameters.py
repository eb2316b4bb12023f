"""Judges of the section on parameter sensitivity, IV-B: two vehicles, both readings of its f."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from amiri2026.paper.drawn import MOST
from amiri2026.paper.drawn_sweeps import VEHICLES, DrawnSweep, fly_drawn_sweep
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.errors import DRAWN, TABLE_VEHICLE
from amiri2026.paper.judges.sweep_cases import (
    HERTZ,
    RADIANS,
    Swept,
    of_the_vehicle,
    swept,
)
from amiri2026.sensitivity.claims import CLAIMS, judgement, view
from amiri2026.sensitivity.findings import (
    Check,
    follows,
    goes_with,
    restricted,
    trend_of_few,
)
from amiri2026.sensitivity.task import AMPLITUDE, FREQUENCY, TwoPhaseForce
from amiri2026.verdicts import Case, Judgement, judged, or_misprint, over_cases
from continuair import Vehicle, load_vehicle
from continuair.kernels import REFERENCE

RADIUS, LENGTH, BEND = "arm radius", "arm length", "initial bend"

STRAIGHT = "straight arm at the start"


def _judge(name: str, more: Callable[[Evidence], list[Case]], evidence: Evidence) -> Judgement:
    """Judge by the checks of the sentence with all sweeps, and by more cases."""
    claim = CLAIMS[name]
    cases = [_case(found, claim.checks) for found in swept(evidence)]
    return over_cases([*cases, *more(evidence)], claim.note)


def _case(found: Swept, checks: tuple[Check, ...], reading: str = "") -> Case:
    """Return the case of checks on sweeps; reading: an addition to that of f."""
    told = f"{found.reading}, {reading}" if reading else found.reading
    return Case(found.vehicle, told, view(found.sweeps, checks))


def _none(evidence: Evidence) -> list[Case]:
    return []


def _one_sweep(evidence: Evidence) -> list[Case]:
    """Judge IV-B.2 for vehicles that differ in one dimension of the arm alone."""
    cases = []
    for found in swept(evidence):
        for name, plural in ((RADIUS, "radii"), (LENGTH, "lengths")):
            checks = [goes_with(key, (name,)) for key in ("arm_inertia_kg_m2", "com_travel_m")]
            cases.append(_case(found, tuple(checks), f"{plural} alone"))
    return cases


def _printed_radii(evidence: Evidence) -> list[Case]:
    """Judge IV-B.7 at the three radii that the paper prints."""
    check = trend_of_few(RADIUS, "displacement_m", -1)
    return [_case(found, (check,), "the three printed radii") for found in of_the_vehicle(evidence)]


def _large_bends(evidence: Evidence) -> list[Case]:
    """Judge IV-B.24 over the upper half of the bends, as the paper prints none of its three."""
    cases = []
    for found in of_the_vehicle(evidence):
        upper = {BEND: restricted(found.sweeps[BEND], 0.5)}
        part = Swept(found.vehicle, found.reading, upper)
        cases.append(_case(part, CLAIMS["IV-B.24"].checks, "bends of 0.5 to 1 1/m"))
    return cases


def _straight_start(evidence: Evidence) -> list[Case]:
    """Judge IV-B.9 from a straight arm, and for vehicles drawn: the paper prints no start."""
    vehicle, cases = load_vehicle(TABLE_VEHICLE), []
    for reading in (RADIANS, HERTZ):
        sweep = evidence.swept(vehicle, RADIUS, hertz=reading == HERTZ, straight=True)
        found = Swept(TABLE_VEHICLE, reading, {RADIUS: sweep})
        cases.append(_case(found, CLAIMS["IV-B.9"].checks, STRAIGHT))
    if evidence.quick:
        return cases
    for straight in (False, True):
        drawn = fly_drawn_sweep(evidence.vehicle, RADIUS, models=[REFERENCE], straight=straight)
        measured = [drawn.measured[key] for key in _OF_EXCITATION]
        holds = np.all([follows(each, -1) for each in measured], axis=0)
        reading = f"{RADIANS}, {STRAIGHT}" if straight else RADIANS
        cases.append(Case(DRAWN, reading, _share(drawn, holds)))
    return cases


_OF_EXCITATION = ("largest_bend_1_m", "com_travel_m", "inertia_change")


def _share(drawn: DrawnSweep, holds: np.ndarray) -> Judgement:
    """Return whether a claim holds for most of the vehicles drawn."""
    count, of = int((holds & drawn.usable).sum()), int(drawn.usable.sum())
    left_out = f"; {VEHICLES - of} more are lost or not resolved" if of < VEHICLES else ""
    share = count / of if of else float("nan")
    return judged(
        share > MOST,
        f"the claim holds for {count} of {of} vehicles of random radius, length, modulus and UAV "
        f"mass, at the values that the paper compares{left_out}",
        share_of_vehicles=share,
    )


def _longer_drawn(evidence: Evidence) -> list[Case]:
    """Judge IV-B.17 for vehicles drawn, and for one of those for which it holds."""
    cases: list[Case] = []
    if evidence.quick:
        return cases
    for reading in (RADIANS, HERTZ):
        hertz = reading == HERTZ
        drawn = fly_drawn_sweep(evidence.vehicle, LENGTH, hertz=hertz)
        shorter = follows(drawn.measured["error"], -1)
        holds = shorter & follows(drawn.measured["oscillation_m"], 1) & drawn.usable
        cases.append(Case(DRAWN, reading, _share(drawn, holds)))
        if holds.any():
            one = _drawn_vehicle(evidence.vehicle, drawn, int(np.argmax(holds)))
            sweeps = {LENGTH: evidence.swept(one, LENGTH, hertz=hertz)}
            cases.append(_case(Swept(one.name, reading, sweeps), CLAIMS["IV-B.17"].checks))
    return cases


def _drawn_vehicle(vehicle: Vehicle, drawn: DrawnSweep, index: int) -> Vehicle:
    """Return a random vehicle, named by its parameters except the length, which varies."""
    fields: dict[str, Any] = {key: column[index] for key, column in drawn.fields.items()}
    name = (
        f"UAV of {fields['uav.mass']:.3g} kg with an arm of radius "
        f"{1e3 * fields['arm.radius']:.3g} mm and {1e-9 * fields['arm.youngs_modulus']:.3g} GPa"
    )
    return vehicle.replace(fields | {"name": name})


def _mere_payload(evidence: Evidence) -> Judgement:
    """Judge IV-B.8: rigid arms are flown in the vehicle's own studies alone."""
    checks = CLAIMS["IV-B.8"].checks
    known = of_the_vehicle(evidence)[: 1 if evidence.quick else 2]
    return over_cases([_case(found, checks) for found in known])


def _moduli(evidence: Evidence) -> Judgement:
    """Judge IV-B.19: no flight is needed."""
    return judgement(evidence.sensitivity.results, "IV-B.19")


def _frequency(evidence: Evidence) -> Judgement:
    """Judge IV-B.4: is the printed force repeated after the period of its frequency?"""
    tenth, period = 0.1, 2.0 * np.pi / FREQUENCY
    printed = _unlike_after(tenth, TwoPhaseForce())
    in_hertz = _unlike_after(tenth, TwoPhaseForce(hertz=True))
    in_radians = _unlike_after(period, TwoPhaseForce())
    found = judged(
        printed < 1e-9,
        f"a force of 10 Hz repeats itself after 0.1 s, but the printed one has changed by up to "
        f"{printed:.3g} of its amplitude; its period is {period:.3g} s",
        change_after_a_tenth_of_a_second_over_amplitude=printed,
    )
    return or_misprint(
        found,
        "the force is a_m sin(2π f t) with f = 10 Hz, or a_m sin(f t) with f = 10 rad/s. The first "
        f"changes by {in_hertz:.1g} of its amplitude in 0.1 s, and the second by {in_radians:.1g} "
        f"in its period of {period:.3g} s; as printed it changes by {printed:.3g} in 0.1 s. Both "
        "readings are flown",
    )


def _unlike_after(period: float, force: TwoPhaseForce) -> float:
    """Return largest change of a force over a period within its first phase, over its amplitude."""
    times = np.linspace(0.0, 1.5, 1001)[:, None]
    return float(np.abs(force(times + period) - force(times)).max() / AMPLITUDE)


_MORE: dict[str, Callable[[Evidence], list[Case]]] = {
    "IV-B.2": _one_sweep,
    "IV-B.7": _printed_radii,
    "IV-B.9": _straight_start,
    "IV-B.17": _longer_drawn,
    "IV-B.24": _large_bends,
}
"""Further cases of a sentence, beside both vehicles in both readings of f."""

JUDGES: dict[str, Callable[[Evidence], Judgement]] = {
    name: functools.partial(_judge, name, _MORE.get(name, _none)) for name in CLAIMS
} | {"IV-B.4": _frequency, "IV-B.8": _mere_payload, "IV-B.19": _moduli}
"""Judge of every sentence of the section, by its id."""
