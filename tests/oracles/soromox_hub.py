"""A SoRoMoX robot that is an aerial continuum manipulator: a rigid first segment is the UAV.

Its conventions: backbone along local x, state [quaternion xyzw, position] of the root, and κ_y, κ_z
of every section; velocities [ω, v of the root] in world axes, and their rates. The hub is a solid
cylinder about the backbone; B sits at its middle, and the arm's mount half its length below. With
local axes (x, y, z) = (-z, y, x) of B, the untwisted bend k turns sections by k × ẑ, so κ_y = -k_x
and κ_z = k_y.
"""

from __future__ import annotations

import contextlib
from importlib.metadata import version
from typing import Any
from unittest import mock

import jax
import numpy as np
from scipy.spatial.transform import Rotation

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import soromox.systems.pcs.pcs as pcs  # noqa: E402
from soromox.systems import PCS, PCSStructure  # noqa: E402
from soromox.systems.components import LinkSpec  # noqa: E402

import continuair as ca  # noqa: E402

SOURCE = f"SoRoMoX {version('soromox')}"
HUB_LENGTH, HUB_RADIUS, HUB_MASS = 0.12, 0.15, 2.0

_LOCAL = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Local axes of SoRoMoX as columns in body axes."""
_STRAIN = np.array([-1.0, 1.0])
"""(κ_y, κ_z) per component of a bend vector."""


def vehicle(**changes: Any) -> ca.Vehicle:
    """The preset `paper` with the hub's inertia and the mount below it."""
    across = HUB_MASS * (HUB_LENGTH**2 / 12 + HUB_RADIUS**2 / 4)
    along = HUB_MASS * HUB_RADIUS**2 / 2
    hub = {
        "uav.mass": HUB_MASS,
        "uav.inertia": [across, across, along],
        "uav.mount": [0.0, 0.0, -HUB_LENGTH / 2],
    }
    return ca.load_vehicle("paper").replace({**hub, **changes})


def vehicle_of_sections() -> ca.Vehicle:
    """The same hub with an arm of two sections that differ in all."""
    one = vehicle()
    of_rod = ("length", "radius", "density", "youngs_modulus", "damping")
    rod = {name: getattr(one.arm, name) for name in of_rod}
    thinner = {"length": 0.6, "radius": 0.003, "density": 5000.0, "youngs_modulus": 9e10}
    sections = [rod | {"length": 0.5}, rod | thinner]
    uav = {"mass": one.uav.mass, "inertia": one.uav.inertia}
    arm = {"mount": one.uav.mount, "section": sections}
    return ca.Vehicle(name="two sections", uav=uav, arm=[arm])


class Hub:
    """The same vehicle as a floating piecewise-constant-strain robot: the hub, then the sections.

    SoRoMoX's own Gauss-Legendre nodes stop converging at the rounding of float32: their weights
    sum to 1 within 1e-7 only. `own_nodes` False hands it NumPy's nodes instead, all else its own.
    """

    def __init__(
        self, like: ca.Vehicle, nodes: int = 40, gravity: float = 9.81, own_nodes: bool = False
    ):
        sections = like.arms[0].section
        straight = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
        hub = LinkSpec.circular(
            length=HUB_LENGTH,
            radius=HUB_RADIUS,
            density=HUB_MASS / (np.pi * HUB_RADIUS**2 * HUB_LENGTH),
            reference_strain=straight,
            young_modulus=sections[0].youngs_modulus,
            poisson_ratio=0.3,
        )
        rods = [
            LinkSpec.circular(
                length=each.length,
                radius=each.radius,
                density=each.density,
                reference_strain=straight,
                young_modulus=each.youngs_modulus,
                poisson_ratio=0.3,
            )
            for each in sections
        ]
        of_section = [False, True, True, False, False, False]
        bending = [False] * 6 + of_section * len(sections)
        structure = PCSStructure(num_gauss_points=nodes, strain_selector=jnp.asarray(bending))
        with contextlib.nullcontext() if own_nodes else _converged_nodes():
            self.robot = PCS.from_links(
                [hub, *rods],
                structure=structure,
                gravity=jnp.asarray([0.0, 0.0, -gravity]),
                floating_base=True,
                backend="jax",
            )
        self.length = HUB_LENGTH + sum(each.length for each in sections)
        self._strain = np.tile(_STRAIN, len(sections))
        self._terms = jax.jit(lambda q, v: self.robot.dynamics_terms(q, v))
        self._rates = jax.jit(lambda y, push: self.robot.forward_dynamics(0.0, y, (None, push)))
        self._pose = jax.jit(lambda q, s: self.robot.forward_kinematics(q, s))

    def state(self, p: Any, attitude: Rotation, k: Any, v: Any, omega: Any, kd: Any) -> np.ndarray:
        """Its state from position and velocity of B (world), body angular velocity and bends."""
        root = attitude.apply([0.0, 0.0, HUB_LENGTH / 2])
        spin = attitude.apply(omega)
        q = np.concatenate([self._quaternion(attitude), p + root, self._strain * k])
        return np.concatenate([q, spin, v + np.cross(spin, root), self._strain * kd])

    def velocity_map(self, attitude: Rotation) -> np.ndarray:
        """(n, n): its velocities per (v of B world, ω body, k̇)."""
        R, n = attitude.as_matrix(), 6 + len(self._strain)
        T = np.zeros((n, n))
        T[:3, 3:6] = R
        T[3:6, :3] = np.eye(3)
        T[3:6, 3:6] = -_cross(R @ [0.0, 0.0, HUB_LENGTH / 2]) @ R
        T[6:, 6:] = np.diag(self._strain)
        return T

    def mass_matrix(self, y: np.ndarray, attitude: Rotation) -> np.ndarray:
        """M (n, n) for (v of B world, ω body, k̇)."""
        T, at = self.velocity_map(attitude), 7 + len(self._strain)
        return T.T @ np.asarray(self._terms(y[:at], y[at:])[0]) @ T

    def accelerations(
        self, y: np.ndarray, attitude: Rotation, omega: Any, push: Any = 0.0
    ) -> np.ndarray:
        """(v̇ of B world, ω̇ body, k̈); push (n,): work-conjugate to (v world, ω body, k̇)."""
        T, at = self.velocity_map(attitude), 7 + len(self._strain)
        effort = np.linalg.solve(T.T, np.broadcast_to(push, len(T)))
        rates = np.asarray(self._rates(y, effort))[at:]
        R, arm = attitude.as_matrix(), attitude.apply([0.0, 0.0, HUB_LENGTH / 2])
        spin, turn = R @ omega, rates[:3]
        # The root is half a hub above B and accelerates with it and around it.
        above = np.cross(turn, arm) + np.cross(spin, np.cross(spin, arm))
        return np.concatenate([rates[3:6] - above, R.T @ turn, self._strain * rates[6:]])

    def rates(self, y: np.ndarray) -> np.ndarray:
        """The rate of its own state in free flight."""
        return np.asarray(self._rates(y, np.zeros(6 + len(self._strain))))

    def tip(self, y: np.ndarray) -> np.ndarray:
        """Position of the arm's tip, world axes."""
        pose = np.asarray(self._pose(y[: 7 + len(self._strain)], self.length)).ravel()
        return pose[4:7] if pose.size == 7 else pose.reshape(4, 4)[:3, 3]

    @staticmethod
    def _quaternion(attitude: Rotation) -> np.ndarray:
        return (attitude * Rotation.from_matrix(_LOCAL)).as_quat()


def _converged_nodes() -> Any:
    """SoRoMoX with NumPy's Gauss-Legendre nodes; like its own, with both ends at weight 0."""

    def nodes(count: int, a: Any = 0.0, b: Any = 1.0) -> tuple[Any, Any, int]:
        x, weight = np.polynomial.legendre.leggauss(count)
        points = np.concatenate([[-1.0], x, [1.0]])
        weights = np.concatenate([[0.0], weight, [0.0]])
        return (
            a + (b - a) * jnp.asarray(1 + points) / 2,
            (b - a) * jnp.asarray(weights) / 2,
            count + 2,
        )

    return mock.patch.object(pcs, "gauss_quadrature", nodes)


def _cross(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
