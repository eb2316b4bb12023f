"""Set-points over time of a flight controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.records import with_known_fields
from continuair.typing import Array, ArrayLike
from continuair.warning import warn

Given: TypeAlias = ArrayLike | Callable[[float], ArrayLike] | None

WIDTHS = {"position": 3, "velocity": 3, "yaw": 1, "yaw_rate": 1, "bend": None}
"""Set-point -> its number of components; None: two per section."""

_GOES_WITH = {"velocity": "position", "yaw_rate": "yaw"}
"""Rate -> the set-point that it is the rate of."""


@with_known_fields("the setpoints", "give fields by name")
@dataclass(frozen=True, eq=False)
class Setpoints(Immutable):
    """Set-points of a flight controller.

    Parameters
    ----------
    position : array_like or callable, optional
        Position of B's origin in world axes, shape (3,) [m]. Default: its start. If only `velocity`
        is given, the position is not controlled.
    velocity : array_like or callable, optional
        Velocity of B's origin in world axes, shape (3,) [m/s]. Beside a position, its rate.
        Default: 0.
    yaw : array_like or callable, optional
        Yaw [rad]. Default: its start.
    yaw_rate : array_like or callable, optional
        Rate of `yaw` [rad/s]; needs `yaw`. Default: 0.
    bend : array_like or callable, optional
        Bend vectors, two numbers per section [1/m]. Default: those of the start.
    times : array_like, shape (n,), optional
        Increasing times of the arrays [s].

    Raises
    ------
    InputError
        If a field cannot be used.

    Notes
    -----
    Each set-point is a constant, a function of the time [s], or, with `times`, an array over them.
    Such an array is interpolated linearly, and is constant before the first and after the last
    time. There the rate of a position or a yaw is 0 if either of the two is an array. A leading
    dimension (runs,), before the times, gives each run its own.
    """

    position: Given = None
    velocity: Given = None
    yaw: Given = None
    yaw_rate: Given = None
    bend: Given = None
    times: ArrayLike | None = None

    def __post_init__(self) -> None:
        if self.times is not None:
            object.__setattr__(self, "times", _checked_times(self.times))
        for name in WIDTHS:
            object.__setattr__(self, name, self._checked(name, getattr(self, name)))
        arrays = [name for name in WIDTHS if isinstance(getattr(self, name), np.ndarray)]
        if self.times is not None and not arrays:
            raise InputError(
                "times",
                (
                    f"of the setpoints is {shown(self.times)}, but no set-point is an "
                    "array over them"
                ),
                "give such an array, or omit times",
            )
        if self.yaw_rate is not None and self.yaw is None:
            raise InputError(
                "yaw_rate",
                "of the setpoints is given without yaw",
                "give the matching yaw, such as lambda t: 0.5 * t",
            )
        if self.times is not None and isinstance(self.yaw, np.ndarray):
            _warn_of_wraps(self.yaw[..., 0], np.asarray(self.times))

    def _checked(self, name: str, value: Any) -> Any:
        """Return a function that returns valid numbers at t = 0, or a read-only array."""
        if value is None or callable(value):
            if callable(value):
                _rows(name, _called(name, value, 0.0), None)
            return value
        return checks.frozen(
            _rows(name, value, None if self.times is None else np.size(self.times))
        )

    @property
    def runs(self) -> int | None:
        """Number of runs that have set-points of their own, or None."""
        counts = {len(rows) for name in WIDTHS if (rows := self.at(name, np.zeros(1))) is not None}
        counts.discard(1)
        if len(counts) > 1:
            raise InputError(
                "setpoints",
                f"hold {' and '.join(map(str, sorted(counts)))} runs",
                "give as many rows in each, or one for all runs",
            )
        return counts.pop() if counts else None

    def at(self, name: str, instants: Array, runs: NDArray[np.intp] | None = None) -> Array | None:
        """Return a set-point at some times.

        Parameters
        ----------
        name : {"position", "velocity", "yaw", "yaw_rate", "bend"}
            The set-point.
        instants : ndarray, shape (times,)
            Times [s].
        runs : ndarray of int, optional
            Runs that are wanted. Default: all.

        Returns
        -------
        ndarray, shape (runs or 1, times, width), or None
            The set-point, or None if it is not given.
        """
        found = self._given_at(name, instants, runs)
        if found is None or not self._rests(name):
            return found
        # Before the first and after the last time the set-point is constant.
        times = np.asarray(self.times)
        slack = 1e-12 * np.abs(times).max()
        within = (instants >= times[0] - slack) & (instants <= times[-1] + slack)
        return np.where(within[:, None], found, 0.0)

    def _given_at(self, name: str, instants: Array, runs: NDArray[np.intp] | None) -> Array | None:
        """Return a set-point as `at` does, by itself."""
        value = getattr(self, name)
        if value is None:
            return None
        if callable(value):
            found = [
                _of_runs(_rows(name, _called(name, value, t), None), runs)
                for t in instants.tolist()
            ]
            if len({rows.shape for rows in found}) > 1:
                raise InputError(name, "of the setpoints changes its shape over time", "keep it")
            for i in checks.asked_again(len(instants)):
                again = _rows(name, _called(name, value, float(instants[i])), None)
                checks.repeats(f"{name} of the setpoints", found[i], _of_runs(again, runs))
            return np.concatenate(found, axis=1)
        value = _of_runs(value, runs)
        if self.times is None:
            return np.broadcast_to(value, (len(value), len(instants), value.shape[-1]))
        times = np.asarray(self.times)
        lines = [[np.interp(instants, times, column) for column in run.T] for run in value]
        return np.array(lines).swapaxes(1, 2)

    def _rests(self, name: str) -> bool:
        """Return whether it is a rate of which itself or its set-point is an array over times."""
        if self.times is None or name not in _GOES_WITH:
            return False
        rate, moved = getattr(self, name), getattr(self, _GOES_WITH[name])
        return moved is not None and not (callable(rate) and callable(moved))

    def describe(self) -> dict[str, object]:
        """Return the given set-points for JSON.

        Returns
        -------
        dict
            Set-point to value; functions of time are given by name.
        """
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: _plain(value) for name, value in found.items() if value is not None}


def _of_runs(rows: Array, runs: NDArray[np.intp] | None) -> Array:
    """Return the rows (runs or 1, times or 1, width) of some runs."""
    return rows if runs is None or len(rows) == 1 else rows[runs]


def _warn_of_wraps(yaw: Array, times: Array) -> None:
    """Warn if a yaw (runs, n) changes by more than π between two times, as a wrapped yaw does."""
    turns = np.abs(np.diff(yaw, axis=1)).max(axis=0)
    if (turns > np.pi).any():
        at = int(np.argmax(turns))
        warn(
            f"yaw of the setpoints turns by {turns[at]:.3g} rad from t = {times[at]:.6g} to "
            f"{times[at + 1]:.6g} s; if it wraps there, give np.unwrap(yaw), otherwise more times.",
            stacklevel=5,
        )


def _rows(name: str, value: Any, times: int | None) -> Array:
    """Return numbers (runs or 1, times or 1, width) of a set-point, or raise InputError."""
    found = checks.finite_array(value)
    width = WIDTHS[name]
    if found is not None and found.ndim == 3 and found.shape[1] == 1 and times is None:
        found = found[:, 0]
    if (
        found is not None
        and found.ndim == 2 + (times is not None)
        and width == found.shape[-1] == 1
    ):
        found = found[..., 0]
    wanted = f"{width or 'two per section'}" + (f" at each of {times} times" if times else "")
    instead = ", or a function of time" if times else ""
    if found is not None and width == 1:
        found = found[..., None]
    shapes = (2, 3) if times else (1, 2)
    if (
        found is None
        or found.ndim not in shapes
        or not found.size
        or not _fits(found, width, times)
    ):
        raise InputError(
            name,
            f"of the setpoints is {shown(value)}",
            f"give finite numbers, {wanted}, or a row of them per run{instead}",
        )
    if times is None:
        return found.reshape(-1, 1, found.shape[-1])
    return found.reshape(-1, times, found.shape[-1])


def _fits(found: Array, width: int | None, times: int | None) -> bool:
    """Return whether the last dimensions are those of the times and of a set-point."""
    last: int = found.shape[-1]
    of_times = not times or found.shape[-2] == times
    return of_times and (last == width if width else last % 2 == 0)


def _called(name: str, value: Callable[[float], ArrayLike], time: float) -> Any:
    """Return the value of a function at a time [s]; InputError if the function fails."""
    try:
        return value(time)
    except Exception as error:  # whatever a user's function raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            name,
            f"of the setpoints cannot be evaluated at t = {time:g} s ({reason})",
            "give a function of the time alone",
        ) from error


def _checked_times(value: Any) -> Array:
    """Return increasing times (n,), or raise InputError."""
    found = checks.finite_array(value)
    if found is None or found.ndim != 1 or len(found) < 2 or not (np.diff(found) > 0.0).all():
        raise InputError(
            "times", f"of the setpoints is {shown(value)}", "give two or more, rising [s]"
        )
    return checks.frozen(found)


def _plain(value: Any) -> Any:
    """Return an array as a list, and a function as its name."""
    return (
        value.tolist()
        if isinstance(value, np.ndarray)
        else getattr(value, "__qualname__", type(value).__qualname__)
    )
