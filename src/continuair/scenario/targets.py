"""Targets: feature points on a rigid body whose centroid follows a path."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.paths import Path
from continuair.scenario.records import with_known_fields
from continuair.typing import Array, ArrayLike

_CHECKED, _MOST_CHECKED = 4001, 1_000_000
"""Samples of a path within its duration at which it is checked, and where it is refined."""

_PARTS = 8
"""Parts of an interval that is refined."""

_NOTHING = 1e-9
"""Distance between successive samples that counts as zero [m]."""

DISTANCE = 2.0
"""Desired distance Z_d of the camera [m]: our choice, as the paper does not give one."""

FROM_ABOVE = (1.0, 0.0, 0.0, 0.0)
"""Attitude of a camera that points down from a straight arm under a level UAV."""

_UNIT_NORM_TOLERANCE = 1e-3


def square(side: float = 0.5) -> Array:
    """Return the corners of a horizontal square about its centre.

    Parameters
    ----------
    side : float, optional
        Side [m].

    Returns
    -------
    ndarray, shape (4, 3)
        Corners in world axes [m].

    Raises
    ------
    InputError
        If `side` is not above 0.

    Examples
    --------
    >>> ca.square(2.0).tolist()
    [[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]]
    """
    half = checks.positive("side", side, " [m]") / 2
    return np.array([[half, half, 0], [-half, half, 0], [-half, -half, 0], [half, -half, 0.0]])


@with_known_fields("a target", "give a path and fields by name")
@dataclass(frozen=True)
class Target(Immutable):
    """Feature points of a rigid body whose centroid follows a path.

    Parameters
    ----------
    path : Path
        Path of the centroid, such as ``ca.paths.letter("M")``.
    points : array_like, shape (n, 3), optional
        Three or more feature points relative to the centroid, in world axes [m]. Default: `square`.
    distance : float, optional
        Desired distance of the camera from the centroid, along its optical axis [m].
    camera_attitude : array_like, shape (4,), optional
        Attitude of the camera of the desired image: unit quaternion x y z w from camera axes to
        world axes. Default: straight down. (0, 0, 0, 1) looks straight up.

    Raises
    ------
    InputError
        If a field cannot be used, or the path jumps.
    """

    path: Path
    points: ArrayLike = field(default_factory=square)
    distance: float = DISTANCE
    camera_attitude: ArrayLike = FROM_ABOVE

    def __post_init__(self) -> None:
        if not isinstance(self.path, Path):
            raise InputError(
                "path", f"is {shown(self.path)}", "give one, such as paths.letter('M')"
            )
        _check_motion(self.path, self.path.duration)
        rows = checks.finite_array(self.points)
        if rows is None or rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 3:
            raise InputError(
                "points",
                f"is {shown(self.points)}",
                "give at least 3 points of 3 finite numbers [m]",
            )
        attitude = checks.vector("camera_attitude", self.camera_attitude, 4)
        norm = np.linalg.norm(attitude)
        if abs(norm - 1.0) > _UNIT_NORM_TOLERANCE:
            raise InputError(
                "camera_attitude",
                f"is {shown(self.camera_attitude)}, of norm {norm:.4g}",
                "give a unit quaternion x y z w",
            )
        object.__setattr__(self, "camera_attitude", checks.frozen(attitude / norm))
        nearest = 0.0 - (rows @ self._camera_axes)[:, 2].min()
        if not checks.is_number(self.distance) or not nearest < self.distance:
            raise InputError(
                "distance",
                f"is {shown(self.distance)}",
                (
                    f"give a number above {nearest:g} [m], so that all points lie in front "
                    "of the camera"
                ),
            )
        object.__setattr__(self, "points", checks.frozen(rows))
        object.__setattr__(self, "distance", float(self.distance))

    @property
    def _camera_axes(self) -> Array:
        """Axes (3, 3) of the camera of the desired image in the world, as columns."""
        return np.asarray(Rotation.from_quat(self.camera_attitude).as_matrix())

    @property
    def camera_axis(self) -> Array:
        """Optical axis (3,) of the camera of the desired image, in world axes."""
        return np.asarray(self._camera_axes[:, 2])

    @property
    def desired(self) -> Array:
        """Desired image (2n,) in normalised coordinates."""
        seen = np.asarray(self.points) @ self._camera_axes + [0.0, 0.0, self.distance]
        return np.asarray(seen[:, :2] / seen[:, 2:]).ravel()

    @property
    def depths(self) -> Array:
        """Depths of the points along the camera's axis in the desired image (n,) [m]."""
        return np.asarray((np.asarray(self.points) @ self._camera_axes)[:, 2] + self.distance)

    def check_until(self, end: float) -> None:
        """Check the path beyond its duration.

        Parameters
        ----------
        end : float
            Time until which the path is followed [s].

        Raises
        ------
        InputError
            If the path jumps, or its velocity is not the derivative of its position.
        """
        if end > self.path.duration:
            _check_motion(self.path, end)

    def describe(self) -> dict[str, object]:
        """Return the target's fields for JSON.

        Returns
        -------
        dict
            Name and duration of the path, points, distance and camera_attitude.
        """
        return {
            "path": self.path.name,
            "duration": self.path.duration,
            "points": np.asarray(self.points).tolist(),
            "distance": self.distance,
            "camera_attitude": np.asarray(self.camera_attitude).tolist(),
        }


def _check_motion(path: Path, end: float) -> None:
    """Raise InputError unless a path is free of jumps until `end`, with a consistent velocity.

    Coarse samples of tight turns look like jumps. Intervals whose positions and velocity disagree
    are divided, which removes these, but not true jumps.
    """
    count = int(min(_CHECKED * max(end / path.duration, 1.0), _MOST_CHECKED))
    starts, parts, width = np.zeros(1), count - 1, end / (count - 1)
    nothing, fastest = _NOTHING, 0.0
    while True:
        times = np.minimum(starts[:, None] + width * np.arange(parts + 1), end)
        off, moved, largest = _disagreement(path, times)
        rounding = nothing + 1e-12 * largest
        far = off > rounding + 1e-2 * max(moved.max(), width * fastest)
        if not far.any():
            return
        if width <= end / _MOST_CHECKED:
            at = times[:, :-1].flat[int(np.argmax(off))]
            raise InputError(
                "path",
                f"{path.name} jumps, or its velocity is not the derivative of its position, near "
                f"t = {at:.3g} s",
                "give a path with bounded acceleration",
            )
        fastest = max(fastest, np.max(moved[~far], initial=0.0) / width)
        starts, parts = times[:, :-1][far], _PARTS
        width, nothing = width / parts, nothing / parts


def _disagreement(path: Path, times: Array) -> tuple[Array, Array, float]:
    """Return by how much positions and velocity of a path disagree, and how far it moves.

    times: (m, k) [s], in rows that rise. Returns two arrays (m, k - 1) of distances [m], and the
    largest coordinate [m]. Raises InputError if the path does not return finite arrays of the right
    shape.
    """
    flat = times.ravel()
    try:
        position, velocity, acceleration = (np.asarray(a, float) for a in path(flat))
        shapes = {position.shape, velocity.shape, acceleration.shape}
    except (TypeError, ValueError):
        shapes = set()
    if shapes != {(flat.size, 3)}:
        raise InputError(
            "path",
            f"{path.name} does not return three arrays (n, 3) for n times",
            "return position, velocity and acceleration",
        )
    if not np.isfinite([position, velocity, acceleration]).all():
        raise InputError("path", f"{path.name} is not finite", "correct its motion")
    again = checks.asked_again(flat.size)
    checks.repeats(f"path {path.name}", position[again], np.asarray(path(flat[again])[0], float))
    position, velocity = (each.reshape(*times.shape, 3) for each in (position, velocity))
    moved = np.diff(position, axis=1)
    meant = 0.5 * (velocity[:, 1:] + velocity[:, :-1]) * np.diff(times)[..., None]
    off = np.linalg.norm(moved - meant, axis=2)
    return off, np.linalg.norm(moved, axis=2), float(np.abs(position).max())
