"""Targets: feature points on a rigid body whose centroid follows a path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.paths import Path
from continuair.scenario.records import with_known_fields

_CHECKED, _MOST_CHECKED = 4001, 1_000_000
"""Times of a path that are checked within its duration, and at most in all."""

_NOTHING = 1e-9
"""Distance from one of them to the next that is none [m]."""

DISTANCE = 2.0
"""Distance Z_d at which the camera is to stay [m]: our choice, as the paper prints none."""

FROM_ABOVE = (1.0, 0.0, 0.0, 0.0)
"""Attitude of a camera at the tip of a straight arm under a level UAV: it looks down, its x along
the world's."""

_UNIT_NORM_TOLERANCE = 1e-3


@with_known_fields("a target", "give a path and fields by name")
@dataclass(frozen=True)
class Target(Immutable):
    """Feature points about the centroid (n, 3) [m, world axes], and the centroid's path.

    The desired image is what a camera with camera_attitude (4,), camera axes to world, x y z w,
    sees whose axis goes through the centroid, distance [m] before it: from straight above by
    default. (0, 0, 0, 1) is that from straight below. The design of gains takes it from `desired`
    and `depths`. Raises InputError.
    """

    path: Path
    points: Any = None
    distance: float = DISTANCE
    camera_attitude: Any = FROM_ABOVE

    def __post_init__(self) -> None:
        if not isinstance(self.path, Path):
            raise InputError(f"path is {shown(self.path)}; give one, such as paths.letter('M').")
        _check_motion(self.path, self.path.duration)
        points = square() if self.points is None else self.points
        rows = checks.finite_array(points)
        if rows is None or rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 3:
            raise InputError(
                f"points is {shown(points)}; give at least 3 points of 3 finite numbers [m]."
            )
        attitude = checks.vector("camera_attitude", self.camera_attitude, 4)
        norm = np.linalg.norm(attitude)
        if abs(norm - 1.0) > _UNIT_NORM_TOLERANCE:
            raise InputError(
                f"camera_attitude is {shown(self.camera_attitude)}, of norm {norm:.4g}; give a "
                "unit quaternion x y z w."
            )
        object.__setattr__(self, "camera_attitude", checks.frozen(attitude / norm))
        nearest = 0.0 - (rows @ self._camera_axes)[:, 2].min()
        if not checks.is_number(self.distance) or not nearest < self.distance:
            raise InputError(
                f"distance is {shown(self.distance)}; give one [m] that leaves all points of the "
                f"target before the camera (above {nearest:g})."
            )
        object.__setattr__(self, "points", checks.frozen(rows))
        object.__setattr__(self, "distance", float(self.distance))

    @property
    def _camera_axes(self) -> np.ndarray:
        """Axes (3, 3) of the camera of the desired image in the world, as columns."""
        return np.asarray(Rotation.from_quat(self.camera_attitude).as_matrix())

    @property
    def camera_axis(self) -> np.ndarray:
        """The direction (3,) in which the camera of the desired image looks, world axes."""
        return self._camera_axes[:, 2]

    @property
    def desired(self) -> np.ndarray:
        """The desired image (2n,), normalised."""
        seen = self.points @ self._camera_axes + [0.0, 0.0, self.distance]
        return (seen[:, :2] / seen[:, 2:]).ravel()

    @property
    def depths(self) -> np.ndarray:
        """How far off each point is along the camera's axis in the desired image (n,) [m]."""
        return np.asarray((self.points @ self._camera_axes)[:, 2] + self.distance)

    def check_until(self, end: float) -> None:
        """Raise InputError unless the path, where it is followed beyond its duration until that
        time [s], moves there as within."""
        if end > self.path.duration:
            _check_motion(self.path, end)

    def describe(self) -> dict[str, Any]:
        """The target as JSON can hold it."""
        return {
            "path": self.path.name,
            "duration": self.path.duration,
            "points": self.points.tolist(),
            "distance": self.distance,
            "camera_attitude": self.camera_attitude.tolist(),
        }


def _check_motion(path: Path, end: float) -> None:
    """Raise InputError unless the path moves on until then without jumps, as fast as it says."""
    count = int(min(_CHECKED * max(end / path.duration, 1.0), _MOST_CHECKED))
    at, nothing = _jump(path, end, count, _NOTHING), _NOTHING
    # Samples that are too far apart for its turns look like jumps, which finer ones do not mend.
    while at is not None and count < _MOST_CHECKED:
        count, nothing = min(8 * count, _MOST_CHECKED), nothing / 8
        at = _jump(path, end, count, nothing)
    if at is not None:
        raise InputError(
            f"path {path.name} jumps, or its velocity is not its position's, near t = {at:.3g} s; "
            "give a path with a bounded acceleration."
        )


def _jump(path: Path, end: float, count: int, nothing: float) -> float | None:
    """When [s] a path moves on farthest from where it says, if that is far, by count samples.

    nothing: a distance that is none [m]. Raises InputError for what no path returns.
    """
    times = np.linspace(0.0, end, count)
    try:
        position, velocity, acceleration = (np.asarray(a, float) for a in path(times))
        shapes = {position.shape, velocity.shape, acceleration.shape}
    except (TypeError, ValueError):
        shapes = set()
    if shapes != {(count, 3)}:
        raise InputError(
            f"path {path.name} does not return three arrays (n, 3) for n times; let its motion "
            "return position, velocity and acceleration."
        )
    if not np.isfinite([position, velocity, acceleration]).all():
        raise InputError(f"path {path.name} is not finite; correct its motion.")
    again = checks.asked_again(count)
    checks.repeats(f"path {path.name}", position[again], np.asarray(path(times[again])[0], float))
    moved = np.diff(position, axis=0)
    meant = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(times)[:, None]
    off = np.linalg.norm(moved - meant, axis=1)
    rounding = nothing + 1e-12 * np.abs(position).max()
    far = off.max() > rounding + 1e-2 * np.linalg.norm(moved, axis=1).max()
    return float(times[int(np.argmax(off))]) if far else None


def square(side: float = 0.5) -> np.ndarray:
    """Corners (4, 3) of a horizontal square about its centre, side [m]. Raises InputError.

    >>> ca.square(2.0).tolist()
    [[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]]
    """
    half = checks.positive("side", side, " [m]") / 2
    return np.array([[half, half, 0], [-half, half, 0], [-half, -half, 0], [half, -half, 0.0]])
