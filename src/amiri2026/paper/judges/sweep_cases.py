"""Vehicles and readings with which the paper's sweeps of parameters are flown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.errors import TABLE_VEHICLE
from amiri2026.sensitivity.task import PARAMETERS
from continuair import Vehicle, load_vehicle

RADIANS, HERTZ = "sin(f t)", "sin(2π f t)"
"""Readings of f in the force of the sweeps."""


@dataclass(frozen=True)
class Swept:
    """Sweeps by name, with the vehicle and the reading with which they were flown."""

    vehicle: str
    reading: str
    sweeps: dict[str, Any]


def of_the_vehicle(evidence: Evidence) -> list[Swept]:
    """Return the vehicle's sweeps in both readings of f.

    In a quick run those in Hz are flown once, without rigid arms.
    """
    vehicle = evidence.vehicle
    if evidence.quick:
        in_hertz = {name: evidence.swept(vehicle, name, hertz=True) for name in PARAMETERS}
    else:
        in_hertz = evidence.sensitivity_hertz.results["sweeps"]
    return [
        Swept(vehicle.name, RADIANS, evidence.sensitivity.results["sweeps"]),
        Swept(vehicle.name, HERTZ, in_hertz),
    ]


def other_vehicles(evidence: Evidence) -> list[Vehicle]:
    """Return the preset `table1`, unless that is the vehicle."""
    return [] if evidence.vehicle.name == TABLE_VEHICLE else [load_vehicle(TABLE_VEHICLE)]


def swept(evidence: Evidence) -> list[Swept]:
    """Return the sweeps of the vehicle and of `other_vehicles`, in both readings of f."""
    others = [
        Swept(
            vehicle.name,
            reading,
            {name: evidence.swept(vehicle, name, hertz=reading == HERTZ) for name in PARAMETERS},
        )
        for vehicle in other_vehicles(evidence)
        for reading in (RADIANS, HERTZ)
    ]
    return [*of_the_vehicle(evidence), *others]
