"""Meshes of simple bodies: vertices, normals (n, 3) and triangles (m, 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Mesh:
    """Vertices and triangles, counter-clockwise as seen from outside."""

    vertices: Array
    normals: Array
    triangles: Array


def cube() -> Mesh:
    """Return a cube from -1 to 1 along each axis."""
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
    """Return a tube of rings (n,) along z, the highest first, open at both ends."""
    circle = _circle(sides)
    rings = np.asarray(radii)[:, None, None] * circle
    rings[..., 2] += np.asarray(heights)[:, None]
    around, n = np.arange(sides), len(rings)
    nxt = (around + 1) % sides
    walls = [
        np.column_stack([a, a + sides, b, b, a + sides, b + sides]).reshape(-1, 3)
        for ring in range(n - 1)
        for a, b in [(ring * sides + around, ring * sides + nxt)]
    ]
    return Mesh(rings.reshape(-1, 3), np.tile(circle, (n, 1)), np.concatenate(walls))


def closed(open_tube: Mesh, sides: int = 16) -> Mesh:
    """Return a tube with both its ends; their vertices are the last 2 sides, in order."""
    vertices, around = open_tube.vertices, np.arange(sides)
    first = len(vertices) + np.column_stack([np.zeros(sides - 2, int), around[1:-1], around[2:]])
    up = np.tile([0.0, 0.0, 1.0], (sides, 1))
    return Mesh(
        np.concatenate([vertices, vertices[:sides], vertices[-sides:]]),
        np.concatenate([open_tube.normals, up, -up]),
        np.concatenate([open_tube.triangles, first, sides + first[:, ::-1]]),
    )


def ring(inner: float, sides: int) -> Mesh:
    """Return the area between two circles in the plane z = 0, the outer of radius 1, facing up."""
    outside, here = _circle(sides), np.arange(sides)
    there = (here + 1) % sides
    faces = [[here, sides + here, sides + there], [here, sides + there, there]]
    return Mesh(
        np.vstack([inner * outside, outside]),
        np.tile([0.0, 0.0, 1.0], (2 * sides, 1)),
        np.concatenate([np.column_stack(each) for each in faces]),
    )


def _circle(sides: int) -> Array:
    angles = 2.0 * np.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(sides)])
