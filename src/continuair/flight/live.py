"""`Simulation`: a flight that a program outside steps, one control period at a time."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.engine.engine import Drive, Logs, Start
from continuair.engine.loop import Scene, watch
from continuair.errors import InputError, shown
from continuair.flight.camera_timing import motion_of
from continuair.flight.cohorts import Cohort
from continuair.flight.inputs import field_width, groups_of
from continuair.flight.prepare import check_scenario, checked_step, prepare
from continuair.flight.reading import GIVEN_TO_STEPS
from continuair.flight.resolution import warn_of_saturation
from continuair.flight.steps import check_divides
from continuair.flight.time_grid import Grid, Marks, grid_of, marks_at, seen_at, stage_times
from continuair.flight.trajectory import WATCHED_VARIABLES, Recorder, default_variables, in_front
from continuair.kernels.dynamics import MODELS
from continuair.kernels.step import OK, STATUS
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.coordinates import branches_in, euler_on_branch, paper_rates
from continuair.vehicle.layout import FIELDS, watched_columns
from continuair.vehicle.vehicle import Vehicle, check_vehicle

Array = np.ndarray

_ONE = np.zeros(1, int)  # the index of the only run


@dataclass(frozen=True)
class Observation:
    """What the camera sees now, without its noise and latency.

    features, desired (2n,): image and the image to reach, (u, v) in turn [px], features NaN of
    points that are not before the camera; depth (n,) [m];
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
    """One vehicle in a scenario, advanced by `step` under forces held for a control period.

    The scenario gives the start, the inputs that disturb the flight, and the target, if any; its
    duration is not a limit. It flies by RK4. step: [s], or "auto", 0.2 over the fastest rate of the
    vehicle and the start, at most the control period; inputs that change faster need a shorter one.
    model: as in `simulate`; control_period: [s]. Raises InputError.
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
        checks.choice("model", model, MODELS)
        _check_pushed(vehicle, scenario)
        period = checks.positive("control_period", control_period, " [s]")
        if not (isinstance(step, str) and step == "auto"):
            check_divides(period, checked_step(step))
        self._flight = prepare(
            vehicle,
            scenario,
            step=step,
            sample=period,
            duration=period,
            threads=1,
            stacklevel=3,
        )
        if self._flight.batched:
            raise InputError(
                f"vehicle and scenario hold {self._flight.runs} runs, but a Simulation is of one; "
                "give one run, or use continuair.simulate for a batch."
            )
        self._vehicle, self._scenario, self._model = vehicle, scenario, model
        self._engine, self._step = self._flight.engine(model), float(self._flight.steps[0])
        self._period, self._status, self._ended = period, OK, 0.0
        self._saturation = 0.0
        layout = self._engine.layout
        self._hover = np.zeros(layout.inputs)
        if vehicle.uav.rotors is not None and scenario.rotor_command is None:
            hover = self._flight.scenario.rotor_command
            layout.add(self._hover, FIELDS["rotor_command"], np.asarray(hover, float).ravel())
        row = np.zeros(layout.log)
        row[: layout.state] = self._flight.start.states[0]
        row[layout.branch] = np.atleast_2d(scenario.q)[0, 6:]
        row[layout.euler] = np.atleast_2d(scenario.q)[0, 3:6]
        self._rows, self._pushes, self._groups = [row], [np.zeros(layout.inputs)], 0
        self._given: set[str] = set()
        self._stepping = Lock()

    def __copy__(self) -> Simulation:
        raise InputError(
            "a Simulation cannot be copied, as both would fly one flight; begin another one, "
            "whose time, inputs and rotors begin anew, from its state: "
            "Simulation(vehicle, scenario.replace(q=one.q, qd=one.qd))."
        )

    def __deepcopy__(self, _: dict[int, Any]) -> Simulation:
        return self.__copy__()

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle that flies."""
        return self._vehicle

    @property
    def scenario(self) -> Scenario:
        """The scenario that it flies in."""
        return self._scenario

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
        euler = euler_on_branch(row[layout.attitude], row[layout.euler])
        return np.concatenate([row[layout.position], euler, row[layout.branch]])

    @property
    def qd(self) -> Array:
        """Rates of the paper's coordinates (8,), NaN of the Euler angles at a pitch of ±π/2."""
        return paper_rates(self.q[None], self.state[None])[0]

    def step(
        self,
        tau: Any = None,
        *,
        force: Any = None,
        moment: Any = None,
        bend_moment: Any = None,
        tip_wrench: Any = None,
        rotor_command: Any = None,
        wind: Any = None,
    ) -> None:
        """Advance one control period under what acts besides the scenario's inputs.

        tau (8,): generalised forces conjugate to q: force in world axes [N], torques conjugate to
        the Euler angles [N m], Q_κ [N m²] and Q_ψa [N m]. The others as in `Scenario`; a
        tip_wrench acts on the tip. All add up, but for a rotor_command where the scenario gives
        none: it takes the place of the hover. Raises InputError, also for a flight that has ended.
        """
        given = {
            "tau": tau, "force": force, "moment": moment, "bend_moment": bend_moment,
            "tip_wrench": tip_wrench, "rotor_command": rotor_command, "wind": wind,
        }  # fmt: skip
        if not self._stepping.acquire(blocking=False):
            raise InputError(
                "step is called while another thread steps this Simulation; give each thread one "
                "of its own."
            )
        try:
            self._advance(given)
        finally:
            self._stepping.release()

    def _advance(self, given: dict[str, Any]) -> None:
        push = self._row_of(given)
        if self._status != OK:
            raise InputError(
                f"step is not possible: the flight ended at {self._ended:g} s ({self.status}); "
                "start a new Simulation."
            )
        layout, row, grid = self._engine.layout, self._rows[-1], self._grid()
        states, first = row[None, : layout.state], self._rows[0][None, : layout.state]
        start = Start(states, branches_in(row[None], layout), frozen=first)
        self._groups |= groups_of(name for name, value in given.items() if value is not None)
        self._given |= {name for name, value in given.items() if np.any(value)}
        acting = self._drive(stage_times(grid), push)
        logs = self._engine.roll_out(_ONE, start, grid, acting)
        self._pushes[-1] = push
        self._saturation = max(self._saturation, float(logs.saturation[0]))
        self._status = int(logs.status[0])
        if self._status != OK:
            self._ended = float(grid.starts[logs.last_step[0]])
            return
        self._pushes.append(push)
        self._rows.append(logs.log[0, -1])

    def observe(self) -> Observation:
        """What the camera sees now; raises InputError without a target."""
        watched = self._watch(self._rows[-1:], np.array([self.time]))[0, 0]
        camera, target = self._vehicle.camera, self._scenario.targets[0]
        n = len(target.points)
        scale = np.tile(camera.focal_length, n)
        centre = np.tile(camera.principal_point, n)
        seen = {name: watched[at] for name, at in watched_columns(n).items()}
        return Observation(
            features=scale * in_front(seen["image"], seen["depth"]) + centre,
            desired=scale * target.desired + centre,
            depth=seen["depth"],
            in_view=seen["in_view"] > 0.0,
            camera_position=seen["camera_position"],
            camera_attitude=seen["camera_attitude"],
            camera_twist=seen["camera_twist"],
            target_velocity=target.path(self.time)[1][0],
        )

    def trajectory(self) -> xr.Dataset:
        """The flight so far, a sample per control period, as `simulate` returns it.

        Of what `step` was given its scenario has the names alone, as of functions of time.
        """
        scenario, engine = self._scenario, self._engine
        times = self._marks(0).samples[:-1]
        log = np.stack(self._rows)[None]
        acting = self._drive(seen_at(times, scenario.jumps), np.stack(self._pushes)[:, None])
        names, scene, watched = default_variables(self._vehicle, scenario), None, None
        if scenario.targets:
            names += tuple(sorted(WATCHED_VARIABLES))
            target, motion = scenario.targets[0], motion_of(scenario, times)
            scene = Scene(target.points, target.desired[None], motion, motion)
            watched = watch(engine, log, target.points, motion)
        # A flight that ended did so between its last sample and the next.
        starts = times[:-1] if self._status == OK else np.append(times[:-1], self._ended)
        status, last = np.array([self._status], np.int32), np.array([len(times) - 1])
        observed = engine.observe(log, acting)
        grid = Grid(times, starts, np.diff(times), *(np.empty(0),) * 3)
        flight = dataclasses.replace(self._flight, marks=Marks(times, times, times[:0]))
        recorder = Recorder(flight, self._model, names, "float64")
        logs = Logs(log, status, last, np.array([self._saturation]), observed, watched, scene)
        recorder.keep(Cohort(flight, _ONE, grid, acting, None), logs)
        warn_of_saturation(recorder.saturation, stacklevel=3)
        given = dict.fromkeys(sorted(self._given), GIVEN_TO_STEPS)
        told = json.loads(flight.provenance["scenario"]) | given
        return recorder.dataset({"step": self._step, "scenario": json.dumps(told)})

    def _grid(self) -> Grid:
        """The steps of the next control period, between the same jumps as in `simulate`."""
        return grid_of(self._marks(len(self._rows) - 1), self._step)

    def _marks(self, first: int) -> Marks:
        """The marks of the control periods from one on to the next that is flown."""
        edges = self._period * np.arange(first, len(self._rows) + 1)
        return marks_at(edges, self._scenario.jumps, knots=self._scenario.knots)

    def _row_of(self, given: dict[str, Any]) -> Array:
        """A row of inputs of fields of a scenario, or InputError."""
        layout = self._engine.layout
        row = np.zeros(layout.inputs)
        for name, value in given.items():
            if value is None:
                continue
            if not layout.of_input.keys() >= set(FIELDS[name]):
                table = "[uav.drag]" if name == "wind" else "[uav.rotors]"
                raise InputError(
                    f"{name} is {shown(value)}, but the vehicle has no {table}; leave it out, or "
                    "give the vehicle one."
                )
            layout.add(row, FIELDS[name], _numbers(name, value, field_width(name, layout)))
        # What holds the vehicle by itself does so until the program commands its rotors.
        return row if given["rotor_command"] is None else row - self._hover

    def _drive(self, times: Array, push: Array) -> Drive:
        """What acts at times; push (inputs,), or (n, 1, inputs) at each time."""
        drive = self._flight.drive(times, _ONE)
        table = drive.table + push
        timed = len(table) > 1 and (drive.timed or push.ndim > 1)
        return Drive(table, timed, drive.groups | self._groups, drive.gravity)

    def _watch(self, rows: list[Array], times: Array) -> Array:
        if not self._scenario.targets:
            raise InputError("target of the scenario is None; give one to look at.")
        motion = motion_of(self._scenario, times)
        return watch(self._engine, np.stack(rows)[None], self._scenario.targets[0].points, motion)


def _check_pushed(vehicle: Any, scenario: Any) -> None:
    """Raise InputError for a controller."""
    check_vehicle(vehicle)
    check_scenario(scenario)
    if scenario.controller is not None:
        raise InputError(
            f"controller of the scenario is {scenario.controller.name}, but a Simulation is pushed "
            "by step(…); leave the controller out, or use continuair.simulate."
        )


def _numbers(name: str, value: Any, size: int) -> Array:
    array = checks.finite_array(value)
    if array is None or array.shape != (size,):
        raise InputError(f"{name} is {shown(value)}; give {size} finite numbers.")
    return array
