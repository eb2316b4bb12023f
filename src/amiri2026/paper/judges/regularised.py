"""Open-loop tests with the threshold of Remark 1 in the dynamics, and without it.

Where |κ| <= κ_s, M and J_t do not change with κ, but κ̇ goes on and its terms in C still act. M then
belongs to no kinetic energy of the motion, and momentum is not conserved.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from amiri2026.table.compiled import Job, fly
from amiri2026.table.metrics import error, tips
from amiri2026.table.printed import NODES, STATUS, Flight, PrintedModel
from amiri2026.table.reading import Reading
from amiri2026.verdicts import Case, judged
from continuair import Vehicle, equations
from continuair.equations import slices

Array = np.ndarray

_MODELS = ("coupled", "block")

_MOST = 200_000
"""Evaluations after which a flight of a stiff arm stops; one of the preset `paper` takes 20,000."""

_RIGHT = 0.01
"""Share of the arm's length up to which a flight counts as right."""


@dataclass(frozen=True)
class Flown:
    """A test with a threshold beside the same without it.

    length: of the arm [m]. κ_s [1/m]. tip: RMS distance of the coupled tips [m]. errors: RMSE
    between decoupled (blocks) and coupled tip, without and with κ_s [m]. drift: largest distance of
    the coupled centres of mass [m], on which the same external forces act. ended: status of a
    flight that stopped early, or "". Numbers are NaN then.
    """

    vehicle: str
    test: str
    length: float
    κ_s: float
    tip: float
    errors: tuple[float, float]
    drift: float
    ended: str


@lru_cache(maxsize=8)
def fly_with(vehicle: Vehicle, test: str, κ_s: float) -> Flown:
    """Return a test A to D of a vehicle with a κ_s [1/m], beside the same without."""
    vehicles = [vehicle.replace({"arm.kappa_s": value}) for value in (0.0, κ_s)]
    readings = [Reading(decoupled="block", remark1=on) for on in (False, True)]
    jobs = [
        Job(each, reading, test, model)
        for each, reading in zip(vehicles, readings, strict=True)
        for model in _MODELS
    ]
    flights = fly(jobs, most=_MOST)
    seen = [
        tips(PrintedModel(job.vehicle, job.reading), flight).position
        for job, flight in zip(jobs, flights, strict=True)
    ]
    plain, regularised = (
        centre_of_mass(each, flight) for each, flight in zip(vehicles, flights[::2], strict=True)
    )
    return Flown(
        vehicle.name,
        test,
        float(vehicle.arm.length),
        κ_s,
        error(seen[0], seen[2], "rmse"),
        (error(seen[0], seen[1], "rmse"), error(seen[2], seen[3], "rmse")),
        float(np.linalg.norm(regularised - plain, axis=1).max()),
        next((STATUS[flight.status] for flight in flights if flight.status), ""),
    )


def centre_of_mass(vehicle: Vehicle, flight: Flight) -> Array:
    """Return the path (n, 3) of the centre of mass in the world [m], with κ_s where |κ| <= κ_s."""
    s, mass, *_ = slices(vehicle.arm, NODES)
    path = np.full((len(flight.q), 3), np.nan)
    for row in np.flatnonzero(np.isfinite(flight.q).all(axis=1)):
        q = flight.q[row]
        moments = vehicle.uav.mass * q[:3] + mass @ equations.position(vehicle, q, s)
        path[row] = moments / (vehicle.uav.mass + mass.sum())
    return path


def as_case(flown: Flown) -> Case:
    """Return whether a threshold leaves the coupled flight right."""
    return Case(
        flown.vehicle,
        f"Test {flown.test}, κ_s = {flown.κ_s:.2g} 1/m in the derived M, C and J_t",
        judged(
            max(flown.tip, flown.drift) <= _RIGHT * flown.length,
            f"the coupled tip is off by {flown.tip:.2g} m RMS, and the centre of mass by up to "
            f"{flown.drift:.2g} m under the same external forces",
            **{"RMS error of the coupled tip [m]": flown.tip},
        ),
    )
