"""Flights of the coupled model with one of its couplings switched off, to tell which one matters.

With ν = (velocity, world; angular velocity, body; bend rate), M ν̇ + c = f couples UAV and arm by
the blocks M_ua, M_au of M, and by what of c is left out with them. Decoupling drops all of it,
M_d ν̇ + c_d = f. Three parts are told apart, and each is dropped alone:

* "carriage": the acceleration a_G = g + F/m of the common centre of mass does not reach the arm's
  bend, M_ba a_G. In free fall a_G = g: the decoupled arm sags under a weight that it does not feel.
* "inertia": the rest of M_ua ν̇_a and M_au ν̇_u, the arm's recoil and its answer to the UAV.
* "coriolis": what is quadratic in the rates.

M⁻¹ and M_d⁻¹ are the kernels' answers to unit forces, so that nothing is derived twice.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import xarray as xr

from continuair.engine.engine import Engine
from continuair.errors import InputError
from continuair.flight.steps import automatic_step
from continuair.flight.time_grid import make_grid, sample_inputs, stage_times
from continuair.kernels.forces.inputs import GENERAL, PAPER, TIP
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

COUPLINGS = ("carriage", "inertia", "coriolis")
"""The couplings that can be dropped."""

_UNITS = 9  # the motion itself, then the answers to unit forces


def fly_without(
    vehicle: Vehicle,
    scenario: Scenario,
    *,
    sample: float = 1e-2,
    duration: float | None = None,
) -> xr.Dataset:
    """Tip of the coupled model without one coupling, for each of COUPLINGS.

    vehicle, scenario: plain or batched, in open loop. Returns tip_position and tip_attitude over
    (coupling, run, time); a run that leaves the model's range is NaN from there on. Steps are the
    automatic ones, at most `sample` [s]. Raises InputError.
    """
    if scenario.controller is not None:
        raise InputError("scenario holds a controller; couplings are told apart in open loop.")
    coupled = Engine(vehicle, "coupled")
    duration = scenario.duration if duration is None else duration
    step = min(automatic_step(coupled, scenario.q, scenario.qd), sample)
    grid = make_grid(duration, step, sample, scenario.jumps)
    inputs, stride = sample_inputs(scenario, stage_times(grid), coupled.layout)
    q, qd = (np.atleast_2d(a) for a in (scenario.q, scenario.qd))
    runs = max(vehicle.runs or 1, len(q), len(qd), inputs.shape[1])
    plants = _Plants(vehicle, coupled, scenario.gravity, runs)
    layout, rows = plants.layout, runs * len(COUPLINGS)
    q, qd = (np.broadcast_to(a, (runs, a.shape[1])) for a in (q, qd))
    y = np.tile(state_from_paper(q, qd), (len(COUPLINGS), 1))
    angle = np.tile(q[:, -1], len(COUPLINGS))
    log = np.full((rows, len(grid.samples), layout.log), np.nan)
    log[:, 0] = _row(y, angle, layout)
    for i, h in enumerate(grid.steps):
        first, mid, last = (inputs[stride * (3 * i + k)] for k in range(3))
        k1 = plants.rate(y, angle, first)
        k2 = plants.rate(y + h / 2 * k1, angle, mid)
        k3 = plants.rate(y + h / 2 * k2, angle, mid)
        k4 = plants.rate(y + h * k3, angle, last)
        y = y + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        y[:, layout.attitude] /= np.linalg.norm(y[:, layout.attitude], axis=1, keepdims=True)
        angle = _followed(angle, y[:, layout.bend])
        if grid.sample_after[i] >= 0:
            log[:, grid.sample_after[i]] = _row(y, angle, layout)
    return plants.tips(log, grid.samples)


class _Plants:
    """The coupled and the decoupled engine, asked for several answers of each run at once."""

    def __init__(self, vehicle: Vehicle, coupled: Engine, gravity: float, runs: int) -> None:
        self.layout, self.gravity, self.runs = coupled.layout, gravity, runs
        self.mass = np.broadcast_to(np.asarray(vehicle.mass, float), runs)
        # Rows of vehicles beside those of states: one per coupling and run, then per question too.
        self.watching = _repeated(coupled, 1)
        self.asked = [
            _repeated(engine, _UNITS) for engine in (coupled, Engine(vehicle, "decoupled"))
        ]

    def rate(self, y: Array, angle: Array, row: Array) -> Array:
        """dy/dt (couplings runs, state), each block without its coupling."""
        at, rows, runs = self.layout, len(y), self.runs
        row = np.tile(np.broadcast_to(row, (runs, at.inputs)), (len(COUPLINGS), 1))
        ask = np.repeat(row[:, None], _UNITS, axis=1)
        for unit in range(1, _UNITS):
            ask[:, unit, unit - 1] += 1.0
        states, angles = np.repeat(y, _UNITS, axis=0), np.repeat(angle, _UNITS)
        ask = ask.reshape(1, -1, at.inputs)
        groups = GENERAL + PAPER + TIP
        answers = [
            engine.derivative(states, angles, ask, self.gravity, groups).reshape(rows, _UNITS, -1)
            for engine in self.asked
        ]
        out = answers[0][:, 0].copy()
        accelerations = [a[:, :, at.velocity.start :] for a in answers]
        finite = np.isfinite(np.concatenate(accelerations, axis=1)).all(axis=(1, 2))
        coupled, decoupled = (a[:, 0] for a in accelerations)
        inverse, inverse_d = (np.swapaxes(a[:, 1:] - a[:, :1], 1, 2) for a in accelerations)
        M, M_d = (
            np.linalg.inv(np.where(finite[:, None, None], a, np.eye(8)))
            for a in (inverse, inverse_d)
        )
        carried = np.zeros((rows, 8))
        carried[:, 6:] = np.einsum("nij,nj->ni", M[:, 6:, :3], self._common(row))
        carriage, inertia, coriolis = (slice(k * runs, (k + 1) * runs) for k in range(3))
        found = np.empty((rows, 8))
        found[carriage] = (coupled + _times(inverse, carried))[carriage]
        found[inertia] = _times(inverse_d, _times(M, coupled) - carried)[inertia]
        found[coriolis] = _times(inverse, _times(M_d, decoupled))[coriolis]
        out[:, at.velocity.start :] = np.where(finite[:, None], found, np.nan)
        return out

    def tips(self, log: Array, times: Array) -> xr.Dataset:
        """The tip along logged states."""
        nothing = np.zeros((1, 1, self.layout.inputs))
        seen = self.watching.observe(log, (nothing, 0), self.gravity, 0)
        seen = seen.reshape(len(COUPLINGS), self.runs, *seen.shape[1:])
        dims = ("coupling", "run", "time")
        return xr.Dataset(
            {
                "tip_position": ((*dims, "axis"), seen[..., :3]),
                "tip_attitude": ((*dims, "quaternion"), seen[..., 3:7]),
            },
            {
                "coupling": list(COUPLINGS),
                "time": times,
                "axis": list("xyz"),
                "quaternion": list("xyzw"),
            },
        )

    def _common(self, row: Array) -> Array:
        """Acceleration (couplings runs, 3) of the common centre of mass, world axes."""
        force = row[:, self.layout.force] + row[:, self.layout.tip_wrench][:, :3]
        mass = np.tile(self.mass, len(COUPLINGS))
        return np.asarray(force / mass[:, None] + [0.0, 0.0, -self.gravity])


def _repeated(engine: Engine, questions: int) -> Engine:
    """The engine for states in blocks by coupling, each state `questions` times in a row."""
    found = copy.copy(engine)
    if len(engine.plants) > 1:
        found.plants = np.repeat(np.tile(engine.plants, len(COUPLINGS)), questions)
        table = np.tile(engine.table, (len(COUPLINGS), *[1] * (engine.table.ndim - 1)))
        found.table = np.repeat(table, questions, axis=0)
    return found


def _times(matrix: Array, vector: Array) -> Array:
    return np.einsum("nij,nj->ni", matrix, vector)


def _followed(angle: Array, bend: Array) -> Array:
    """ψa (runs,) on the branch, of two a half turn apart, that is next to the last one."""
    found = np.arctan2(bend[:, 1], bend[:, 0])
    found = found + np.pi * np.round((angle - found) / np.pi)
    return np.where(np.linalg.norm(bend, axis=1) > 0.0, found, angle)


def _row(y: Array, angle: Array, layout: Any) -> Array:
    rows = np.zeros((len(y), layout.log))
    rows[:, : layout.state] = y
    bend = y[:, layout.bend]
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rows[:, layout.branch] = np.stack([np.sum(along * bend, axis=1), angle], axis=1)
    return rows
