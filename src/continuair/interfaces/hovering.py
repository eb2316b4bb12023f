"""Task of the learning environments: hold a point from a disturbed start."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.errors import InputError, shown
from continuair.flight.fleet import Fleet
from continuair.kernels.step import OK
from continuair.typing import Model
from continuair.vehicle.bending import constant_bends
from continuair.vehicle.coordinates import polar_of_bends
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle, load_vehicle

Array = np.ndarray

ROTORS = {"layout": "quad_x", "lever": 0.2, "thrust_limits": (0.0, 10.0),
          "torque_per_thrust": 0.016, "lag": 0.04}  # fmt: skip
"""Rotors of the default vehicle, the preset two_section."""

DISTURBANCE = {"position": 0.5, "turn": 0.2, "bend": 0.3, "velocity": 0.3, "spin": 0.3}
"""Largest disturbances of a start, along each axis: of position [m], Euler angles [rad], the turn
of each section, evenly bent [rad], velocity [m/s] and Euler rates [rad/s]."""

BOUND = 2.0
"""Distance from the goal at which an episode ends [m]."""

POINTS = ("tip", "uav")


class Outcome(NamedTuple):
    """Result of a step of all runs: observations (runs, …), rewards and ends (runs,)."""

    observation: Array
    reward: Array
    terminated: Array


class Hovering:
    """Runs of a vehicle whose task is to hold its first tip, or its UAV, at the origin.

    Actions (runs, rotors): thrusts, from the least at -1 to the largest at 1. With a bend_moment
    above 0, (runs, rotors + bends): the bend moments too, over that [N m²]; with a tendon_command
    above 0, the commands of all tendons last, over that [N, m]. Observations: the
    vector to the goal (3) [m], the rotation matrix (9) by rows, velocity (3) [m/s] in world axes,
    angular velocity (3) [rad/s] in body axes, the coordinates of all sections and their rates (bend
    vectors [1/m] of arcs, `strain` of others, in the order of results), and the rotors' speeds over
    their largest. Rewards: 1 at the goal, reduced by 1 / BOUND per metre from
    it, and 0 beyond, where an episode ends. An episode also ends with the flight. Raises
    InputError.
    """

    def __init__(
        self,
        runs: int,
        vehicle: Any = None,
        *,
        hold: str = "tip",
        bend_moment: float = 0.0,
        tendon_command: float = 0.0,
        disturbance: float = 1.0,
        period: float = 0.02,
        model: Model = "coupled",
        device: str = "cpu",
    ) -> None:
        checks.choice("hold", hold, POINTS)
        self._moment = checks.number("bend_moment", bend_moment, least=0.0, otherwise=" [N m²]")
        self._pull = checks.number("tendon_command", tendon_command, least=0.0, otherwise=" [N, m]")
        self._size = checks.number("disturbance", disturbance, least=0.0)
        found = default_vehicle() if vehicle is None else vehicle
        found = found if isinstance(found, Vehicle) else load_vehicle(found)
        if not found.arms:
            asked = {"hold": hold if hold == "tip" else None, "bend_moment": self._moment or None}
            for name, value in asked.items():
                if value is not None:
                    raise InputError(
                        name,
                        f"is {shown(value)}, but vehicle {shown(found.name)} has no arm",
                        "give hold='uav' and no bend_moment",
                    )
        if self._pull and not found.tendons:
            raise InputError(
                "tendon_command",
                f"is {self._pull:g}, but vehicle {shown(found.name)} has no tendons",
                "leave it out, or give the arm [[arm.tendon]]",
            )
        self.fleet = Fleet(found, runs, period=period, model=model, device=device)
        assert found.uav.rotors is not None
        self._limits = found.uav.rotors.limits
        self._holds_tip = hold == "tip"
        sections = [each for arm in found.arms for each in arm.section]
        lengths = [per_run(each.length, runs) for each in sections]
        self._lengths = np.array(lengths).reshape(len(sections), runs).T
        self._bent_alike = constant_bends(found)
        self._home = -self._held()

    @property
    def actions(self) -> int:
        """Numbers of an action."""
        layout = self.fleet.layout
        tendons = layout.tendons if self._pull else 0
        return layout.rotors + (layout.bends if self._moment else 0) + tendons

    @property
    def observations(self) -> int:
        """Numbers of an observation."""
        return self.observed().shape[1]

    def begin(self, which: Sequence[int], generators: Sequence[np.random.Generator]) -> None:
        """Restart some runs, each at a start that its generator draws."""
        if not len(which):
            return
        runs = np.asarray(which)
        starts = [self._start(run, random) for run, random in zip(runs, generators, strict=True)]
        q, qd = (np.stack(each) for each in zip(*starts, strict=True))
        self.fleet.begin(runs, q, qd)

    def step(self, actions: Array) -> Outcome:
        """Advance all runs by a control period; actions (runs, actions) are clipped to ±1."""
        rotors = self.fleet.layout.rotors
        share = np.clip(np.asarray(actions, float), -1.0, 1.0)
        least, greatest = self._limits[..., 0], self._limits[..., 1]
        thrusts = least + 0.5 * (1.0 + share[:, :rotors]) * (greatest - least)
        bends = self.fleet.layout.bends if self._moment else 0
        moments, pulls = np.split(share[:, rotors:], [bends], axis=1)
        given = {"bend_moment": self._moment * moments} if self._moment else {}
        given |= {"tendon_command": self._pull * pulls} if self._pull else {}
        self.fleet.step(rotor_command=thrusts, **given)
        observation = self.observed()
        far = np.linalg.norm(observation[:, :3], axis=1)
        ended = (self.fleet.status != OK) | (far > BOUND)
        return Outcome(observation, np.where(ended, 0.0, 1.0 - far / BOUND), ended)

    def observed(self) -> Array:
        """Return observations (runs, observations) of the runs' states."""
        layout, states = self.fleet.layout, self.fleet.states
        turn = Rotation.from_quat(states[:, layout.attitude]).as_matrix().reshape(len(states), 9)
        rest = (layout.velocity, layout.angular_velocity, layout.bend, layout.bend_rate)
        parts = [states[:, each] for each in (*rest, layout.rotor_speed)]
        return np.hstack([-self._held(), turn, *parts])

    def _held(self) -> Array:
        """Return the positions of the points to hold (runs, 3), world axes."""
        if self._holds_tip:
            return self.fleet.tips()[:, 0]
        return self.fleet.states[:, self.fleet.layout.position]

    def _start(self, run: int, random: np.random.Generator) -> tuple[Array, Array]:
        """Return paper coordinates and rates (coordinates,) of a disturbed hover at the goal."""

        def drawn(name: str, *shape: int) -> Array:
            most = self._size * DISTURBANCE[name]
            return random.uniform(-most, most, shape)

        turns = drawn("bend", len(self._lengths[run]), 2) / self._lengths[run][:, None]
        bends = np.zeros(self.fleet.layout.bends)
        bends[self._bent_alike] = turns
        polar = polar_of_bends(bends, self.fleet.layout)
        place = self._home[run] + drawn("position", 3)
        q = np.concatenate([place, drawn("turn", 3), polar])
        qd = np.concatenate([drawn("velocity", 3), drawn("spin", 3), np.zeros(polar.size)])
        return q, qd


def default_vehicle() -> Vehicle:
    """Return a quadrotor with the arm of the preset two_section."""
    return load_vehicle("two_section").replace({"uav.rotors": ROTORS})
