"""Whether a closed loop's flight follows from what is asked, or from how numbers are rounded.

A loop on the brink multiplies every disturbance, and where it ends differs from processor to
processor. A start a nanometre off tells such loops: it disturbs far more than rounding does.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from continuair.flight.simulate import simulate
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

NUDGE = 1e-9
"""How far the start is moved along x [m]."""

GROWTH = 30.0
"""By how much a loop may multiply what that changes in the image. Loops that hold their target
forget it, and reach less than 10 on the way; those on the brink reach hundreds and more."""


def fly_twice(
    vehicle: Vehicle, scenario: Scenario, variables: Iterable[str] = (), **options: Any
) -> tuple[xr.Dataset, xr.DataArray]:
    """Fly a closed loop and the nudged one; return the flight, and whether it is determined.

    variables: those that the flight holds besides feature_error; options: of `simulate`.
    """
    names = ["feature_error"]
    flight = simulate(vehicle, scenario, variables=[*names, *variables], **options)
    moved = simulate(vehicle, nudged(scenario), variables=names, **options)
    return flight, determined(flight, moved)


def nudged(scenario: Scenario) -> Scenario:
    """Return the same scenario from a start NUDGE off."""
    q = np.array(scenario.q, dtype=float)
    q[..., 0] += NUDGE
    return scenario.replace(q=q)


def determined(flight: xr.Dataset, moved: xr.Dataset) -> xr.DataArray:
    """Tell by run whether a flight and the nudged one stay together; no run that ended early does.

    Both hold feature_error from the start on.
    """
    change = abs(moved["feature_error"] - flight["feature_error"]).max("pixel", skipna=False)
    return change.max("time", skipna=False) <= GROWTH * change.isel(time=0)
