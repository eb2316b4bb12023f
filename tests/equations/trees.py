"""Vehicles of several arms and sections, their random states, and vehicles of stored cases."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.oracles.make_kane_cases import ALL, BENT, Kind, draw

SHAPES = ((1,), (2,), (3,), (1, 1), (2, 1))
"""Sections of each arm."""


def of_case(described: Any) -> ca.Vehicle:
    """The package's vehicle of one that `tests.oracles.kane` describes."""
    arms = []
    for each in described["arms"]:
        arm = {name: each[name] for name in ("mount", "attitude")} | {"section": each["sections"]}
        arms.append(arm | ({"tip": each["tip"]} if each["tip"] else {}))
    return ca.Vehicle(name="case", uav=described["uav"], arm=arms)


def furnished(shape: tuple[int, ...]) -> ca.Vehicle:
    """Tilted mounts off the centre, damping, a disk on every section and a body on every tip."""
    described = draw(shape, "tree", Kind((BENT,), **ALL))["vehicle"]
    for arm in described["arms"]:
        for section in arm["sections"]:
            disk = {"position": 0.7 * section["length"], "mass": 0.02, "inertia": [2e-6, 3e-6]}
            section["disks"] = [*section["disks"], disk]
    return of_case(described)


# Remark 1 off, so that the tests see the equations and not the threshold.
TREES = {
    "+".join(map(str, shape)): furnished(shape).replace(
        {
            f"arm.{arm}.section.{section}.kappa_s": 0.0
            for arm, sections in enumerate(shape)
            for section in range(sections)
        }
    )
    for shape in SHAPES
}


def lengths(vehicle: ca.Vehicle) -> np.ndarray:
    """Of all sections (N,) [m]."""
    return np.array([section.length for arm in vehicle.arms for section in arm.section])


def curvatures(vehicle: ca.Vehicle, n: int, rng: np.random.Generator) -> np.ndarray:
    """Random |κ| (n, N): from 0.05 1/m to nearly a full circle, evenly by their logarithm."""
    full = 6.0 / lengths(vehicle)
    return np.asarray(np.exp(rng.uniform(np.log(0.05), np.log(full), (n, len(full)))))


def states(vehicle: ca.Vehicle, n: int, seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """n pairs (q, q̇): any bend but a small one, |θ| <= 1.2, all other angles."""
    rng = np.random.default_rng(seed)
    κ = curvatures(vehicle, n, rng) * rng.choice([-1, 1], (n, vehicle.sections))
    ψ = rng.uniform(-np.pi, np.pi, κ.shape)
    euler = rng.uniform(-1, 1, (n, 3)) * [np.pi, 1.2, np.pi]
    polar = np.stack([κ, ψ], axis=-1).reshape(n, -1)
    q = np.hstack([rng.uniform(-2, 2, (n, 3)), euler, polar])
    return list(zip(q, rng.normal(size=q.shape), strict=True))


def flights(vehicle: ca.Vehicle, n: int, seed: int) -> dict[str, Any]:
    """n random states with everything that acts, as arguments of `continuair.accelerations`."""
    rng = np.random.default_rng(seed)
    sections, arms = vehicle.sections, len(vehicle.arms)
    κ, ψ = curvatures(vehicle, n, rng), rng.uniform(-np.pi, np.pi, (n, sections))
    euler = rng.uniform(-1, 1, (n, 3)) * [np.pi, 1.2, np.pi]
    stiffness = [section.bending_stiffness for arm in vehicle.arms for section in arm.section]
    return {
        "attitude": Rotation.from_euler("ZYX", euler[:, ::-1]).as_quat(),
        "bend": κ[..., None] * np.stack([np.cos(ψ), np.sin(ψ)], axis=-1),
        "velocity": rng.normal(0, 3, (n, 3)),
        "angular_velocity": rng.normal(0, 3, (n, 3)),
        "bend_rate": rng.normal(0, 3, (n, sections, 2)) / lengths(vehicle)[:, None],
        "force": rng.normal(0, 10, (n, 3)),
        "moment": rng.normal(0, 1, (n, 3)),
        "bend_moment": rng.normal(0, 2, (n, sections, 2)) * np.array(stiffness)[:, None],
        "tip_wrench": rng.normal(0, 1, (n, arms, 6)) * [3, 3, 3, 0.1, 0.1, 0.1],
    }
