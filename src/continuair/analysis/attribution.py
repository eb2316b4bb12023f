"""Which coupling a decoupled model misses most: each is dropped alone, on a sample of flights."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.couplings import COUPLINGS, fly_without
from continuair.analysis.metrics import rmse
from continuair.flight.simulate import simulate
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def attribution(vehicle: Vehicle, scenario: Scenario, sample: float) -> dict[str, Array]:
    """RMSE of the tip [m] (runs,) from the coupled flight without each of COUPLINGS alone, and of
    `decoupled`, without all of them. NaN where a flight left the model's range.

    vehicle, scenario: batched, in open loop; sample: time between samples [s]. Raises InputError.
    """
    options: dict[str, Any] = {"sample": sample, "variables": ["tip_position"]}
    coupled, decoupled = (
        _tips(simulate(vehicle, scenario, model=model, **options))
        for model in ("coupled", "decoupled")
    )
    without = fly_without(vehicle, scenario, sample=sample)["tip_position"]
    found = {name: rmse(coupled, without.sel(coupling=name).to_numpy()) for name in COUPLINGS}
    return {name: np.atleast_1d(v) for name, v in found.items()} | {
        "decoupled": np.atleast_1d(rmse(coupled, decoupled))
    }


def responsible(errors: dict[str, Array]) -> Array:
    """Return the name (runs,) of the coupling whose loss alone errs most; "" for a lost flight."""
    rows = np.stack([errors[name] for name in COUPLINGS])
    known = np.isfinite(rows).all(axis=0)
    names = np.array(COUPLINGS)[np.argmax(np.nan_to_num(rows), axis=0)]
    return np.where(known, names, "")


def _tips(flight: xr.Dataset) -> Array:
    tips = flight["tip_position"]
    rows = tips.expand_dims("run") if "run" not in tips.dims else tips
    return rows.transpose("run", "time", "axis").to_numpy()
