"""Arms whose strain varies in SoRoMoX: a floating hub, then segments with Legendre strain fields.

A rigid first segment is the UAV, as in soromox_hub.py, whose axes are used here too. With local
axes (x, y, z) = (-z, y, x) of B, SoRoMoX's strains are κ_x = τ, κ_y = -b_x, κ_z = b_y,
σ_x = 1 + e, σ_y = γ_y, σ_z = γ_x.
"""

from typing import Any
from unittest import mock

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS
from tests.oracles.conftest import Claim
from tests.sections.strains import rod

pytest.importorskip("soromox", exc_type=ImportError)
import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import soromox.systems.gvs.construction as construction  # noqa: E402
import soromox.systems.gvs.core as core  # noqa: E402
from soromox.systems.components import JointSpec, LinkSpec  # noqa: E402
from soromox.systems.gvs import GVS, GVSSegment, StrainBasisSpec  # noqa: E402

from tests.oracles.soromox_hub import (  # noqa: E402
    HUB_LENGTH,
    HUB_MASS,
    HUB_RADIUS,
    SOURCE,
)

STATES, NODES, COARSE = 5, 16, 64
LOCAL = Rotation.from_matrix([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
ROWS = dict(zip(COMPONENTS, ((1, -1.0), (2, 1.0), (0, 1.0), (3, 1.0), (5, 1.0), (4, 1.0)),
                strict=True))  # fmt: skip
"""Row of SoRoMoX's strain, and sign, of each component."""

ARMS: dict[str, list[dict[str, Any]]] = {
    "linear bending": [rod(nodes=NODES, bending=1)],
    "quadratic bending": [rod(nodes=NODES, bending=2)],
    "linear bending with linear twist": [rod(nodes=NODES, bending=1, twist=1)],
    "bending, twist, stretch and shear": [
        rod(nodes=NODES, bending=1, twist=0, stretch=0, shear=0)
    ],
    "an arc, then linear bending": [
        rod(length=0.3), rod(nodes=NODES, length=0.3, bending=1)
    ],
}  # fmt: skip


def numpys_nodes(N_GQ: int, a: float = 0.0, b: float = 1.0) -> tuple[Any, Any, int]:
    """NumPy's nodes with both ends: SoRoMoX's own stop converging at the rounding of float32."""
    x, weight = np.polynomial.legendre.leggauss(N_GQ)
    places, weights = np.concatenate([[-1], x, [1]]), np.concatenate([[0], weight, [0]])
    return a + (b - a) * jnp.asarray(1 + places) / 2, (b - a) * jnp.asarray(weights) / 2, N_GQ + 2


def segment(section: Section | None, nodes: int) -> GVSSegment:
    """A section, or the rigid cylinder of the hub."""
    selector, orders = [0] * 6, [0] * 6
    if section is None:
        density = HUB_MASS / (np.pi * HUB_RADIUS**2 * HUB_LENGTH)
        shape, young, ratio = (HUB_LENGTH, HUB_RADIUS, density), 1e9, 0.25
    else:
        shape = section.length, section.radius, section.density
        young, ratio = section.youngs_modulus, section.poisson_ratio or 0.25
        for name, count in zip(COMPONENTS, section.orders.counts, strict=True):
            if count:
                selector[ROWS[name][0]], orders[ROWS[name][0]] = 1, count - 1
    link = LinkSpec.circular(
        length=shape[0], radius=shape[1], density=shape[2], young_modulus=young,
        poisson_ratio=ratio, material_damping_coefficient=0.0,
        reference_strain=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    )  # fmt: skip
    basis = StrainBasisSpec("legendre", selector, orders)
    return GVSSegment(link=link, joint=JointSpec.fixed(), num_gauss_points=nodes, basis=basis)


class Robot:
    """A vehicle as a floating robot of SoRoMoX."""

    def __init__(self, vehicle: ca.Vehicle, nodes: int) -> None:
        sections = vehicle.arms[0].section
        with (
            mock.patch.object(core, "gauss_quadrature", numpys_nodes),
            mock.patch.object(construction, "gauss_quadrature", numpys_nodes),
        ):
            robot = GVS.from_segments(
                [segment(each, nodes) for each in (None, *sections)],
                gravity=jnp.asarray([0.0, 0.0, -9.81]), floating_base=True, backend="jax",
            )  # fmt: skip
        self._rates = jax.jit(lambda y, push: robot.forward_dynamics(0.0, y, (None, push)))
        order: list[int] = []
        sign: list[float] = []
        for section in sections:
            counts = dict(zip(COMPONENTS, section.orders.counts, strict=True))
            first, at = {}, len(order)
            for name in sorted(COMPONENTS, key=lambda name: ROWS[name][0]):
                first[name], at = at, at + counts[name]
            for name in COMPONENTS:
                order += range(first[name], first[name] + counts[name])
                sign += [ROWS[name][1]] * counts[name]
        self._order, self._sign = np.array(order), np.array(sign)

    def theirs(self, own: np.ndarray) -> np.ndarray:
        """Coordinates, rates or forces of the sections in SoRoMoX's order and signs."""
        found = np.zeros(len(own))
        found[self._order] = self._sign * own
        return found

    def accelerations(self, state: dict[str, np.ndarray]) -> np.ndarray:
        """(v̇ of B world, ω̇ body, strain's second derivatives)."""
        attitude = Rotation.from_quat(state["attitude"])
        up = attitude.apply([0.0, 0.0, HUB_LENGTH / 2])
        spin = attitude.apply(state["angular_velocity"])
        place = np.concatenate([(attitude * LOCAL).as_quat(), up, self.theirs(state["strain"])])
        moved = [spin, state["velocity"] + np.cross(spin, up), self.theirs(state["strain_rate"])]
        effort = np.concatenate([np.zeros(6), self.theirs(state["strain_force"])])
        rates = np.array(self._rates(np.concatenate([place, *moved]), effort))[len(place) :]
        turn = rates[:3]
        above = np.cross(turn, up) + np.cross(spin, np.cross(spin, up))
        own = self._sign * rates[6:][self._order]
        return np.concatenate([rates[3:6] - above, attitude.inv().apply(turn), own])


@pytest.mark.parametrize("name", ARMS)
def test_accelerations_of_strain_fields(claim: Claim, name: str) -> None:
    across = HUB_MASS * (HUB_LENGTH**2 / 12 + HUB_RADIUS**2 / 4)
    uav = {"mass": HUB_MASS, "inertia": [across, across, HUB_MASS * HUB_RADIUS**2 / 2]}
    arm = {"mount": [0.0, 0.0, -HUB_LENGTH / 2], "section": ARMS[name]}
    vehicle = ca.Vehicle(name="hub", uav=uav, arm=[arm])
    coarse, fine = Robot(vehicle, COARSE), Robot(vehicle, 2 * COARSE)
    random, worst = np.random.default_rng(8), 0.0
    parts = [each for section in vehicle.arms[0].section for each in section.orders.coordinates]
    size = np.array([0.05 if component > 2 else 1.0 for component, _ in parts])
    for _ in range(STATES):
        state: dict[str, Any] = {
            "attitude": random.normal(size=4),
            "velocity": random.normal(size=3),
            "angular_velocity": random.normal(size=3),
            "strain": size * random.normal(size=len(parts)),
            "strain_rate": size * random.normal(size=len(parts)),
            "strain_force": 0.01 * random.normal(size=len(parts)),
        }
        # Its product of exponentials between nodes is of the fourth order.
        theirs = (16.0 * fine.accelerations(state) - coarse.accelerations(state)) / 15.0
        ours = np.concatenate(ca.accelerations(vehicle, **state))
        for part in (slice(0, 3), slice(3, 6), slice(6, None)):
            error = np.linalg.norm(ours[part] - theirs[part]) / np.linalg.norm(theirs[part])
            worst = max(worst, float(error))
    what = f"accelerations of strain fields, {name}, worst of v̇, ω̇ and q̈ relative"
    note = f"SoRoMoX extrapolated from {COARSE} and {2 * COARSE} nodes, ours of {NODES}"
    claim(f"{what}, {STATES} random states", SOURCE, 1e-9, worst, note=note)
