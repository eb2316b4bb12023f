"""How far Tests A to D move and turn the decoupled tip from the coupled one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.paper.evidence import Evidence
from amiri2026.sensitivity.findings import listed
from amiri2026.table.study import ABLATIONS, READING
from amiri2026.verdicts import Case, Judgement
from continuair.kernels import REFERENCE

Errors = dict[str, float]
"""An error by test."""

_KEYS = ("rmse_t_m", "angle_rad")

TABLE_VEHICLE = "table1"

FITS = 1.15
"""Numbers within this factor of those of Table I count as the same."""

ELEMENTS = "off-diagonal elements zero, Remark 1 as printed"
BLOCKS = "UAV-arm blocks zero"
NORMALISED = f"{ELEMENTS}, errors over the range of each axis"
IN_UNITS = f"{ELEMENTS}, errors in m and rad"
BLOCKS_IN_UNITS = f"{BLOCKS}, errors in m and rad"
BLOCKS_POOLED = f"{BLOCKS}, the printed, pooled formula"

DRAWN = "vehicles drawn"
"""The vehicles of `drawn`, of which a sentence must hold for most."""


@dataclass(frozen=True)
class TipErrors:
    """Errors of one vehicle under one reading: RMSE of the tip position and RMS angle between the
    tips [m, rad], or both over the range of each axis.

    positions, rotations: all values that the errors may have, several only of flights that have not
    converged. scale: of which a position error is a share, the arm's length [m], or 1 of errors
    over a range. units: of position and rotation, empty of errors over a range.
    """

    vehicle: str
    reading: str
    position: Errors
    rotation: Errors
    positions: tuple[Errors, ...]
    rotations: tuple[Errors, ...]
    scale: float
    units: tuple[str, str]

    def moved(self, tests: str = "".join(OPEN_LOOP_TESTS)) -> str:
        """Return position errors of tests with their unit."""
        return _shown([self.position[test] for test in tests], self.units[0])

    def turned(self, tests: str = "".join(OPEN_LOOP_TESTS)) -> str:
        """Return rotation errors of tests with their unit."""
        return _shown([self.rotation[test] for test in tests], self.units[1])

    def position_numbers(self, tests: str = "".join(OPEN_LOOP_TESTS)) -> dict[str, float]:
        """Return position errors of tests by names that hold the unit."""
        return _named("position", self.position, self.units[0], tests)

    def rotation_numbers(self, tests: str = "".join(OPEN_LOOP_TESTS)) -> dict[str, float]:
        """Return rotation errors of tests by names that hold the unit."""
        return _named("rotation", self.rotation, self.units[1], tests)


def _shown(values: list[float], unit: str) -> str:
    return f"{listed(values)} {unit}" if unit else f"{listed(values)} of the range"


def _named(of: str, errors: Errors, unit: str, tests: str) -> dict[str, float]:
    name = f"error in {of} [{unit}]" if unit else f"error in {of} over range"
    return {f"{name}, Test {test}": errors[test] for test in tests}


View = Callable[[TipErrors], Judgement]


def as_cases(found: list[TipErrors], view: View) -> list[Case]:
    """Return the cases of a view over vehicles and readings."""
    return [Case(each.vehicle, each.reading, view(each)) for each in found]


def tip_errors(evidence: Evidence) -> list[TipErrors]:
    """Return errors of `table1` over ranges and in units, and of the vehicle with zero blocks."""
    table = evidence.table
    plain = table["in_metres_and_radians"]
    position, rotation = (
        {test: float(plain[test][key]) for test in OPEN_LOOP_TESTS} for key in _KEYS
    )
    arm = float(table["vehicle"]["arm"]["length"])
    in_units = ((position,), (rotation,), arm, ("m", "rad"))
    return [
        _over_ranges(TABLE_VEHICLE, table["ours"]),
        TipErrors(TABLE_VEHICLE, IN_UNITS, position, rotation, *in_units),
        _of_open_loop(
            evidence, BLOCKS_IN_UNITS, _KEYS, float(evidence.vehicle.arm.length), ("m", "rad")
        ),
    ]


def by_printed_formula(evidence: Evidence) -> TipErrors:
    """Return errors of the vehicle with zero blocks, as the printed formula has them."""
    return _of_open_loop(evidence, BLOCKS_POOLED, ("nrmse_t", "nrmse_r"), 1.0, ("", ""))


def by_elements(evidence: Evidence) -> TipErrors:
    """Return errors over ranges of the vehicle under the reading of Table I."""
    flown = evidence.printed(evidence.vehicle, READING)
    return _over_ranges(evidence.vehicle.name, flown.table(READING).tolist())


def _over_ranges(vehicle: str, table: list[list[float]]) -> TipErrors:
    position, rotation = (dict(zip(OPEN_LOOP_TESTS, row, strict=True)) for row in table)
    return TipErrors(
        vehicle, NORMALISED, position, rotation, (position,), (rotation,), 1.0, ("", "")
    )


def _of_open_loop(
    evidence: Evidence, reading: str, keys: tuple[str, str], scale: float, units: tuple[str, str]
) -> TipErrors:
    position, rotation = (errors(evidence, key) for key in keys)
    positions, rotations = (tuple(possible(evidence, key)) for key in keys)
    name = evidence.vehicle.name
    return TipErrors(name, reading, position, rotation, positions, rotations, scale, units)


def ablation(table: dict[str, Any], **change: Any) -> dict[str, Any]:
    """Return the entry of Table I with a change of its reading, as ABLATIONS lists it."""
    name = next(name for name, other in ABLATIONS.items() if other == change)
    return next(entry for entry in table["ablations"] if entry["change"] == name)


def errors(evidence: Evidence, key: str = "rmse_t_m") -> Errors:
    """Return a metric of the decoupled model in Tests A to D, of position [m] by default."""
    tests: dict[str, Any] = evidence.open_loop.results["tests"]
    return {letter: float(entries["decoupled"][key]) for letter, entries in tests.items()}


def possible(evidence: Evidence, key: str = "rmse_t_m") -> Iterator[Errors]:
    """Yield all that `errors` may be.

    If flights have not converged, these are the bounds that their relative errors leave open.
    """
    ours = errors(evidence, key)
    ranges = []
    for letter, entries in evidence.open_loop.results["tests"].items():
        found = {ours[letter]}
        if not all(entries[model]["converged"] for model in (REFERENCE, "decoupled")):
            share = entries["decoupled"]["relative_error"]
            found |= {ours[letter] * max(0.0, 1.0 - share), ours[letter] * (1.0 + share)}
        ranges.append(found)
    for values in product(*ranges):
        yield dict(zip(ours, values, strict=True))
