"""Sensitivity of closed-loop flights to a tiny change of their start.

A loop near instability amplifies every disturbance, and its end state then differs between
processors. A start moved by 1 nm, which is far more than rounding, detects such loops.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypedDict, Unpack

import numpy as np
import xarray as xr

from continuair.flight.simulate import simulate
from continuair.scenario.scenarios import Scenario
from continuair.typing import Model
from continuair.vehicle.vehicle import Vehicle

NUDGE = 1e-9
"""Change of the start along x [m]."""

GROWTH = 30.0
"""Largest growth of the change in the image. Loops that hold their target stay below 10; loops near
instability reach hundreds and more."""


class Options(TypedDict, total=False):
    """Options of `simulate` for both flights."""

    model: Model
    duration: float | None
    sample: float
    device: str


def fly_twice(
    vehicle: Vehicle,
    scenario: Scenario,
    variables: Iterable[str] = (),
    **options: Unpack[Options],
) -> tuple[xr.Dataset, xr.DataArray]:
    """Simulate a closed loop twice, from starts that differ by `NUDGE`.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    scenario : Scenario
        A scenario with a controller and a target.
    variables : iterable of str, optional
        Variables to keep besides `feature_error`.
    **options : object
        Options of `simulate`: `model`, `duration`, `sample`, `device`.

    Returns
    -------
    flight : xarray.Dataset
        The first flight.
    determined : xarray.DataArray
        By run: whether the two flights stay together. False for runs that stopped early.
    """
    names = ["feature_error"]
    flight = simulate(vehicle, scenario, variables=[*names, *variables], **options)
    moved = simulate(vehicle, nudged(scenario), variables=names, **options)
    return flight, determined(flight, moved)


def nudged(scenario: Scenario) -> Scenario:
    """Return a scenario with its start moved by NUDGE along x."""
    q = np.array(scenario.q, dtype=float)
    q[..., 0] += NUDGE
    return scenario.replace(q=q)


def determined(flight: xr.Dataset, moved: xr.Dataset) -> xr.DataArray:
    """Return by run whether a flight and the nudged one stay together.

    False for runs that stopped early. Both hold feature_error from the start on.
    """
    change = abs(moved["feature_error"] - flight["feature_error"]).max("pixel", skipna=False)
    return change.max("time", skipna=False) <= GROWTH * change.isel(time=0)
