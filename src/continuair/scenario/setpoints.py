"""Set-points: where a flight controller is to bring the vehicle and its arms, over time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.records import with_known_fields
from continuair.warning import warn

Array = NDArray[np.float64]
Given = ArrayLike | Callable[[float], ArrayLike] | None

WIDTHS = {"position": 3, "velocity": 3, "yaw": 1, "yaw_rate": 1, "bend": None}
"""Set-point -> how many numbers it is, None for two per section."""

_GOES_WITH = {"velocity": "position", "yaw_rate": "yaw"}
"""Rate -> what it is the rate of."""


@with_known_fields("the setpoints", "give fields by name")
@dataclass(frozen=True, eq=False)
class Setpoints(Immutable):
    """What a flight controller follows; what is None stays as the flight starts, velocities are 0.

    Each is constant, a function of the time [s], or, where `times` are given, an array over them
    with straight lines in between, which stays before the first and after the last. There the rate
    beside a position or a yaw is 0, where either of the two is an array. A leading dimension
    (runs,), before that of the times, gives each run its own. Raises InputError.
    """

    position: Given = None
    """of B's origin in the world, (3,) [m]; left out beside a velocity, that alone counts"""

    velocity: Given = None
    """of B's origin, world axes, (3,) [m/s]: beside a position, the velocity that goes with it"""

    yaw: Given = None
    """a number [rad]"""

    yaw_rate: Given = None
    """a number, the rate that goes with a yaw that is given [rad/s]"""

    bend: Given = None
    """bend vectors, two numbers per section [1/m]"""

    times: ArrayLike | None = None
    """times of arrays (n,), rising [s]"""

    def __post_init__(self) -> None:
        if self.times is not None:
            object.__setattr__(self, "times", _checked_times(self.times))
        for name in WIDTHS:
            object.__setattr__(self, name, self._checked(name, getattr(self, name)))
        arrays = [name for name in WIDTHS if isinstance(getattr(self, name), np.ndarray)]
        if self.times is not None and not arrays:
            raise InputError(
                f"times of the setpoints is {shown(self.times)}, but no set-point is an array over "
                "them; leave the times out, or give one that is."
            )
        if self.yaw_rate is not None and self.yaw is None:
            raise InputError(
                "yaw_rate of the setpoints is given, but no yaw, which would stay as the flight "
                "starts; give the yaw that goes with it, such as lambda t: 0.5 * t."
            )
        if self.times is not None and isinstance(self.yaw, np.ndarray):
            _warn_of_wraps(self.yaw[..., 0], np.asarray(self.times))

    def _checked(self, name: str, value: Any) -> Any:
        if value is None or callable(value):
            if callable(value):
                _rows(name, _called(name, value, 0.0), None)
            return value
        return checks.frozen(
            _rows(name, value, None if self.times is None else np.size(self.times))
        )

    @property
    def runs(self) -> int | None:
        """The number of runs that have set-points of their own, or None."""
        counts = {len(rows) for name in WIDTHS if (rows := self.at(name, np.zeros(1))) is not None}
        counts.discard(1)
        if len(counts) > 1:
            raise InputError(
                f"setpoints hold {' and '.join(map(str, sorted(counts)))} runs; give as many rows "
                "in each, or one for all runs."
            )
        return counts.pop() if counts else None

    def at(self, name: str, instants: Array) -> Array | None:
        """A set-point at some times, (runs or 1, times, width); None if it is not given."""
        found = self._given_at(name, instants)
        if found is None or not self._rests(name):
            return found
        # What holds its first or last place does not move.
        times = np.asarray(self.times)
        slack = 1e-12 * np.abs(times).max()
        within = (instants >= times[0] - slack) & (instants <= times[-1] + slack)
        return np.where(within[:, None], found, 0.0)

    def _given_at(self, name: str, instants: Array) -> Array | None:
        """As `at`, of each set-point by itself."""
        value = getattr(self, name)
        if value is None:
            return None
        if callable(value):
            found = [_rows(name, _called(name, value, t), None) for t in instants.tolist()]
            if len({rows.shape for rows in found}) > 1:
                raise InputError(f"{name} of the setpoints changes its shape over time; keep it.")
            for i in checks.asked_again(len(instants)):
                again = _rows(name, _called(name, value, float(instants[i])), None)
                checks.repeats(f"{name} of the setpoints", found[i], again)
            return np.concatenate(found, axis=1)
        if self.times is None:
            return np.broadcast_to(value, (len(value), len(instants), value.shape[-1]))
        times = np.asarray(self.times)
        lines = [[np.interp(instants, times, column) for column in run.T] for run in value]
        return np.array(lines).swapaxes(1, 2)

    def _rests(self, name: str) -> bool:
        """Whether it is the rate of a set-point, and one of the two is an array over times."""
        if self.times is None or name not in _GOES_WITH:
            return False
        rate, moved = getattr(self, name), getattr(self, _GOES_WITH[name])
        return moved is not None and not (callable(rate) and callable(moved))

    def describe(self) -> dict[str, Any]:
        """What is given, as JSON can hold it, functions of time by their name."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: _plain(value) for name, value in found.items() if value is not None}


def _warn_of_wraps(yaw: Array, times: Array) -> None:
    """Warn if a yaw (runs, n) goes by more than half a turn from one time to the next, as one that
    a log or an arctangent gives within ±π does where it wraps."""
    turns = np.abs(np.diff(yaw, axis=1)).max(axis=0)
    if (turns > np.pi).any():
        at = int(np.argmax(turns))
        warn(
            f"yaw of the setpoints turns by {turns[at]:.3g} rad from t = {times[at]:.6g} to "
            f"{times[at + 1]:.6g} s, which is flown as it is; give np.unwrap(yaw) if it wraps "
            "there, or times in between if it is meant.",
            stacklevel=5,
        )


def _rows(name: str, value: Any, times: int | None) -> Array:
    """Numbers (runs or 1, times or 1, width) from what was given, which may be such already."""
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
    instead = ", or a function of time, as of what stays" if times else ""
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
            f"{name} of the setpoints is {shown(value)}; give finite numbers, {wanted}, or a row "
            f"of them per run{instead}."
        )
    if times is None:
        return found.reshape(-1, 1, found.shape[-1])
    return found.reshape(-1, times, found.shape[-1])


def _fits(found: Array, width: int | None, times: int | None) -> bool:
    """Whether the last dimensions are those of the times and of a set-point."""
    last: int = found.shape[-1]
    of_times = not times or found.shape[-2] == times
    return of_times and (last == width if width else last % 2 == 0)


def _called(name: str, value: Callable[[float], ArrayLike], time: float) -> Any:
    try:
        return value(time)
    except Exception as error:  # whatever a user's function raises
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(
            f"{name} of the setpoints cannot be evaluated at t = {time:g} s ({reason}); give a "
            "function of the time alone."
        ) from error


def _checked_times(value: Any) -> Array:
    found = checks.finite_array(value)
    if found is None or found.ndim != 1 or len(found) < 2 or not (np.diff(found) > 0.0).all():
        raise InputError(f"times of the setpoints is {shown(value)}; give two or more, rising [s].")
    return checks.frozen(found)


def _plain(value: Any) -> Any:
    return (
        value.tolist()
        if isinstance(value, np.ndarray)
        else getattr(value, "__qualname__", type(value).__qualname__)
    )
