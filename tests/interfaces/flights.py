"""Short flights that are written to files."""

from functools import cache

import numpy as np
import xarray as xr

import continuair as ca


@cache
def flight(name: str, duration: float = 0.25) -> xr.Dataset:
    """A preset that turns, climbs and swings, under a steady force that lifts it."""
    vehicle = ca.load_vehicle(name)
    start = [1.0, 2.0, 3.0, 0.1, -0.2, 0.3, *[0.5, 0.7] * vehicle.sections]
    rates = [0.3, -0.2, 0.4, 0.5, 0.6, 2.0, *[0.3, 0.2] * vehicle.sections]
    force = np.array([0.5, -0.3, 10.5 * vehicle.mass])
    scenario = ca.Scenario("lifted", start, rates, force=force, duration=duration)
    return ca.simulate(vehicle, scenario, sample=0.01)
