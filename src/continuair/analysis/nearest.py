"""Distances of points from obstacles."""

from __future__ import annotations

import numpy as np

from continuair.equations.turns import of_quaternion
from continuair.scenario.obstacles import Obstacle
from continuair.typing import Array


def nearest(obstacle: Obstacle, points: Array) -> tuple[Array, Array]:
    """Return distances from the surface and the directions out of the obstacle there.

    Parameters
    ----------
    obstacle : Obstacle
        The obstacle.
    points : ndarray, shape (..., 3)
        Points in world axes [m].

    Returns
    -------
    distance : ndarray, shape (...)
        Distance [m], negative inside.
    normal : ndarray, shape (..., 3)
        Unit vectors in world axes; of the nearest face inside a box or a cylinder.
    """
    placed = np.array(obstacle.placed())
    axes, sizes = of_quaternion(placed[3:7]), placed[7:]
    own = (points - placed[:3]) @ axes
    if obstacle.shape == "plane":
        distance, normal = own[..., 2], np.broadcast_to([0.0, 0.0, 1.0], own.shape)
    elif obstacle.shape == "sphere":
        far = np.linalg.norm(own, axis=-1)
        distance, normal = far - sizes[0], _scaled(own, far)
    elif obstacle.shape == "box":
        distance, normal = _beyond(np.abs(own) - sizes)
        normal = normal * np.where(own < 0.0, -1.0, 1.0)
    else:
        far = np.linalg.norm(own[..., :2], axis=-1)
        both = np.stack([far, np.abs(own[..., 2])], axis=-1)
        distance, across = _beyond(both - sizes[:2])
        up = across[..., 1:] * np.where(own[..., 2:] < 0.0, -1.0, 1.0)
        normal = np.concatenate([across[..., :1] * _scaled(own[..., :2], far), up], axis=-1)
    return distance, normal @ axes.T


def _scaled(vectors: Array, sizes: Array) -> Array:
    """Return vectors (..., n) of length 1, or of 0."""
    return np.asarray(vectors / np.where(sizes > 0.0, sizes, 1.0)[..., None])


def _beyond(faces: Array) -> tuple[Array, Array]:
    """Return distance and direction (..., n) of points at distances (..., n) from faces."""
    outside = np.maximum(faces, 0.0)
    far = np.linalg.norm(outside, axis=-1)
    within = np.eye(faces.shape[-1])[np.argmax(faces, axis=-1)]
    normal = np.where((far > 0.0)[..., None], _scaled(outside, far), within)
    return far + np.minimum(faces.max(axis=-1), 0.0), normal
