"""V̇ of the paper's proof at one state, with the law substituted and no term dropped.

All of G is cancelled and the arm has no damping; J_L = L J_c, where the paper prints T_a⁻¹ for the
rotation into camera axes. The target may move.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import Vehicle
from continuair.equations import (
    camera_jacobian,
    camera_pose,
    coriolis_matrix,
    interaction_matrix,
    look,
    mass_matrix,
)

Array = np.ndarray

_APART = 1e-6
"""Seconds between the two J_L that give its rate: their error is 1e-9 of it at 1 rad/s."""

_STEP = 1e-3
"""Seconds between the samples of a five-point slope: its error is 1e-9 of motions of 1 1/s."""


@dataclass(frozen=True)
class Target:
    """v_t, v̇_t and v̈_t (6,): the target's twist at the camera's origin and its rates.

    In camera axes; m/s and rad/s, per s and per s². The rates are of the components.
    """

    twist: Array
    rate: Array
    second: Array


REST = Target(np.zeros(6), np.zeros(6), np.zeros(6))
"""A target at rest."""


@dataclass(frozen=True)
class State:
    """Quantities of a state in V̇, for any gains: e (2n,), J_L, L and their rates, M and C q̇.

    qd: (8,), the rates of the paper's coordinates.
    """

    qd: Array
    e: Array
    J: Array
    J_rate: Array
    L: Array
    L_rate: Array
    M: Array
    coriolis: Array
    target: Target


@dataclass(frozen=True)
class Motion:
    """V [J], V̇ [W], q̈ (8,), v_c = J_L q̇, ė and e_a (2n,) of a state under a set of gains."""

    V: float
    V_rate: float
    qdd: Array
    v_c: Array
    e_dot: Array
    e_a: Array


def state(
    vehicle: Vehicle, q: Array, qd: Array, points: Array, desired: Array, target: Target = REST
) -> State:
    """Return the state of a vehicle before points (n, 3) in the world [m]; desired: s_d (2n,)."""
    at, axes = camera_pose(vehicle, q)
    seen = (points - at) @ axes
    moving = (target.twist[:3] + np.cross(target.twist[3:], seen)) @ axes.T

    def slopes(time: float) -> tuple[Array, Array]:
        then = q + time * qd
        L = interaction_matrix(*look(vehicle, then, points + time * moving))
        return L, L @ camera_jacobian(vehicle, then)

    L, J = slopes(0.0)
    ahead, behind = slopes(_APART), slopes(-_APART)
    L_rate, J_rate = ((a - b) / (2.0 * _APART) for a, b in zip(ahead, behind, strict=True))
    e = desired - look(vehicle, q, points)[0]
    M, coriolis = mass_matrix(vehicle, q), coriolis_matrix(vehicle, q, qd) @ qd
    return State(qd, e, J, J_rate, L, L_rate, M, coriolis, target)


def motion(at: State, gains: dict[str, Any]) -> Motion:
    """Return V of Eq. (18) and its rate under Eqs. (10), (15) and (16), from q̈ and ë."""
    Kp, Kd, Cp, Cd, Cs = (gains[name] for name in ("Kp", "Kd", "Cp", "Cd", "Cs"))
    σ = float(gains["sigma"])
    v_c = at.J @ at.qd
    e_dot = at.L @ at.target.twist - v_c
    e_a = Cd @ e_dot + Cp @ at.e + Cs @ np.tanh(at.e / σ)
    push = at.J.T @ (Kp @ e_a - Kd @ v_c)
    qdd = np.linalg.solve(at.M, push - at.coriolis)
    of_target = at.L_rate @ at.target.twist + at.L @ at.target.rate
    e_dotdot = of_target - at.J @ qdd - at.J_rate @ at.qd
    e_a_rate = Cd @ e_dotdot + slope_of_e_a(at, gains) @ e_dot
    kinetic = 0.5 * at.qd @ at.M @ at.qd
    # Ṁ - 2C is skew, so that the kinetic energy grows by the power of the actuators.
    rate = at.qd @ push + e_a @ Kp @ e_a_rate
    return Motion(float(kinetic + 0.5 * e_a @ Kp @ e_a), float(rate), qdd, v_c, e_dot, e_a)


def slope_of_e_a(at: State, gains: dict[str, Any]) -> Array:
    """Return C_p + C_s D/σ (2n, 2n), the slope of e_a by e."""
    sech = 1.0 / np.cosh(at.e / gains["sigma"]) ** 2
    return np.asarray(gains["Cp"] + gains["Cs"] * sech / gains["sigma"])


def r_printed(at: State, gains: dict[str, Any]) -> Array:
    """Return r (2n,) as printed: C_d v̈_t + (C_p + C_s D/σ) v̇_t, for 2n = 6 only."""
    slope = slope_of_e_a(at, gains)
    return np.asarray(gains["Cd"] @ at.target.second + slope @ at.target.rate)


def r_corrected(at: State, gains: dict[str, Any]) -> Array:
    """Return the target's part of ė_a (2n,): C_d (L v̇_t + L̇ v_t) + (C_p + C_s D/σ) L v_t."""
    accelerating = at.L @ at.target.rate + at.L_rate @ at.target.twist
    slope = slope_of_e_a(at, gains)
    return np.asarray(gains["Cd"] @ accelerating + slope @ at.L @ at.target.twist)


def largest_lambda(of: Motion, gains: dict[str, Any], r: Array | None = None) -> float:
    """Return the largest λ for which Eq. (19) holds in a motion; not above 0 if none does.

    r: the vector (2n,) of δ = ‖K_p‖² ‖r‖²/(2λ); none for δ = 0. A smaller λ does then, too, as the
    right side of Eq. (19) falls with λ.
    """
    excess = of.V_rate + 0.5 * of.v_c @ gains["Kd"] @ of.v_c
    size = of.e_a @ of.e_a
    b = 0.0 if r is None else 0.5 * float(np.linalg.norm(gains["Kp"], 2) ** 2 * (r @ r))
    if b == 0.0:
        return float(-excess / size)
    # λ² ‖e_a‖² + λ excess - b = 0, in a form that loses no digits for a large excess.
    root = np.sqrt(excess**2 + 4.0 * size * b)
    return float(2.0 * b / (excess + root) if excess > 0.0 else (root - excess) / (2.0 * size))


def sound_rate(at: State, of: Motion, gains: dict[str, Any]) -> float:
    """Return the rate [W] of ½ q̇ᵀM q̇ + ½ eᵀK_pC_p e + Σ (K_pC_s)_ii σ ln cosh(e_i/σ).

    For K_pC_p symmetric and K_pC_s diagonal. It is the power of the actuators and the derivative of
    the potential, with q̈ of the motion.
    """
    kinetic = at.qd @ (at.M @ of.qdd + at.coriolis)
    force = gains["Cp"] @ at.e + gains["Cs"] @ np.tanh(at.e / gains["sigma"])
    return float(kinetic + of.e_dot @ gains["Kp"] @ force)


@dataclass(frozen=True)
class Course:
    """A smooth motion of vehicle and target about time 0.

    q, qd, qdd: (8,) of the vehicle. points: (n, 3) in the world [m]. centre: velocity,
    acceleration and jerk (3, 3) of their centroid [m/s, m/s², m/s³]. axis: unit vector (3,) about
    which they turn. turn: angular velocity and acceleration about it [rad/s, rad/s²].
    """

    vehicle: Vehicle
    q: Array
    qd: Array
    qdd: Array
    points: Array
    centre: Array
    axis: Array
    turn: tuple[float, float]

    def joints(self, t: float) -> tuple[Array, Array]:
        """Return q and q̇ (8,)."""
        return self.q + t * self.qd + 0.5 * t**2 * self.qdd, self.qd + t * self.qdd

    def seen(self, t: float) -> tuple[Array, Array]:
        """Return the normalised image (2n,) and the depths (n,) [m]."""
        middle, angle = self.points.mean(0), self.turn[0] * t + 0.5 * self.turn[1] * t**2
        turned = Rotation.from_rotvec(angle * self.axis).apply(self.points - middle)
        moved = self.centre.T @ [t, t**2 / 2.0, t**3 / 6.0]
        return look(self.vehicle, self.joints(t)[0], middle + moved + turned)

    def matrix(self, t: float) -> Array:
        """Return L (2n, 6)."""
        return interaction_matrix(*self.seen(t))

    def target_twist(self, t: float) -> Array:
        """Return v_t (6,), the target's twist at the camera's origin, in camera axes."""
        at, axes = camera_pose(self.vehicle, self.joints(t)[0])
        moved = self.centre.T @ [t, t**2 / 2.0, t**3 / 6.0]
        velocity = self.centre.T @ [1.0, t, t**2 / 2.0]
        angular = (self.turn[0] + t * self.turn[1]) * self.axis
        velocity = velocity + np.cross(angular, at - self.points.mean(0) - moved)
        return np.concatenate([velocity @ axes, angular @ axes])

    def camera_part(self, t: float) -> Array:
        """Return L v_c (2n,)."""
        q, qd = self.joints(t)
        return np.asarray(self.matrix(t) @ camera_jacobian(self.vehicle, q) @ qd)


def r_residuals(course: Course, desired: Array, gains: dict[str, Any]) -> tuple[float, float]:
    """Return relative residuals of the printed and the corrected r in the target's part of ė_a.

    The target's part is the derivative of e_a, whose ė is that of the projected points' e, minus
    the camera's part of Eq. (12) in it.
    """

    def e(t: float) -> Array:
        return np.asarray(desired - course.seen(t)[0])

    def e_a(t: float) -> Array:
        sliding = gains["Cs"] @ np.tanh(e(t) / gains["sigma"])
        return np.asarray(gains["Cd"] @ _slope(e, t) + gains["Cp"] @ e(t) + sliding)

    def twist_rate(t: float) -> Array:
        return _slope(course.target_twist, t)

    sech = 1.0 / np.cosh(e(0.0) / gains["sigma"]) ** 2
    slope = gains["Cp"] + gains["Cs"] * sech / gains["sigma"]
    camera = gains["Cd"] @ _slope(course.camera_part, 0.0) + slope @ course.camera_part(0.0)
    right = _slope(e_a, 0.0) + camera
    v, rate, L = course.target_twist(0.0), twist_rate(0.0), course.matrix(0.0)
    printed = gains["Cd"] @ _slope(twist_rate, 0.0) + slope @ rate
    accelerating = L @ rate + _slope(course.matrix, 0.0) @ v
    corrected = gains["Cd"] @ accelerating + slope @ L @ v
    size = float(np.linalg.norm(right))
    first, second = (float(np.linalg.norm(r - right)) / size for r in (printed, corrected))
    return first, second


def _slope(of: Callable[[float], Array], t: float) -> Array:
    """Return the derivative of a function of time by five points."""
    near, far = (of(t + k * _STEP) - of(t - k * _STEP) for k in (1, 2))
    return np.asarray((8.0 * near - far) / (12.0 * _STEP))
