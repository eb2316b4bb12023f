"""Trajectories: labelled Datasets with units, axes and provenance."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Logs
from continuair.engine.loop import POSE_AND_TWIST
from continuair.flight.time_grid import Grid
from continuair.kernels.step import STATUS
from continuair.vehicle.coordinates import continuous_euler
from continuair.vehicle.layout import Layout

_BENDING = {
    "coupled": "",
    "decoupled": "T_d: bending and UAV blocks of M alone; ",
    "independent": "UAV with frozen payload, plus the arm on its fixed base; ",
}

VARIABLES: dict[str, tuple[str, str, str]] = {
    "position": ("axis", "m", "origin of B (UAV centre of mass), world axes"),
    "attitude": ("quaternion", "1", "B to world, x y z w"),
    "bend": ("bend_axis", "1/m", "bend vector κ (cos ψa, sin ψa), body axes"),
    "velocity": ("axis", "m/s", "velocity of B's origin, body axes"),
    "angular_velocity": ("axis", "rad/s", "angular velocity of B, body axes"),
    "bend_rate": ("bend_axis", "1/(m s)", "rate of the bend vector, body axes"),
    "q": ("coordinate", "m, rad, 1/m", "the paper's coordinates, angles on continuous branches"),
    "tip_position": ("axis", "m", "tip of the arm, world axes"),
    "tip_attitude": ("quaternion", "1", "untwisted tip frame (z along the tangent) to world"),
    "kinetic_energy": ("", "J", "kinetic energy of the model"),
    "gravity_energy": ("", "J", "potential energy of gravity, 0 at world z = 0"),
    "elastic_energy": ("", "J", "½ E I l |k|²"),
    "linear_momentum": ("axis", "kg m/s", "linear momentum of what the model moves, world axes"),
    "angular_momentum": ("axis", "kg m²/s", "angular momentum about the world origin, world axes"),
    "base_force": ("axis", "N", "force that the arm puts on the UAV, body axes"),
    "base_moment": (
        "axis",
        "N m",
        "moment that the arm puts on the UAV, about B's origin (UAV "
        "centre of mass), body axes, reaction of the bend actuation included",
    ),
    "command": (
        "actuator",
        "N, N m, N m²",
        "the controller's push, from each sample on: force in world axes, moment on the UAV in "
        "body axes, bend moments",
    ),
    "features": ("pixel", "px", "true image of the feature points, (u, v) in turn"),
    "feature_error": ("pixel", "px", "desired minus true image, (u, v) in turn"),
    "depth": ("point", "m", "depth of the feature points"),
    "in_view": ("point", "1", "1 where a feature point is in the image and before the camera"),
    "camera_position": ("axis", "m", "the camera, world axes"),
    "camera_attitude": ("quaternion", "1", "camera axes to world, x y z w"),
    "camera_twist": ("twist", "m/s, rad/s", "velocity and angular velocity, camera axes"),
    "target_position": ("axis", "m", "the target's centroid, world axes"),
    "target_velocity": ("axis", "m/s", "velocity of the target's centroid, world axes"),
}
"""Variable -> (dimension, units, meaning)."""

WATCHED_VARIABLES = frozenset(
    {"features", "feature_error", "depth", "in_view", "target_position", "target_velocity"}
    | {"camera_position", "camera_attitude", "camera_twist"}
)
"""Variables of a closed loop with a target."""

_OBSERVED: dict[str, Any] = {
    "tip_position": slice(0, 3),
    "tip_attitude": slice(3, 7),
    "kinetic_energy": 7,
    "gravity_energy": 8,
    "elastic_energy": 9,
    "linear_momentum": slice(10, 13),
    "angular_momentum": slice(13, 16),
    "base_force": slice(16, 19),
    "base_moment": slice(19, 22),
}
OBSERVED_VARIABLES = frozenset(_OBSERVED)

_CAMERA = {
    "camera_position": slice(0, 3),
    "camera_attitude": slice(3, 7),
    "camera_twist": slice(7, POSE_AND_TWIST),
}

_LOGGED = ("position", "attitude", "bend", "angular_velocity", "bend_rate", "command")
"""Variables that are a slice of the log, by the name of that slice in `Layout`."""

_RUNNING = ("scene", "part")
"""What is known of a flight while it is assembled, and not kept."""

_COORDINATES: dict[str, list[Any]] = {
    "actuator": ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"]
    + ["bend_moment_x", "bend_moment_y"],
    "twist": ["vx", "vy", "vz", "wx", "wy", "wz"],
    "axis": list("xyz"),
    "quaternion": list("xyzw"),
    "bend_axis": ["x", "y"],
    "coordinate": ["x", "y", "z", "roll", "pitch", "yaw", "kappa", "psi_a"],
}


def assemble(
    grid: Grid,
    logs: Logs,
    layout: Layout,
    names: Iterable[str],
    batched: bool,
    provenance: dict[str, Any],
) -> xr.Dataset:
    """Dataset of the named variables from the logs of a chunk of runs."""
    data: dict[str, Any] = {}
    model = provenance["model"]
    for name in names:
        dimension, units, meaning = VARIABLES[name]
        if name in WATCHED_VARIABLES:
            values = _watched(name, logs, provenance).astype(logs.log.dtype, copy=False)
        else:
            values = _values(name, logs, layout)
        dims = ("run", "time", dimension) if dimension else ("run", "time")
        if name == "kinetic_energy":
            meaning = _BENDING[model] + meaning
        data[name] = (dims, values, {"units": units, "long_name": meaning})
    times = np.append(grid.starts, grid.samples[-1])
    codes = ", ".join(f"{code} {text}" for code, text in STATUS.items())
    data["status"] = (
        "run",
        logs.status.astype(np.int8),
        {"long_name": f"how the run ended: {codes}"},
    )
    data["end_time"] = (
        "run",
        times[logs.last_step],
        {"units": "s", "long_name": "time up to which the run is valid"},
    )
    used = {VARIABLES[name][0] for name in names} - {""}
    coordinates: dict[str, Any] = {n: _COORDINATES[n] for n in sorted(used) if n in _COORDINATES}
    coordinates["time"] = ("time", grid.samples, {"units": "s"})
    dataset = xr.Dataset(data, coordinates, _attributes(provenance))
    return dataset if batched else dataset.isel(run=0)


def concatenate(parts: list[xr.Dataset]) -> xr.Dataset:
    """Join chunks of one batch along `run`."""
    if len(parts) == 1:
        return parts[0]
    return xr.concat(
        parts,
        "run",
        data_vars="minimal",
        coords="minimal",
        compat="override",
        join="override",
        combine_attrs="override",
    )


def _values(name: str, logs: Logs, layout: Layout) -> np.ndarray:
    if name in _OBSERVED:
        assert logs.observed is not None
        return logs.observed[..., _OBSERVED[name]].copy()
    log = logs.log
    if name in _LOGGED:
        return log[..., getattr(layout, name)].copy()
    if name == "q":
        euler = continuous_euler(log[..., layout.attitude])
        return np.concatenate([log[..., layout.position], euler, log[..., layout.branch]], -1)
    # The kernels integrate the velocity of B's origin in world axes.
    attitude = log[..., layout.attitude].reshape(-1, 4)
    valid = np.isfinite(attitude).all(-1)
    turned = np.full((len(attitude), 3), np.nan, log.dtype)
    turned[valid] = Rotation.from_quat(attitude[valid]).apply(
        log[..., layout.velocity].reshape(-1, 3)[valid], inverse=True
    )
    return turned.reshape(*log.shape[:-1], 3)


def _watched(name: str, logs: Logs, provenance: dict[str, Any]) -> np.ndarray:
    """What the camera sees, in pixels, and where it and its target are."""
    watched, scene, camera = logs.watched, provenance["scene"], provenance["vehicle"].camera
    assert watched is not None

    def of_part(rows: Any) -> np.ndarray:
        rows = np.atleast_2d(rows)
        return rows if len(rows) == 1 else rows[provenance["part"]]

    n = len(scene.corners)
    if name in ("target_position", "target_velocity"):
        part = slice(0, 3) if name == "target_position" else slice(3, 6)
        rows = of_part(np.moveaxis(scene.motion_at_samples[..., part], 0, 1))
        return np.broadcast_to(rows, (*watched.shape[:2], 3)).copy()
    if name in _CAMERA:
        return watched[..., _CAMERA[name]].copy()
    image, depth, seen = np.split(watched[..., POSE_AND_TWIST:], [2 * n, 3 * n], axis=-1)
    if name == "depth":
        return depth.copy()
    if name == "in_view":
        return seen.copy()
    scale = np.tile(of_part(camera.focal_length), n)[:, None]
    if name == "feature_error":
        return scale * (of_part(scene.desired)[:, None] - image)
    return scale * image + np.tile(of_part(camera.principal_point), n)[:, None]


def default_variables(scenario: Any) -> tuple[str, ...]:
    """All variables that a scenario has."""
    absent: set[str] = set()
    if scenario.controller is None:
        absent |= {"command"}
    if scenario.controller is None or not scenario.targets:
        absent |= WATCHED_VARIABLES
    return tuple(name for name in VARIABLES if name not in absent)


def _attributes(provenance: dict[str, Any]) -> dict[str, Any]:
    attributes = {name: value for name, value in provenance.items() if name not in _RUNNING}
    attributes["vehicle"] = json.dumps(provenance["vehicle"].describe())
    attributes["scenario"] = json.dumps(provenance["scenario"].describe())
    attributes["versions"] = json.dumps(
        {name: version(name) for name in ("continuair", "warp-lang", "numpy", "scipy")}
    )
    return attributes
