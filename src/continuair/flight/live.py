"""`Simulation`: a flight that a program outside steps, one control period at a time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.engine.engine import Engine, Logs
from continuair.engine.loop import POSE_AND_TWIST, Scene, watch
from continuair.errors import InputError, shown
from continuair.flight.simulate import MODELS, warn_if_coarse
from continuair.flight.steps import automatic_step
from continuair.flight.time_grid import Grid, groups_in_use, make_grid, sample_inputs, stage_times
from continuair.flight.trajectory import WATCHED_VARIABLES, assemble, default_variables
from continuair.kernels.forces.inputs import GENERAL, PAPER
from continuair.kernels.step import OK, STATUS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import continuous_euler, paper_rates, state_from_paper
from continuair.vehicle.vehicle import Vehicle, check_vehicle

Array = np.ndarray


@dataclass(frozen=True)
class Observation:
    """What the camera sees now, without its noise and latency.

    features, desired (2n,): image and the image to reach, (u, v) in turn [px]; depth (n,) [m];
    in_view (n,): whether a point is in the image and before the camera; camera_position (3,) [m]
    and camera_attitude (4,), camera axes to world, x y z w; camera_twist (6,): (v, ω) in camera
    axes; target_velocity (3,) of the centroid in world axes [m/s].
    """

    features: Array
    desired: Array
    depth: Array
    in_view: Array
    camera_position: Array
    camera_attitude: Array
    camera_twist: Array
    target_velocity: Array


class Simulation:
    """One vehicle in a scenario, advanced by `step(tau)` under forces held for a control period.

    The scenario gives the start, the inputs that disturb the flight, and the target, if any; its
    duration is not a limit. model, step: as in `simulate`; control_period: [s]. Raises InputError.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        scenario: Scenario,
        *,
        model: str = "coupled",
        step: float | str = "auto",
        control_period: float = 1e-3,
    ) -> None:
        _check(vehicle, scenario, control_period)
        check_vehicle(vehicle)
        checks.choice("model", model, MODELS)
        control_period = checks.positive("control_period", control_period)
        if not (isinstance(step, str) and step == "auto"):
            step = checks.positive("step", step, " or 'auto'")
            parts = control_period / step
            if round(parts) < 1 or abs(parts - round(parts)) > 1e-6:
                raise InputError(
                    f"control_period is {control_period:g} s, which is not a multiple of the step, "
                    f"{step:g} s; give one that is, or step='auto'."
                )
        q, qd = np.atleast_2d(scenario.q), np.atleast_2d(scenario.qd)
        fine = automatic_step(Engine(vehicle, "coupled"), q, qd)
        self._step = min(fine, control_period) if isinstance(step, str) else float(step)
        warn_if_coarse(self._step, fine, stacklevel=3)
        self._vehicle, self._scenario, self._model = vehicle, scenario, model
        self._engine = Engine(vehicle, model, threads=1)
        self._period, self._status, self._ended = float(control_period), OK, 0.0
        layout = self._engine.layout
        row = np.zeros(layout.log)
        row[: layout.state] = state_from_paper(q, qd)[0]
        row[layout.branch] = q[0, 6:]
        self._rows, self._taus = [row], [np.zeros(layout.coordinates)]
        self._euler = continuous_euler(row[None, layout.attitude])[0]

    @property
    def time(self) -> float:
        """Time of the flight [s]."""
        return (len(self._rows) - 1) * self._period

    @property
    def status(self) -> str:
        """ "ok", or how the flight ended."""
        return STATUS[self._status]

    @property
    def state(self) -> Array:
        """The state (17,), as `Layout` orders it."""
        return self._rows[-1][: self._engine.layout.state].copy()

    @property
    def q(self) -> Array:
        """The paper's coordinates (8,) [m, rad, 1/m, rad], angles on continuous branches."""
        layout, row = self._engine.layout, self._rows[-1]
        return np.concatenate([row[layout.position], self._euler, row[layout.branch]])

    @property
    def qd(self) -> Array:
        """Rates of the paper's coordinates (8,)."""
        return paper_rates(self.q[None], self.state[None], self._vehicle.arm.kappa_s)[0]

    def step(self, tau: Any) -> None:
        """Advance one control period under generalised forces tau (8,), conjugate to q.

        Force in world axes [N], torques conjugate to the Euler angles [N m], Q_κ [N m²] and
        Q_ψa [N m]; they act besides the scenario's inputs. Raises InputError, also for a flight
        that has ended.
        """
        push = _numbers(tau, self._engine.layout.coordinates)
        if self._status != OK:
            raise InputError(
                f"step is not possible: the flight ended at {self._ended:g} s ({self.status}); "
                "start a new Simulation."
            )
        layout, row = self._engine.layout, self._rows[-1]
        grid = self._grid()
        logs = self._engine.roll_out(
            row[None, : layout.state],
            row[None, layout.branch.stop - 1],
            grid,
            self._inputs(stage_times(grid), push),
            (np.zeros((1, 1, layout.inputs)), 0),
            self._scenario.gravity,
            self._groups,
            observe=False,
            initial=self._rows[0][None, : layout.state],
        )
        self._taus[-1] = push
        self._status = int(logs.status[0])
        if self._status != OK:
            self._ended = float(grid.starts[logs.last_step[0]])
            return
        self._taus.append(push)
        self._rows.append(logs.log[0, -1])
        self._euler = _nearest_euler(self._rows[-1][layout.attitude], self._euler)

    def observe(self) -> Observation:
        """What the camera sees now; raises InputError without a target."""
        watched = self._watch(self._rows[-1:], np.array([self.time]))[0, 0]
        camera, target = self._vehicle.camera, self._scenario.targets[0]
        n = len(target.points)
        scale = np.tile(camera.focal_length, n)
        centre = np.tile(camera.principal_point, n)
        image, depth, seen = np.split(watched[POSE_AND_TWIST:], [2 * n, 3 * n])
        return Observation(
            features=scale * image + centre,
            desired=scale * target.desired + centre,
            depth=depth,
            in_view=seen > 0.0,
            camera_position=watched[:3],
            camera_attitude=watched[3:7],
            camera_twist=watched[7:POSE_AND_TWIST],
            target_velocity=target.path(self.time)[1][0],
        )

    def trajectory(self) -> xr.Dataset:
        """The flight so far, a sample per control period, as `simulate` returns it."""
        engine, scenario = self._engine, self._scenario
        times = self._period * np.arange(len(self._rows))
        log = np.stack(self._rows)[None]
        inputs = self._inputs(times, np.stack(self._taus)[:, None])
        observed = engine.observe(log, inputs, scenario.gravity, self._groups)
        names, scene, watched = default_variables(scenario), None, None
        if scenario.targets:
            names += tuple(sorted(WATCHED_VARIABLES))
            motion = self._motion(times)
            target = scenario.targets[0]
            scene = Scene(target.points, target.desired[None], motion, motion)
            watched = self._watch(self._rows, times)
        status = np.array([self._status], np.int32)
        last = np.array([len(times) - 1])
        # A flight that ended did so between its last sample and the next.
        starts = times[:-1] if self._status == OK else np.append(times[:-1], self._ended)
        grid = Grid(times, starts, np.diff(times), *(np.empty(0),) * 3)
        provenance = dict(
            vehicle=self._vehicle,
            scenario=scenario,
            model=self._model,
            step=self._step,
            integrator="rk4",
            dtype="float64",
            gravity=scenario.gravity,
            scene=scene,
            part=slice(0, 1),
        )
        logs = Logs(log, status, last, observed, watched)
        return assemble(grid, logs, engine.layout, names, False, provenance)

    @property
    def _groups(self) -> int:
        return groups_in_use(self._scenario) | GENERAL | PAPER

    def _grid(self) -> Grid:
        """The steps of the next control period; input jumps at its edges are met from inside."""
        now, period, jumps = self.time, self._period, np.array(self._scenario.jumps)
        margin = 1e-9 * period
        inside = jumps[(jumps > now + margin) & (jumps < now + period - margin)] - now
        grid = make_grid(period, min(self._step, period), period, inside)
        grid.opens[0] |= bool((np.abs(jumps - now) <= margin).any())
        grid.closes[-1] |= bool((np.abs(jumps - now - period) <= margin).any())
        return dataclasses.replace(grid, samples=now + grid.samples, starts=now + grid.starts)

    def _inputs(self, times: Array, tau: Array) -> tuple[Array, int]:
        """Input table at times and its rows per time; tau (8,), or (n, 1, 8) at each time."""
        layout = self._engine.layout
        table, stride = sample_inputs(self._scenario, times, layout)
        table = np.broadcast_to(table, np.broadcast_shapes(table.shape, (*tau.shape[:-1], 1)))
        table = np.array(table)
        table[..., layout.force] += tau[..., :3]
        table[..., layout.euler_and_polar] += tau[..., 3:]
        return table, int(len(table) > 1 and (stride or tau.ndim > 1))

    def _motion(self, times: Array) -> Array:
        """Centroid and its velocity (times, 1, 6) of the target."""
        if not self._scenario.targets:
            raise InputError("target of the scenario is None; give one to look at.")
        return np.hstack(self._scenario.targets[0].path(times)[:2])[:, None]

    def _watch(self, rows: list[Array], times: Array) -> Array:
        motion = self._motion(times)
        return watch(self._engine, np.stack(rows)[None], self._scenario.targets[0].points, motion)


def _check(vehicle: Any, scenario: Any, control_period: Any) -> None:
    if not isinstance(scenario, Scenario):
        raise InputError(f"scenario is {shown(scenario)}; give a continuair.Scenario.")
    if scenario.controller is not None:
        raise InputError(
            f"controller of the scenario is {scenario.controller.name}, but a Simulation is pushed "
            "by step(tau); leave the controller out, or use continuair.simulate."
        )
    number = isinstance(control_period, (int, float, np.number))
    if not number or isinstance(control_period, bool) or not 0.0 < control_period < np.inf:
        raise InputError(
            f"control_period is {shown(control_period)}; give a finite number above 0 [s]."
        )
    runs = {
        "vehicle": getattr(vehicle, "runs", None),
        "scenario": scenario.runs,
        "target": len(scenario.targets) if isinstance(scenario.target, (list, tuple)) else None,
    }
    for name, count in runs.items():
        if count is not None:
            raise InputError(
                f"{name} holds {count} runs, but a Simulation is of one; give one run, or use "
                "continuair.simulate for a batch."
            )


def _numbers(tau: Any, size: int) -> Array:
    try:
        array = np.array(tau, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise InputError(f"tau is {shown(tau)}; give {size} finite generalised forces.")
    return array


def _nearest_euler(attitude: Array, before: Array) -> Array:
    """The triple of ZYX angles (3,), of all that an attitude has, nearest to the one before."""
    roll, pitch, yaw = continuous_euler(attitude[None])[0]
    triples = np.array([[roll, pitch, yaw], [roll + np.pi, np.pi - pitch, yaw + np.pi]])
    triples += 2.0 * np.pi * np.round((before - triples) / (2.0 * np.pi))
    return np.asarray(triples[np.argmin(((triples - before) ** 2).sum(1))])
