"""Vehicles of the tests of tendons."""

from typing import Any

import numpy as np
import xarray as xr

import continuair as ca
from tests.sections.strains import flying, rod

FOUR = [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi]
DISKS = {"count": 8, "mass": 0.002}


def pulled(*groups: dict[str, Any], sections: Any = None, **section: Any) -> ca.Vehicle:
    """Return a vehicle whose arm has these groups of tendons; sections: one arc by default."""
    parts = [rod(**section)] if sections is None else sections
    return flying(*parts, tendon=[{"angles": FOUR, "offset": 0.01} | group for group in groups])


def floating(vehicle: ca.Vehicle, duration: float = 0.2, **changes: Any) -> ca.Scenario:
    """Return a flight in weightlessness from a moving start, on which nothing else acts."""
    rates = np.random.default_rng(5).normal(size=vehicle.layout.coordinates)
    rates[6:] *= 10.0
    q = np.zeros(vehicle.layout.coordinates)
    given: dict[str, Any] = {"duration": duration, "gravity": 0.0} | changes
    return ca.Scenario("floating", q, rates, **given)


def settled(
    vehicle: ca.Vehicle, command: Any, duration: float = 0.5, bends: Any = None
) -> xr.Dataset:
    """Return the last sample of a flight in which the arm comes to rest; bends: at the start."""
    q = np.zeros(vehicle.layout.coordinates)
    if bends is not None:
        at = np.reshape(bends, (-1, 2))
        q[6:] = np.column_stack([np.hypot(*at.T), np.arctan2(at[:, 1], at[:, 0])]).ravel()
    scenario = ca.Scenario("settling", q, gravity=0.0, duration=duration, tendon_command=command)
    return ca.simulate(vehicle, scenario, rtol=1e-9).isel(time=-1)
