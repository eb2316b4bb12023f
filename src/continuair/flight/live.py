"""`Simulation`: a flight that a program steps, one control period at a time."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from threading import Lock
from typing import Any, Literal

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
from continuair.typing import Array, ArrayLike, Model
from continuair.vehicle.coordinates import branches_in, euler_on_branch, paper_rates
from continuair.vehicle.layout import FIELDS, watched_columns
from continuair.vehicle.vehicle import Vehicle, check_vehicle

_ONE = np.zeros(1, int)  # the index of the only run


@dataclass(frozen=True)
class Observation:
    """Camera measurements at one time, without noise and latency.

    Parameters
    ----------
    features, desired : ndarray, shape (2n,)
        Image and desired image, (u, v) in turn [px]. Features of points behind the camera are NaN.
    depth : ndarray, shape (n,)
        Depths of the points [m].
    in_view : ndarray of bool, shape (n,)
        Whether a point is in the image and in front of the camera.
    camera_position : ndarray, shape (3,)
        Position of the camera in world axes [m].
    camera_attitude : ndarray, shape (4,)
        Quaternion x y z w, camera axes to world.
    camera_twist : ndarray, shape (6,)
        Velocity and angular velocity in camera axes [m/s, rad/s].
    target_velocity : ndarray, shape (3,)
        Velocity of the target's centroid in world axes [m/s].
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
    """One vehicle in a scenario, advanced step by step under inputs held for a control period.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    scenario : Scenario
        Start, inputs that act as disturbances, and the target, if any; without a controller. Its
        duration is not a limit.
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        As in `simulate`.
    step : float or "auto", default "auto"
        Step of RK4 [s], a divisor of the control period. "auto": ``min(control_period, 0.2 /
        fastest_rate)`` of the vehicle and the start. Inputs that change faster need a shorter step.
    control_period : float, default 1e-3
        Time that each call of `step` simulates [s].

    Raises
    ------
    InputError
        If an argument cannot be used.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        scenario: Scenario,
        *,
        model: Model = "coupled",
        step: float | Literal["auto"] = "auto",
        control_period: float = 1e-3,
    ) -> None:
        checks.choice("model", model, MODELS)
        _check_open_loop(vehicle, scenario)
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
            strain=True,
            stacklevel=3,
        )
        if self._flight.batched:
            raise InputError(
                "vehicle",
                f"and scenario have {self._flight.runs} runs, but a Simulation needs one",
                "give one run, or use continuair.simulate",
            )
        self._vehicle, self._scenario, self._model = self._flight.vehicle, scenario, model
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
        self._rows, self._inputs, self._groups = [row], [np.zeros(layout.inputs)], 0
        self._given: set[str] = set()
        self._stepping = Lock()

    def __copy__(self) -> Simulation:
        raise InputError(
            "Simulation",
            "cannot be copied",
            "start another one at time 0 from its state: "
            "Simulation(vehicle, scenario.replace(q=one.q, qd=one.qd))",
        )

    def __deepcopy__(self, _: dict[int, object]) -> Simulation:
        return self.__copy__()

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self._vehicle

    @property
    def scenario(self) -> Scenario:
        """The scenario."""
        return self._scenario

    @property
    def time(self) -> float:
        """Time of the flight [s]."""
        return (len(self._rows) - 1) * self._period

    @property
    def status(self) -> str:
        """Status of the flight: "ok", or the reason why it stopped."""
        return STATUS[self._status]

    @property
    def state(self) -> Array:
        """The state (17,), ordered as in `Layout`."""
        return self._rows[-1][: self._engine.layout.state].copy()

    @property
    def q(self) -> Array:
        """Paper coordinates (8,) [m, rad, 1/m, rad], angles on continuous branches."""
        layout, row = self._engine.layout, self._rows[-1]
        euler = euler_on_branch(row[layout.attitude], row[layout.euler])
        return np.concatenate([row[layout.position], euler, row[layout.branch]])

    @property
    def qd(self) -> Array:
        """Rates of the paper coordinates (8,); those of Euler angles are NaN at a pitch of ±π/2."""
        layout = self._engine.layout
        return paper_rates(self.q[None], self.state[None], layout=layout)[0]

    def step(
        self,
        tau: ArrayLike | None = None,
        *,
        force: ArrayLike | None = None,
        moment: ArrayLike | None = None,
        bend_moment: ArrayLike | None = None,
        tip_wrench: ArrayLike | None = None,
        rotor_command: ArrayLike | None = None,
        tendon_command: ArrayLike | None = None,
        wind: ArrayLike | None = None,
    ) -> None:
        """Advance one control period under inputs that are added to the scenario's.

        Parameters
        ----------
        tau : array_like, shape (8,), optional
            Generalised forces conjugate to q: force in world axes [N], torques conjugate to the
            Euler angles [N m], Q_κ [N m²] and Q_ψa [N m].
        force : array_like, shape (3,), optional
            Force at the UAV's centre of mass in world axes [N].
        moment : array_like, shape (3,), optional
            Moment on the UAV in body axes [N m].
        bend_moment : array_like, shape (2,), optional
            Generalised forces conjugate to the bend vectors, two per section [N m²].
        tip_wrench : array_like, shape (6,), optional
            Force and moment on the tip in world axes, six per arm [N, N m].
        rotor_command : array_like, shape (rotors,), optional
            Commanded thrusts [N]. If the scenario gives none, it replaces the hovering command.
        tendon_command : array_like, shape (tendons,), optional
            Tensions above the pretensions [N], or lengths to take in [m].
        wind : array_like, shape (3,), optional
            Velocity of the air in world axes [m/s].

        Raises
        ------
        InputError
            If an input cannot be used, or the flight has stopped.
        """
        given = {
            "tau": tau, "force": force, "moment": moment, "bend_moment": bend_moment,
            "tip_wrench": tip_wrench, "rotor_command": rotor_command,
            "tendon_command": tendon_command, "wind": wind,
        }  # fmt: skip
        if not self._stepping.acquire(blocking=False):
            raise InputError(
                "step",
                "is called while another thread steps this Simulation",
                "give each thread its own",
            )
        try:
            self._advance(given)
        finally:
            self._stepping.release()

    def _advance(self, given: dict[str, Any]) -> None:
        """Advance one control period under inputs by name."""
        inputs = self._row_of(given)
        if self._status != OK:
            raise InputError(
                "step",
                f"is not possible: the flight stopped at {self._ended:g} s ({self.status})",
                "start a new Simulation",
            )
        layout, row, grid = self._engine.layout, self._rows[-1], self._grid()
        states, first = row[None, : layout.state], self._rows[0][None, : layout.state]
        start = Start(states, branches_in(row[None], layout), frozen=first)
        self._groups |= groups_of(name for name, value in given.items() if value is not None)
        self._given |= {name for name, value in given.items() if np.any(value)}
        acting = self._drive(stage_times(grid), inputs)
        logs = self._engine.roll_out(_ONE, start, grid, acting)
        self._inputs[-1] = inputs
        self._saturation = max(self._saturation, float(logs.saturation[0]))
        self._status = int(logs.status[0])
        if self._status != OK:
            self._ended = float(grid.starts[logs.last_step[0]])
            return
        self._inputs.append(inputs)
        self._rows.append(logs.log[0, -1])

    def observe(self) -> Observation:
        """Return the current camera measurements, without noise and latency.

        Returns
        -------
        Observation
            Image, depths, and motion of camera and target.

        Raises
        ------
        InputError
            If the scenario has no target.
        """
        watched = self._watch(self._rows[-1:], np.array([self.time]))[0, 0]
        camera, target = self._vehicle.camera, self._scenario.targets[0]
        n = len(np.asarray(target.points))
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
        """Return the flight so far, one sample per control period.

        Returns
        -------
        xarray.Dataset
            As of `simulate`. Its scenario has only the names of inputs that `step` was given.
        """
        scenario, engine = self._scenario, self._engine
        times = self._marks(0).samples[:-1]
        log = np.stack(self._rows)[None]
        acting = self._drive(seen_at(times, scenario.jumps), np.stack(self._inputs)[:, None])
        names, scene, watched = default_variables(self._vehicle, scenario), None, None
        if scenario.targets:
            names += tuple(sorted(WATCHED_VARIABLES))
            target, motion = scenario.targets[0], motion_of(scenario, times)
            points = np.asarray(target.points)
            scene = Scene(points, target.desired[None], motion, motion)
            watched = watch(engine, log, points, motion)
        # A flight that stopped did so between its last sample and the next.
        starts = times[:-1] if self._status == OK else np.append(times[:-1], self._ended)
        status, last = np.array([self._status], np.int32), np.array([len(times) - 1])
        observed = engine.observe(log, acting, names)
        none = np.zeros(0, bool)
        grid = Grid(times, starts, np.diff(times), np.zeros(0, np.int32), none, none)
        flight = dataclasses.replace(self._flight, marks=Marks(times, times, times[:0]))
        recorder = Recorder(flight, self._model, names, "float64")
        logs = Logs(log, status, last, np.array([self._saturation]), observed, watched, scene)
        recorder.keep(Cohort(flight, _ONE, grid, acting, None), logs)
        warn_of_saturation(recorder.flight.vehicle, recorder.saturation, stacklevel=3)
        given = dict.fromkeys(sorted(self._given), GIVEN_TO_STEPS)
        told = json.loads(flight.provenance["scenario"]) | given
        return recorder.dataset({"step": self._step, "scenario": json.dumps(told)})

    def _grid(self) -> Grid:
        """Return the steps of the next control period, between the same jumps as in `simulate`."""
        return grid_of(self._marks(len(self._rows) - 1), self._step)

    def _marks(self, first: int) -> Marks:
        """Return the breakpoints of control periods from `first` to the next one."""
        edges = np.asarray(self._period * np.arange(first, len(self._rows) + 1), float)
        return marks_at(edges, self._scenario.jumps, knots=self._scenario.knots)

    def _row_of(self, given: dict[str, Any]) -> Array:
        """Return a row of inputs from fields of a scenario, or raise InputError."""
        layout = self._engine.layout
        row = np.zeros(layout.inputs)
        for name, value in given.items():
            if value is None:
                continue
            if not layout.of_input.keys() >= set(FIELDS[name]):
                table = {"wind": "[uav.drag]", "rotor_command": "[uav.rotors]"}.get(
                    name, "[[arm.tendon]]"
                )
                raise InputError(
                    name,
                    f"is {shown(value)}, but the vehicle has no {table}",
                    "omit it, or give the vehicle one",
                )
            layout.add(row, FIELDS[name], _numbers(name, value, field_width(name, layout)))
        # The hovering command acts until the program commands the rotors.
        return row if given["rotor_command"] is None else row - self._hover

    def _drive(self, times: Array, inputs: Array) -> Drive:
        """Return the inputs at times, with rows (inputs,) or (n, 1, inputs) added."""
        drive = self._flight.drive(times, _ONE)
        table = drive.table + inputs
        timed = len(table) > 1 and (drive.timed or inputs.ndim > 1)
        return Drive(table, timed, drive.groups | self._groups, drive.gravity)

    def _watch(self, rows: list[Array], times: Array) -> Array:
        """Return the camera's measurements (1, rows, columns); InputError without a target."""
        if not self._scenario.targets:
            raise InputError("target", "of the scenario is None", "give a continuair.Target")
        motion = motion_of(self._scenario, times)
        points = np.asarray(self._scenario.targets[0].points)
        return watch(self._engine, np.stack(rows)[None], points, motion)


def _check_open_loop(vehicle: Vehicle, scenario: Scenario) -> None:
    """Raise InputError for a scenario with a controller."""
    check_vehicle(vehicle)
    check_scenario(scenario)
    if scenario.controller is not None:
        raise InputError(
            "controller",
            (
                f"of the scenario is {scenario.controller.name}, but a Simulation is "
                "driven by step(…)"
            ),
            "remove it, or use continuair.simulate",
        )


def _numbers(name: str, value: object, size: int) -> Array:
    """Return `size` finite numbers, or raise InputError."""
    array = checks.finite_array(value)
    if array is None or array.shape != (size,):
        raise InputError(name, f"is {shown(value)}", f"give {size} finite numbers")
    return array
