"""`Fleet`: many flights that a program steps together, each restarted at any time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair import checks
from continuair.engine.engine import Drive, Start
from continuair.errors import InputError
from continuair.flight.inputs import groups_of
from continuair.flight.prepare import prepare
from continuair.flight.time_grid import grid_of
from continuair.kernels.dynamics import MODELS
from continuair.kernels.step import OK
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array, Model
from continuair.vehicle.coordinates import branches_in, branches_of, state_from_paper
from continuair.vehicle.layout import FIELDS
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

SPIN = 10.0
"""Angular velocity [rad/s] up to which the automatic step resolves a vehicle's rotation."""


_CHANGING = ("states", "status", "_angles", "_first")
"""Attributes of a Fleet that change in flight."""


class Fleet:
    """Runs of a vehicle with rotors, stepped together by a control period, in one launch.

    vehicle: one for all runs, or a batch of as many. period: control period [s]; model, device: as
    in `simulate`. states (runs, state): current states, ordered as in `Layout`; runs that have
    stopped keep theirs. status (runs,): of kernels/step.py. step_length: [s]. Until they are begun,
    all runs hover level at the origin with straight arms. A copy, by `copy.deepcopy` or pickle,
    continues as the original does. Raises InputError.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        runs: int,
        *,
        period: float,
        model: Model = "coupled",
        device: str = "cpu",
        gravity: float = 9.81,
    ) -> None:
        self._made_with = {
            "vehicle": vehicle, "runs": runs, "period": period,
            "model": model, "device": device, "gravity": gravity,
        }  # fmt: skip
        checks.choice("model", model, MODELS)
        self.runs = checks.whole("runs", runs, 1)
        period = checks.positive("period", period, " [s]")
        _check_vehicle(vehicle, runs)
        width = vehicle.layout.coordinates
        spinning = np.zeros(width)
        spinning[3] = SPIN
        hover = Scenario("hover", np.zeros(width), spinning, duration=period, gravity=gravity)
        flight = prepare(vehicle, hover, sample=period, duration=period, device=device, strain=True)
        self._engine = flight.engine(model)
        self._grid = grid_of(flight.marks, float(flight.steps.min()))
        self.step_length = float(self._grid.steps[0])
        self.layout, self.gravity = self._engine.layout, gravity
        rotors = vehicle.uav.rotors
        assert rotors is not None
        self._without_lag = per_run(rotors.lag, runs) == 0.0
        self._highest = rotors.highest
        self._speeds_of = rotors.speeds_of
        # Speeds of rotors, and what other terms add.
        own = flight.start.states[:, self.layout.bend_rate.stop :]
        self._own = np.broadcast_to(own, (runs, own.shape[1]))
        self.states = np.empty((runs, self.layout.state))
        self._angles = np.empty((runs, self.layout.branch_angles))
        self._first = np.empty_like(self.states)
        self.status = np.empty(runs, np.int32)
        self.begin(np.arange(runs), np.zeros((runs, width)), np.zeros((runs, width)))

    def __getstate__(self) -> dict[str, Any]:
        """Return the arguments and the current state of its runs; kernels cannot be copied."""
        changing = {name: getattr(self, name).copy() for name in _CHANGING}
        return {"made_with": self._made_with, "changing": changing}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["made_with"])  # type: ignore[misc]
        self.__dict__.update(state["changing"])

    def begin(self, which: NDArray[np.intp], q: Array, qd: Array) -> None:
        """Restart some runs, by their indices (n,), at paper coordinates and rates (n, …).

        Their rotors have the speeds of hovering.
        """
        self.states[which] = np.hstack([state_from_paper(q, qd, self.layout), self._own[which]])
        self._angles[which] = branches_of(q, self.layout)
        self._first[which] = self.states[which]
        self.status[which] = OK

    def step(self, **given: Array) -> None:
        """Advance all runs by a control period under held inputs (runs, …), named as those of a
        Scenario.

        Runs that have stopped do not change.
        """
        layout = self.layout
        table = np.zeros((1, self.runs, layout.inputs))
        for name, values in given.items():
            layout.add(table, FIELDS[name], values)
        acting = Drive(table, False, groups_of(given), self.gravity)
        start = Start(self.states, self._angles, frozen=self._first)
        logs = self._engine.roll_out(np.arange(self.runs), start, self._grid, acting)
        last, on = logs.log[:, -1], self.status == OK
        self.status = np.where(on, logs.status, self.status)
        going = self.status == OK
        self.states[going] = last[going, : layout.state]
        commands = table[0, :, layout.of_input["rotor_command"]]
        self._set_speeds(commands, going & self._without_lag)
        self._angles[going] = branches_in(last[going], layout)

    def _set_speeds(self, commands: Array, which: NDArray[np.bool_]) -> None:
        """Set the speeds of rotors without lag, which are not integrated, to the commanded ones."""
        given = self._speeds_of(np.clip(commands, 0.0, self._highest))
        self.states[which, self.layout.rotor_speed] = given[which]

    def tips(self) -> Array:
        """Return the positions of the tips in world axes (runs, arms, 3) [m]."""
        layout = self.layout
        rows = np.zeros((self.runs, 1, layout.log))
        rows[:, 0, : layout.state] = self.states
        nothing = Drive(np.zeros((1, 1, layout.inputs)), False, 0, self.gravity)
        seen = self._engine.observe(
            rows, nothing, ["tip_position"], np.arange(self.runs), among=np.inf
        )[:, 0]
        return seen[:, self._engine.observed["tip_position"]].reshape(self.runs, -1, 3)


def _check_vehicle(vehicle: object, runs: int) -> None:
    """Raise InputError for a vehicle without rotors, or with another number of runs."""
    if isinstance(vehicle, Vehicle) and vehicle.runs not in (None, runs):
        raise InputError(
            "vehicle",
            f"has {vehicle.runs} runs, but there are {runs}",
            "give equally many, or one for all",
        )
    if isinstance(vehicle, Vehicle) and vehicle.uav.rotors is None:
        raise InputError(
            "vehicle",
            "has no rotors",
            (
                "give it a table [uav.rotors], as in vehicle.replace({'uav.rotors': "
                "{'layout': 'quad_x', …}})"
            ),
        )
