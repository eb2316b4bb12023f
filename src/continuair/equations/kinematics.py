"""Differential kinematics of a UAV with one constant-curvature section, Eqs. (1)-(7).

Remark 1, Eq. (6), holds throughout: |κ| <= κ_s counts as κ_s, the parameter arm.kappa_s; 0
switches it off, and then κ = 0 divides by zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray[Any, np.dtype[Any]]
TIP_FRAMES = ("untwisted", "frenet")


def rotation(q: Array) -> Array:
    """R_B: body to world, (3, 3), of the ZYX Euler angles of q, Eq. (7): Rz(ψ) Ry(θ) Rx(φ)."""
    return _about_z(q[5]) @ _about_y(q[4]) @ _about_x(q[3])


def euler_rate_matrix(q: Array) -> Array:
    """T, (3, 3): Euler rates (φ̇, θ̇, ψ̇) to angular velocity in world axes; after Eq. (7).

    The paper calls T_e the map from Euler rates to angular velocity, as here, and yet prints T_e⁻¹
    in J_p2 and J_o2. (It is of rates only: in J_L = L T_a⁻¹ J_t, before Eq. (15), the paper also
    applies it to linear velocity, where a rotation belongs.)
    """
    sθ, cθ, sψ, cψ = np.sin(q[4]), np.cos(q[4]), np.sin(q[5]), np.cos(q[5])
    nil, one = 0.0 * sθ, 1.0 + 0.0 * sθ
    return np.array([[cψ * cθ, -sψ, nil], [sψ * cθ, cψ, nil], [-sθ, nil, one]])


def bend_of(vehicle: Vehicle, q: Array) -> tuple[Any, Any]:
    """(κ, ψa) with Remark 1, Eq. (6): |κ| <= κ_s counts as κ_s, whatever the sign of κ."""
    threshold = vehicle.arm.kappa_s
    κ = q[6]
    return (threshold + 0.0 * κ if abs(κ.real) <= threshold else κ), q[7]


def arm_position(vehicle: Vehicle, q: Array, s: Any) -> Array:
    """F(s, κ, ψa), Eq. (2): backbone points (..., 3) in body axes from the arm's base [m].

    s: arc lengths (...) [m]. The paper prints z = +sin(κs)/κ; the arm hangs, and Appendix A is the
    derivative of -sin(κs)/κ.
    """
    κ, ψ = bend_of(vehicle, q)
    s = np.asarray(s, float)
    out = (1.0 - np.cos(s * κ)) / κ
    return np.stack([out * np.cos(ψ), out * np.sin(ψ), -np.sin(s * κ) / κ], axis=-1)


def position(vehicle: Vehicle, q: Array, s: Any) -> Array:
    """Backbone points (..., 3) in the world [m]: Eq. (1), mount P_o included, carried there by q.

    s: arc lengths (...) from 0 to the arm's length [m].
    """
    body = np.asarray(vehicle.uav.mount) + arm_position(vehicle, q, s)
    return q[:3] + body @ rotation(q).T


def section_rotation(vehicle: Vehicle, q: Array, s: Any, tip_frame: str = "untwisted") -> Array:
    """R_s: section frames at s to body, (..., 3, 3), z along the tangent, away from the UAV.

    s: arc lengths (...) [m]. "untwisted": Rz(ψa) Ry(-κs) Rz(-ψa) diag(1, -1, -1), what a
    tendon-driven arm does. "frenet": without Rz(-ψa), the frame of the paper's Eq. (5), which spins
    with ψa. Raises InputError for any other frame.
    """
    _check_frame(tip_frame)
    κ, ψ = bend_of(vehicle, q)
    bent = _about_z(ψ) @ _about_y(-κ * np.asarray(s, float))
    return (bent @ _about_z(-ψ) if tip_frame == "untwisted" else bent) @ np.diag([1.0, -1.0, -1.0])


def arm_jacobian(
    vehicle: Vehicle, q: Array, s: Any, tip_frame: str = "untwisted"
) -> tuple[Array, Array]:
    """J_pa (Appendix A) and J_oa (Eq. (5)), each (..., 3, 2), in body axes, for (κ̇, ψ̇a).

    s: arc lengths (...) [m]. Appendix A is used as printed. The paper's second column of J_oa,
    [0 0 1], is that of the Frenet frame; the untwisted one is [sin κs cos ψa, sin κs sin ψa,
    1 - cos κs]. Its first column, [-s sin ψa, s cos ψa, 0], is that of an arm that points up, as
    Eq. (2) is printed; the hanging arm of Appendix A turns the other way. Eq. (4) puts the rate of
    R_s into so(3), where it is the rate times the transpose of R_s that belongs there.
    """
    _check_frame(tip_frame)
    κ, ψ = bend_of(vehicle, q)
    s = np.asarray(s, float)
    sine, cosine, sψ, cψ = np.sin(κ * s), np.cos(κ * s), np.sin(ψ), np.cos(ψ)
    nil = 0.0 * sine
    radial = (cosine - 1.0) / κ**2 + s * sine / κ
    by_κ = [cψ * radial, sψ * radial, sine / κ**2 - s * cosine / κ]
    by_ψ = [sψ * (cosine - 1.0) / κ, -cψ * (cosine - 1.0) / κ, nil]
    spin_κ = [s * sψ + nil, -s * cψ + nil, nil]
    spin_ψ = [nil, nil, nil + 1.0]
    if tip_frame == "untwisted":
        spin_ψ = [sine * cψ, sine * sψ, 1.0 - cosine]
    return _columns(by_κ, by_ψ), _columns(spin_κ, spin_ψ)


def jacobian(vehicle: Vehicle, q: Array, s: Any, tip_frame: str = "untwisted") -> Array:
    """J (..., 6, 8): linear rows, then angular rows, in world axes, at s; before Eq. (8).

    s: arc lengths (...) from 0 to the arm's length [m]. J_p = [1, -[R P_s]× T, R J_pa] and
    J_o = [0, T, R J_oa], where the paper prints T_e⁻¹ for T (`euler_rate_matrix`), J_p3 for J_o3,
    and other columns of J_oa (`arm_jacobian`). Raises InputError for an unknown frame.
    """
    s = np.asarray(s, float)
    R, T = rotation(q), euler_rate_matrix(q)
    J_pa, J_oa = arm_jacobian(vehicle, q, s, tip_frame)
    lever = (np.asarray(vehicle.uav.mount) + arm_position(vehicle, q, s)) @ R.T
    J = np.zeros((*s.shape, 6, 8), dtype=np.result_type(q, float))
    J[..., :3, :3] = np.eye(3)
    J[..., :3, 3:6] = -skew(lever) @ T
    J[..., :3, 6:] = R @ J_pa
    J[..., 3:, 3:6] = T
    J[..., 3:, 6:] = R @ J_oa
    return J


def skew(v: Array) -> Array:
    """[v]×, (..., 3, 3), of vectors (..., 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    nil = 0.0 * x
    return _rows([nil, -z, y], [z, nil, -x], [-y, x, nil])


def _check_frame(tip_frame: str) -> None:
    if tip_frame not in TIP_FRAMES:
        raise InputError(f"tip_frame is {shown(tip_frame)}; use 'untwisted' or 'frenet'.")


def _columns(first: list[Any], second: list[Any]) -> Array:
    return np.stack([np.stack(first, -1), np.stack(second, -1)], -1)


def _about_x(angle: Any) -> Array:
    s, c, nil, one = _turn(angle)
    return _rows([one, nil, nil], [nil, c, -s], [nil, s, c])


def _about_y(angle: Any) -> Array:
    s, c, nil, one = _turn(angle)
    return _rows([c, nil, s], [nil, one, nil], [-s, nil, c])


def _about_z(angle: Any) -> Array:
    s, c, nil, one = _turn(angle)
    return _rows([c, -s, nil], [s, c, nil], [nil, nil, one])


def _turn(angle: Any) -> tuple[Any, Any, Any, Any]:
    nil = 0.0 * angle
    return np.sin(angle), np.cos(angle), nil, 1.0 + nil


def _rows(*rows: list[Any]) -> Array:
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
