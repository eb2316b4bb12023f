"""Judges of the sentences of the paper's section on parameter sensitivity, IV-B."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from amiri2026.extremes import largest, least
from amiri2026.sensitivity.findings import (
    Check,
    at_least,
    at_most,
    column,
    converged,
    goes_with,
    if_converged,
    largest_above_the_middle,
    least_spread,
    trend,
)
from amiri2026.sensitivity.swing import AMPLITUDE_OFF, FREQUENCY_OFF, PHASE_OFF
from amiri2026.sensitivity.task import FREQUENCY, PARAMETERS
from amiri2026.sentences import sentences
from amiri2026.verdicts import UNDECIDED, Judgement, all_of, judged
from continuair.analysis import percent

FEWEST = 10
"""Values between that must have been flown to the end for a sweep to be judged by."""

SAME = 0.1
"""Numbers within this share of each other count as the same."""

MATERIALS = {"Nitinol": (28e9, 83e9), "titanium alloys": (100e9, 125e9), "steel": (190e9, 215e9)}
"""Young's moduli of data sheets [Pa]; Nitinol from its martensite to its austenite."""

_RADIUS, _MASS, _LENGTH = "arm radius", "UAV mass", "arm length"
_MODULUS, _BEND, _ROLL = "Young's modulus", "initial bend", "initial roll"


@dataclass(frozen=True)
class Claim:
    """The subject of a sentence, and the checks of its parts."""

    about: str
    checks: tuple[Check, ...]
    note: str = ""


def verdicts(results: dict[str, Any]) -> list[dict[str, Any]]:
    """Return id, about, quote and judgement of every sentence, from the study's sweeps."""
    listed = sentences()
    return [
        {"id": name, "about": claim.about, "quote": listed[name].quote}
        | vars(judgement(results, name))
        for name, claim in CLAIMS.items()
    ]


def judgement(results: dict[str, Any], name: str) -> Judgement:
    """Return the judgement of one sentence, by its id, with its note."""
    return view(results["sweeps"], CLAIMS[name].checks, CLAIMS[name].note)


def view(sweeps: dict[str, Any], checks: Sequence[Check], note: str = "") -> Judgement:
    """Return the judgement of checks on sweeps, undecided if one of them was not simulated."""
    usable = {
        parameter: sweep
        for parameter, sweep in sweeps.items()
        if len(sweep["between"]["value"]) >= FEWEST
    }
    try:
        return all_of([check(usable) for check in checks], note)
    except KeyError as missing:
        if missing.args[0] not in PARAMETERS:
            raise
        return Judgement(UNDECIDED, f"the sweep of the {missing.args[0]} was not flown")


def _unlike_a_payload(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return the relative change of the tip's displacement if the arm is frozen, per radius."""
    shares = [
        abs(row["displacement_m"] / row["displacement_frozen_m"] - 1.0)
        for row in sweeps[_RADIUS]["rows"]
    ]
    return shares, converged(sweeps[_RADIUS])


def _error_at_the_largest_radius(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return the error over the displacement at the largest radius."""
    row = sweeps[_RADIUS]["rows"][-1]
    error = row["models"]["decoupled"]["rmse_xy_m"]
    return [error / row["displacement_m"]], converged(sweeps[_RADIUS])


def _least_error_at_the_largest_radius(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return the error at the largest radius over the least of the smaller ones."""
    *smaller, at_end = column(sweeps[_RADIUS]["rows"], "error")
    return [at_end / least(smaller)], converged(sweeps[_RADIUS])


def _share_of_displacement(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return errors of the stiffer arms over their displacements."""
    rows = sweeps[_MODULUS]["rows"][1:]
    shares = [
        error / row["displacement_m"]
        for error, row in zip(column(rows, "error"), rows, strict=True)
    ]
    return shares, converged(sweeps[_MODULUS])


def _beyond_its_range(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """How far outside the range of its material each modulus lies, as a share of the modulus."""
    moduli = [row["value"] for row in sweeps[_MODULUS]["rows"]]
    ranges = [MATERIALS[name] for name in ("Nitinol", "titanium alloys", "steel")]
    outside = [
        max(low - modulus, modulus - high, 0.0) / modulus
        for modulus, (low, high) in zip(moduli, ranges, strict=True)
    ]
    return outside, True


def _growth(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return the error in the last second over that in the first, at the least UAV mass."""
    seconds = sweeps[_MASS]["rows"][0]["models"]["decoupled"]["rmse_xy_by_second_m"]
    return [seconds[-1] / seconds[0]], converged(sweeps[_MASS])


def _ratio_of_changes(measure: str) -> Any:
    """Largest over least of a measure in the sweep of the length, over that of the radius."""

    def value(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
        changes = [
            largest(found) / least(found)
            for found in (column(sweeps[name]["rows"], measure) for name in (_LENGTH, _RADIUS))
        ]
        return [changes[0] / changes[1]], True

    return value


def _misses_the_oscillation(sweeps: dict[str, Any]) -> Judgement:
    """Check that some property of the oscillation is off by more than SAME at the longest arm."""
    row = sweeps[_LENGTH]["rows"][-1]
    entry = row["models"]["decoupled"]
    frequency, amplitude, phase = (entry[key] for key in (FREQUENCY_OFF, AMPLITUDE_OFF, PHASE_OFF))
    share = entry["rmse_xy_m"] / row["oscillation_m"]
    where = row["label"]
    found = judged(
        max(frequency, amplitude, phase) > SAME,
        f"at {where} the decoupled tip's oscillation about the centre of mass is off by "
        f"{percent(frequency)} in frequency, {percent(amplitude)} in amplitude and {phase:.2g} rad "
        f"in phase (limits {percent(SAME)} and {SAME:g} rad); the tip's horizontal error, which "
        f"includes the path of the UAV, is {share:.3g} of the oscillation",
        **{
            f"frequency off at {where} (share)": frequency,
            f"amplitude off at {where} (share)": amplitude,
            f"phase off at {where} [rad]": phase,
            f"error over oscillation at {where}": share,
        },
    )
    return if_converged([sweeps[_LENGTH]], found)


def _period(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Return the period of the printed sin(f t) with f = 10, in tenths of a second."""
    return [2.0 * math.pi / FREQUENCY / 0.1], True


CLAIMS = {
    "IV-B.2": Claim("sensitivity", (goes_with("arm_inertia_kg_m2"), goes_with("com_travel_m"))),
    "IV-B.4": Claim(
        "sensitivity",
        (at_most(_period, 1.01, "the printed force has a period of {} times 0.1 s"),),
        "With f = 10 Hz the expression must be sin(2π f t), which --hertz flies",
    ),
    "IV-B.7": Claim(
        _RADIUS,
        (trend(_RADIUS, "arm_inertia_kg_m2", 1), trend(_RADIUS, "displacement_m", -1)),
    ),
    "IV-B.8": Claim(
        _RADIUS,
        (
            at_most(
                _unlike_a_payload,
                SAME,
                "the displacement differs from that with a rigid arm by shares of {}",
            ),
        ),
    ),
    "IV-B.9": Claim(
        _RADIUS,
        tuple(
            trend(_RADIUS, measure, -1)
            for measure in ("largest_bend_1_m", "com_travel_m", "inertia_change")
        ),
    ),
    "IV-B.10": Claim(
        _RADIUS,
        (
            at_most(
                _error_at_the_largest_radius,
                SAME,
                "at the largest radius the error is {} of the displacement",
            ),
            at_most(
                _least_error_at_the_largest_radius,
                1.0,
                "that error is {} times the least one at smaller radii",
            ),
        ),
    ),
    "IV-B.12": Claim(_MASS, (trend(_MASS, "displacement_m", -1),)),
    "IV-B.13": Claim(
        _MASS,
        (
            trend(_MASS, "error", -1),
            at_least(
                _growth,
                1.0,
                "at the least UAV mass the error of the last second is {} times that of the first",
            ),
        ),
    ),
    "IV-B.16": Claim(
        _LENGTH,
        tuple(
            at_most(
                _ratio_of_changes(measure),
                1.0,
                f"the {name} grows over the lengths by {{}} of its factor over the radii",
            )
            for measure, name in (
                ("mass_kg", "vehicle's mass"),
                ("arm_inertia_kg_m2", "arm's inertia"),
            )
        ),
    ),
    "IV-B.17": Claim(_LENGTH, (trend(_LENGTH, "error", -1), trend(_LENGTH, "oscillation_m", 1))),
    "IV-B.18": Claim(_LENGTH, (_misses_the_oscillation,)),
    "IV-B.19": Claim(
        _MODULUS,
        (
            at_most(
                _beyond_its_range,
                0.0,
                "the moduli lie outside the ranges of their materials by shares of {}",
            ),
        ),
    ),
    "IV-B.20": Claim(
        _MODULUS,
        (
            trend(_MODULUS, "error", -1),
            at_most(
                _share_of_displacement,
                SAME,
                "the errors of the two stiffer arms are {} of the displacement",
            ),
        ),
    ),
    "IV-B.21": Claim(
        _MODULUS,
        (least_spread(_MODULUS),),
        "No flight of this section has contact or a wrench on the tip",
    ),
    "IV-B.24": Claim(
        _BEND, (trend(_BEND, "error", 1),), "The bends are ours; the paper prints none"
    ),
    "IV-B.27": Claim(
        _ROLL, (largest_above_the_middle(_ROLL),), "The roll angles are ours; the paper prints none"
    ),
}
"""The section's claims by id. Amiri et al., "Parameter Sensitivity Analysis"."""
