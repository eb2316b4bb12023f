"""Tendons put no more power into an arm than their motors give, at states drawn at random.

All powers are taken from compiled batches: that into the arm from the kinetic energy that the
accelerations of tendons change, rates of lengths and energies from differences along the motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start
from continuair.flight.time_grid import grid_of, marks_of
from continuair.vehicle.layout import TENDONS
from tests.sections.strains import rod
from tests.tendons.pulled import DISKS, pulled

Array = np.ndarray

COUNT = 100_000
STEPS = (1e-3, 2e-5)
"""Steps of differences along a motion [s]: of the energy of springs, quadratic in the lengths but
for kinks, and of guides, one-sided, as what has slid moves one way."""

_FORWARD = np.array([-11.0, 18.0, -9.0, 2.0]) / 6.0
_CENTRAL = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0


@dataclass(frozen=True, eq=False)
class Rows:
    """States of one vehicle (n, state) with constant commands, and their rates."""

    engine: Engine
    states: Array
    drive: Drive
    rates: Array

    def seen(self, states: Array, *names: str) -> list[Array]:
        """Return observed variables (n, columns) of states."""
        return seen(self.engine, states, self.drive, *names)


def seen(engine: Engine, states: Array, drive: Drive, *names: str) -> list[Array]:
    rows = np.zeros((len(states), 1, engine.layout.log))
    rows[:, 0, : engine.layout.state] = states
    found = engine.observe(rows, drive, names)[:, 0]
    return [found[:, engine.observed[name]] for name in names]


def start_of(engine: Engine, states: Array) -> Start:
    return Start(states, np.zeros((len(states), engine.layout.branch_angles)))


def random_rows(vehicle: ca.Vehicle, bend: float, taken: float) -> Rows:
    """Return COUNT states as steps end in them: guides beyond friction have slid.

    bend, taken: scale of the coordinates [1/m], and of motors [N, m].
    """
    count = COUNT
    engine, draw = Engine(vehicle, "coupled"), np.random.default_rng(3)
    layout = engine.layout
    states = np.zeros((count, layout.state))
    states[:, layout.attitude.stop - 1] = 1.0
    states[:, layout.bend] = bend * draw.normal(size=(count, layout.bends))
    for name, size in (("velocity", 0.3), ("angular_velocity", 0.3), ("bend_rate", 10.0)):
        states[:, getattr(layout, name)] = (
            size
            * draw.normal(size=(count, 1))
            * draw.normal(size=states[:, getattr(layout, name)].shape)
        )
    motors, slips = (layout.of_state.get(f"tendon_{name}", slice(0)) for name in ("motor", "slip"))
    for where, size in ((motors, taken), (slips, 1e-3)):
        states[:, where] = size * draw.normal(size=states[:, where].shape)
    table = np.zeros((1, count, layout.inputs))
    commands = layout.of_input["tendon_command"]
    table[0, :, commands] = taken * draw.normal(size=table[0, :, commands].shape)
    drive = Drive(table, False, TENDONS, 0.0)
    # A step so short that it only lets guides slide.
    grid = grid_of(marks_of(1e-12, 1e-12), 1e-12)
    flown = engine.roll_out(np.arange(count), start_of(engine, states), grid, drive)
    assert not flown.status.any()
    states = np.ascontiguousarray(flown.log[:, -1, : layout.state])
    rates = engine.derivative(start_of(engine, states), drive, compiled=True)
    return Rows(engine, states, drive, rates)


def power_into_arm(rows: Rows) -> Array:
    """Return zᵀ M Δż (n,) [W], with what tendons add to accelerations, Δż.

    By the kinetic energy, which is quadratic in the velocities z.
    """
    vehicle = rows.engine.vehicle.replace({"arm.0.tendon": ()})
    bare = Engine(vehicle, "coupled")
    moving = slice(bare.layout.velocity.start, bare.layout.bend_rate.stop)
    states = np.ascontiguousarray(rows.states[:, : bare.layout.state])
    still = Drive(np.zeros((1, 1, bare.layout.inputs)), False, 0, 0.0)
    rates = bare.derivative(start_of(bare, states), still, compiled=True)
    added = (rows.rates[:, : bare.layout.state] - rates)[:, moving]
    # Where all tendons are slack they add nothing.
    size = np.maximum(np.linalg.norm(added, axis=1), 1e-9)
    scale = np.linalg.norm(states[:, moving], axis=1) / size
    energies = []
    for sign in (1.0, -1.0):
        moved = states.copy()
        moved[:, moving] += sign * scale[:, None] * added
        energies.append(seen(bare, moved, still, "kinetic_energy")[0][:, 0])
    return np.asarray((energies[0] - energies[1]) / (2.0 * scale))


def rate_of_length(rows: Rows, step: float = 3e-3) -> Array:
    """Return the rates of the tendons' lengths (n, tendons) [m/s]."""
    layout, found = rows.engine.layout, 0.0
    for place, weight in zip(range(-3, 4), _CENTRAL, strict=True):
        moved = rows.states.copy()
        moved[:, layout.bend] += place * step * moved[:, layout.bend_rate]
        found = found + weight / step * rows.seen(moved, "tendon_length")[0]
    return np.asarray(found)


def rate_of_energy(rows: Rows, springs: float, guides: float) -> Array:
    """Return the rate of the energy of springs and guides just after a state (n,) [W]."""
    slips = rows.engine.layout.of_state.get("tendon_slip", slice(0))

    def energy(ahead: float, slid: bool) -> Array:
        moved = rows.states + ahead * rows.rates
        moved[:, slips] *= slid
        return np.asarray(rows.seen(moved, "tendon_energy")[0])

    found = (energy(springs, False) - energy(-springs, False)) / (2.0 * springs)
    for place, weight in enumerate(_FORWARD):
        ahead = place * guides
        found = found + weight / guides * (energy(ahead, True) - energy(ahead, False))
    return np.asarray(found.sum(axis=1))


def motor_power(rows: Rows, tension: Array, speed: Array) -> Array:
    """Return what motors give (n,) [W]: winches by their taking in, others by the whole length."""
    by_length = [group.command == "length" for arm in rows.engine.vehicle.arms
                 for group in arm.tendon for _ in range(group.count)]  # fmt: skip
    taking = rows.rates[:, rows.engine.layout.of_state.get("tendon_motor", slice(0))]
    wound = taking if taking.size else np.zeros_like(speed)
    return np.asarray((tension * np.where(by_length, wound, -speed)).sum(axis=1))


RUBBING: dict[str, Any] = {"friction": 0.3, "pretension": 3.0, "friction_stiffness": 2e3}
WINCH: dict[str, Any] = {
    "command": "length", "stiffness": 2e3, "lag": 0.05, "rate": 0.5, "limits": [0.0, 8.0],
    "pretension": 3.0,
}  # fmt: skip
LONG = pytest.mark.long
CASES = [
    pytest.param([RUBBING], {}, 1.0, 10.0, id="friction and slack"),
    pytest.param([WINCH | RUBBING | {"damping": 2.0}], {}, 0.3, 1.5e-3, id="winches that rub"),
    pytest.param([WINCH | {"damping": 2.0}], {}, 0.3, 1.5e-3, marks=LONG, id="damped winches"),
    pytest.param([WINCH], {}, 0.3, 1.5e-3, marks=LONG, id="winches that lose nothing"),
    pytest.param([RUBBING | {"offset": [0.02, 0.01], "lag": 0.1}],
                 {"sections": [rod(bending=1, nodes=6), rod()]}, 1.0, 10.0, marks=LONG,
                 id="converging along a strain and an arc"),
    pytest.param([RUBBING | {"guides": "disks"}], {"disks": DISKS}, 1.0, 10.0, marks=LONG,
                 id="from disk to disk"),
]  # fmt: skip


@pytest.mark.parametrize(("groups", "arm", "bend", "taken"), CASES)
def test_tendons_give_an_arm_no_more_power_than_their_motors_give(
    groups: Any, arm: Any, bend: float, taken: float
) -> None:
    """Power into the arm, and what springs and guides store, exceed the motors' nowhere by more
    than 1e-12 of the largest power."""
    rows = random_rows(pulled(*groups, **arm), bend, taken)
    tension, rubbed = rows.seen(rows.states, "tendon_tension", "tendon_friction_power")
    given, speed = power_into_arm(rows), rate_of_length(rows)
    largest = np.abs(given).max()
    # What comes along the tendon at its motor goes into guides and arm.
    along = (tension * speed).sum(axis=1)
    assert np.abs(given + rubbed.sum(axis=1) + along).max() < 1e-12 * largest

    motors = motor_power(rows, tension, speed)
    stored, finer = (rate_of_energy(rows, *np.multiply(part, STEPS)) for part in (1.0, 0.5))
    smooth = np.abs(stored - finer) < 2e-12 * largest
    gained = given + stored - motors
    assert smooth.mean() > 0.75
    assert gained[smooth].max() < 1e-12 * largest
    # A tendon that begins to slide, or to be slack, within that time: by far shorter steps.
    assert (given + rate_of_energy(rows, 1e-8, 1e-9) - motors).max() < 1e-6 * largest

    if any(group.get("friction") or group.get("damping") for group in groups):
        assert (gained[smooth] < -1e-3 * largest).mean() > 0.2
    else:
        assert np.abs(gained[smooth]).max() < 1e-12 * largest
    assert 0.05 < (tension == 0.0).mean() < 0.6
