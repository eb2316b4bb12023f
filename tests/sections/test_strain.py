"""Sections whose strain varies: against Newton's laws, arcs, beam theory and limits."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations as eq
from continuair.sections.strain.nodes import gathered, gauss, integration
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle_file import as_toml
from tests.sections.newton import Flyer, Rod, needed_forces
from tests.sections.strains import MOUNT, UAV, flying, rod

ARMS: dict[str, list[dict[str, Any]]] = {
    "linear": [rod(nodes=11, bending=1)],
    "all strains": [rod(nodes=14, bending=2, twist=1, stretch=1, shear=0)],
    "arc and strain": [
        rod(length=0.3),
        rod(nodes=14, length=0.3, bending=1, twist=0, disks=[
            {"position": 0.1 * k, "mass": 0.01, "inertia": [2e-6, 4e-6]} for k in (1, 2, 3)
        ]),
    ],
}  # fmt: skip


def as_rod(section: Section, fine: int = 24) -> Rod:
    """Return the same section of the oracle, its backbone in slices at Gauss nodes."""
    orders = section.orders
    bend, shear = (orders.bending,) * 2, (orders.shear,) * 2
    each = (*bend, orders.twist, orders.stretch, *shear)
    nodes, weights = gauss(fine)
    across = section.transverse_inertia_per_length * section.length
    bodies = [(x, w * section.backbone_mass, w * across, 2.0 * w * across)
              for x, w in zip(nodes, weights, strict=True)]  # fmt: skip
    bodies += [(disk.position / section.length, disk.mass, disk.transverse_inertia,
                disk.axial_inertia) for disk in section.disks]  # fmt: skip
    return Rod(section.length, each, bodies, section.rigidities())


def elastic(vehicle: ca.Vehicle, q: np.ndarray) -> np.ndarray:
    """Return the elastic force on the coordinates, by ∫ over the length."""
    found, first = [], 0
    nodes, weights = gauss(8)
    for section in vehicle.arms[0].section:
        one = as_rod(section)
        own = q[first : first + len(one.coordinates)]
        first += len(own)
        for c, p in one.coordinates:
            along = [
                np.polynomial.legendre.Legendre.basis(p)(2 * nodes - 1) * value
                * np.polynomial.legendre.Legendre.basis(order)(2 * nodes - 1)
                for (component, order), value in zip(one.coordinates, own, strict=True)
                if component == c
            ]  # fmt: skip
            found.append(section.length * one.stiffness[c] * (weights @ np.sum(along, 0)))
    return np.array(found)


def drawn(vehicle: ca.Vehicle, seed: int) -> dict[str, Any]:
    """Return a random state and random loads."""
    draw = np.random.default_rng(seed)
    components = [c for each in vehicle.arms[0].section for c, _ in each.orders.coordinates]
    size = np.where(np.array(components) > 2, 0.05, 1.0)
    n = len(components)
    return {
        "attitude": Rotation.random(random_state=seed).as_quat(),
        "strain": size * draw.normal(size=n),
        "strain_rate": size * draw.normal(size=n),
        "angular_velocity": draw.normal(size=3),
        "force": draw.normal(size=3),
        "moment": 0.1 * draw.normal(size=3),
        "tip_wrench": 0.1 * draw.normal(size=(1, 6)),
        "strain_force": 0.01 * draw.normal(size=n),
    }


def test_a_file_holds_a_strain(tmp_path: Path) -> None:
    vehicle = flying(*ARMS["arc and strain"])
    (tmp_path / "vehicle.toml").write_text(as_toml(vehicle))
    assert ca.load_vehicle(tmp_path / "vehicle.toml") == vehicle


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name == "linear" else pytest.mark.long) for name in ARMS],
)
def test_accelerations_obey_newton_and_euler(name: str) -> None:
    vehicle = flying(*ARMS[name])
    flyer = Flyer(
        UAV["mass"], np.array(UAV["inertia"]), np.array(MOUNT),
        [as_rod(each) for each in vehicle.arms[0].section],
    )  # fmt: skip
    state = drawn(vehicle, 4)
    # Without what holds the strain, accelerations are too large to be followed in time.
    state["strain_force"] = state["strain_force"] + elastic(vehicle, state["strain"])
    v_dot, w_dot, q_dot_dot = ca.accelerations(vehicle, **state)
    attitude = Rotation.from_quat(state["attitude"]).as_matrix()
    # The rate of a turning vector of 0 is ω, and its second rate is ω̇.
    rates = np.concatenate([np.zeros(3), state["angular_velocity"], state["strain_rate"]])
    q = state["strain"]
    found = needed_forces(
        flyer, attitude, rates, np.concatenate([v_dot, w_dot, q_dot_dot]), q,
        state["tip_wrench"][0], 9.81,
    )  # fmt: skip
    acting = [state["force"], state["moment"], state["strain_force"] - elastic(vehicle, q)]
    expected = np.concatenate(acting)
    # Second differences lose digits where shear, which is stiff and light, accelerates fast.
    atol = 2e-8 if name == "all strains" else 1e-9
    np.testing.assert_allclose(
        found, expected, rtol=0, atol=atol * max(1.0, np.abs(expected).max())
    )


class ConstantStrain(Section):
    """A section of constant bending that is computed as one whose strain varies."""

    @property
    def kind(self) -> str:
        return "strain"

    @property
    def node_count(self) -> int:
        return 14


@pytest.mark.long
@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
def test_constant_bending_is_the_arc(model: Any) -> None:
    arcs = flying(rod(length=0.3), rod(length=0.2))
    (arm,) = arcs.arms
    for place in (0, 1):
        sections = [ConstantStrain.model_construct(**dict(each)) if n == place else each
                    for n, each in enumerate(arm.section)]  # fmt: skip
        other = arcs.having(arm=(arm.having(section=tuple(sections)),))
        state = {name: value for name, value in drawn(arcs, 7).items() if "strain" not in name}
        draw = np.random.default_rng(8)
        for name in ("bend", "bend_rate", "bend_moment"):
            state[name] = draw.normal(size=(2, 2)) * (0.01 if name == "bend_moment" else 2.0)
        of_arcs = ca.accelerations(arcs, model=model, **state)
        found = ca.accelerations(other, model=model, **state)
        for one, expected in zip(found, of_arcs, strict=True):
            np.testing.assert_allclose(
                one, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max()
            )


@pytest.mark.parametrize(
    ("order", "ratio"),
    [
        (1, 1.0048),
        *(pytest.param(*each, marks=pytest.mark.long) for each in [(2, 1.0003), (3, 1.0)]),
    ],
)
def test_the_first_frequency_approaches_that_of_a_beam(order: int, ratio: float) -> None:
    """The clamped arm oscillates freely in the independent model."""
    vehicle = flying(rod(radius=0.001, bending=order))
    (section,) = vehicle.arms[0].section
    n = 2 * (order + 1)
    small = 1e-6
    _, _, response = ca.accelerations(
        vehicle, strain=small * np.eye(n), model="independent", gravity=0.0
    )
    squares = np.linalg.eigvals(-response.T / small)
    found = np.sqrt(np.sort(squares.real)[0])
    beam = 1.8751040687**2 / section.length**2 * np.sqrt(
        section.bending_stiffness / section.mass_per_length
    )  # fmt: skip
    assert found / beam == pytest.approx(ratio, abs=2e-4)
    assert section.clamped_frequency == pytest.approx(found, rel=1e-6)


def test_nodes_reproduce_moments_of_the_mass_and_integrals() -> None:
    backbone = np.array([[0.3, 2e-6, 4e-6]])
    disks = np.array([[[0.25, 0.05, 1e-6, 2e-6], [1.0, 0.02, 0.0, 0.0]]])
    nodes, bodies = gathered(7, backbone, disks)
    for degree in range(14):
        expected = 0.3 / (degree + 1) + 0.05 * 0.25**degree + 0.02
        assert bodies[0, :, 0] @ nodes[0] ** degree == pytest.approx(expected, rel=1e-12)
    assert bodies[0, :, 0].min() > 0.0
    np.testing.assert_allclose(bodies[0, :, 1:].sum(0), [3e-6, 6e-6], rtol=1e-12)
    A = integration(nodes)[0]
    ends = np.append(nodes[0], 1.0)
    for degree in range(7):
        np.testing.assert_allclose(A @ nodes[0] ** degree, ends ** (degree + 1) / (degree + 1),
                                   rtol=0, atol=1e-13)  # fmt: skip


@pytest.mark.parametrize(
    ("model", "mask"),
    [("coupled", "coupled"), pytest.param("decoupled", "block", marks=pytest.mark.long)],
)
def test_accelerations_are_those_of_the_readable_equations(model: Any, mask: Any) -> None:
    """Reached: 6e-9 with 11 nodes."""
    vehicle, state = flying(*ARMS["linear"]), drawn(flying(*ARMS["linear"]), 5)
    del state["tip_wrench"]
    found = ca.accelerations(vehicle, **state, model=model)
    expected = eq.rod_accelerations(vehicle, **state, mask=mask)
    for one, other in zip(found, expected, strict=True):
        assert np.linalg.norm(one - other) < 2e-8 * max(1.0, float(np.linalg.norm(other)))


@pytest.mark.long
@pytest.mark.parametrize(("count", "error"), [(0, 1e-6), (5, 1e-4)])
def test_the_default_nodes_suffice_up_to_half_a_circle(count: int, error: float) -> None:
    places = 0.5 * np.arange(1, count + 1) / max(count, 1)
    disks = [{"position": s, "mass": 0.05, "inertia": [1e-5, 2e-5]} for s in places]
    vehicle = flying(rod(bending=1, damping_ratio=0.1, disks=disks))
    for strain in ([2.0, 0, 0, 0], [4.0, 1.0, 2.0, 0.5], [0, 5.0, 0, 5.0]):
        found = ca.accelerations(vehicle, strain=strain)[2]
        expected = eq.rod_accelerations(vehicle, strain=strain)[2]
        assert np.linalg.norm(found - expected) < error * np.linalg.norm(expected)
