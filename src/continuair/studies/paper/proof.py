"""V̇ of the paper's proof at one state, with the law substituted and no term dropped.

A target at rest, all of G cancelled and an arm without damping; J_L = L J_c, where the paper prints
T_a⁻¹ for the rotation into camera axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.equations import coriolis_matrix, image_jacobian, look, mass_matrix
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_APART = 1e-6
"""Seconds between the two J_L that give its rate: their error is 1e-9 of it at 1 rad/s."""


@dataclass(frozen=True)
class State:
    """What V̇ needs of a state, whatever the gains: e, ė = -J_L q̇ (2n,), M, C q̇, J_L and its rate.

    q, qd: (8,), the paper's coordinates.
    """

    qd: Array
    e: Array
    J: Array
    J_rate: Array
    M: Array
    coriolis: Array


@dataclass(frozen=True)
class Motion:
    """V [J], V̇ [W], q̈ (8,), v_c = J_L q̇ and e_a (2n,) of a state under a set of gains."""

    V: float
    V_rate: float
    qdd: Array
    v_c: Array
    e_a: Array


def state(vehicle: Vehicle, q: Array, qd: Array, points: Array, desired: Array) -> State:
    """The state of a vehicle before points (n, 3) at rest in the world [m]; desired: s_d (2n,)."""
    ahead, behind = (
        image_jacobian(vehicle, q + sign * _APART * qd, points) for sign in (1.0, -1.0)
    )
    return State(
        qd,
        desired - look(vehicle, q, points)[0],
        image_jacobian(vehicle, q, points),
        (ahead - behind) / (2.0 * _APART),
        mass_matrix(vehicle, q),
        coriolis_matrix(vehicle, q, qd) @ qd,
    )


def motion(at: State, gains: dict[str, Any]) -> Motion:
    """V of Eq. (18) and its rate under Eqs. (10), (15) and (16), from q̈ and ë."""
    Kp, Kd, Cp, Cd, Cs = (gains[name] for name in ("Kp", "Kd", "Cp", "Cd", "Cs"))
    σ = float(gains["sigma"])
    v_c = at.J @ at.qd
    e_a = -Cd @ v_c + Cp @ at.e + Cs @ np.tanh(at.e / σ)
    push = at.J.T @ (Kp @ e_a - Kd @ v_c)
    qdd = np.linalg.solve(at.M, push - at.coriolis)
    e_dotdot = -(at.J @ qdd + at.J_rate @ at.qd)
    sech = 1.0 / np.cosh(at.e / σ) ** 2
    e_a_rate = Cd @ e_dotdot - (Cp + Cs * sech / σ) @ v_c
    kinetic = 0.5 * at.qd @ at.M @ at.qd
    # Ṁ - 2C is skew, so that the kinetic energy grows by the power of the push.
    rate = at.qd @ push + e_a @ Kp @ e_a_rate
    return Motion(float(kinetic + 0.5 * e_a @ Kp @ e_a), float(rate), qdd, v_c, e_a)


def largest_lambda(of: Motion, gains: dict[str, Any]) -> float:
    """The largest λ for which Eq. (19) with δ = 0 holds in a motion; below 0 if none does."""
    fall = -of.V_rate - 0.5 * of.v_c @ gains["Kd"] @ of.v_c
    return float(fall / (of.e_a @ of.e_a))
