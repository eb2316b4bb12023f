"""Forces that a motion needs, by Newton and Euler: positions of slices along a path in time.

Frames of a section solve R' = R κ̂ and p' = R ε at Chebyshev points; a motion q(t) is differentiated
in time and along each coordinate by central differences of the eighth and sixth order. Nothing is
shared with the package but the description of the strain.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.polynomial import chebyshev, legendre
from scipy.spatial.transform import Rotation

POINTS = 26
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])


def hat(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


Body = tuple[float, np.ndarray, np.ndarray, np.ndarray]
"""Mass, inertia in own axes, place and axes in the world."""


@dataclass
class Rod:
    """A section: orders of bend x, bend y, twist, stretch, shear x, shear y; None if left out.

    bodies: place over the length, mass, transverse and axial inertia of each slice or disk.
    """

    length: float
    orders: tuple[int | None, ...]
    bodies: Sequence[tuple[float, float, float, float]]
    stiffness: tuple[float, ...]

    @property
    def coordinates(self) -> list[tuple[int, int]]:
        return [(c, p) for c, order in enumerate(self.orders) if order is not None
                for p in range(order + 1)]  # fmt: skip

    def strain(self, x: float, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = np.zeros(6)
        for (c, p), value in zip(self.coordinates, q, strict=True):
            found[c] += value * legendre.Legendre.basis(p)(2 * x - 1)
        b_x, b_y, twist, stretch, shear_x, shear_y = found
        return np.array([b_y, -b_x, -twist]), np.array([shear_x, shear_y, -1 - stretch])

    def frames(self, q: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Axes and places of all bodies, and of the tip, from the base."""
        y = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        # Of values at the points to the integral from -1.
        to_series = np.linalg.inv(chebyshev.chebvander(y, POINTS - 1))
        integral = chebyshev.chebint(to_series, lbnd=-1, axis=0)
        at_points = chebyshev.chebvander(y, POINTS) @ integral * self.length / 2
        strains = [self.strain((1 + each) / 2, q) for each in y]
        # Rows r of R: r(y) = r(-1) + ∫ r κ̂.
        system = np.eye(3 * POINTS)
        for k, (kappa, _) in enumerate(strains):
            for i in range(POINTS):
                system[3 * i : 3 * i + 3, 3 * k : 3 * k + 3] -= at_points[i, k] * hat(kappa).T
        rows = np.linalg.solve(system, np.tile(np.eye(3), (POINTS, 1)))
        R = rows.reshape(POINTS, 3, 3).transpose(0, 2, 1)
        rate = np.array([r @ hat(kappa) for r, (kappa, _) in zip(R, strains, strict=True)])
        sped = np.array([r @ epsilon for r, (_, epsilon) in zip(R, strains, strict=True)])
        at = np.array([2 * body[0] - 1 for body in self.bodies] + [1.0])
        to = chebyshev.chebvander(at, POINTS) @ integral * self.length / 2
        axes = np.eye(3) + np.tensordot(to, rate, 1)
        return list(axes), list(to @ sped)


@dataclass
class Flyer:
    """A UAV with an arm. state: place, turning vector of the attitude, and coordinates."""

    mass: float
    inertia: np.ndarray
    mount: np.ndarray
    rods: Sequence[Rod]
    tip: tuple[float, np.ndarray, np.ndarray] = (0.0, np.zeros(3), np.zeros((3, 3)))

    def bodies(self, state: np.ndarray, attitude: np.ndarray) -> list[Body]:
        """Mass, inertia in own axes, place and axes in the world of each body; last, the tip."""
        place, turn = state[:3], Rotation.from_rotvec(state[3:6]).as_matrix()
        R, first = attitude @ turn, 6
        found = [(self.mass, self.inertia, place, R)]
        p = place + R @ self.mount
        for rod in self.rods:
            count = len(rod.coordinates)
            axes, places = rod.frames(state[first : first + count])
            for (_, mass, across, along), own, at in zip(rod.bodies, axes, places, strict=False):
                inertia = np.diag([across, across, along])
                found.append((mass, inertia, p + R @ at, R @ own))
            p, R, first = p + R @ places[-1], R @ axes[-1], first + count
        mass, centre, inertia = self.tip
        found.append((mass, inertia, p + R @ centre, R))
        found.append((0.0, np.zeros((3, 3)), p, R))
        return found


def moved_along(state: np.ndarray, direction: np.ndarray, t: float) -> np.ndarray:
    return state + t * direction


def needed_forces(
    flyer: Flyer, attitude: np.ndarray, rates: np.ndarray, accelerations: np.ndarray,
    q: np.ndarray, wrench: np.ndarray, gravity: float,
) -> np.ndarray:  # fmt: skip
    """Return the generalised forces on (B in world axes, turning in body axes, coordinates).

    rates: velocity, turning vector's rate and q̇; accelerations: their rates, at t = 0.
    """

    def along(t: float) -> np.ndarray:
        return np.concatenate([np.zeros(6), q]) + t * rates + t * t / 2 * accelerations

    def sampled(path: Callable[[float], np.ndarray], step: float) -> list[list[Body]]:
        return [flyer.bodies(path(k * step), attitude) for k in range(-4, 5)]

    # Steps in time over which the coordinates change little.
    h, d = 0.03 / np.sqrt(np.abs(accelerations).max()), 0.02
    motion = sampled(along, h)
    still = flyer.bodies(along(0.0), attitude)
    virtual = []
    for one in np.eye(6 + len(q)):
        virtual.append(sampled(partial(moved_along, along(0.0), one), d))
    found = np.zeros(6 + len(q))
    for index, (mass, inertia, _, R) in enumerate(still):
        places = np.array([each[index][2] for each in motion])
        axes = np.array([each[index][3] for each in motion])
        a = np.tensordot(SECOND, places, 1) / h**2
        spins = np.tensordot(FIRST, axes, 1) / h @ R.T
        spin = np.array([spins[2, 1], spins[0, 2], spins[1, 0]])
        curl = np.tensordot(SECOND, axes, 1) / h**2 @ R.T
        skew = (curl - curl.T) / 2
        alpha = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        inertia = R @ inertia @ R.T
        force = mass * (a + np.array([0, 0, gravity]))
        moment = inertia @ alpha + np.cross(spin, inertia @ spin)
        if index == len(still) - 1:
            force, moment = -wrench[:3], -wrench[3:]
        for j, moved in enumerate(virtual):
            dp = np.tensordot(FIRST, np.array([each[index][2] for each in moved]), 1) / d
            dR = np.tensordot(FIRST, np.array([each[index][3] for each in moved]), 1) / d @ R.T
            found[j] += force @ dp + moment @ np.array([dR[2, 1], dR[0, 2], dR[1, 0]])
    return found
