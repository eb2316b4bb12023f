"""Paths of a target's centroid: position, velocity and acceleration, all bounded and continuous."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.letters import LETTERS, strokes
from continuair.vehicle.fields import is_title

Array = np.ndarray

SMOOTHING = 0.04
"""Time spent in each rounded corner, as a share of the duration."""

_CORNERS_PER_ARC = 48


@dataclass(frozen=True)
class Path(Immutable):
    """A motion over `duration` [s]; calling it with times (n,) gives three arrays (n, 3).

    They are position [m], velocity [m/s] and acceleration [m/s²] in world axes. Beyond the duration
    lines, polylines, letters and words stay where they ended; what is given by a formula, circles,
    Lissajous figures and functions, goes on.
    """

    name: str
    duration: float
    motion: Callable[[Array], tuple[Array, Array, Array]]

    def __post_init__(self) -> None:
        if not is_title(self.name):
            raise InputError(f"name of a path is {shown(self.name)}; give one line of text.")
        if not callable(self.motion):
            raise InputError(f"motion is {shown(self.motion)}; give a function of the time alone.")
        object.__setattr__(self, "duration", checks.positive("duration", self.duration, " [s]"))

    def __call__(self, times: Any) -> tuple[Array, Array, Array]:
        if not checks.means_numbers(times):
            raise InputError(f"times is {shown(times)}; give numbers [s], none of them masked.")
        # A copy, as a motion may change its times in place.
        found = self.motion(np.array(times, float, ndmin=1))
        if isinstance(found, tuple) and not checks.means_numbers(found):
            raise InputError(
                f"motion of the path {self.name} holds a truth value, a masked entry or a unit; "
                "return numbers, in SI units, at every time."
            )
        return found


def hold(position: Any = (0.0, 0.0, 0.0), duration: float = 50.0) -> Path:
    """Stay at a position (3,) [m]."""
    at = checks.vector("position", position, 3)

    def motion(t: Array) -> tuple[Array, Array, Array]:
        still = np.zeros((len(t), 3))
        return at + still, still, still.copy()

    return Path("hold", checks.positive("duration", duration), motion)


def circle(
    radius: float = 0.4, period: float = 20.0, centre: Any = (0.0, 0.0, 0.0), duration: float = 50.0
) -> Path:
    """Run round a horizontal circle [m] once per period [s], anticlockwise from +x.

    It goes on beyond the duration.

    >>> place, velocity, acceleration = ca.paths.circle(0.5, period=20.0)([0.0])
    >>> place.tolist()
    [[0.5, 0.0, 0.0]]
    """
    radius = checks.positive("radius", radius)
    found = lissajous((radius, radius), (1, 1), (np.pi / 2, 0.0), period, centre, duration)
    return Path("circle", found.duration, found.motion)


def lissajous(
    amplitudes: Any = (0.4, 0.4),
    ratios: Any = (1, 2),
    phases: Any = (0.0, 0.0),
    period: float = 20.0,
    centre: Any = (0.0, 0.0, 0.0),
    duration: float = 50.0,
) -> Path:
    """x and y oscillate with amplitudes [m], `ratios` times per period [s], from phases [rad].

    They go on beyond the duration.
    """
    a, n, phase = (
        checks.vector(name, value, 2)
        for name, value in (("amplitudes", amplitudes), ("ratios", ratios), ("phases", phases))
    )
    w, at = 2.0 * np.pi * n / checks.positive("period", period), checks.vector("centre", centre, 3)

    def motion(t: Array) -> tuple[Array, Array, Array]:
        angle = np.outer(t, w) + phase
        level = np.zeros((len(t), 1))
        waves = (a * np.sin(angle), a * w * np.cos(angle), -a * w**2 * np.sin(angle))
        position, velocity, acceleration = (np.hstack([wave, level]) for wave in waves)
        return at + position, velocity, acceleration

    return Path("lissajous", checks.positive("duration", duration), motion)


def line(start: Any, end: Any, duration: float = 50.0, smoothing: float = SMOOTHING) -> Path:
    """Go from start to end (3,) [m], from rest to rest, and stay there."""
    ends = [checks.vector("start", start, 3), checks.vector("end", end, 3)]
    found = polyline(ends, duration, smoothing)
    return Path("line", found.duration, found.motion)


def polyline(points: Any, duration: float = 50.0, smoothing: float = SMOOTHING) -> Path:
    """Go along points (n, 2 or 3) [m] at constant speed, corners rounded, from rest to rest.

    It stays at the last one. smoothing: time spent in each corner, as a share of the duration. The
    velocity along the corners is convolved with a quadratic B-spline, so that the acceleration has
    a bounded slope.
    """
    corners, duration = _points(points), checks.positive("duration", duration)
    if not checks.is_number(smoothing) or not 0.0 < smoothing < 1.0:
        raise InputError(
            f"smoothing is {shown(smoothing)}, but must lie between 0 and 1: sharp corners would "
            "need unbounded acceleration; give a share of the duration, such as "
            f"{SMOOTHING}."
        )
    width = smoothing * duration
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not (lengths > 0.0).all():
        raise InputError(
            f"points repeats the point {corners[1:][lengths == 0.0][0].tolist()}; leave out "
            "points that are the same as the one before."
        )
    times = width / 2 + np.append(0.0, np.cumsum(lengths) / lengths.sum()) * (duration - width)
    velocities = np.diff(corners, axis=0) / np.diff(times)[:, None]
    rest = np.zeros((1, 3))
    jumps = np.diff(np.vstack([rest, velocities, rest]), axis=0)
    # Corners closer together than the smoothing are one smooth curve.
    return Path("polyline", duration, lambda t: _rounded(t, corners, times, jumps, width))


def letter(
    name: str,
    height: float = 0.8,
    duration: float = 50.0,
    centre: Any = (0.0, 0.0, 0.0),
    smoothing: float = SMOOTHING,
) -> Path:
    """Write one of the letters M, R, A, L, `height` [m] high, in the world's xy plane."""
    if not isinstance(name, str) or len(name) != 1 or name.upper() not in LETTERS:
        raise InputError(
            f"letter is {shown(name)}; give one of the letters {', '.join(LETTERS)} (paths.word "
            "writes several)."
        )
    return word(name, height, duration, centre, smoothing)


def word(
    text: str,
    height: float = 0.8,
    duration: float = 50.0,
    centre: Any = (0.0, 0.0, 0.0),
    smoothing: float = SMOOTHING,
) -> Path:
    """Write letters in a row, duration [s] and the rest as in `letter`, centred in the plane."""
    corners = checks.positive("height", height) * strokes(text, _CORNERS_PER_ARC)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    flat = np.column_stack([corners - middle, np.zeros(len(corners))])
    found = polyline(flat + checks.vector("centre", centre, 3), duration, smoothing)
    return Path(text.upper(), found.duration, found.motion)


def from_function(
    position: Callable[[float], ArrayLike], duration: float, name: str = "function"
) -> Path:
    """Follow a function of time [s] that returns a position (3,) [m]; slopes by differences.

    It is followed beyond the duration, too, where a flight looks for jumps alone. Raises InputError
    if the acceleration has no bound: where second differences grow as they become finer, the path
    has a corner or a jump; and for positions that are rounded to single precision, of which no
    acceleration is left.
    """
    duration = checks.positive("duration", duration)
    if not callable(position):
        raise InputError(f"position is {shown(position)}; give a function of the time alone.")

    def at(t: Array) -> Array:
        return np.array([_evaluated(position, x) for x in t.tolist()])

    h = 1e-4 * min(1.0, duration)

    def motion(t: Array) -> tuple[Array, Array, Array]:
        # At the edges the differences are taken inside, where the function has values.
        c = np.where(t <= duration, np.clip(t, h, duration - h), t)
        before, here, after = at(c - h), at(c), at(c + h)
        velocity, acceleration = (after - before) / (2 * h), (after - 2 * here + before) / h**2
        return at(t), velocity + acceleration * (t - c)[:, None], acceleration

    _check_bounded(at, duration)
    _check_precise(at, h, duration)
    return Path(name, duration, motion)


def _evaluated(position: Callable[[float], Any], t: float) -> Array:
    try:
        found = position(t)
    except Exception as error:  # whatever a user's function raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            f"position cannot be evaluated at t = {t:g} ({reason}); give a function of the time "
            "alone."
        ) from error
    return checks.vector("position", found, 3)


def _check_bounded(position: Callable[[Array], Array], duration: float) -> None:
    """Raise InputError if accelerations grow as the times at which they are taken get closer."""
    # At a corner they double each time the step halves; one that is resolved keeps its value.
    sharpest = []
    for count in (2000, 4000, 8000):
        t = np.linspace(0.0, duration, count)
        second = np.diff(position(t), 2, axis=0) / (t[1] - t[0]) ** 2
        sharpest.append(np.abs(second).max())
    if sharpest[2] > 1e-6 and sharpest[2] > 1.8 * sharpest[0]:
        raise InputError(
            f"position has an acceleration without bound (it reaches {sharpest[2]:.3g} m/s² and "
            "grows as the time steps shrink); round the path's corners."
        )


def _check_precise(position: Callable[[Array], Array], h: float, duration: float) -> None:
    """Raise InputError if differences h apart are mostly rounding, unlike those 4 h apart."""
    t = np.linspace(5.0 * h, duration - 5.0 * h, 301)
    here = position(t)
    near, far = (
        (position(t + each) - 2.0 * here + position(t - each)) / each**2 for each in (h, 4.0 * h)
    )
    # An acceleration that jumps differs at a few of the times, rounding at most of them; where the
    # path rests, or goes straight on, there is none.
    off = np.linalg.norm(near - far, axis=1)
    moving = off[np.any((near != 0.0) | (far != 0.0), axis=1)]
    noise = np.median(moving) if len(moving) >= 5 else 0.0
    if noise > max(0.01 * np.linalg.norm(far, axis=1).max(), 0.01):
        raise InputError(
            f"position is rounded so coarsely that its acceleration is wrong by {noise:.2g} m/s²; "
            "compute it in double precision, not far from the origin."
        )


def _rounded(
    t: Array, corners: Array, times: Array, jumps: Array, width: float
) -> tuple[Array, Array, Array]:
    """The piecewise linear motion, and near every corner what the B-spline adds to it."""
    order = np.argsort(t, kind="stable")
    t = t[order]
    at = np.column_stack([np.interp(t, times, column) for column in corners.T])
    # np.interp has no slope: the velocity is the sum of the jumps so far.
    velocity = np.vstack([np.zeros(3), np.cumsum(jumps, axis=0)])[np.searchsorted(times, t)]
    acceleration = np.zeros_like(at)
    first, last = np.searchsorted(t, times - width / 2), np.searchsorted(t, times + width / 2)
    for corner, jump, begin, end in zip(times, jumps, first, last, strict=True):
        x = t[begin:end] - corner
        ramp, step, bump = _smooth_ramp(x, width)
        at[begin:end] += np.outer(ramp - np.maximum(x, 0.0), jump)
        velocity[begin:end] += np.outer(step - (x > 0.0), jump)
        acceleration[begin:end] += np.outer(bump, jump)
    back = np.argsort(order, kind="stable")
    return at[back], velocity[back], acceleration[back]


def _smooth_ramp(x: Array, width: float) -> tuple[Array, Array, Array]:
    """max(x, 0) convolved with a quadratic B-spline of that width, and its two derivatives."""
    h = np.float64(width) / 3.0  # its powers may be infinite, which a path is refused for
    parts = [
        (sign, np.maximum(x - (j - 1.5) * h, 0.0)) for j, sign in enumerate((1.0, -3.0, 3.0, -1.0))
    ]
    ramp, step, bump = np.zeros((3, *x.shape))
    with np.errstate(over="ignore", invalid="ignore"):
        for sign, part in parts:
            square = part * part
            ramp += sign * (square * square)
            step += sign * (square * part)
            bump += sign * square
        return ramp / (24.0 * h**3), step / (6.0 * h**3), bump / (2.0 * h**3)


def _points(points: Any) -> Array:
    rows = checks.finite_array(points)
    if rows is None or rows.ndim != 2 or rows.shape[1] not in (2, 3) or len(rows) < 2:
        raise InputError(f"points is {shown(points)}; give 2 or more points of 2 or 3 numbers [m].")
    return np.hstack([rows, np.zeros((len(rows), 3 - rows.shape[1]))])
