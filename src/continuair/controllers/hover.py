"""The hovering vehicle as a linear system, gravity and flexible arms included."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from continuair.equations.kinematics import skew
from continuair.equations.level import level_height, level_inertia
from continuair.sections import of_coordinates, of_pairs
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_UP = np.array([0.0, 0.0, 1.0])

_TURN = 0.05
"""Bend times length [rad] over which slopes of the arms' weight are taken."""

_SMALL_TURN = 1e-3
"""Bend times length [rad] over which its slope is taken."""

_MOST_TRIES, _AT_REST, _LONGEST_STEP = 60, 1e-5, 0.3
"""Of the search for rest: steps, and the bend times length [rad] of the step that is left there,
and of any step at most."""


@dataclass(frozen=True, eq=False)
class Hover:
    """A vehicle that hovers level with straight arms, or with arms that are held bent.

    mass [kg]; inertia (3, 3) about the common centre of mass; moment (3,): mass times the centre of
    mass, body axes [kg m]. M (6 + bends, 6 + bends): of velocity, angular velocity and bend rates,
    about B. stiffness, damping (bends,): of the arms. weight (bends, bends): contribution of their
    weight to the stiffness. A (12 + 2 bends, …): of position, small rotations, bends, and the rates
    of all of them. B (…, 4 + bends): of thrust, moment and bend moments, with the side forces that
    tilted rotors produce with them.
    """

    mass: float
    gravity: float
    inertia: Array
    moment: Array
    M: Array
    stiffness: Array
    damping: Array
    weight: Array
    A: Array
    B: Array

    @property
    def bends(self) -> int:
        """The number of bend coordinates."""
        return len(self.stiffness)

    @property
    def free_bends(self) -> Array:
        """Inertia (bends, bends) of the bends while the vehicle reacts freely [kg m⁴]."""
        coupled = self.M[6:, :6]
        return self.M[6:, 6:] - coupled @ np.linalg.solve(self.M[:6, :6], coupled.T)


# Many controllers are made for one vehicle.
@lru_cache(maxsize=64)
def hover(vehicle: Vehicle, gravity: float, bend: tuple[float, ...] | None = None) -> Hover:
    """Return the linear system of a vehicle of one run.

    Its arms are held at bends, the coordinates of all sections, straight by default.
    """
    held = np.zeros(vehicle.layout.bends) if bend is None else np.array(bend)
    M = level_inertia(vehicle, held)
    n, mass = len(M) - 6, float(M[0, 0])
    off = -M[:3, 3:6]
    H = np.array([off[2, 1], off[0, 2], off[1, 0]])
    stiffness, damping = of_pairs(vehicle, "stiffness")[0], of_pairs(vehicle, "damping")[0]
    weight = gravity * _height_slopes(vehicle, held)
    K = np.zeros((6 + n, 6 + n))
    # A bend moves the centre of mass by F b, on which the thrust turns the vehicle.
    K[3:6, 6:] = -gravity * skew(_UP) @ M[:3, 6:]
    K[6:, 6:] = stiffness + weight
    D = np.zeros((6 + n, 6 + n))
    D[6:, 6:] = damping
    pushed = np.zeros((6 + n, 4 + n))
    pushed[:2, :4], pushed[2, 0] = _sideways(vehicle), 1.0
    pushed[3:, 1:] = np.eye(3 + n)
    A, B = np.zeros((12 + 2 * n, 12 + 2 * n)), np.zeros((12 + 2 * n, 4 + n))
    A[: 6 + n, 6 + n :] = np.eye(6 + n)
    A[6 + n :, : 6 + n] = -np.linalg.solve(M, K)
    A[6 + n :, 6 + n :] = -np.linalg.solve(M, D)
    A[6 + n : 9 + n, 3:6] -= gravity * skew(_UP)
    B[6 + n :] = np.linalg.solve(M, pushed)
    inertia = M[3:6, 3:6] + skew(H) @ skew(H) / mass
    each = np.diag(stiffness), np.diag(damping)
    return Hover(mass, gravity, inertia, H, M, *each, weight, A, B)


def _sideways(vehicle: Vehicle) -> Array:
    """Return the side forces (2, 4) of the rotors per unit of thrust and of each moment.

    They are 0 for upright rotors, and for rotors that can produce any wrench without them.
    """
    rotors = vehicle.uav.rotors
    if rotors is None:
        return np.zeros((2, 4))
    return np.asarray(rotors.allocation[:2] @ rotors.thrusts_for(np.eye(6)[2:]).T)


def resting(vehicle: Vehicle, gravity: float, free: Array) -> tuple[float, ...]:
    """Return bends (bends,) at which free sections rest under their weight.

    The others are held straight. All are straight if no stable equilibrium is found.
    """
    stiffness, moving = of_pairs(vehicle, "stiffness")[0], vehicle.layout.per_coordinate(free)
    lengths = 1.0 / of_coordinates(vehicle, "natural")[0]
    bend = np.zeros(len(lengths))
    for _ in range(_MOST_TRIES if free.any() else 0):
        pull = stiffness @ bend + gravity * _height_slope(vehicle, bend)
        stiff = stiffness + gravity * _height_slopes(vehicle, bend)
        curvatures, axes = np.linalg.eigh(stiff[np.ix_(moving, moving)])
        # Downhill where the weight overcomes the stiffness, too.
        along = axes.T @ pull[moving] / np.maximum(np.abs(curvatures), 1e-9 * stiffness.max())
        step = np.zeros(len(bend))
        step[moving] = -axes @ along
        longest = float(np.abs(step * lengths).max())
        if longest <= _AT_REST:
            stable = curvatures[0] > 0.0 and np.abs(bend * lengths).max() < 2.0 * np.pi
            return tuple(bend) if stable else (0.0,) * len(bend)
        bend = bend + step / max(1.0, longest / _LONGEST_STEP)
    return (0.0,) * len(bend)


def _height_slope(vehicle: Vehicle, bend: Array) -> Array:
    """Return the first derivatives (bends,) of Σ m z by the coordinates, at bends (bends,)."""
    steps = np.diag(_SMALL_TURN * of_coordinates(vehicle, "natural")[0])
    above, below = np.split(level_height(vehicle, np.vstack([bend + steps, bend - steps])), 2)
    return np.asarray((above - below) / (2.0 * np.diag(steps)))


def _height_slopes(vehicle: Vehicle, bend: Array) -> Array:
    """Return second derivatives (bends, bends) of Σ m z by the coordinates, at bends (bends,)."""
    steps = np.diag(_TURN * of_coordinates(vehicle, "natural")[0])
    one, two = steps[:, None], steps[None]
    corners = np.stack([one + two, -one - two, one - two, two - one])
    height = level_height(vehicle, bend + corners)
    sizes = np.diag(steps)
    twice = height[0] + height[1] - height[2] - height[3]
    return np.asarray(twice / (4.0 * np.outer(sizes, sizes)))
