"""The adjoint sweep that propagates derivatives of a cost backwards through the steps of a flight.

With y_i the state at the start of step i and λ_i the cost's derivative with respect to it,

    λ_i = (∂y_{i+1}/∂y_i)ᵀ λ_{i+1} + ∂cost/∂y_i.

The inputs of step i, the fields of the vehicle and, for "independent", the initial state receive
(∂y_{i+1}/∂·)ᵀ λ_{i+1}. Attitudes are differentiated in their four components; each step ends with
a unit quaternion, so the component along the quaternion has no effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Logs
from continuair.engine.slopes import Slopes
from continuair.engine.tangents import Tangents
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.trajectory import OF_SECTION, OF_STRAIN, Recorder
from continuair.kernels.slopes import tip_columns
from continuair.typing import Array
from continuair.vehicle.layout import GENERAL, OF_TIPS, TIP, Layout, width_of

OF_STATE = ("position", "attitude", "bend", "velocity", "angular_velocity", "bend_rate")
"""Variables of a trajectory that form the state, of arcs; velocity in body axes."""

_AT_ONCE = 2048
"""Number of steps whose derivatives are in memory at once."""


def variables_of_state(layout: Layout) -> dict[str, str]:
    """Return the variables that form the state of a trajectory, and their columns' names."""
    names = {name: name for name in OF_STATE}
    if not layout.strains:
        return names
    renamed = dict(zip(OF_SECTION, OF_STRAIN, strict=True))
    return {renamed.get(name, name): name for name in names}


@dataclass(frozen=True, eq=False)
class Flown:
    """A flight of one model.

    log: rows (steps + 1, columns) at the starts of steps and at the end. samples: indices (n,) of
    the rows that are samples. recorder: holds the samples.
    """

    cohort: Cohort
    model: str
    log: Array
    samples: Array
    status: int
    recorder: Recorder

    @property
    def layout(self) -> Layout:
        """Columns of states and inputs."""
        return self.cohort.flight.coupled.layout

    @property
    def times(self) -> Array:
        """Starts of the steps, and the end (steps + 1,) [s]."""
        return np.append(self.cohort.grid.starts, self.cohort.grid.samples[-1])


def flown(flight: Flight, model: str) -> Flown:
    """Simulate a prepared flight of one run, and keep the state at the start of each step."""
    cohort, engine = next(flight.cohorts()), flight.engine(model)
    grid = cohort.grid
    samples = np.append(0, 1 + np.flatnonzero(grid.sample_after >= 0))
    each = np.arange(1, 1 + len(grid.steps), dtype=np.int32)
    ends = np.append(grid.starts, grid.samples[-1])
    logs = engine.roll_out(
        cohort.runs, cohort.start, replace(grid, samples=ends, sample_after=each), cohort.drive
    )
    at_samples = np.ascontiguousarray(logs.log[:, samples])
    observed = engine.observe(at_samples, cohort.at_samples, OF_TIPS)
    names = (*variables_of_state(flight.coupled.layout), *OF_TIPS)
    recorder = Recorder(flight, model, names, "float64")
    kept = Logs(at_samples, logs.status, logs.last_step, logs.saturation, observed)
    recorder.keep(cohort, kept)
    return Flown(cohort, model, logs.log[0], samples, int(logs.status[0]), recorder)


@dataclass(frozen=True, eq=False)
class Swept:
    """Derivatives of a cost.

    With respect to the initial state (state,), inputs held during each step (steps, inputs), and
    directions of the vehicle's fields (directions,).
    """

    state: Array
    inputs: Array
    fields: Array


def sweep(flight: Flown, tangents: Tangents, cost: Mapping[str, Array]) -> Swept:
    """Return the derivatives of a cost, given those with respect to trajectory variables.

    cost: variable -> derivatives (samples, columns).
    """
    slopes = Slopes(flight.cohort.flight.engine(flight.model), tangents)
    grid, layout = flight.cohort.grid, flight.layout
    # Inputs that the scenario omits are zero, and have derivatives as well.
    drive = replace(flight.cohort.drive, groups=GENERAL + TIP)
    inputs, state, begun = slice(0, layout.inputs), slopes.directions.state, slopes.directions.start
    count, own = len(grid.steps), _of_states(flight, cost)
    start, of_inputs = np.zeros(layout.state), np.zeros((count, layout.inputs))
    fields = _add_tips(flight, slopes, cost, own)
    back = own[count]
    for first in reversed(range(0, count, _AT_ONCE)):
        part = slice(first, min(first + _AT_ONCE, count))
        rows = slopes.of_steps(grid, drive, flight.log, part)
        for i in reversed(range(part.start, part.stop)):
            found = rows[i - part.start] @ back
            of_inputs[i] = found[inputs]
            fields += found[slopes.fields]
            if begun.stop > begun.start:
                start += found[begun]
            back = found[state] + own[i]
    return Swept(back + start, of_inputs, fields)


def _of_states(flight: Flown, cost: Mapping[str, Array]) -> Array:
    """Return the partial derivatives of a cost with respect to each state (steps + 1, state)."""
    layout, at = flight.layout, flight.samples
    own = np.zeros((len(flight.log), layout.state))
    for name, column in variables_of_state(layout).items():
        if name in cost and name != "velocity":
            own[at, getattr(layout, column)] += cost[name]
    if "velocity" in cost:
        moved, turned = _of_body_velocity(flight.log[at], cost["velocity"], layout)
        own[at, layout.velocity] += moved
        own[at, layout.attitude] += turned
    return own


def _add_tips(flight: Flown, slopes: Slopes, cost: Mapping[str, Array], own: Array) -> Array:
    """Add the cost's derivatives through the tips to `own`; return those of the fields."""
    columns = tip_columns(flight.layout.arms)
    on_tips = np.zeros((len(flight.samples), width_of(columns)))
    for name in columns.keys() & cost.keys():
        on_tips[:, columns[name]] = cost[name]
    fields = np.zeros(slopes.fields.stop - slopes.fields.start)
    told = np.flatnonzero(on_tips.any(axis=1))
    for first in range(0, len(told), _AT_ONCE):
        rows = told[first : first + _AT_ONCE]
        at = flight.samples[rows]
        found = np.einsum("ndc,nc->nd", slopes.of_tips(flight.log[at]), on_tips[rows])
        own[at] += found[:, slopes.directions.state]
        fields += found[:, slopes.fields].sum(axis=0)
    return fields


def _of_body_velocity(log: Array, cost: Array, layout: Layout) -> tuple[Array, Array]:
    """Return derivatives with respect to world velocities (n, 3) and attitudes (n, 4).

    cost: derivatives with respect to velocities in body axes (n, 3).
    """
    attitude = log[:, layout.attitude]
    turn = Rotation.from_quat(attitude)
    in_body = turn.inv().apply(log[:, layout.velocity])
    # A rotation by θ in body axes changes the body components of a vector v by v × θ.
    return turn.apply(cost), 2.0 * _turned(attitude, np.cross(cost, in_body))


def _turned(attitude: Array, angle: Array) -> Array:
    """Return twice the change of quaternions (n, 4) by small body-axis rotation vectors (n, 3)."""
    x, y, z, w = attitude.T
    a, b, c = angle.T
    return np.stack(
        [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a,
         -x * a - y * b - z * c], axis=-1,
    )  # fmt: skip


def of_rotation(attitude: Array, slope: Array) -> Array:
    """Return the derivative (3,) with respect to a rotation vector in body axes.

    slope: derivative with respect to a quaternion (4,); its component along the quaternion is
    ignored.
    """
    tangents = 0.5 * _turned(np.tile(attitude, (3, 1)), np.eye(3))
    return np.asarray(tangents @ slope)
