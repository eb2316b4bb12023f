"""Time grid and inputs of a roll-out: steps that end at every sample and every input jump."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.errors import InputError
from continuair.kernels.forces.inputs import GENERAL, PAPER, TIP
from continuair.vehicle.layout import Layout

MOST_STEPS = 1e7
"""Steps of one run: their inputs are sampled beforehand, and would fill the memory."""

_ROUNDING = 1e-6
"""Share of a sample that is left over by rounding alone."""

_COLUMNS = ("force", "moment", "bend_moment", "tip_wrench")
"""Inputs that are a slice of the table, by the name of that slice in `Layout`."""


@dataclass(frozen=True)
class Grid:
    """samples (n,) [s]; starts and steps (m,) [s]; sample_after (m,): sample a step ends at, or -1;
    opens, closes (m,): whether a step starts or ends at an input jump."""

    samples: np.ndarray
    starts: np.ndarray
    steps: np.ndarray
    sample_after: np.ndarray
    opens: np.ndarray
    closes: np.ndarray


def make_grid(
    duration: float,
    step: float,
    sample: float,
    jumps: Iterable[float] = (),
    control_period: float | None = None,
) -> Grid:
    """Split [0, duration] at samples, jumps and control instants, and those pieces into steps."""
    finest = min(step, sample)
    if duration > MOST_STEPS * finest:
        raise InputError(
            f"duration is {duration:g} s, which takes more than {MOST_STEPS:.0e} steps of "
            f"{finest:.2g} s; shorten it, give a longer step or sample, or check arm.radius, "
            "arm.length, arm.youngs_modulus, its damping and the initial rates, which make the "
            "automatic step short."
        )
    # The last interval is the shorter one; what is left of rounding is none.
    count = max(1, int(np.ceil(duration / sample - _ROUNDING)))
    samples = np.append(sample * np.arange(count), duration)
    inside = np.array([t for t in jumps if 0.0 < t < duration])
    # A jump within rounding of a sample is that sample.
    for i, t in enumerate(inside):
        near = np.argmin(np.abs(samples - t))
        if abs(samples[near] - t) < 1e-9 * duration:
            samples[near] = t
        inside[i] = t
    marks = np.union1d(samples, inside)
    if control_period is not None:
        marks = _merged(
            marks, np.arange(control_instants(duration, control_period)), control_period
        )
    length = np.diff(marks)
    pieces = np.maximum(1, np.ceil(length / step * (1.0 - 1e-12))).astype(int)
    last = np.cumsum(pieces) - 1
    within = np.arange(pieces.sum()) - np.repeat(last - pieces + 1, pieces)
    steps = np.repeat(length / pieces, pieces)
    sample_after = np.full(len(steps), -1, np.int32)
    ends_at = np.searchsorted(samples, marks[1:])
    is_sample = np.isin(marks[1:], samples)
    sample_after[last[is_sample]] = ends_at[is_sample]
    opens, closes = np.zeros(len(steps), bool), np.zeros(len(steps), bool)
    at_jump = np.isin(marks, inside)
    opens[(last - pieces + 1)[at_jump[:-1]]] = True
    closes[last[at_jump[1:]]] = True
    return Grid(
        samples, np.repeat(marks[:-1], pieces) + within * steps, steps, sample_after, opens, closes
    )


def control_instants(duration: float, period: float) -> int:
    """The number of control instants in [0, duration), one per period from 0."""
    return int(np.ceil(duration / period * (1.0 - 1e-12)))


def _merged(marks: np.ndarray, counts: np.ndarray, period: float) -> np.ndarray:
    """Marks with the instants counts * period, but for those within rounding of a mark."""
    instants = counts * period
    after = np.clip(np.searchsorted(marks, instants), 1, len(marks) - 1)
    gap = np.minimum(np.abs(marks[after] - instants), np.abs(marks[after - 1] - instants))
    return np.union1d(marks, instants[gap > 1e-9 * marks[-1]])


def stage_times(grid: Grid) -> np.ndarray:
    """Start, middle and end of every step (3 m,), nudged to the step's own side of a jump."""
    # A sum of start and step may round to the far side of a jump.
    start, end = grid.starts.copy(), np.append(grid.starts[1:], grid.samples[-1])
    start[grid.opens] = np.nextafter(start[grid.opens], np.inf)
    end[grid.closes] = np.nextafter(end[grid.closes], -np.inf)
    return np.column_stack([start, grid.starts + 0.5 * grid.steps, end]).ravel()


def groups_in_use(scenario: Any) -> int:
    """Bits of the input columns that a scenario uses."""
    general = any(
        getattr(scenario, name) is not None for name in ("force", "moment", "bend_moment", "tau")
    )
    groups = GENERAL * general + PAPER * (scenario.tau is not None)
    return groups + TIP * (scenario.tip_wrench is not None)


def sample_inputs(scenario: Any, times: np.ndarray, layout: Layout) -> tuple[np.ndarray, int]:
    """Input table (rows, runs or 1, inputs) and its rows per time: 0 if all inputs are constant."""
    parts: list[tuple[str, slice, np.ndarray]] = []
    for name in _COLUMNS:
        value, where = getattr(scenario, name), getattr(layout, name)
        if value is not None:
            sign = scenario.tip_wrench_sign if name == "tip_wrench" else 1.0
            width = where.stop - where.start
            parts.append((name, where, sign * _at(name, value, times, width)))
    if scenario.tau is not None:
        tau = _at("tau", scenario.tau, times, layout.coordinates)
        parts.append(("tau", layout.force, tau[..., :3]))
        parts.append(("tau", layout.euler_and_polar, tau[..., 3:]))
    rows = max((v.shape[0] for _, _, v in parts), default=1)
    runs = max((v.shape[1] for _, _, v in parts), default=1)
    if any(v.shape[1] not in (1, runs) for _, _, v in parts):
        held = {name: f"{name} has {v.shape[1]}" for name, _, v in parts}
        raise InputError(
            f"inputs hold rows for different numbers of runs ({', '.join(held.values())}); give "
            "as many rows in each, or one row for all runs."
        )
    table = np.zeros((rows, runs, layout.inputs))
    for _, where, value in parts:
        table[..., where] += value
    return table, int(rows > 1)


def _at(name: str, value: Any, times: np.ndarray, width: int) -> np.ndarray:
    """An input at every time: (times or 1, runs or 1, width)."""
    if not callable(value):
        constant = np.asarray(value, float)
        return constant.reshape(1, -1, constant.shape[-1])
    # Steps share their ends: each time is asked for once.
    distinct, index = np.unique(times, return_inverse=True)
    try:
        given = [value(t) for t in distinct.tolist()]
    except Exception as error:
        raise InputError(
            f"{name} raises {type(error).__name__} ({error}) during the flight; return {width} "
            "numbers at every time of it."
        ) from error
    try:
        rows = np.array(given, float)
    except (TypeError, ValueError):
        rows = np.empty((0, 0))
    if rows.shape[-1] != width or rows.ndim not in (2, 3) or len(rows) != len(distinct):
        raise InputError(
            f"{name} returns values of changing or wrong shape over time; return {width} numbers, "
            "or a row of them per run, at every time."
        )
    bad = ~np.isfinite(rows.reshape(len(rows), -1)).all(-1)
    if bad.any():
        raise InputError(
            f"{name} is not finite at t = {distinct[bad][0]:g} s; return finite numbers at every "
            "time of the flight."
        )
    return rows[index].reshape(len(times), -1, width)
