"""Kane's equations on nodes with the bend vector: an oracle without the singularity at κ = 0.

It shares no code with the kernels nor with continuair.equations, and not their formulas either. A
section turns by the exponential map: by the rotation vector θ = s k × ẑ, in body axes. The
backbone is the integral of its own tangent, so with the left Jacobian of the rotation group,

    A(θ) = 1 + f₁(θ²) [θ]× + f₃(θ²) [θ]×²,   f₁(z) = (1 - cos √z)/z,   f₃(z) = (1 - sin √z/√z)/z,

the backbone point is r = P_o - s A ẑ and the section's spin relative to the body is A θ̇. (The
f₂ = sin √z / √z of other texts is 1 - z f₃.) f₁, f₃ and their derivatives are power series, summed
with more digits than their alternating terms lose, for any |k| l up to 2π and some way beyond.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any

import numpy as np

from continuair.vehicle.vehicle import Vehicle

_NODES = 32
_TERMS = 40  # z^40/80! < 1e-50 at |k| l = 2π
_BITS = 512  # of the fraction: a rounding grows to z^40 of it, 2^-299
_ONE = 1 << _BITS
_E = np.eye(3)
_Z = _E[2]


@dataclass(frozen=True)
class _Sections:
    """Backbone nodes and disks (n): masses and inertia, and how they move at a bend and its rate.

    Vectors are in body axes, relative to the body; `velocity_rate` and `spin_rate` are the parts
    of the accelerations that are quadratic in the bend rate.
    """

    mass: np.ndarray
    inertia: np.ndarray  # (n, 3, 3)
    place: np.ndarray  # (n, 3)
    velocity: np.ndarray
    velocity_rate: np.ndarray
    per_bend_rate: np.ndarray  # (n, 3, 2)
    spin: np.ndarray  # (n, 3)
    spin_rate: np.ndarray
    spin_per_bend_rate: np.ndarray  # (n, 3, 2)


def kane_accelerations(
    vehicle: Vehicle,
    attitude_rotation: Any,
    bend: Any,
    velocity: Any,
    omega: Any,
    bend_rate: Any,
    *,
    force_world: Any = 0.0,
    moment_body: Any = 0.0,
    bend_moment: Any = 0.0,
    tip_wrench: Any = 0.0,
    model: str = "coupled",
    gravity: float = 9.81,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(a_o, ω̇, k̈): the inertial acceleration of B's origin in body axes, and two rates.

    attitude_rotation: body to world (3, 3). bend, bend_rate (2,): [1/m], [1/(m s)]. velocity,
    omega (3,): of B, body axes; by Galilean invariance the velocity has no effect. force_world (3,)
    [N] at B's origin; moment_body (3,) [N m]; bend_moment (2,) [N m²], conjugate to k; tip_wrench
    (6,): force [N] and moment [N m], world axes, acting on the tip. model: "coupled" or
    "decoupled", the UAV-arm blocks of M and of the Christoffel C zero.
    """
    del velocity
    R, w = np.asarray(attitude_rotation, float), np.asarray(omega, float)
    sections = _sections(vehicle, bend, bend_rate)
    M = _inertia(vehicle, sections)
    if model == "decoupled":
        M[:6, 6:] = M[6:, :6] = 0.0
    load = _velocity_and_weight(vehicle, sections, w, gravity * R.T @ -_Z, model == "decoupled")
    load[:3] += R.T @ np.broadcast_to(force_world, 3)
    load[3:6] += moment_body
    load[6:] += bend_moment + _spring_and_damper(vehicle, bend, bend_rate)
    load += _at_the_tip(vehicle, bend, R, np.broadcast_to(tip_wrench, 6))
    solved = np.linalg.solve(M, load)
    return solved[:3], solved[3:6], solved[6:]


def accelerations(
    vehicle: Vehicle, k: Any, kd: Any, omega: Any, model: str, gravity: float = 9.81
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(a_o - g in body axes, ω̇, k̈) of a level vehicle on which only gravity acts."""
    a_o, omega_rate, kdd = kane_accelerations(
        vehicle, _E, k, np.zeros(3), omega, kd, model=model, gravity=gravity
    )
    return a_o + gravity * _Z, omega_rate, kdd


def _inertia(vehicle: Vehicle, sections: _Sections) -> np.ndarray:
    """M (8, 8) for (a_o, ω̇, k̈)."""
    M = np.zeros((8, 8))
    M[:3, :3], M[3:6, 3:6] = vehicle.uav.mass * _E, np.asarray(vehicle.uav.inertia)
    partial, turn = _partial_velocities(sections)
    M += np.einsum("nij,n,nik->jk", partial, sections.mass, partial)
    M += np.einsum("nij,nih,nhk->jk", turn, sections.inertia, turn)
    return M


def _velocity_and_weight(
    vehicle: Vehicle, sections: _Sections, w: np.ndarray, g: np.ndarray, decoupled: bool
) -> np.ndarray:
    """Minus what velocities and gravity g (body axes) put into the eight rows.

    Each row has its own terms, the terms in both ω and k̇, and the other's own. Zero blocks in the
    Christoffel matrix leave the first, and half of the second: ½ [all + own - the other's own].
    """
    shared, other = (0.5, 0.0) if decoupled else (1.0, 1.0)
    move = np.stack(
        [
            np.cross(w, np.cross(w, sections.place)),
            2.0 * np.cross(w, sections.velocity),
            sections.velocity_rate,
        ]
    )
    turn = _turns(sections, w)
    per_uav, per_arm = np.array([1.0, shared, other]), np.array([other, shared, 1.0])
    row_weights = np.stack([per_uav] * 6 + [per_arm] * 2)
    partial, angular = _partial_velocities(sections)
    load = -np.einsum("n,nij,jc,cni->j", sections.mass, partial, row_weights, move)
    load += np.einsum("n,nij,i->j", sections.mass, partial, g)
    load -= np.einsum("nij,jc,cni->j", angular, row_weights, turn)
    inertia = np.asarray(vehicle.uav.inertia)
    load[:3] += vehicle.uav.mass * g
    load[3:6] -= np.cross(w, inertia @ w)
    return load


def _turns(sections: _Sections, w: np.ndarray) -> np.ndarray:
    """Rates of the sections' own angular momentum (3, n, 3): in ω alone, in both, in k̇ alone."""
    dJ, spin = sections.inertia, sections.spin
    whole = w + spin
    rate = _apply(dJ, np.cross(w, spin) + sections.spin_rate)
    in_all = rate + np.cross(whole, _apply(dJ, whole))
    of_uav = np.cross(w, dJ @ w)
    of_arm = _apply(dJ, sections.spin_rate) + np.cross(spin, _apply(dJ, spin))
    return np.stack([of_uav, in_all - of_uav - of_arm, of_arm])


def _at_the_tip(vehicle: Vehicle, bend: Any, R: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    s = np.array([vehicle.arm.length])
    tip = _moving(vehicle, s, np.zeros(1), np.zeros((1, 2)), bend, np.zeros(2))
    partial, turn = _partial_velocities(tip)
    pushed: np.ndarray = partial[0].T @ R.T @ wrench[:3] + turn[0].T @ R.T @ wrench[3:]
    return pushed


def _spring_and_damper(vehicle: Vehicle, bend: Any, bend_rate: Any) -> np.ndarray:
    arm = vehicle.arm
    stiff, damped = arm.bending_stiffness * arm.length, arm.structural_damping * arm.length
    return -stiff * np.asarray(bend, float) - damped * np.asarray(bend_rate, float)


def _partial_velocities(sections: _Sections) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 8) each: velocity and angular velocity per (v, ω, k̇), in body axes."""
    n = len(sections.mass)
    unit = np.broadcast_to(_E, (n, 3, 3))
    partial = np.concatenate([unit, -_cross(sections.place), sections.per_bend_rate], axis=-1)
    turn = np.concatenate([0.0 * unit, unit, sections.spin_per_bend_rate], axis=-1)
    return partial, turn


def _sections(vehicle: Vehicle, bend: Any, bend_rate: Any) -> _Sections:
    arm, disks = vehicle.arm, vehicle.arm.disks
    x, weight = np.polynomial.legendre.leggauss(_NODES)
    ds = 0.5 * arm.length * weight
    s = np.concatenate([0.5 * arm.length * (1.0 + x), [disk.position for disk in disks]])
    mass = np.concatenate([arm.mass_per_length * ds, [disk.mass for disk in disks]])
    ρI = arm.density * np.pi / 4.0 * arm.radius**4
    rod = np.outer(ds, [ρI, 2.0 * ρI])
    inertia = np.vstack([rod, *(np.array([disk.inertia]) for disk in disks)])
    return _moving(vehicle, s, mass, inertia, bend, bend_rate)


def _moving(
    vehicle: Vehicle, s: np.ndarray, mass: np.ndarray, inertia: np.ndarray, bend: Any, rate: Any
) -> _Sections:
    """Sections at s (n) with masses (n) and (transverse, axial) moments of inertia (n, 2)."""
    k, kd = np.array([*bend, 0.0]), np.array([*rate, 0.0])
    f1, f3 = _series(s, bend)
    z1, z2 = 2.0 * s**2 * (k @ kd), 2.0 * s**2 * (kd @ kd)
    θ, θd = np.outer(s, np.cross(k, _Z)), np.outer(s, np.cross(kd, _Z))
    T, D = _cross(θ), _cross(θd)
    A = _E + _scale(f1[0], T) + _scale(f3[0], T @ T)
    Ad = _rate(f1, f3, T, D, z1)
    Add = (
        _scale(f1[2] * z1**2 + f1[1] * z2, T)
        + _scale(2.0 * f1[1] * z1, D)
        + _scale(f3[2] * z1**2 + f3[1] * z2, T @ T)
        + _scale(2.0 * f3[1] * z1, T @ D + D @ T)
        + _scale(2.0 * f3[0], D @ D)
    )
    unit = [np.cross(e, _Z) for e in _E[:2]]
    along = [
        _rate(f1, f3, T, _cross(np.outer(s, unit[i])), 2.0 * s**2 * k[i]) @ _Z for i in range(2)
    ]
    tangent = -(_E + _scale(1.0 - f3[0] * (θ**2).sum(1), T) + _scale(f1[0], T @ T)) @ _Z
    dJ = _scale(inertia[:, 0], np.broadcast_to(_E, A.shape))
    dJ = dJ + np.einsum("n,ni,nj->nij", inertia[:, 1] - inertia[:, 0], tangent, tangent)
    return _Sections(
        mass=mass,
        inertia=dJ,
        place=np.asarray(vehicle.uav.mount) - s[:, None] * (A @ _Z),
        velocity=-s[:, None] * (Ad @ _Z),
        velocity_rate=-s[:, None] * (Add @ _Z),
        per_bend_rate=-s[:, None, None] * np.stack(along, axis=-1),
        spin=_apply(A, θd),
        spin_rate=_apply(Ad, θd),
        spin_per_bend_rate=_scale(s, A @ np.stack(unit, axis=-1)),
    )


def _rate(f1: Any, f3: Any, T: np.ndarray, D: np.ndarray, z1: np.ndarray) -> np.ndarray:
    """The rate of A(θ), D being [θ̇]× and z1 the rate of θ²."""
    turning = _scale(f1[1] * z1, T) + _scale(f1[0], D)
    return turning + _scale(f3[1] * z1, T @ T) + _scale(f3[0], T @ D + D @ T)


def _series(s: np.ndarray, bend: Any) -> tuple[tuple[np.ndarray, ...], ...]:
    """f₁ and f₃, each with its first two derivatives in z = |k|² s², (n), rounded to float64."""
    u = sum(_product(_fixed(k), _fixed(k)) for k in bend)
    z = [_product(u, _product(_fixed(x), _fixed(x))) for x in s]
    return tuple(
        tuple(np.array([_sum(terms, each) for each in z]) for terms in _coefficients(n))
        for n in (2, 3)
    )


@cache
def _coefficients(n: int) -> list[list[int]]:
    """(-1)^j / (2j + n)!, by j, and those of its first two derivatives, as fixed-point numbers."""
    value = [(-1) ** j * _ONE // factorial(2 * j + n) for j in range(_TERMS)]
    first = [j * each for j, each in enumerate(value)]
    second = [(j - 1) * each for j, each in enumerate(first)]
    return [value, first[1:], second[2:]]


def _fixed(x: float) -> int:
    """The whole number of 2^-512 that is nearest below a number."""
    numerator, denominator = float(x).as_integer_ratio()
    return numerator * _ONE // denominator


def _product(one: int, other: int) -> int:
    return one * other >> _BITS


def _sum(coefficients: list[int], z: int) -> float:
    total = 0
    for each in reversed(coefficients):
        total = each + (total * z >> _BITS)
    return total / _ONE


def _apply(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", matrices, vectors)


def _scale(factors: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    return factors[:, None, None] * matrices


def _cross(vectors: np.ndarray) -> np.ndarray:
    """[v]×, (n, 3, 3), of vectors (n, 3)."""
    return -np.cross(vectors[:, None, :], _E[None, :, :])
