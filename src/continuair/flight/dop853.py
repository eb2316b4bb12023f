"""The reference integrator: SciPy's DOP853 driving the kernels' derivative, one run at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import DOP853

from continuair.engine.engine import Engine, Logs, Start
from continuair.flight.cohorts import Cohort, Flight
from continuair.flight.time_grid import beside, stage_times
from continuair.kernels.rollout import SUMS
from continuair.kernels.step import NOT_FINITE, OK, OVERBENT
from continuair.vehicle.arc import bend_vectors
from continuair.vehicle.layout import FIELDS, Layout

Array = np.ndarray

# With a relative tolerance alone, components that pass through zero would stall the step.
_ABSOLUTE = 1e-2

# Automatic steps that one of its steps takes at most where inputs act over time: at rest its steps
# would grow past a gust before they have seen it.
_LONGEST = 8.0

# Parts of an automatic step in which inputs are looked at beforehand, the share of its largest
# value by which one may be off a line there, the share that is none, and steps looked at together.
_PARTS, _OFF, _NOTHING, _AT_ONCE = 8, 0.05, 1e-10, 4000

# Points per step at which the signed branch of the bend is followed: its steps are long.
_FOLLOWED = 16


def integrate_reference(flight: Flight, engine: Engine, cohort: Cohort, tolerance: float) -> Logs:
    """Integrate one run piece by piece between input jumps; inputs are called at its own stages."""
    grid, layout, start = cohort.grid, engine.layout, flight.start
    log = np.full((1, len(grid.samples), layout.log), np.nan)
    branch = [start.angle[0]]
    y = start.states[0].copy()
    log[0, 0] = _row(y, branch[0], layout)
    overbent: list[float] = []
    looked: list[tuple[float, np.ndarray]] = []
    status, reached = OK, grid.samples[-1]
    for left, right, longest in _pieces(flight, cohort):
        inside = beside(left, right - left, np.inf), beside(right, right - left, -np.inf)

        def rate(t: float, state: Array, inside: Any = inside, branch: Any = branch) -> np.ndarray:
            # The polar torques act along the branch followed so far.
            acting = flight.drive(np.clip([t], *inside), cohort.runs)
            angle = _follow(state, branch[0], layout)[None]
            at = Start(state[None], angle, start.states)
            found: Array = engine.derivative(at, acting)[0]
            if np.isnan(found).any() and np.isfinite(state).all():
                overbent.append(t)
            return found

        if not np.isfinite(rate(left, y)).all():
            status, reached = OVERBENT, left
            break
        solver = DOP853(
            rate, left, y, right, max_step=longest, rtol=tolerance, atol=_ABSOLUTE * tolerance
        )
        while solver.status == "running":
            with np.errstate(invalid="ignore"):
                # Of an input that has just begun, squares of what a step errs by may vanish.
                solver.step()
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                status = OVERBENT if overbent else NOT_FINITE
                reached = solver.t if solver.status == "failed" else solver.t_old
                break
            dense = solver.dense_output()
            covered = grid.samples[(grid.samples > solver.t_old) & (grid.samples <= solver.t)]
            between = np.linspace(solver.t_old, solver.t, _FOLLOWED + 1)[1:]
            for t in np.union1d(covered, between):
                state = _unit(dense(t), layout)
                branch[0] = _follow(state, branch[0], layout)
                row = _row(state, branch[0], layout)
                log[0, np.flatnonzero(grid.samples == t)] = row
                looked.append((t, row))
        y = _unit(solver.y, layout)
        if status != OK:
            break
    # The step in which it ended, as of the other integrators; without an end the one after all.
    last = np.searchsorted(grid.starts, reached, side="right") - (status != OK)
    observed = engine.observe(log, cohort.at_samples)
    # It keeps its own account of its errors, in the tolerance.
    untold = np.full((1, SUMS), np.nan)
    untold[0, -1] = _largest_saturation(flight, engine, cohort, looked)
    return Logs(log, np.array([status], np.int32), np.array([last], np.int32), untold, observed)


def _pieces(flight: Flight, cohort: Cohort) -> list[tuple[float, float, float]]:
    """Start, end and longest step [s] of what is integrated at a time: between jumps, and where
    inputs begin or cease to move within automatic steps, as in a tap."""
    grid, step, end = cohort.grid, float(flight.steps[0]), float(cohort.grid.samples[-1])
    starts, rough = grid.opens.copy(), np.zeros(len(grid.starts), bool)
    longest = np.full(len(rough), np.inf)
    if any(callable(getattr(flight.scenario, name)) for name in FIELDS):
        rough = _rough(flight, cohort)
        longest = np.where(rough, step / _PARTS, _LONGEST * step)
    starts[1:] |= rough[1:] != rough[:-1]
    lefts = grid.starts[starts]
    return list(zip(lefts, np.append(lefts[1:], end), longest[starts], strict=True))


def _rough(flight: Flight, cohort: Cohort) -> np.ndarray:
    """In which steps (m,) of the grid inputs are off the line from its start to its end."""
    begins, _, ends = stage_times(cohort.grid).reshape(-1, 3).T
    shares = np.linspace(0.0, 1.0, _PARTS + 1)
    off, largest = [], []
    for first in range(0, len(begins), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        times = begins[some, None] + np.outer(ends[some] - begins[some], shares)
        found = flight.drive(times.ravel(), cohort.runs).table.reshape(*times.shape, -1)
        line = found[:, :1] + shares[:, None] * (found[:, -1:] - found[:, :1])
        off.append(np.abs(found - line).max(axis=1))
        largest.append(np.abs(found).max(axis=(0, 1)))
    whole = np.max(largest, axis=0)
    counted = whole > _NOTHING * whole.max()
    return np.asarray((np.vstack(off) > _OFF * whole)[:, counted].any(axis=1))


def _largest_saturation(
    flight: Flight, engine: Engine, cohort: Cohort, looked: list[tuple[float, np.ndarray]]
) -> float:
    """That at the points of the steps that were looked at; without rotors none."""
    at = engine.observed.get("saturation")
    if at is None or not looked:
        return 0.0
    times, rows = (np.array(each) for each in zip(*looked, strict=True))
    seen = engine.observe(rows[None], flight.drive(times, cohort.runs))
    return float(np.nanmax(seen[..., at]))


def _unit(state: np.ndarray, layout: Layout) -> np.ndarray:
    state = state.copy()
    state[layout.attitude] /= np.linalg.norm(state[layout.attitude])
    return state


def _follow(state: np.ndarray, branch: np.ndarray, layout: Layout) -> np.ndarray:
    """ψa of each bend, and the roll, on the branches nearest to the ones followed so far."""
    x, y = np.vstack([bend_vectors(state[layout.bend]), _tilt(state[layout.attitude])]).T
    angle = np.arctan2(y, x)
    nearest = angle + np.pi * np.round((branch - angle) / np.pi)
    return np.where((x == 0.0) & (y == 0.0), branch, nearest)


def _row(state: np.ndarray, branch: np.ndarray, layout: Layout) -> np.ndarray:
    psi = branch[:-1]
    along = np.stack([np.cos(psi), np.sin(psi)], axis=-1)
    kappa = (bend_vectors(state[layout.bend]) * along).sum(-1)
    polar = np.stack([kappa, psi], axis=-1).ravel()
    return np.concatenate([state, polar, branch[-1:], np.zeros(layout.push.stop)])


def _tilt(attitude: np.ndarray) -> np.ndarray:
    """cos θ (cos φ, sin φ) of an attitude."""
    x, y, z, w = attitude
    return np.array([1.0 - 2.0 * (x * x + y * y), 2.0 * (y * z + x * w)])
