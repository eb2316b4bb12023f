"""Meshes of simple bodies: vertices, normals (n, 3) and triangles (m, 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Mesh:
    """Corners of triangles run counter-clockwise as seen from outside."""

    vertices: Array
    normals: Array
    triangles: Array


def cube() -> Mesh:
    """From -1 to 1 along each axis."""
    vertices: list[Array] = []
    normals: list[Array] = []
    triangles: list[list[int]] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v, w = (np.roll(np.eye(3), -axis, axis=0)[i] for i in (1, 2, 0))
            corners = [sign * w + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            first, order = 4 * len(normals), ((0, 1, 2), (0, 2, 3))
            vertices += corners
            normals.append(sign * w)
            triangles += [[first + i for i in (face if sign > 0 else face[::-1])] for face in order]
    return Mesh(np.array(vertices), np.repeat(normals, 4, axis=0), np.array(triangles))


def tube(heights: Array, radii: Array, sides: int = 16) -> Mesh:
    """Rings (n,) along z, the highest first, closed at both ends; the last 2 sides vertices are
    those of the ends, the first one first."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(sides)])
    rings = np.asarray(radii)[:, None, None] * circle
    rings[..., 2] += np.asarray(heights)[:, None]
    around, n = np.arange(sides), len(rings)
    nxt = (around + 1) % sides
    walls = [
        np.column_stack([a, a + sides, b, b, a + sides, b + sides]).reshape(-1, 3)
        for ring in range(n - 1)
        for a, b in [(ring * sides + around, ring * sides + nxt)]
    ]
    first, last = n * sides, (n + 1) * sides
    fan = np.column_stack([np.zeros(sides - 2, int), around[1:-1], around[2:]])
    up = np.tile([0.0, 0.0, 1.0], (sides, 1))
    return Mesh(
        np.concatenate([rings.reshape(-1, 3), rings[0], rings[-1]]),
        np.concatenate([np.tile(circle, (n, 1)), up, -up]),
        np.concatenate([*walls, first + fan, last + fan[:, ::-1]]),
    )
