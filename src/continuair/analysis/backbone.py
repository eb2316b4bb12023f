"""Points and frames along an arm's backbone, from the coordinates of its sections."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.equations.arc import arc_rotation
from continuair.equations.strain import rod_curve, strain_of
from continuair.equations.turns import of_quaternion
from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

TIP = np.diag([1.0, -1.0, -1.0])
"""Axes of a tip frame, whose z points out of the arm, relative to those of its section's end."""

_STRIPS = 32
"""Strips of a section over which a bend that varies is summed."""

HALF_TURN = (1.0, 0.0, 0.0, 0.0)
"""`TIP` as a quaternion x y z w."""


def parts(vehicle: Vehicle, bend: Array) -> list[tuple[ArmChain, Array]]:
    """Return each arm with its own coordinates (..., coordinates of the arm), of (..., bends)."""
    own = [bend[..., of_arm] for of_arm in vehicle.layout.of_arm]
    return list(zip(vehicle.arms, own, strict=True))


def sections_of(arm: ArmChain, bend: Array) -> list[tuple[Section, Array]]:
    """Return each section of an arm with its own coordinates (..., coordinates)."""
    ends = np.cumsum([section.coordinates for section in arm.section])
    return list(zip(arm.section, np.split(bend, ends[:-1], axis=-1), strict=True))


def angle_of(section: Section, bend: Array) -> Array:
    """Return the angle (...) [rad] by which a section bends from end to end, ∫ κ ds; of an arc κ l.

    bend: its coordinates (..., coordinates).
    """
    if section.polar:
        return np.asarray(np.linalg.norm(bend, axis=-1) * section.length)
    shares = (np.arange(_STRIPS) + 0.5) / _STRIPS
    bends = [
        np.linalg.norm(strain_of(section.orders, bend, x)[0][..., :2], axis=-1) for x in shares
    ]
    return np.asarray(np.mean(bends, axis=0) * section.length)


def along(arm: ArmChain, bend: Array, points: int) -> tuple[Array, Array]:
    """Return points (..., points, 3) [m] and frames (..., points, 3, 3) along an arm, body axes.

    bend: (..., coordinates of the arm). Frames are untwisted section frames with the tangent along
    -z.
    """
    return along_at(arm, bend, stations(arm, points))


def along_at(
    arm: ArmChain, bend: Array, s: Array, pieces: int | None = None
) -> tuple[Array, Array]:
    """Return points and frames as `along`, at ascending arc lengths (points,) from the mount.

    pieces: of a section whose strain varies, as in `equations.strain.rod_curve`.
    """
    points = len(s)
    found = np.empty((*bend.shape[:-1], points, 3))
    frames = np.empty((*found.shape, 3))
    origin: Array = np.broadcast_to(np.asarray(arm.mount, float), (*bend.shape[:-1], 3))
    axes: Array = np.broadcast_to(of_quaternion(arm.attitude), (*origin.shape, 3))
    first, start = 0, 0.0
    for index, (section, own) in enumerate(sections_of(arm, bend)):
        last = index == len(arm.section) - 1
        stop = points if last else int(np.searchsorted(s, start + section.length))
        # The section's end, where the next one begins, is one more point.
        local = np.append(s[first:stop] - start, section.length)
        r, turn = curve(section, own, local, pieces)
        r, turn = origin[..., None, :] + _turned(axes, r), axes[..., None, :, :] @ turn
        found[..., first:stop, :] = r[..., :-1, :]
        frames[..., first:stop, :, :] = turn[..., :-1, :, :]
        origin, axes = r[..., -1, :], turn[..., -1, :, :]
        first, start = stop, start + section.length
    return found, frames


def curve(
    section: Section, bend: Array, s: Array, pieces: int | None = None
) -> tuple[Array, Array]:
    """Return points (..., n, 3) [m] and frames (..., n, 3, 3) at s, in axes of the base."""
    if section.polar:
        return arc(bend[..., None, :], s)
    return rod_curve(section.orders, section.length, bend, s, pieces)


def arc(bend: Array, s: Array | float) -> tuple[Array, Array]:
    """Return points (..., 3) [m] and untwisted frames (..., 3, 3) at s, in axes of the base.

    bend: bend vectors (..., 2) [1/m]; s: arc lengths [m].
    """
    kappa, psi = np.linalg.norm(bend, axis=-1), np.arctan2(bend[..., 1], bend[..., 0])
    return backbone_point(bend, s), arc_rotation(kappa, psi + 0.0 * s, s)


def backbone_point(bend: Array, s: Array | float) -> Array:
    """Return r(s) (..., 3) [m] for bend vectors (..., 2); Appendix A, Amiri et al.

    The sinc form has no singularity at bend 0.
    """
    angle = np.linalg.norm(bend, axis=-1) * s
    # np.sinc(x) is sin(pi x) / (pi x).
    across = 0.5 * s**2 * np.sinc(angle / (2 * np.pi)) ** 2
    down = s * np.sinc(angle / np.pi)
    return np.concatenate([bend * across[..., None], -down[..., None]], axis=-1)


def placed(position: Array, attitude: Array, points: Array) -> Array:
    """Return points (..., n, 3) of a body in the world; position (..., 3), attitude (..., 4)."""
    return np.asarray(position[..., None, :] + turned(attitude, points))


def turned(attitude: Array, vectors: Array) -> Array:
    """Return vectors (..., n, 3) rotated by an attitude (..., 4) x y z w, to world axes."""
    return _turned(of_quaternion(attitude), vectors)


def stations(arm: ArmChain, points: int) -> Array:
    """Return arc lengths (points,) [m], evenly spaced from an arm's mount to its tip."""
    return np.linspace(0.0, sum(section.length for section in arm.section), points)


def quaternions(frames: Array) -> Array:
    """Return quaternions (..., 4), x y z w, of axes (..., 3, 3)."""
    found = Rotation.from_matrix(frames.reshape(-1, 3, 3)).as_quat()
    return np.asarray(found).reshape(*frames.shape[:-2], 4)


def _turned(axes: Array, points: Array) -> Array:
    """Return vectors (..., n, 3) multiplied by axes (..., 3, 3)."""
    return np.asarray(np.einsum("...ij,...pj->...pi", axes, points))
