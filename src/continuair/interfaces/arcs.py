"""Frames along arms of constant curvature, without a singularity at bend 0; Eqs. (2) to (5)."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.arms import ArmChain
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def arc_frame(bend: Array, s: float) -> tuple[Array, Array]:
    """Where arc length s [m] is from the base, (..., 3) [m], and the untwisted axes there, (..., 4)
    x y z w; both in the axes of the base, of which the arm runs along -z. bend: (..., 2) [1/m]."""
    angle = s * np.linalg.norm(bend, axis=-1, keepdims=True)
    # np.sinc(x) is sin(πx) / (πx).
    half = np.sinc(angle / (2.0 * np.pi))
    point = np.concatenate([0.5 * s**2 * half**2 * bend, -s * np.sinc(angle / np.pi)], axis=-1)
    about = 0.5 * s * half * np.stack([bend[..., 1], -bend[..., 0]], axis=-1)
    turn = np.concatenate([about, np.zeros_like(angle), np.cos(0.5 * angle)], axis=-1)
    return point, turn


def backbone(vehicle: Vehicle, bend: Array, pieces: int = 16) -> list[tuple[Array, Array]]:
    """Of each arm the points along it, (n, sections times pieces + 1, 3) [m], and the attitude of
    its tip, z out of it, (n, 4) x y z w; both in body axes.

    bend: (n, sections, 2) [1/m], of all arms; pieces: how many a section is cut into.
    """
    found, first = [], 0
    for arm in vehicle.arms:
        found.append(_along(arm, bend[:, first : first + len(arm.section)], pieces))
        first += len(arm.section)
    return found


def _along(arm: ArmChain, bend: Array, pieces: int) -> tuple[Array, Array]:
    base, axes = np.asarray(arm.mount), Rotation.from_quat(arm.attitude)
    points = [np.broadcast_to(base, (len(bend), 3))]
    for index, section in enumerate(arm.section):
        for share in np.arange(1, pieces + 1) / pieces:
            at, turn = arc_frame(bend[:, index], share * section.length)
            points.append(base + axes.apply(at))
        base, axes = points[-1], axes * Rotation.from_quat(turn)
    out = axes * Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
    return np.stack(points, axis=1), out.as_quat()
