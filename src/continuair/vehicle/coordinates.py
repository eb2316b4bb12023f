"""The paper's coordinates q = [x y z φ θ ψ κ ψa] as a view of the singularity-free state.

(κ, ψa) follow for every section, arm by arm from the base out; `Layout` orders the columns of the
state.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.vehicle.layout import Layout


def state_from_paper(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """States (runs, state) from paper coordinates and their rates, both (runs, coordinates)."""
    attitude = Rotation.from_euler("ZYX", q[:, [5, 4, 3]]).as_quat()
    (kappa, psi), (kappa_d, psi_d) = _polar(q), _polar(qd)
    along, across = _bend_directions(psi)
    bend = kappa[..., None] * along
    bend_rate = kappa_d[..., None] * along + (kappa * psi_d)[..., None] * across
    spin = np.einsum("nij,nj->ni", euler_to_body_rates(q), qd[:, 3:6])
    bend, bend_rate = (x.reshape(len(q), -1) for x in (bend, bend_rate))
    return np.hstack([q[:, :3], attitude, bend, qd[:, :3], spin, bend_rate])


def branches_of(q: np.ndarray) -> np.ndarray:
    """What names the branches of the coordinates q (runs, coordinates): ψa of each section and the
    roll, (runs, sections + 1)."""
    return np.hstack([q[:, 7::2], q[:, 3:4]])


def paper_rates(q: np.ndarray, state: np.ndarray, threshold: Any) -> np.ndarray:
    """q̇ (runs, coordinates) of states (runs, state) at q: `state_from_paper`, undone.

    threshold: κ_s [1/m] of each section, or of all, as in `paper_accelerations`; ψ̇a of a straight
    section with κ_s = 0 is 0.
    """
    layout, (kappa, psi) = _layout(q), _polar(q)
    euler = np.linalg.solve(euler_to_body_rates(q), state[:, layout.angular_velocity, None])[..., 0]
    along, across = _bend_directions(psi)
    bend_rate = state[:, layout.bend_rate].reshape(*kappa.shape, 2)
    safe = np.copysign(np.maximum(np.abs(kappa), _per_section(threshold)), kappa)
    around = (bend_rate * across).sum(-1)
    psi_d = np.divide(around, safe, out=np.zeros_like(around), where=safe != 0.0)
    return _joined(state[:, layout.velocity], euler, (bend_rate * along).sum(-1), psi_d)


def paper_accelerations(
    q: np.ndarray, qd: np.ndarray, rate: np.ndarray, threshold: Any
) -> np.ndarray:
    """q̈ (runs, coordinates) from the state's rate (runs, state).

    threshold: κ_s [1/m] (Remark 1), of each section or of all: |κ| below it divides ψ̈a as κ_s, with
    the sign of κ.
    """
    layout, (kappa, psi), (kappa_d, psi_d) = _layout(q), _polar(q), _polar(qd)
    E, Ed = euler_to_body_rates(q), _euler_to_body_rates_dot(q, qd)
    spin = rate[:, layout.angular_velocity] - np.einsum("nij,nj->ni", Ed, qd[:, 3:6])
    euler = np.linalg.solve(E, spin[..., None])[..., 0]
    along, across = _bend_directions(psi)
    bend = rate[:, layout.bend_rate].reshape(*kappa.shape, 2)
    kappa_dd = (bend * along).sum(-1) + kappa * psi_d**2
    safe = np.copysign(np.maximum(np.abs(kappa), _per_section(threshold)), kappa)
    psi_dd = ((bend * across).sum(-1) - 2.0 * kappa_d * psi_d) / safe
    return _joined(rate[:, layout.velocity], euler, kappa_dd, psi_dd)


def _layout(q: np.ndarray) -> Layout:
    """Columns of a state; the arms that sections belong to do not change them."""
    return Layout((q.shape[1] // 2 - 3,))


def _polar(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """κ and ψa (runs, sections), or their rates."""
    return q[:, 6::2], q[:, 7::2]


def _per_section(threshold: Any) -> np.ndarray:
    """κ_s (runs or 1, sections or 1) from one number, or one per run, or those."""
    found = np.asarray(threshold)
    return found if found.ndim == 2 else found.reshape(-1, 1)


def _joined(moved: np.ndarray, euler: np.ndarray, kappa: np.ndarray, psi: np.ndarray) -> np.ndarray:
    polar = np.stack([kappa, psi], axis=-1).reshape(len(kappa), -1)
    return np.hstack([moved, euler, polar])


def continuous_euler(attitude: np.ndarray) -> np.ndarray:
    """ZYX Euler angles (roll, pitch, yaw) along samples (..., samples, 4), free of jumps.

    Of the two triples of one attitude, (φ, θ, ψ) and (φ + π, π - θ, ψ + π), each sample takes the
    one nearest to the sample before, so that a tumble through θ = π/2 stays smooth.
    """
    flat = attitude.reshape(-1, *attitude.shape[-2:])
    valid = np.isfinite(flat).all(-1)
    filled = np.where(valid[..., None], flat, np.array([0.0, 0.0, 0.0, 1.0]))
    x, y, z, w = np.moveaxis(filled, -1, 0)
    roll = np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0))
    yaw = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    angles = np.stack([roll, pitch, yaw], -1)
    other = np.stack([roll + np.pi, np.pi - pitch, yaw + np.pi], -1)
    # Both ways of changing triple are equally far, so that each step says stay or change by itself.
    stay = (_wrapped(angles[:, 1:] - angles[:, :-1]) ** 2).sum(-1)
    change = (_wrapped(other[:, 1:] - angles[:, :-1]) ** 2).sum(-1)
    changed = np.cumsum(change < stay, axis=1) % 2 == 1
    angles[:, 1:] = np.where(changed[..., None], other[:, 1:], angles[:, 1:])
    angles = np.unwrap(angles, axis=1)
    angles[~valid] = np.nan
    return np.asarray(angles.reshape(*attitude.shape[:-1], 3))


def _wrapped(angle: np.ndarray) -> np.ndarray:
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def euler_to_body_rates(q: np.ndarray) -> np.ndarray:
    """E(φ, θ), (runs, 3, 3): ZYX Euler rates (φ̇, θ̇, ψ̇) to angular velocity in body axes."""
    (sφ, cφ), (sθ, cθ) = _sine_cosine(q[:, 3]), _sine_cosine(q[:, 4])
    one, nil = np.ones_like(sφ), np.zeros_like(sφ)
    return _matrix([[one, nil, -sθ], [nil, cφ, sφ * cθ], [nil, -sφ, cφ * cθ]])


def _euler_to_body_rates_dot(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    (sφ, cφ), (sθ, cθ) = _sine_cosine(q[:, 3]), _sine_cosine(q[:, 4])
    φd, θd, nil = qd[:, 3], qd[:, 4], np.zeros_like(sφ)
    return _matrix(
        [
            [nil, nil, -cθ * θd],
            [nil, -sφ * φd, cφ * cθ * φd - sφ * sθ * θd],
            [nil, -cφ * φd, -sφ * cθ * φd - cφ * sθ * θd],
        ]
    )


def _sine_cosine(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.sin(angle), np.cos(angle)


def _matrix(rows: list[list[np.ndarray]]) -> np.ndarray:
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _bend_directions(psi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Along the bend and across it, (..., 2) each."""
    sine, cosine = _sine_cosine(psi)
    return np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)
