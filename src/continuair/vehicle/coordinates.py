"""Conversions between the paper's coordinates q = [x y z φ θ ψ κ ψa] and the state.

The state has no singularity. The coordinates of all sections follow one another, arm by arm from
the base: (κ, ψa) of an arc, and those of a strain field as they are in the state. `Layout` gives
the columns of the state.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.typing import Array, ArrayLike
from continuair.vehicle.arc import sections_of
from continuair.vehicle.layout import Layout
from continuair.vehicle.poles import POLE, mend_near_poles, with_roll

_NEAR = 1.5
"""Change of roll and yaw per sample below which neither jumps and the triple is kept [rad]: the
other triple differs by at least π - 1.5 in both, and its pitch is never nearer."""


def state_from_paper(q: np.ndarray, qd: np.ndarray, layout: Layout) -> np.ndarray:
    """Return states (runs, state) for paper coordinates and rates, both (runs, coordinates)."""
    attitude = Rotation.from_euler("ZYX", q[:, [5, 4, 3]]).as_quat()
    (kappa, psi), (kappa_d, psi_d) = _polar_of(q, layout), _polar_of(qd, layout)
    along, across = _bend_directions(psi)
    bend, bend_rate = bends_of(q, layout), np.array(qd[:, layout.polar])
    bend_rate[:, layout.arc_coordinates] = (
        kappa_d[..., None] * along + (kappa * psi_d)[..., None] * across
    )
    spin = np.einsum("nij,nj->ni", euler_to_body_rates(q), qd[:, 3:6])
    return np.hstack([q[:, :3], attitude, bend, qd[:, :3], spin, bend_rate])


def bends_of(q: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the coordinates of the sections in a state, (..., bends), for the paper's."""
    kappa, psi = _polar_of(q, layout)
    found = np.array(q[..., layout.polar], float)
    found[..., layout.arc_coordinates] = kappa[..., None] * _bend_directions(psi)[0]
    return found


def polar_of_bends(bends: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the paper's coordinates of the sections, κ not negative, for those in a state."""
    x, y = np.moveaxis(bends[..., layout.arc_coordinates], -1, 0)
    found = np.array(bends, float)
    found[..., layout.arc_coordinates] = np.stack([np.hypot(x, y), np.arctan2(y, x)], axis=-1)
    return found


def branches_of(q: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the angles (runs, sections + 3) that fix the branches of q (runs, coordinates).

    These are ψa of each arc, 0 for other sections, then roll, pitch and yaw.
    """
    return _angles(_polar_of(q, layout)[1], q[:, 3:6], layout)


def _angles(psi: np.ndarray, euler: np.ndarray, layout: Layout) -> np.ndarray:
    """Return ψa of arcs (..., arcs) at the place of their sections, followed by Euler angles."""
    found = np.zeros((*psi.shape[:-1], layout.sections + euler.shape[-1]))
    found[..., list(layout.arcs)], found[..., layout.sections :] = psi, euler
    return found


def branches_in(rows: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the angles of `branches_of` for log rows (..., log), as the kernel follows them."""
    psi = rows[..., layout.branch][..., layout.arc_coordinates[:, 1]]
    return _angles(psi, rows[..., layout.euler], layout)


def followed_coordinates(rows: np.ndarray, layout: Layout) -> np.ndarray:
    """Return the paper's coordinates of all sections (..., bends) of log rows (..., log).

    |κ| is computed from the bends: the kernel's own is a sum of two products, whose rounding
    depends on how it was compiled.
    """
    bends, found = rows[..., layout.bend], np.array(rows[..., layout.branch])
    kappa, pairs = layout.arc_coordinates[:, 0], layout.arc_coordinates
    found[..., list(layout.strain_coordinates)] = bends[..., list(layout.strain_coordinates)]
    x, y = bends[..., pairs[:, 0]], bends[..., pairs[:, 1]]
    found[..., kappa] = np.copysign(np.hypot(x, y), found[..., kappa])
    return found


def paper_rates(
    q: Array, state: Array, threshold: ArrayLike = 0.0, layout: Layout | None = None
) -> Array:
    """Return the rates q̇ of the paper's coordinates for given states.

    Parameters
    ----------
    q : ndarray, shape (runs, coordinates)
        The paper's coordinates of the states.
    state : ndarray, shape (runs, state)
        States, in the columns of `Layout`.
    threshold : array_like, default 0.0
        Curvature κ_s [1/m] of Remark 1, Amiri et al. (2026): one number, one per run (runs,), or
        (runs or 1, sections). |κ| below κ_s divides ψ̇a as κ_s.
    layout : Layout, optional
        Columns of the states, `vehicle.layout`. Default: those of arcs.

    Returns
    -------
    ndarray, shape (runs, coordinates)
        Rates of q. ψ̇a of a straight section is 0 without a threshold. Rates of the Euler angles are
        NaN at a pitch of ±π/2, where they do not exist.
    """
    layout = Layout.of_arcs(sections_of(q)) if layout is None else layout
    kappa, psi = _polar_of(q, layout)
    euler = _body_to_euler_rates(q, state[:, layout.angular_velocity])
    euler[np.abs(np.cos(q[:, 4])) < POLE] = np.nan
    along, across = _bend_directions(psi)
    moved = state[:, layout.bend_rate]
    bend_rate = moved[:, layout.arc_coordinates]
    safe = np.copysign(np.maximum(np.abs(kappa), _per_arc(threshold, layout)), kappa)
    around = (bend_rate * across).sum(-1)
    psi_d = np.divide(around, safe, out=np.zeros_like(around), where=safe != 0.0)
    polar = _with_polar(moved, (bend_rate * along).sum(-1), psi_d, layout)
    return np.hstack([state[:, layout.velocity], euler, polar])


def paper_accelerations(
    q: np.ndarray, qd: np.ndarray, rate: np.ndarray, threshold: ArrayLike, layout: Layout
) -> np.ndarray:
    """Return q̈ (runs, coordinates) for rates of the state (runs, state).

    threshold: κ_s [1/m] (Remark 1), as in `paper_rates`. |κ| below κ_s divides ψ̈a as κ_s, with the
    sign of κ.
    """
    (kappa, psi), (kappa_d, psi_d) = _polar_of(q, layout), _polar_of(qd, layout)
    turned = np.einsum("nij,nj->ni", _euler_to_body_rates_dot(q, qd), qd[:, 3:6])
    euler = _body_to_euler_rates(q, rate[:, layout.angular_velocity] - turned)
    along, across = _bend_directions(psi)
    moved = rate[:, layout.bend_rate]
    bend = moved[:, layout.arc_coordinates]
    kappa_dd = (bend * along).sum(-1) + kappa * psi_d**2
    safe = np.copysign(np.maximum(np.abs(kappa), _per_arc(threshold, layout)), kappa)
    psi_dd = ((bend * across).sum(-1) - 2.0 * kappa_d * psi_d) / safe
    polar = _with_polar(moved, kappa_dd, psi_dd, layout)
    return np.hstack([rate[:, layout.velocity], euler, polar])


def _polar_of(q: np.ndarray, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Return κ and ψa (..., arcs) in the paper's coordinates, or in their rates."""
    pairs = q[..., layout.polar][..., layout.arc_coordinates]
    return pairs[..., 0], pairs[..., 1]


def _with_polar(
    coordinates: np.ndarray, kappa: np.ndarray, psi: np.ndarray, layout: Layout
) -> np.ndarray:
    """Return coordinates (runs, bends) with κ and ψa, or their rates, in the place of arcs."""
    found = np.array(coordinates)
    found[:, layout.arc_coordinates] = np.stack([kappa, psi], axis=-1)
    return found


def _per_arc(threshold: ArrayLike, layout: Layout) -> np.ndarray:
    """Return κ_s (runs or 1, arcs or 1)."""
    found = np.asarray(threshold)
    if found.ndim != 2:
        return found.reshape(-1, 1)
    return found if found.shape[1] == 1 else found[:, list(layout.arcs)]


def continuous_euler(attitude: Array) -> Array:
    """Return ZYX Euler angles along samples of an attitude, without jumps.

    Parameters
    ----------
    attitude : ndarray, shape (..., samples, 4)
        Quaternions x, y, z, w. NaN in a sample gives NaN in its angles.

    Returns
    -------
    ndarray, shape (..., samples, 3)
        Roll, pitch and yaw [rad].

    Notes
    -----
    Two triples describe one attitude, (φ, θ, ψ) and (φ + π, π - θ, ψ + π). Each sample uses the one
    nearest to the previous sample, so that a tumble through θ = π/2 stays smooth. At a pitch of
    ±π/2, where only φ ∓ ψ is defined, φ is that of the previous sample.
    """
    flat = np.asarray(attitude, float).reshape(-1, *attitude.shape[-2:])
    flown = np.isfinite(flat).all(axis=(1, 2))
    if flown.all():
        found = _smooth(flat)
    else:
        found = np.empty((*flat.shape[:2], 3))
        found[flown], found[~flown] = _smooth(flat[flown]), _as_far_as_known(flat[~flown])
    return found.reshape(*attitude.shape[:-1], 3)


def unflipped(attitude: np.ndarray) -> np.ndarray:
    """Return unit quaternions (samples, 4), each with the sign nearer to the previous one."""
    flips = np.where((attitude[1:] * attitude[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    signs = np.cumprod(np.append(1.0, flips))
    found = signs[:, None] * attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    return np.asarray(found)


def euler_on_branch(attitude: np.ndarray, followed: np.ndarray) -> np.ndarray:
    """Return ZYX Euler angles (..., 3) of attitudes (..., 4) on the branch of followed angles.

    followed: angles (..., 3) that the kernel follows from step to step. The result uses the same
    triple and is within half a turn of them.
    """
    branch = np.asarray(followed, float).reshape(-1, 3)
    angles = continuous_euler(np.reshape(attitude, (-1, 1, 4)))[:, 0]
    free = np.abs(np.cos(angles[:, 1])) < POLE
    angles[free] = with_roll(angles[free], branch[free, 0])
    other = ~free & (np.cos(angles[:, 0] - branch[:, 0]) < 0.0)
    angles[other] = _other(angles[other])
    angles += 2.0 * np.pi * np.round((branch - angles) / (2.0 * np.pi))
    return angles.reshape(followed.shape)


def _as_far_as_known(attitude: np.ndarray) -> np.ndarray:
    """Return the angles of `_smooth`, NaN where an attitude is not finite."""
    valid = np.isfinite(attitude).all(-1)
    found = _smooth(np.where(valid[..., None], attitude, np.array([0.0, 0.0, 0.0, 1.0])))
    found[~valid] = np.nan
    return found


def _smooth(attitude: np.ndarray) -> np.ndarray:
    """Return angles (runs, samples, 3) without jumps, of finite attitudes (runs, samples, 4)."""
    x, y, z, w = np.array(np.moveaxis(attitude, -1, 0), order="C")
    roll = np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0))
    yaw = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    angles = np.stack([roll, pitch, yaw], -1)
    mend_near_poles(angles, attitude)
    roll, yaw = angles[..., 0], angles[..., 2]
    far = (np.abs(np.diff(roll)) > _NEAR) | (np.abs(np.diff(yaw)) > _NEAR)
    jumping = far.any(axis=1)
    if jumping.any():
        angles[jumping] = _without_jumps(angles[jumping], *np.nonzero(far[jumping]))
    return angles


def _without_jumps(angles: np.ndarray, run: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Remove jumps, which occur only after samples `at` of some runs, from (runs, samples, 3)."""
    before, after = angles[run, at], angles[run, at + 1]
    changes, turns = np.zeros((len(angles), angles.shape[1] - 1), bool), np.zeros_like(angles)
    # Both changes of triple are equally far, so that each step decides by itself.
    stay = (_wrapped(after - before) ** 2).sum(-1)
    changes[run, at] = (_wrapped(_other(after) - before) ** 2).sum(-1) < stay
    changed = np.zeros(angles.shape[:2], bool)
    np.logical_xor.accumulate(changes, axis=1, out=changed[:, 1:])
    angles[changed] = _other(angles[changed])
    turns[run, at + 1] = _turns(angles[run, at + 1] - angles[run, at])
    angles += np.cumsum(turns, axis=1, out=turns)
    return angles


def _other(angles: np.ndarray) -> np.ndarray:
    """Return the other triple (n, 3) of the same attitudes."""
    return np.pi + np.array([1.0, -1.0, 1.0]) * angles


def _turns(step: np.ndarray) -> np.ndarray:
    """Return the whole turns to add to steps of π and more to make them the shorter way."""
    shorter = np.mod(step + np.pi, 2.0 * np.pi) - np.pi
    shorter[(shorter == -np.pi) & (step > 0.0)] = np.pi
    return np.where(np.abs(step) < np.pi, 0.0, shorter - step)


def _wrapped(angle: np.ndarray) -> np.ndarray:
    return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))


def euler_to_body_rates(q: np.ndarray) -> np.ndarray:
    """Return E(φ, θ), (runs, 3, 3): ZYX Euler rates to angular velocity in body axes."""
    (sφ, cφ), (sθ, cθ) = _sine_cosine(q[:, 3]), _sine_cosine(q[:, 4])
    one, nil = np.ones_like(sφ), np.zeros_like(sφ)
    return _matrix([[one, nil, -sθ], [nil, cφ, sφ * cθ], [nil, -sφ, cφ * cθ]])


def _body_to_euler_rates(q: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """Return Euler rates E⁻¹ ω of angular velocities in body axes (runs, 3).

    They are not finite at θ = ±π/2.
    """
    (sφ, cφ), (sθ, cθ) = _sine_cosine(q[:, 3]), _sine_cosine(q[:, 4])
    x, y, z = spin.T
    yaw = (sφ * y + cφ * z) / cθ
    return np.stack([x + sθ * yaw, cφ * y - sφ * z, yaw], -1)


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
    """Return unit vectors along the bend and across it, (..., 2) each."""
    sine, cosine = _sine_cosine(psi)
    return np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)
