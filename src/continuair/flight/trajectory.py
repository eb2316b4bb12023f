"""Trajectories: labelled Datasets with units, axes and provenance."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.indexes import PandasIndex

from continuair.engine.engine import Logs
from continuair.engine.loop import columns_of_runs
from continuair.engine.rows import adjacent
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.labels import labels_of
from continuair.flight.provenance import provenance_of
from continuair.flight.reading import BATCH_ROW
from continuair.kernels.adaptive import COUNTS, EVALUATIONS, REACHED, REJECTED, SATURATION, STEPS
from continuair.kernels.step import OK, STATUS
from continuair.scenario.scenarios import Scenario
from continuair.terms import terms_of
from continuair.typing import Array
from continuair.vehicle.coordinates import euler_on_branch, followed_coordinates
from continuair.vehicle.layout import (
    MOTION,
    OF_ARM,
    TENDON_VARIABLES,
    observed_columns,
    watched_columns,
)
from continuair.vehicle.runs import take
from continuair.vehicle.vehicle import Vehicle

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
    "strain": (
        "strain_coordinate",
        "1/m or 1",
        "coordinates of all sections",
    ),
    "strain_rate": ("strain_coordinate", "1/(m s) or 1/s", "rates of the strain's coordinates"),
    "q": ("coordinate", "m, rad, 1/m", "the paper's coordinates, angles on continuous branches"),
    "tip_position": ("axis", "m", "tip of the arm, world axes"),
    "tip_attitude": ("quaternion", "1", "untwisted tip frame (z along the tangent) to world"),
    "tip_velocity": ("axis", "m/s", "velocity of the tip, world axes"),
    "tip_angular_velocity": ("axis", "rad/s", "angular velocity of the tip, world axes"),
    "kinetic_energy": ("", "J", "kinetic energy of the model"),
    "gravity_energy": ("", "J", "potential energy of gravity, 0 at world z = 0"),
    "elastic_energy": ("", "J", "elastic energy of all sections, ½ E I l |k|² of an arc"),
    "term_energy": ("", "J", "potential energy of the vehicle's terms that have one"),
    "linear_momentum": ("axis", "kg m/s", "linear momentum of the moving parts, world axes"),
    "angular_momentum": ("axis", "kg m²/s", "angular momentum about the world origin, world axes"),
    "base_force": ("axis", "N", "force of the arm on the UAV, body axes"),
    "base_moment": (
        "axis",
        "N m",
        "moment of the arm on the UAV, about B's origin (UAV centre of mass), body axes, reaction "
        "of the bend actuation included",
    ),
    "rotor_thrust": ("rotor", "N", "thrusts of the rotors"),
    "rotor_power": ("rotor", "W", "induced power of the rotors, by momentum theory in hover"),
    "saturation": (
        "",
        "1",
        "largest commanded thrust beyond a rotor's limits, in parts of their range",
    ),
    "contact_force": ("axis", "N", "force of all obstacles on each arm, world axes"),
    "payload": ("", "1", "1 while a tip carries the payload"),
    "payload_impulse": ("axis", "N s", "impulse of the payload on the tip so far, world axes"),
    "tendon_tension": ("tendon", "N", "tension of each tendon at its motor"),
    "tendon_end_tension": ("tendon", "N", "tension of each tendon in its last stretch"),
    "tendon_length": ("tendon", "m", "length of each tendon's path from the base to its end"),
    "tendon_slack": ("tendon", "m", "length by which a tendon is longer than its path"),
    "tendon_friction_power": (
        "tendon",
        "W",
        "power that friction takes from a tendon; what guides have stored, they give back",
    ),
    "tendon_energy": ("tendon", "J", "energy stored in a tendon's elasticity and in its guides"),
    "command": (
        "actuator",
        "N, N m, N m²",
        "actuator wrench of the controller, from each sample on: force in world axes, moment on "
        "the UAV in body axes, bend moments",
    ),
    "features": (
        "pixel",
        "px",
        "true image of the feature points, (u, v) in turn; NaN for points behind the camera",
    ),
    "feature_error": ("pixel", "px", "desired minus true image, (u, v) in turn; NaN as features"),
    "depth": ("point", "m", "depth of the feature points"),
    "in_view": ("point", "1", "1 if a feature point is in the image and in front of the camera"),
    "camera_position": ("axis", "m", "position of the camera, world axes"),
    "camera_attitude": ("quaternion", "1", "camera axes to world, x y z w"),
    "camera_twist": ("twist", "m/s, rad/s", "velocity and angular velocity, camera axes"),
    "target_position": ("axis", "m", "position of the target's centroid, world axes"),
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

OF_TENDONS = frozenset(TENDON_VARIABLES)
"""Variables of a vehicle with tendons."""

OF_CONTACT = frozenset({"contact_force"})
"""Variables of a scenario with obstacles."""

OF_PAYLOAD = frozenset({"payload", "payload_impulse"})
"""Variables of a scenario with a payload, which are states."""

OBSERVED_VARIABLES = (
    frozenset(observed_columns(1, energies=True)) | OF_ROTORS | OF_TENDONS | OF_CONTACT
)

NEEDS = (
    dict.fromkeys(OF_ROTORS, "[uav.rotors] in the vehicle")
    | dict.fromkeys(OF_TENDONS, "[[arm.tendon]] in the vehicle")
    | dict.fromkeys(OF_CONTACT, "obstacles in the scenario")
    | dict.fromkeys(OF_PAYLOAD, "a payload in the scenario")
    | {
        "rotor_power": "[uav.rotors] with a radius in the vehicle",
        "term_energy": "obstacles, or a term with an energy in the vehicle",
    }
)
"""Variable -> what only some flights have."""

OF_SECTION = ("bend", "bend_rate")
"""Variables that each arc has, of vehicles whose sections are all arcs."""

OF_STRAIN = ("strain", "strain_rate")
"""Variables of vehicles with a section whose strain varies, in place of those of arcs."""

_LOGGED = {name: name for name in ("position", "attitude", "angular_velocity", "command")} | dict(
    zip(OF_SECTION + OF_STRAIN, 2 * OF_SECTION, strict=True)
)
"""Variables that are a slice of the log: name of that slice in `Layout`."""


Rows = NDArray[np.intp] | slice
"""Rows of a recorder's arrays."""

Reduction = Callable[[Rows, NDArray[np.intp], Logs], None]
"""Function of the rows, indices and logs of some runs; threads may call it at the same time."""


class Recorder:
    """Records variables of a flight's runs during the simulation, part by part.

    names: of VARIABLES; runs: indices of the runs that are recorded, all by default. reductions:
    called with each part's logs, for results of variables that are not kept.
    """

    def __init__(
        self,
        flight: Flight,
        model: str,
        names: tuple[str, ...],
        dtype: str,
        runs: NDArray[np.intp] | None = None,
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
        self.reductions: list[Reduction] = []
        self._observed_beside: frozenset[str] = frozenset()

    @property
    def observed(self) -> frozenset[str]:
        """Variables, also those of a recorder beside this one, that are computed from the log."""
        return self._observed_beside | OBSERVED_VARIABLES.intersection(self.names)

    @contextmanager
    def beside(self, other: Recorder) -> Iterator[None]:
        """Let another recorder keep its variables of the same logs, while the context lasts."""

        def keep(_: Rows, runs: NDArray[np.intp], logs: Logs) -> None:
            """Record the variables of some runs."""
            other._keep_values(runs, logs)

        self.reductions.append(keep)
        self._observed_beside = other.observed
        try:
            yield
        finally:
            self.reductions.remove(keep)
            self._observed_beside = frozenset()

    @property
    def step(self) -> dict[str, float]:
        """Step of a single flight, as an attribute, or the tolerance.

        A batch with steps of one length each has a variable instead.
        """
        if (tolerance := self.flight.tolerance) is not None:
            absolute = tolerance.relative if tolerance.absolute is None else tolerance.absolute
            return {"rtol": tolerance.relative, "atol": absolute, "max_step": tolerance.longest}
        return {} if self.flight.batched else {"step": float(self.flight.steps[self.runs[0]])}

    def needed(self) -> dict[str, float]:
        """Return the bytes that each variable takes."""
        labels, targets = labels_of(self.flight.vehicle), self.flight.scenario.targets
        points = len(targets[0].depths) if targets else 0
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
        """Record the logs of a group of runs."""
        at = self._keep_values(cohort.runs, logs)
        self.saturation[at] = logs.saturation
        times = np.append(cohort.grid.starts, cohort.grid.samples[-1])
        self.end_time[at] = times[logs.last_step]

    def keep_counted(self, runs: NDArray[np.intp], logs: Logs, counts: Array) -> None:
        """Record the logs of some runs with adaptive steps, and their counts."""
        at = self._keep_values(runs, logs)
        self.counts[at] = counts
        self.end_time[at] = np.where(logs.status == OK, self.flight.duration, counts[:, REACHED])
        self.saturation[at] = counts[:, SATURATION]

    def _keep_values(self, runs: NDArray[np.intp], logs: Logs) -> Rows:
        """Record variables and status of some runs, and return their rows."""
        at = adjacent(self._row[runs])
        for reduce in self.reductions:
            reduce(at, runs, logs)
        for name in self.names:
            self._put(at, name, values_of(name, logs, self.flight, runs))
        self.status[at] = logs.status
        return at

    def _put(self, at: Rows, name: str, parts: tuple[Array, ...]) -> None:
        """Record a variable of some runs, whose columns come in parts."""
        if name not in self._values:
            width = sum(part.shape[-1] for part in parts)
            shape = (len(self.runs), *parts[0].shape[1:-1], width)
            # Several threads may get here at once; one of them allocates the array.
            self._values.setdefault(name, np.empty(shape, self.dtype))
        kept, first = self._values[name], 0
        for part in parts:
            kept[at, :, first : first + part.shape[-1]] = part
            first += part.shape[-1]

    def values(self, name: str) -> Array:
        """Return a recorded variable (runs, samples, columns)."""
        return self._values[name]

    def dataset(self, provenance: dict[str, Any]) -> xr.Dataset:
        """Return all recorded variables; provenance: attributes added to those of the flight."""
        kept: dict[str, Any] = {name: self._variable(name) for name in self.names}
        codes = ", ".join(f"{code} {text}" for code, text in STATUS.items())
        kept["status"] = ("run",), self.status, {"long_name": f"how the run ended: {codes}"}
        until = {"units": "s", "long_name": "time up to which the run is valid"}
        kept["end_time"] = ("run",), self.end_time, until
        kept |= self._of_steps()
        if self.flight.vehicle.limited:
            kept["largest_saturation"] = ("run",), self.saturation, LARGEST_SATURATION
        attributes = self._attributes() | provenance
        kept |= provenance_of(attributes, len(self.runs))
        if not self.flight.batched:
            kept = {name: (dims[1:], of[0], told) for name, (dims, of, told) in kept.items()}
        return xr.Dataset(kept, self._coordinates(), attributes)

    def _of_steps(self) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]:
        """Return variables on the integration steps."""
        kept: dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]] = {}
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
        """Return coordinates with cached indexes, as xarray needs longer to make them than a run
        takes."""
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
        """Return the dimensions of a variable over arms or sections, if these are a list."""
        vehicle = self.flight.vehicle
        if not vehicle.has_arm_list:
            return {}
        if name in OF_SECTION:
            return {"section": vehicle.sections}
        return {"arm": len(vehicle.arms)} if name in {*OF_ARM, *OF_CONTACT} else {}

    def _variable(self, name: str) -> tuple[tuple[str, ...], Array, dict[str, str]]:
        """Return a variable of a Dataset: dimensions, values, attributes."""
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
        """Return the attributes of a trajectory."""
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
"""Variables on adaptive steps: column of the counts, and meaning."""

ERROR_ESTIMATE = {
    "units": "1",
    "long_name": "largest distance of a tip from that of a second flight with shorter steps, in "
    "arm lengths",
}
"""Attributes of error_estimate."""

LARGEST_SATURATION = {
    "units": "1",
    "long_name": "largest command beyond the limits of a rotor or tendon, in parts of their range",
}
"""Attributes of largest_saturation, of vehicles with rotors or tendons."""


@cache
def versions() -> str:
    """Return the versions of the packages that computed a result, as JSON."""
    names = ("continuair", "warp-lang", "numpy", "scipy")
    return json.dumps({name: version(name) for name in names})


def values_of(name: str, logs: Logs, flight: Flight, runs: NDArray[np.intp]) -> tuple[Array, ...]:
    """Return values (runs, samples, columns) of a variable of VARIABLES, from the logs of some
    runs.

    The columns come in parts, to avoid a copy before they are recorded.
    """
    layout = flight.coupled.layout
    if name in WATCHED_VARIABLES:
        return (_watched(name, logs, flight, runs),)
    if name in OBSERVED_VARIABLES:
        return (_observed(name, logs, flight, runs),)
    log = logs.log
    if name in OF_PAYLOAD:
        return (log[..., layout.of_state[name]],)
    if name in _LOGGED:
        return (log[..., getattr(layout, _LOGGED[name])],)
    attitude = log[..., layout.attitude]
    if name == "q":
        euler = euler_on_branch(attitude, log[..., layout.euler])
        return log[..., layout.position], euler, followed_coordinates(log, layout)
    # The kernels integrate the velocity of B's origin in world axes.
    return (_in_body_axes(log[..., layout.velocity], attitude),)


def _observed(name: str, logs: Logs, flight: Flight, runs: NDArray[np.intp]) -> Array:
    """Return variables that a kernel computes along the log, and the power of thrusts."""
    assert logs.observed is not None
    layout, vehicle = flight.coupled.layout, flight.vehicle
    columns = layout.observed
    if name != "rotor_power":
        return logs.observed[..., columns[name]]
    assert vehicle.uav.rotors is not None
    rotors = vehicle.uav.rotors if vehicle.runs is None else take(vehicle.uav.rotors, runs)
    return rotors.power(logs.observed[..., columns["rotor_thrust"]])


def _watched(name: str, logs: Logs, flight: Flight, runs: NDArray[np.intp]) -> Array:
    """Return the camera's measurements, in pixels, and the poses of camera and target."""
    assert logs.scene is not None and logs.watched is not None
    watched, scene, camera = logs.watched, logs.scene, flight.vehicle.camera
    n = len(scene.corners)
    columns = watched_columns(n)

    def of_runs(rows: Any) -> Array:
        """Return the rows of these runs, or the only row."""
        rows = np.atleast_2d(rows)
        return rows if len(rows) == 1 else rows[runs]

    if name in ("target_position", "target_velocity"):
        motion = columns_of_runs(scene.motion_at_samples, runs)
        rows = np.moveaxis(motion[..., MOTION[name.removeprefix("target_")]], 0, 1)
        return np.broadcast_to(rows, (*watched.shape[:2], 3))
    if name in columns:
        return watched[..., columns[name]]
    image = in_front(watched[..., columns["image"]], watched[..., columns["depth"]])
    scale = np.tile(of_runs(camera.focal_length), n)[:, None]
    if name == "feature_error":
        return scale * (of_runs(scene.desired)[:, None] - image)
    return scale * image + np.tile(of_runs(camera.principal_point), n)[:, None]


def in_front(image: Array, depth: Array) -> Array:
    """Return the image (..., 2n) of points with depths (..., n), NaN for points behind."""
    return np.where(np.repeat(depth > 0.0, 2, axis=-1), image, np.nan)


def default_variables(vehicle: Vehicle, scenario: Scenario) -> tuple[str, ...]:
    """Return all variables that a vehicle has in a scenario, except q, which follows from the
    others."""
    absent = {"q"}
    if not vehicle.arms:
        absent |= {*OF_ARM, *OF_SECTION, "elastic_energy"}
    absent |= set(OF_SECTION if vehicle.layout.strains else OF_STRAIN)
    if vehicle.uav.rotors is None:
        absent |= OF_ROTORS
    elif vehicle.uav.rotors.radius is None:
        absent |= {"rotor_power"}
    if not vehicle.tendons:
        absent |= OF_TENDONS
    if not scenario.obstacles:
        absent |= OF_CONTACT
    if scenario.payload is None:
        absent |= OF_PAYLOAD
    if not scenario.obstacles and not any(term.has_energy for term in terms_of(vehicle)):
        absent |= {"term_energy"}
    if scenario.controller is None:
        absent |= {"command"}
    if scenario.controller is None or not scenario.targets:
        absent |= WATCHED_VARIABLES
    return tuple(name for name in VARIABLES if name not in absent)


def _in_body_axes(vectors: Array, attitude: Array) -> Array:
    """Return world vectors (..., 3) in the body axes of attitudes (..., 4); NaN is kept."""
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
    """Return the columns of rows (..., n) as contiguous arrays, which are faster."""
    return np.array(np.moveaxis(rows, -1, 0), float, order="C")
