"""A stand-in for `simulate`: flights with a known path, without kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from continuair.analysis.convergence import RTOL
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

# How far each model is from the coupled one: tip in x [m], and tip pitch [rad], after 1 s.
OFFSETS = {"coupled": 0.0, "decoupled": 0.2, "independent": 0.4}


def flight(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    model: str = "coupled",
    sample: float = 1e-3,
    method: str = "Tsit5",
    rtol: float = RTOL,
    check: bool = True,
    error: float = 0.0,
) -> xr.Dataset:
    """Return a falling, slowly pitching vehicle; `error` [arm lengths] is its estimate."""
    time = np.linspace(0.0, scenario.duration, round(scenario.duration / sample) + 1)
    assert method == "Tsit5" and check and rtol == RTOL
    offset = OFFSETS[model] * time**2
    position = np.outer(time**2, [0.0, 0.0, -4.905]) + [0.0, 0.0, 5.0]
    attitude = Rotation.from_rotvec(np.outer(0.3 * time + offset, [0.0, 1.0, 0.0]))
    tip = position + np.column_stack([0.1 * time + offset, 0 * time, 0 * time - 1.0])
    kappa = 0.1 * np.cos(20 * time)
    zero = np.zeros_like(time)
    data: dict[str, Any] = {
        "position": (("time", "axis"), position),
        "attitude": (("time", "quaternion"), attitude.as_quat()),
        "bend": (("time", "bend_axis"), np.column_stack([kappa, zero])),
        "tip_position": (("time", "axis"), tip),
        "tip_attitude": (
            ("time", "quaternion"),
            (attitude * Rotation.from_quat([1.0, 0, 0, 0])).as_quat(),
        ),
        "status": ((), np.int8(0)),
        "error_estimate": ((), error),
        "end_time": ((), scenario.duration),
    }
    attrs = {"model": model, "gravity": scenario.gravity}
    return xr.Dataset(data, {"time": time}, attrs)
