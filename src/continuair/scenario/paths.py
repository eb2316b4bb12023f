"""Paths of a target's centroid with bounded, continuous acceleration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.letters import LETTERS, strokes
from continuair.typing import Array, ArrayLike
from continuair.vehicle.fields import is_title

SMOOTHING = 0.04
"""Time spent in each rounded corner, as a fraction of the duration."""

_CORNERS_PER_ARC = 48


@dataclass(frozen=True)
class Path(Immutable):
    """A motion over a duration.

    Calling it with times (n,) returns position [m], velocity [m/s] and acceleration [m/s²], each
    (n, 3) in world axes.

    Parameters
    ----------
    name : str
        Name of the path, one line of text.
    duration : float
        Duration [s], above 0.
    motion : callable
        Function of times (n,) that returns position, velocity and acceleration, each (n, 3).

    Raises
    ------
    InputError
        If a field cannot be used.

    Notes
    -----
    After their duration, lines, polylines, letters and words stay at their last point. Circles,
    Lissajous figures and functions continue.
    """

    name: str
    duration: float
    motion: Callable[[Array], tuple[Array, Array, Array]]

    def __post_init__(self) -> None:
        if not is_title(self.name):
            raise InputError("name", f"of a path is {shown(self.name)}", "give one line of text")
        if not callable(self.motion):
            raise InputError(
                "motion", f"is {shown(self.motion)}", "give a function of the time alone"
            )
        object.__setattr__(self, "duration", checks.positive("duration", self.duration, " [s]"))

    def __call__(self, times: ArrayLike) -> tuple[Array, Array, Array]:
        if not checks.means_numbers(times):
            raise InputError("times", f"is {shown(times)}", "give numbers [s], none of them masked")
        # A copy, as a motion may change its times in place.
        found = self.motion(np.array(times, float, ndmin=1))
        if isinstance(found, tuple) and not checks.means_numbers(found):
            raise InputError(
                "motion",
                f"of the path {self.name} returns booleans, masked entries or units",
                "return numbers in SI units",
            )
        return found


def hold(position: ArrayLike = (0.0, 0.0, 0.0), duration: float = 50.0) -> Path:
    """Stay at one position.

    Parameters
    ----------
    position : array_like, shape (3,), optional
        Position in world axes [m].
    duration : float, optional
        Duration [s].

    Returns
    -------
    Path
        The path.
    """
    at = checks.vector("position", position, 3)

    def motion(t: Array) -> tuple[Array, Array, Array]:
        still = np.zeros((len(t), 3))
        return at + still, still, still.copy()

    return Path("hold", checks.positive("duration", duration), motion)


def circle(
    radius: float = 0.4,
    period: float = 20.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    duration: float = 50.0,
) -> Path:
    """Move along a horizontal circle, anticlockwise from +x.

    Parameters
    ----------
    radius : float, optional
        Radius [m].
    period : float, optional
        Time of one revolution [s].
    centre : array_like, shape (3,), optional
        Centre in world axes [m].
    duration : float, optional
        Duration [s]; the motion continues after it.

    Returns
    -------
    Path
        The path.

    Examples
    --------
    >>> place, velocity, acceleration = ca.paths.circle(0.5, period=20.0)([0.0])
    >>> place.tolist()
    [[0.5, 0.0, 0.0]]
    """
    radius = checks.positive("radius", radius)
    found = lissajous((radius, radius), (1, 1), (np.pi / 2, 0.0), period, centre, duration)
    return Path("circle", found.duration, found.motion)


def lissajous(
    amplitudes: ArrayLike = (0.4, 0.4),
    ratios: ArrayLike = (1, 2),
    phases: ArrayLike = (0.0, 0.0),
    period: float = 20.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    duration: float = 50.0,
) -> Path:
    """Move along a horizontal Lissajous figure.

    Parameters
    ----------
    amplitudes : array_like, shape (2,), optional
        Amplitudes of x and y [m].
    ratios : array_like, shape (2,), optional
        Oscillations of x and y per period.
    phases : array_like, shape (2,), optional
        Phases of the sines at t = 0 [rad].
    period : float, optional
        Period [s].
    centre : array_like, shape (3,), optional
        Centre in world axes [m].
    duration : float, optional
        Duration [s]; the motion continues after it.

    Returns
    -------
    Path
        The path.
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


def line(
    start: ArrayLike, end: ArrayLike, duration: float = 50.0, smoothing: float = SMOOTHING
) -> Path:
    """Move along a straight line from rest to rest, and stay at its end.

    Parameters
    ----------
    start, end : array_like, shape (3,)
        Ends in world axes [m].
    duration : float, optional
        Duration [s].
    smoothing : float, optional
        Time of starting and of stopping, as a fraction of the duration.

    Returns
    -------
    Path
        The path.
    """
    ends = [checks.vector("start", start, 3), checks.vector("end", end, 3)]
    found = polyline(ends, duration, smoothing)
    return Path("line", found.duration, found.motion)


def polyline(points: ArrayLike, duration: float = 50.0, smoothing: float = SMOOTHING) -> Path:
    """Move along points at constant speed with rounded corners, from rest to rest.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        Corners in world axes [m]. The path stays at the last one.
    duration : float, optional
        Duration [s].
    smoothing : float, optional
        Time spent in each corner, as a fraction of the duration, above 0 and below 1.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        If a point repeats the one before, or `smoothing` is out of range.

    Notes
    -----
    The velocity of the sharp-cornered motion is convolved with a quadratic B-spline, so that the
    acceleration has a bounded slope.
    """
    corners, duration = _points(points), checks.positive("duration", duration)
    if not checks.is_number(smoothing) or not 0.0 < smoothing < 1.0:
        raise InputError(
            "smoothing",
            f"is {shown(smoothing)}",
            f"give a fraction of the duration above 0 and below 1, such as {SMOOTHING}",
        )
    width = smoothing * duration
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not (lengths > 0.0).all():
        raise InputError(
            "points",
            f"repeats {corners[1:][lengths == 0.0][0].tolist()}",
            "leave out points equal to the one before",
        )
    times = width / 2 + np.append(0.0, np.cumsum(lengths) / lengths.sum()) * (duration - width)
    velocities = np.diff(corners, axis=0) / np.diff(times)[:, None]
    rest = np.zeros((1, 3))
    jumps = np.diff(np.vstack([rest, velocities, rest]), axis=0)
    # Corners closer together than the smoothing merge into one smooth curve.
    return Path("polyline", duration, lambda t: _rounded(t, corners, times, jumps, width))


def letter(
    name: str,
    height: float = 0.8,
    duration: float = 50.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    smoothing: float = SMOOTHING,
) -> Path:
    """Write one of the letters M, R, A and L in the world's xy plane.

    Parameters
    ----------
    name : {"M", "R", "A", "L"}
        The letter, in either case.
    height : float, optional
        Height of the letter [m].
    duration : float, optional
        Duration [s].
    centre : array_like, shape (3,), optional
        Centre in world axes [m].
    smoothing : float, optional
        As in `polyline`.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        If `name` is no such letter.
    """
    if not isinstance(name, str) or len(name) != 1 or name.upper() not in LETTERS:
        raise InputError(
            "letter",
            f"is {shown(name)}",
            f"give one of the letters {', '.join(LETTERS)} (paths.word writes several)",
        )
    return word(name, height, duration, centre, smoothing)


def word(
    text: str,
    height: float = 0.8,
    duration: float = 50.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    smoothing: float = SMOOTHING,
) -> Path:
    """Write letters in a row in the world's xy plane.

    Parameters
    ----------
    text : str
        One or more of the letters M, R, A and L.
    height : float, optional
        Height of a letter [m].
    duration : float, optional
        Duration of the whole word [s].
    centre : array_like, shape (3,), optional
        Centre of the word in world axes [m].
    smoothing : float, optional
        As in `polyline`.

    Returns
    -------
    Path
        The path.

    Raises
    ------
    InputError
        If `text` has another letter.
    """
    corners = checks.positive("height", height) * strokes(text, _CORNERS_PER_ARC)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    flat = np.column_stack([corners - middle, np.zeros(len(corners))])
    found = polyline(flat + checks.vector("centre", centre, 3), duration, smoothing)
    return Path(text.upper(), found.duration, found.motion)


def from_function(
    position: Callable[[float], ArrayLike], duration: float, name: str = "function"
) -> Path:
    """Follow a function of time; derivatives are finite differences.

    Parameters
    ----------
    position : callable
        Function of the time [s] that returns a position (3,) in world axes [m].
    duration : float
        Duration [s].
    name : str, optional
        Name of the path.

    Returns
    -------
    Path
        The path. It continues after the duration.

    Raises
    ------
    InputError
        If the acceleration is unbounded: second differences grow as their step shrinks, as at
        corners and jumps. Also if positions are rounded to single precision, which leaves no
        usable acceleration.
    """
    duration = checks.positive("duration", duration)
    if not callable(position):
        raise InputError("position", f"is {shown(position)}", "give a function of the time alone")

    def at(t: Array) -> Array:
        return np.array([_evaluated(position, x) for x in t.tolist()])

    h = 1e-4 * min(1.0, duration)

    def motion(t: Array) -> tuple[Array, Array, Array]:
        # At the ends, differences are taken inside the interval where the function is defined.
        c = np.where(t <= duration, np.clip(t, h, duration - h), t)
        before, here, after = at(c - h), at(c), at(c + h)
        velocity, acceleration = (after - before) / (2 * h), (after - 2 * here + before) / h**2
        return at(t), velocity + acceleration * (t - c)[:, None], acceleration

    _check_bounded(at, duration)
    _check_precise(at, h, duration)
    return Path(name, duration, motion)


def _evaluated(position: Callable[[float], ArrayLike], t: float) -> Array:
    """Return the position (3,) at a time [s]; InputError if the function fails."""
    try:
        found = position(t)
    except Exception as error:  # whatever a user's function raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            "position",
            f"cannot be evaluated at t = {t:g} ({reason})",
            "give a function of the time alone",
        ) from error
    return checks.vector("position", found, 3)


def _check_bounded(position: Callable[[Array], Array], duration: float) -> None:
    """Raise InputError if second differences grow as their time step shrinks."""
    # At a corner they double each time the step halves; a bounded one converges.
    sharpest = []
    for count in (2000, 4000, 8000):
        t = np.linspace(0.0, duration, count)
        second = np.diff(position(t), 2, axis=0) / (t[1] - t[0]) ** 2
        sharpest.append(np.abs(second).max())
    if sharpest[2] > 1e-6 and sharpest[2] > 1.8 * sharpest[0]:
        raise InputError(
            "position",
            (
                f"has unbounded acceleration ({sharpest[2]:.3g} m/s², growing as the time "
                "step shrinks)"
            ),
            "round the path's corners",
        )


def _check_precise(position: Callable[[Array], Array], h: float, duration: float) -> None:
    """Raise InputError if differences over h are mostly rounding, compared with those over 4 h."""
    t = np.linspace(5.0 * h, duration - 5.0 * h, 301)
    here = position(t)
    near, far = (
        (position(t + each) - 2.0 * here + position(t - each)) / each**2 for each in (h, 4.0 * h)
    )
    # A jump of the acceleration changes a few of the differences, rounding most of them. Times at
    # which the path rests or goes straight on have none.
    off = np.linalg.norm(near - far, axis=1)
    moving = off[np.any((near != 0.0) | (far != 0.0), axis=1)]
    noise = np.median(moving) if len(moving) >= 5 else 0.0
    if noise > max(0.01 * np.linalg.norm(far, axis=1).max(), 0.01):
        raise InputError(
            "position",
            f"is rounded too coarsely: its acceleration is wrong by {noise:.2g} m/s²",
            "compute it in double precision near the origin",
        )


def _rounded(
    t: Array, corners: Array, times: Array, jumps: Array, width: float
) -> tuple[Array, Array, Array]:
    """Return the piecewise linear motion, plus the B-spline's correction near every corner."""
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
    """Return max(x, 0) convolved with a quadratic B-spline of a width, and two derivatives."""
    h = np.float64(width) / 3.0  # powers of it may overflow; `Target` refuses such a path
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


def _points(points: ArrayLike) -> Array:
    """Return points (n, 3) from points (n, 2 or 3), or raise InputError."""
    rows = checks.finite_array(points)
    if rows is None or rows.ndim != 2 or rows.shape[1] not in (2, 3) or len(rows) < 2:
        raise InputError(
            "points", f"is {shown(points)}", "give 2 or more points of 2 or 3 numbers [m]"
        )
    return np.hstack([rows, np.zeros((len(rows), 3 - rows.shape[1]))])
