"""A SoRoMoX robot that is an aerial continuum manipulator: a rigid first segment is the UAV.

Its conventions: backbone along local x, state [quaternion xyzw, position, κ_y, κ_z] of the root,
velocities [ω, v of the root] in world axes, [κ̇_y, κ̇_z]. The hub is a solid cylinder about the
backbone; B sits at its middle, and the arm's mount half its length below. With local axes
(x, y, z) = (-z, y, x) of B, the untwisted bend k turns sections by k × ẑ, so κ_y = -k_x, κ_z = k_y.
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
_STRAIN = np.array([[-1.0, 0.0], [0.0, 1.0]])
"""(κ_y, κ_z) per bend vector."""


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


class Hub:
    """The same vehicle as a floating piecewise-constant-strain robot of two segments.

    SoRoMoX's own Gauss-Legendre nodes stop converging at the rounding of float32: their weights
    sum to 1 within 1e-7 only. `own_nodes` False hands it NumPy's nodes instead, all else its own.
    """

    def __init__(
        self, like: ca.Vehicle, nodes: int = 40, gravity: float = 9.81, own_nodes: bool = False
    ):
        arm = like.arm
        straight = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
        material = {"young_modulus": arm.youngs_modulus, "poisson_ratio": 0.3}
        hub = LinkSpec.circular(
            length=HUB_LENGTH,
            radius=HUB_RADIUS,
            density=HUB_MASS / (np.pi * HUB_RADIUS**2 * HUB_LENGTH),
            reference_strain=straight,
            **material,
        )
        rod = LinkSpec.circular(
            length=arm.length,
            radius=arm.radius,
            density=arm.density,
            reference_strain=straight,
            **material,
        )
        bending = [False] * 6 + [False, True, True, False, False, False]
        structure = PCSStructure(num_gauss_points=nodes, strain_selector=jnp.asarray(bending))
        with contextlib.nullcontext() if own_nodes else _converged_nodes():
            self.robot = PCS.from_links(
                [hub, rod],
                structure=structure,
                gravity=jnp.asarray([0.0, 0.0, -gravity]),
                floating_base=True,
                backend="jax",
            )
        self.length = HUB_LENGTH + arm.length
        self._terms = jax.jit(lambda q, v: self.robot.dynamics_terms(q, v))
        self._rates = jax.jit(lambda y, push: self.robot.forward_dynamics(0.0, y, (None, push)))
        self._pose = jax.jit(lambda q, s: self.robot.forward_kinematics(q, s))

    def state(self, p: Any, attitude: Rotation, k: Any, v: Any, omega: Any, kd: Any) -> np.ndarray:
        """Its state from position and velocity of B (world), body angular velocity and bend."""
        root = attitude.apply([0.0, 0.0, HUB_LENGTH / 2])
        spin = attitude.apply(omega)
        q = np.concatenate([self._quaternion(attitude), p + root, _STRAIN @ k])
        return np.concatenate([q, spin, v + np.cross(spin, root), _STRAIN @ kd])

    def velocity_map(self, attitude: Rotation) -> np.ndarray:
        """(8, 8): its velocities per (v of B world, ω body, k̇)."""
        R = attitude.as_matrix()
        T = np.zeros((8, 8))
        T[:3, 3:6] = R
        T[3:6, :3] = np.eye(3)
        T[3:6, 3:6] = -_cross(R @ [0.0, 0.0, HUB_LENGTH / 2]) @ R
        T[6:, 6:] = _STRAIN
        return T

    def mass_matrix(self, y: np.ndarray, attitude: Rotation) -> np.ndarray:
        """M (8, 8) for (v of B world, ω body, k̇)."""
        T = self.velocity_map(attitude)
        return T.T @ np.asarray(self._terms(y[:9], y[9:])[0]) @ T

    def accelerations(
        self, y: np.ndarray, attitude: Rotation, omega: Any, push: Any = 0.0
    ) -> np.ndarray:
        """(v̇ of B world, ω̇ body, k̈); push (8,): work-conjugate to (v world, ω body, k̇)."""
        T = self.velocity_map(attitude)
        effort = np.linalg.solve(T.T, np.broadcast_to(push, 8))
        rates = np.asarray(self._rates(y, effort))[9:]
        R, arm = attitude.as_matrix(), attitude.apply([0.0, 0.0, HUB_LENGTH / 2])
        spin, turn = R @ omega, rates[:3]
        # The root is half a hub above B and accelerates with it and around it.
        above = np.cross(turn, arm) + np.cross(spin, np.cross(spin, arm))
        return np.concatenate([rates[3:6] - above, R.T @ turn, _STRAIN @ rates[6:]])

    def rates(self, y: np.ndarray) -> np.ndarray:
        """The rate of its own state in free flight."""
        return np.asarray(self._rates(y, np.zeros(8)))

    def tip(self, y: np.ndarray) -> np.ndarray:
        """Position of the arm's tip, world axes."""
        pose = np.asarray(self._pose(y[:9], self.length)).ravel()
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
