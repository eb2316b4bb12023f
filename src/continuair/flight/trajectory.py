"""Trajectories: labelled Datasets with units, axes and provenance."""

from __future__ import annotations

import json
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from xarray.indexes import PandasIndex

from continuair.engine.engine import Logs
from continuair.engine.rows import adjacent
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.labels import labels_of
from continuair.flight.provenance import provenance_of
from continuair.flight.reading import BATCH_ROW
from continuair.kernels.adaptive import COUNTS, EVALUATIONS, REACHED, REJECTED, SATURATION, STEPS
from continuair.kernels.step import OK, STATUS
from continuair.terms import terms_of
from continuair.vehicle.arc import followed_polar
from continuair.vehicle.coordinates import euler_on_branch
from continuair.vehicle.layout import (
    MOTION,
    OF_ARM,
    observed_columns,
    watched_columns,
)
from continuair.vehicle.runs import take
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_BENDING = {
    "coupled": "",
    "decoupled": "T_d: bending and UAV blocks of M alone; ",
    "independent": "UAV with frozen payload, plus the arm on its fixed base; ",
}

VARIABLES: dict[str, tuple[str, str, str]] = {
    "position": ("axis", "m", "origin of B (UAV centre of mass), world axes"),
    "attitude": ("quaternion", "1", "B to world, x y z w"),
    "bend": ("bend_axis", "1/m", "bend vector κ (cos ψa, sin ψa), axes of the section's base"),
    "velocity": ("axis", "m/s", "velocity of B's origin, body axes"),
    "angular_velocity": ("axis", "rad/s", "angular velocity of B, body axes"),
    "bend_rate": ("bend_axis", "1/(m s)", "rate of the bend vector, axes of the section's base"),
    "q": ("coordinate", "m, rad, 1/m", "the paper's coordinates, angles on continuous branches"),
    "tip_position": ("axis", "m", "tip of the arm, world axes"),
    "tip_attitude": ("quaternion", "1", "untwisted tip frame (z along the tangent) to world"),
    "tip_velocity": ("axis", "m/s", "velocity of the tip, world axes"),
    "tip_angular_velocity": ("axis", "rad/s", "angular velocity of the tip, world axes"),
    "kinetic_energy": ("", "J", "kinetic energy of the model"),
    "gravity_energy": ("", "J", "potential energy of gravity, 0 at world z = 0"),
    "elastic_energy": ("", "J", "½ E I l |k|² of all sections"),
    "term_energy": ("", "J", "potential energy of the vehicle's terms that have one"),
    "linear_momentum": ("axis", "kg m/s", "linear momentum of what the model moves, world axes"),
    "angular_momentum": ("axis", "kg m²/s", "angular momentum about the world origin, world axes"),
    "base_force": ("axis", "N", "force that the arm puts on the UAV, body axes"),
    "base_moment": (
        "axis",
        "N m",
        "moment that the arm puts on the UAV, about B's origin (UAV "
        "centre of mass), body axes, reaction of the bend actuation included",
    ),
    "rotor_thrust": ("rotor", "N", "thrusts of the rotors"),
    "rotor_power": ("rotor", "W", "induced power of the rotors, by momentum theory in hover"),
    "saturation": (
        "",
        "1",
        "the most that a rotor is asked for beyond its limits, in parts of their range",
    ),
    "command": (
        "actuator",
        "N, N m, N m²",
        "the controller's push, from each sample on: force in world axes, moment on the UAV in "
        "body axes, bend moments",
    ),
    "features": (
        "pixel",
        "px",
        "true image of the feature points, (u, v) in turn; NaN of points behind the camera",
    ),
    "feature_error": ("pixel", "px", "desired minus true image, (u, v) in turn; NaN as features"),
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

OF_ROTORS = frozenset({"rotor_thrust", "rotor_power", "saturation"})
"""Variables of a vehicle with rotors."""

OBSERVED_VARIABLES = frozenset(observed_columns(1, energies=True)) | OF_ROTORS

OF_SECTION = ("bend", "bend_rate")
"""Variables that each section has."""

_LOGGED = ("position", "attitude", "bend", "angular_velocity", "bend_rate", "command")
"""Variables that are a slice of the log, by the name of that slice in `Layout`."""


class Recorder:
    """Keeps variables of a flight's runs while they are flown, part by part.

    names: of VARIABLES; runs: indices of the runs that are kept, all by default.
    """

    def __init__(
        self,
        flight: Flight,
        model: str,
        names: tuple[str, ...],
        dtype: str,
        runs: Array | None = None,
    ) -> None:
        self.flight, self.model, self.names, self.dtype = flight, model, names, dtype
        self.runs = np.arange(flight.runs) if runs is None else runs
        self._row = np.full(flight.runs, -1)
        self._row[self.runs] = np.arange(len(self.runs))
        self._values: dict[str, Array] = {}
        self.status = np.zeros(len(self.runs), np.int8)
        self.end_time = np.zeros(len(self.runs))
        self.counts = np.zeros((len(self.runs), COUNTS))
        self.error_estimate: Array | None = None
        self.saturation = np.zeros(len(self.runs))

    @property
    def step(self) -> dict[str, float]:
        """The step of a single flight, as an attribute, or the tolerance; a batch of steps of one
        length each has a variable."""
        if (tolerance := self.flight.tolerance) is not None:
            absolute = tolerance.relative if tolerance.absolute is None else tolerance.absolute
            return {"rtol": tolerance.relative, "atol": absolute, "max_step": tolerance.longest}
        return {} if self.flight.batched else {"step": float(self.flight.steps[self.runs[0]])}

    def needed(self) -> dict[str, float]:
        """Bytes that each variable takes."""
        labels, targets = labels_of(self.flight.vehicle), self.flight.scenario.targets
        points = len(targets[0].points) if targets else 0
        sizes = {name: len(labels[name]) for name in labels} | {
            "pixel": 2 * points,
            "point": points,
        }
        each = float(
            len(self.runs) * len(self.flight.marks.samples) * np.dtype(self.dtype).itemsize
        )
        found = {}
        for name in self.names:
            dims = [*self._parts(name), *filter(None, [VARIABLES[name][0]])]
            found[name] = each * float(np.prod([sizes[dim] for dim in dims]))
        return found

    def keep(self, cohort: Cohort, logs: Logs) -> None:
        """Keep what the logs of a cohort hold."""
        at = self._keep_values(cohort.runs, logs)
        self.saturation[at] = logs.saturation
        times = np.append(cohort.grid.starts, cohort.grid.samples[-1])
        self.end_time[at] = times[logs.last_step]

    def keep_counted(self, runs: Array, logs: Logs, counts: Array) -> None:
        """Keep what the logs of some runs hold, and what a roll-out by error control counted."""
        at = self._keep_values(runs, logs)
        self.counts[at] = counts
        self.end_time[at] = np.where(logs.status == OK, self.flight.duration, counts[:, REACHED])
        self.saturation[at] = counts[:, SATURATION]

    def _keep_values(self, runs: Array, logs: Logs) -> Array | slice:
        """Keep variables and status of some runs, and return their rows."""
        at = adjacent(self._row[runs])
        for name in self.names:
            self._put(at, name, values_of(name, logs, self.flight, runs))
        self.status[at] = logs.status
        return at

    def _put(self, at: Array | slice, name: str, parts: tuple[Array, ...]) -> None:
        """Keep a variable of some runs, whose columns come in parts."""
        if name not in self._values:
            width = sum(part.shape[-1] for part in parts)
            shape = (len(self.runs), *parts[0].shape[1:-1], width)
            # Of the threads that may all be at a variable first, one makes the room for it.
            self._values.setdefault(name, np.empty(shape, self.dtype))
        kept, first = self._values[name], 0
        for part in parts:
            kept[at, :, first : first + part.shape[-1]] = part
            first += part.shape[-1]

    def values(self, name: str) -> Array:
        """A variable that was kept (runs, samples, columns)."""
        return self._values[name]

    def dataset(self, provenance: dict[str, Any]) -> xr.Dataset:
        """All that was kept; provenance: attributes beside those that follow from the flight."""
        kept = {name: self._variable(name) for name in self.names}
        codes = ", ".join(f"{code} {text}" for code, text in STATUS.items())
        kept["status"] = ("run",), self.status, {"long_name": f"how the run ended: {codes}"}
        until = {"units": "s", "long_name": "time up to which the run is valid"}
        kept["end_time"] = ("run",), self.end_time, until
        kept |= self._of_steps()
        if self.flight.vehicle.uav.rotors is not None:
            kept["largest_saturation"] = ("run",), self.saturation, LARGEST_SATURATION
        attributes = self._attributes() | provenance
        kept |= provenance_of(attributes, len(self.runs))
        if not self.flight.batched:
            kept = {name: (dims[1:], of[0], told) for name, (dims, of, told) in kept.items()}
        return xr.Dataset(kept, self._coordinates(), attributes)

    def _of_steps(self) -> dict[str, tuple[tuple[str, ...], Array, dict[str, str]]]:
        """Variables that say how the integrator went on."""
        kept: dict[str, tuple[tuple[str, ...], Array, dict[str, str]]] = {}
        if self.error_estimate is not None:
            kept["error_estimate"] = ("run",), self.error_estimate, ERROR_ESTIMATE
        if not self.flight.counted:
            if self.flight.batched:
                taken = {"units": "s", "long_name": "integration step"}
                kept["step"] = ("run",), self.flight.steps[self.runs], taken
            return kept
        for name, (column, meaning) in COUNTED.items():
            counted = self.counts[:, column].astype(int)
            kept[name] = ("run",), counted, {"units": "1", "long_name": meaning}
        return kept

    def _coordinates(self) -> xr.Coordinates:
        """Coordinates with their indexes, as xarray takes longer to make them than to fly a run."""
        labels = labels_of(self.flight.vehicle)
        dims = {dim for name in self.names for dim in (*self._parts(name), VARIABLES[name][0])}
        used = sorted(dims & set(labels))
        own = {"time": xr.Variable("time", self.flight.marks.samples, {"units": "s"})}
        if self.flight.batched:
            own["run"] = xr.Variable("run", self.runs)
        own = {name: each.to_index_variable() for name, each in own.items()}
        indexes: dict[Any, Any] = {name: labels.xindexes[name] for name in used}
        indexes |= {name: PandasIndex(each.to_index(), name) for name, each in own.items()}
        found = {name: labels[name].variable for name in used} | own
        if self.flight.batched:
            row = {"long_name": "row of the batch that flew"}
            found[BATCH_ROW] = xr.Variable("run", self.runs, row)
        return xr.Coordinates(found, indexes)

    def _parts(self, name: str) -> dict[str, int]:
        """Dimensions of a variable over arms or sections, which exist where they are a list."""
        vehicle = self.flight.vehicle
        if not vehicle.has_arm_list:
            return {}
        if name in OF_SECTION:
            return {"section": vehicle.sections}
        return {"arm": len(vehicle.arms)} if name in OF_ARM else {}

    def _variable(self, name: str) -> tuple[tuple[str, ...], Array, dict[str, str]]:
        """A variable of a Dataset: dimensions, values, attributes."""
        dimension, units, meaning = VARIABLES[name]
        values, parts = self._values[name], self._parts(name)
        dims = ("run", "time", *parts, *([dimension] if dimension else []))
        if parts:
            values = values.reshape(*values.shape[:2], *parts.values(), -1)
        values = values if dimension else values[..., 0]
        if name == "kinetic_energy":
            meaning = _BENDING.get(self.model, "") + meaning
        return dims, values, {"units": units, "long_name": meaning}

    def _attributes(self) -> dict[str, Any]:
        flight = self.flight
        return {
            **flight.provenance,
            "model": self.model,
            "method": flight.method,
            "dtype": self.dtype,
            "gravity": flight.scenario.gravity,
            "versions": versions(),
        }


COUNTED = {
    "steps": (STEPS, "steps that were accepted"),
    "steps_rejected": (REJECTED, "steps that were rejected"),
    "evaluations": (EVALUATIONS, "evaluations of the equations of motion"),
}
"""Variables of what a roll-out by error control counts: column of the counts, and meaning."""

ERROR_ESTIMATE = {
    "units": "1",
    "long_name": "largest distance of a tip from that of a second flight with shorter steps, in "
    "arm lengths",
}
"""Attributes of error_estimate."""

LARGEST_SATURATION = {
    "units": "1",
    "long_name": "the most that a rotor was asked for beyond its limits, in parts of their range",
}
"""Attributes of largest_saturation, of vehicles with rotors."""


@cache
def versions() -> str:
    """Versions of what computed a result, as JSON."""
    names = ("continuair", "warp-lang", "numpy", "scipy")
    return json.dumps({name: version(name) for name in names})


def values_of(name: str, logs: Logs, flight: Flight, runs: Array) -> tuple[Array, ...]:
    """Values (runs, samples, columns) of a variable of VARIABLES, from the logs of some runs.

    The columns come in parts, that they may be put where they are kept without a copy before.
    """
    layout = flight.coupled.layout
    if name in WATCHED_VARIABLES:
        return (_watched(name, logs, flight, runs),)
    if name in OBSERVED_VARIABLES:
        return (_observed(name, logs, flight, runs),)
    log = logs.log
    if name in _LOGGED:
        return (log[..., getattr(layout, name)],)
    attitude = log[..., layout.attitude]
    if name == "q":
        euler = euler_on_branch(attitude, log[..., layout.euler])
        polar = followed_polar(log[..., layout.branch], log[..., layout.bend])
        return log[..., layout.position], euler, polar
    # The kernels integrate the velocity of B's origin in world axes.
    return (_in_body_axes(log[..., layout.velocity], attitude),)


def _observed(name: str, logs: Logs, flight: Flight, runs: Array) -> Array:
    """What a kernel finds along the log, and the power of thrusts."""
    assert logs.observed is not None
    layout, vehicle = flight.coupled.layout, flight.vehicle
    columns = layout.observed
    if name != "rotor_power":
        return logs.observed[..., columns[name]]
    assert vehicle.uav.rotors is not None
    rotors = vehicle.uav.rotors if vehicle.runs is None else take(vehicle.uav.rotors, runs)
    return rotors.power(logs.observed[..., columns["rotor_thrust"]])


def _watched(name: str, logs: Logs, flight: Flight, runs: Array) -> Array:
    """What the camera sees, in pixels, and where it and its target are."""
    assert logs.scene is not None and logs.watched is not None
    watched, scene, camera = logs.watched, logs.scene, flight.vehicle.camera
    n = len(scene.corners)
    columns = watched_columns(n)

    def of_runs(rows: Any) -> Array:
        rows = np.atleast_2d(rows)
        return rows if len(rows) == 1 else rows[runs]

    if name in ("target_position", "target_velocity"):
        of_motion = scene.motion_at_samples[..., MOTION[name.removeprefix("target_")]]
        rows = of_runs(np.moveaxis(of_motion, 0, 1))
        return np.broadcast_to(rows, (*watched.shape[:2], 3))
    if name in columns:
        return watched[..., columns[name]]
    image = in_front(watched[..., columns["image"]], watched[..., columns["depth"]])
    scale = np.tile(of_runs(camera.focal_length), n)[:, None]
    if name == "feature_error":
        return scale * (of_runs(scene.desired)[:, None] - image)
    return scale * image + np.tile(of_runs(camera.principal_point), n)[:, None]


def in_front(image: Array, depth: Array) -> Array:
    """The image (..., 2n) of points of a depth (..., n), NaN of what is not before the camera."""
    return np.where(np.repeat(depth > 0.0, 2, axis=-1), image, np.nan)


def default_variables(vehicle: Vehicle, scenario: Any) -> tuple[str, ...]:
    """All variables that a vehicle has in a scenario, but q, which is made of the others."""
    absent = {"q"}
    if not vehicle.arms:
        absent |= {*OF_ARM, *OF_SECTION, "elastic_energy"}
    if vehicle.uav.rotors is None:
        absent |= OF_ROTORS
    elif vehicle.uav.rotors.radius is None:
        absent |= {"rotor_power"}
    if not any(term.has_energy for term in terms_of(vehicle)):
        absent |= {"term_energy"}
    if scenario.controller is None:
        absent |= {"command"}
    if scenario.controller is None or not scenario.targets:
        absent |= WATCHED_VARIABLES
    return tuple(name for name in VARIABLES if name not in absent)


def _in_body_axes(vectors: Array, attitude: Array) -> Array:
    """Vectors (..., 3) in world axes, turned back by attitudes (..., 4); NaN stays."""
    x, y, z, w = _columns(attitude)
    size = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / size, y / size, z / size, w / size
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    xy, xz, yz, xw, yw, zw = x * y, x * z, y * z, x * w, y * w, z * w
    a, b, c = _columns(vectors)
    turned = np.empty(vectors.shape)
    turned[..., 0] = (xx - yy - zz + ww) * a + 2.0 * (xy + zw) * b + 2.0 * (xz - yw) * c
    turned[..., 1] = 2.0 * (xy - zw) * a + (-xx + yy - zz + ww) * b + 2.0 * (yz + xw) * c
    turned[..., 2] = 2.0 * (xz + yw) * a + 2.0 * (yz - xw) * b + (-xx - yy + zz + ww) * c
    return turned


def _columns(rows: Array) -> Array:
    """The columns of rows (..., n) each by itself, which is faster to compute with."""
    return np.array(np.moveaxis(rows, -1, 0), float, order="C")
