"""Rates that what acts on a vehicle gives it, which bound the automatic step: the decay by drag in
a flow, and the frequency that pulls at its tips make."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.checks import UnsteadyInput
from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError
from continuair.flight.inputs import evaluated, field_width, told_rate
from continuair.scenario.scenarios import Scenario
from continuair.terms import terms_of
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import AIR, GENERAL, TIP, Layout
from continuair.vehicle.runs import per_run

Array = np.ndarray

_NUDGE = 1e-3
"""Of the flow's speed, or of an arm's length, by which parts are moved to see what acts on that."""

_TIMES, _MOST_TIMES, _PER_SWING = 512, 20_000, 16
"""How often an input over time is looked at: in all, and in a period of the rate that it tells."""

_AT_ONCE = 1024
"""Runs that are looked at at once: bounds the memory of large batches."""


def strongest(name: str, scenario: Scenario, layout: Layout, duration: float) -> Array:
    """The largest norm (runs or 1, n) of each three components of an input over a time [s], as far
    as looks see it; one 0 where it is not given."""
    value = getattr(scenario, name)
    if value is None:
        return np.zeros((1, 1))
    width = field_width(name, layout)
    if callable(value):
        told = told_rate(value)
        swings = 0.0 if told is None else duration * float(np.max(told)) / (2.0 * np.pi)
        count = min(_TIMES + _PER_SWING * swings, _MOST_TIMES)
        jumps = [each for each in scenario.jumps if each < duration]
        times = np.union1d(np.linspace(0.0, duration, int(count)), jumps)
        try:
            found = evaluated(name, value, times, width)
        except UnsteadyInput:
            raise
        except InputError:
            # The flight asks in order, and tells where it fails first, if it does there.
            found = np.zeros((1, 1, width))
    else:
        found = np.atleast_2d(np.asarray(value, float))[None]
    norms = np.linalg.norm(found.reshape(*found.shape[:2], -1, 3), axis=-1)
    return np.asarray(norms.max(axis=0))


def strongest_wind(scenario: Scenario, layout: Layout, duration: float) -> Array:
    """The largest speed (runs or 1,) [m/s] of the wind over a time [s]."""
    return strongest("wind", scenario, layout, duration)[:, 0]


def strongest_pull(scenario: Scenario, layout: Layout, duration: float) -> Array:
    """The largest forces (runs or 1, arms) [N] on the tips over a time [s]; one 0 without any."""
    return strongest("tip_wrench", scenario, layout, duration)[:, ::2]


def drag_rate(engine: Engine, q: Array, flow: Array) -> Array:
    """The fastest decay (runs,) [1/s] by drag in a flow past the vehicle at a speed (runs,) [m/s],
    along any axis of the world, arms straight at the attitude of q (runs or 1, coordinates).

    The largest eigenvalue of M⁻¹ D, D what drag does to velocities of body and bends.
    """
    found = linear_drag_rate(engine) + np.zeros(len(flow))
    if not engine.tree.air:
        return found
    for some in _parts(flow > 0.0):
        found[some] = np.fmax(found[some], _decays(engine, q, flow[some], some))
    return found


def linear_drag_rate(engine: Engine) -> Array:
    """The fastest decay (runs or 1) [1/s] by drag that is linear."""
    decays = [term.decay(engine.vehicle, len(engine.plants)) for term in terms_of(engine.vehicle)]
    return np.max(np.vstack(decays), axis=0)


def term_rate(engine: Engine, states: Array, angles: Array) -> Array:
    """The fastest rate (runs or 1,) [1/s] of a vehicle with terms of its own: the largest
    |eigenvalue| of the Jacobian at states (runs or 1, state); 0 without such terms.

    angles: what names the branches of their bends.
    """
    if not engine.vehicle.terms:
        return np.zeros(1)
    layout, runs = engine.layout, np.arange(max(len(states), len(engine.plants)))
    states, angles = (np.broadcast_to(x, (len(runs), x.shape[1])) for x in (states, angles))
    rates = slice(layout.velocity.start, layout.bend_rate.stop)
    columns = np.r_[0 : layout.bend.stop, rates]
    reach, bends = _of_runs(engine, engine.vehicle.reach, runs)[:, None], _bends(engine, runs)
    ones = np.ones((len(runs), 1))
    sizes = [reach, reach, reach, *[ones] * 4, bends, reach, reach, reach, ones, ones, ones, bends]
    nudges = _NUDGE * np.hstack(sizes)
    moved = np.repeat(states[None], len(columns), axis=0)
    for k, column in enumerate(columns):
        moved[k, :, column] += nudges[:, k]
    still = {"force": np.zeros((1, len(runs), 3))}
    slopes = _slopes(engine, states, moved, angles, runs, still)[..., columns]
    return _largest(slopes / nudges.T[:, :, None])


def pull_rate(engine: Engine, q: Array, pull: Array) -> Array:
    """The largest frequency (runs,) [rad/s] of attitude and bends under forces on the tips
    (runs, arms) [N], all along any axis of the world, arms straight at the attitude of q; 0 where
    nothing pulls."""
    found = np.zeros(len(pull))
    for some in _parts(np.any(pull > 0.0, axis=1)):
        found[some] = _frequencies(engine, q, pull[some], some)
    return found


def _parts(which: Any) -> list[Array]:
    """Indices of runs, some at once."""
    runs = np.flatnonzero(which)
    return np.array_split(runs, -(-len(runs) // _AT_ONCE)) if len(runs) else []


def _decays(engine: Engine, q: Array, flow: Array, runs: Array) -> Array:
    """`drag_rate` of some runs, by their indices, whose flow is not still."""
    layout = engine.layout
    states, angles = _straight(q, runs)
    columns = np.r_[layout.velocity, layout.angular_velocity, layout.bend_rate]
    nudges = _NUDGE * flow[:, None] / _levers(engine, runs)
    moved = np.repeat(states[None], len(columns), axis=0)
    for k, column in enumerate(columns):
        moved[k, :, column] += nudges[:, k]
    winds = np.vstack([np.zeros(3), np.eye(3)])[:, None] * flow[:, None]
    slopes = _slopes(engine, states, moved, angles, runs, {"wind": winds})[..., columns]
    # What structural damping does is there without a flow, too.
    return _largest((slopes[1:] - slopes[0]) / nudges.T[:, :, None])


def _frequencies(engine: Engine, q: Array, pull: Array, runs: Array) -> Array:
    """`pull_rate` of some runs, by their indices, on whose tips something pulls."""
    layout = engine.layout
    states, angles = _straight(q, runs)
    rows = np.r_[layout.angular_velocity, layout.bend_rate]
    # Turns of the body, and tips moved by as much of the reach.
    nudges = np.r_["1", np.full((len(runs), 3), _NUDGE), _NUDGE * _bends(engine, runs)]
    moved = np.repeat(states[None], len(rows), axis=0)
    turns = Rotation.from_quat(states[:, layout.attitude])
    for k in range(3):
        turned = turns * Rotation.from_rotvec(nudges[:, k, None] * np.eye(3)[k])
        moved[k, :, layout.attitude] = turned.as_quat()
    for k, column in enumerate(np.r_[layout.bend]):
        moved[3 + k, :, column] += nudges[:, 3 + k]
    forces = np.zeros((6, *pull.shape, 6))
    for axis in range(3):
        forces[axis, ..., axis], forces[3 + axis, ..., axis] = pull, -pull
    acting = {"tip_wrench": forces.reshape(6, len(runs), -1)}
    slopes = _slopes(engine, states, moved, angles, runs, acting)[..., rows]
    return np.sqrt(_largest(slopes / nudges.T[:, :, None]))


def _straight(q: Array, runs: Array) -> tuple[Array, Array]:
    """States (runs, state), and what names their branches, of straight arms at rest at q."""
    straight = np.array(q[runs] if len(q) > 1 else np.repeat(q, len(runs), axis=0))
    straight[:, 6:] = 0.0
    return state_from_paper(straight, np.zeros(straight.shape)), branches_of(straight)


def _levers(engine: Engine, runs: Array) -> Array:
    """Speeds of what is moved per rate of each velocity (runs, 6 + bends): 1, the reach [m], and
    half the square of a section's length [m²]."""
    reach = _of_runs(engine, engine.vehicle.reach, runs)
    ones = np.ones((len(runs), 3))
    return np.hstack([ones, ones * reach[:, None], 0.5 / _bends(engine, runs) ** 2])


def _bends(engine: Engine, runs: Array) -> Array:
    """Bends (runs, bends) [1/m] by which each section turns by a radian."""
    sections = [section for arm in engine.vehicle.arms for section in arm.section]
    lengths = [_of_runs(engine, section.length, runs) for section in sections]
    return 1.0 / np.repeat(np.stack(lengths, axis=-1), 2, axis=1)


def _of_runs(engine: Engine, value: object, runs: Array) -> Array:
    whole = per_run(value, len(engine.plants))
    return np.broadcast_to(whole[runs] if len(whole) > 1 else whole, runs.shape)


def _slopes(
    engine: Engine, states: Array, moved: Array, angles: Array, runs: Array, acting: dict[str, Any]
) -> Array:
    """By what rates (cases, moved, runs, state) of moved states (moved, runs, state) differ from
    those of states (runs, state), under inputs (cases, runs, columns) by their names."""
    layout, cases = engine.layout, len(next(iter(acting.values())))
    whole = np.concatenate([states[None], moved])
    shape = (cases, *whole.shape[:2])
    inputs = np.zeros((*shape, layout.inputs))
    for name, values in acting.items():
        inputs[..., layout.of_input[name]] = values[:, None]
    many = int(np.prod(shape))
    start = Start(
        *(np.broadcast_to(x, (*shape, x.shape[-1])).reshape(many, -1) for x in (whole, angles))
    )
    drive = Drive(inputs.reshape(1, many, -1), False, GENERAL | AIR | TIP, 0.0)
    rates = engine.derivative(start, drive, np.resize(runs, many)).reshape(*shape, -1)
    return np.asarray(rates[:, 1:] - rates[:, :1])


def _largest(slopes: Array) -> Array:
    """The largest |eigenvalue| (runs,) of slopes (cases, moved, runs, of what is moved); 0 where
    one is not known."""
    matrices = slopes.transpose(0, 2, 3, 1)
    known = np.isfinite(matrices).all((-1, -2))
    found = np.abs(np.linalg.eigvals(np.where(known[..., None, None], matrices, 0.0)))
    return np.asarray(found.max(axis=-1).max(axis=0))
