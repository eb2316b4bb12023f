"""Flights that nobody simulated, as results hold them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca

PAPER = ca.load_vehicle("paper")


def swing(vehicle: ca.Vehicle = PAPER, duration: float = 1.0, **changes: Any) -> xr.Dataset:
    """A vehicle that circles and turns while its arms swing, a sample every 10 ms."""
    t = 0.01 * np.arange(round(100 * duration) + 1)
    position = np.column_stack([0.3 * np.cos(t), 0.3 * np.sin(t), 3.0 + 0.1 * np.sin(2 * t)])
    attitude = Rotation.from_euler("zyx", np.column_stack([0.4 * t, 0.2 * np.sin(t), 0.1 * t]))
    bend = np.stack([np.sin(3.0 * t), 0.5 * np.cos(2.0 * t)], axis=-1)
    force = np.column_stack([np.cos(t), np.sin(t), np.full(len(t), -4.0)])
    dims: tuple[str, ...] = ("time", "bend_axis")
    per_arm: tuple[str, ...] = ("time", "axis")
    if vehicle.has_arm_list:
        bend = bend[:, None] * (1.0 + np.arange(vehicle.sections))[:, None]
        force = np.repeat(force[:, None], len(vehicle.arms), axis=1)
        dims, per_arm = ("time", "section", "bend_axis"), ("time", "arm", "axis")
    return xr.Dataset(
        {
            "position": (("time", "axis"), position),
            "attitude": (("time", "quaternion"), attitude.as_quat()),
            "bend": (dims, bend),
            "base_force": (per_arm, force),
            "status": ((), np.int8(0)),
            "end_time": ((), t[-1]),
        },
        {"time": t, "axis": list("xyz"), "bend_axis": ["x", "y"]},
        {
            "vehicle": json.dumps(vehicle.describe()),
            "scenario": json.dumps(
                {"name": "swing", "tau": [3.0] + (5 + 2 * vehicle.sections) * [0.0]}
            ),
            "model": "coupled",
            "versions": json.dumps({"continuair": "0.1.0"}),
            **changes,
        },
    )


def watching(duration: float = 1.0) -> xr.Dataset:
    """A flight with a camera that looks at a target."""
    flight = swing(duration=duration)
    t = flight["time"].to_numpy()
    points = [[0.25, 0.25, 0.0], [-0.25, 0.25, 0.0], [-0.25, -0.25, 0.0], [0.25, -0.25, 0.0]]
    wanted = np.array([600.0, 600.0, 400.0, 600.0, 400.0, 400.0, 600.0, 400.0])
    error = 40.0 * np.exp(-t)[:, None] * np.ones(8)
    centroid = np.column_stack([0.1 * t, 0.0 * t, 0.0 * t])
    scenario = {"name": "watch", "target": {"points": points, "distance": 2.0}}
    added = {
        "features": (("time", "pixel"), wanted - error),
        "feature_error": (("time", "pixel"), error),
        "target_position": (("time", "axis"), centroid),
    }
    return flight.assign(added).assign_attrs(scenario=json.dumps(scenario))
