"""Tapered rods: against equal radii, beam theory by finite elements, a cone, and limits."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import continuair as ca
from continuair import equations as eq
from continuair.controllers.inertias import rigid_inertia
from continuair.vehicle.vehicle_file import as_toml
from tests.sections.strains import UAV, flying, rod
from tests.sections.test_strain import drawn

RADII = [0.008, 0.004]
LENGTH, DENSITY, MODULUS = 0.5, 1500.0, 5e7


def beam(count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and mass of a clamped Euler-Bernoulli cantilever by cubic elements.

    Degrees of freedom: deflection and slope of each node, without those of the clamped one; with
    the rotary inertia of the cross-sections.
    """
    h = LENGTH / count
    x, w = np.polynomial.legendre.leggauss(5)
    u, w = 0.5 * (1.0 + x), 0.5 * h * w
    shape = np.stack([1 - 3 * u**2 + 2 * u**3, h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3,
                      h * (u**3 - u**2)])  # fmt: skip
    slope = np.stack([-6 * u + 6 * u**2, h * (1 - 4 * u + 3 * u**2), 6 * u - 6 * u**2,
                      h * (3 * u**2 - 2 * u)]) / h  # fmt: skip
    bend = np.stack([-6 + 12 * u, h * (-4 + 6 * u), 6 - 12 * u, h * (6 * u - 2)]) / h**2
    K, M = np.zeros((2, 2 * count + 2, 2 * count + 2))
    for element in range(count):
        r = RADII[0] + (RADII[1] - RADII[0]) * (element + u) / count
        at = slice(2 * element, 2 * element + 4)
        K[at, at] += (w * MODULUS * np.pi / 4 * r**4 * bend) @ bend.T
        M[at, at] += (w * DENSITY * np.pi * r**2 * shape) @ shape.T
        M[at, at] += (w * DENSITY * np.pi / 4 * r**4 * slope) @ slope.T
    return K[2:, 2:], M[2:, 2:]


def tapered(**changes: Any) -> ca.Vehicle:
    """Return a vehicle with one tapered section."""
    return flying(rod(**{"radius": RADII, "bending": 2, **changes}))


def bent(vehicle: ca.Vehicle) -> np.ndarray:
    """Return coordinates of a bent arm."""
    return np.concatenate([np.zeros(6), 0.8 * np.ones(vehicle.layout.bends)])


ORDERS: list[dict[str, Any]] = [
    {"bending": 1},
    {"bending": 2, "twist": 1, "stretch": 1, "shear": 1},
]


@pytest.mark.parametrize("orders", ORDERS)
def test_equal_radii_are_one(orders: dict[str, Any]) -> None:
    one, two = (flying(rod(radius=r, damping=1e-3, **orders)) for r in (0.006, [0.006, 0.006]))
    state = drawn(one, 3)
    given = ca.accelerations(one, **state)
    for ours, theirs in zip(ca.accelerations(two, **state), given, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-11 * np.abs(theirs).max())


@pytest.mark.parametrize("orders", ORDERS)
def test_accelerations_are_those_of_the_readable_form(
    orders: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # With its 64 pieces the readable form itself errs by 5e-9 here, with one radius, too.
    monkeypatch.setattr("continuair.equations.strain.PIECES", 256)
    vehicle = flying(rod(radius=RADII, damping=1e-3, nodes=14, **orders))
    state = drawn(vehicle, 5)
    del state["tip_wrench"]
    ours = ca.accelerations(vehicle, **state)
    theirs = eq.rod_accelerations(vehicle, **state)
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * np.abs(b).max())


@pytest.mark.parametrize(("order", "off"), [(2, 1e-3), (3, 3e-4)])
def test_first_frequency_is_that_of_a_beam(order: int, off: float) -> None:
    vehicle = tapered(bending=order)
    K, M = beam()
    expected = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[0, 0])[0])
    found = ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[0]
    # Fewer shapes are stiffer.
    assert 0.0 < found / expected - 1.0 < off
    assert vehicle.arms[0].section[0].clamped_frequency == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize(("order", "off"), [(2, 8e-3), (3, 1.3e-3)])
def test_tip_deflection_converges_to_that_of_a_beam(order: int, off: float) -> None:
    # A small force, under which the deflection is linear.
    vehicle, force = tapered(bending=order), 1e-6
    K, _ = beam()
    load = np.zeros(len(K))
    load[-2] = force
    expected = np.linalg.solve(K, load)[-2]
    found = ca.trim(vehicle, tip_wrench=[force, 0, 0, 0, 0, 0], gravity=0.0)
    section = vehicle.arms[0].section[0]
    points, _ = eq.rod_curve(section.orders, LENGTH, found.q[6:], [LENGTH])
    # The bend F (l - s)/(E I) grows with 1/r⁴ towards the tip; fewer shapes are stiffer.
    assert 0.0 < 1.0 - points[-1, 0] / expected < off


def test_mass_and_centre_are_those_of_a_cone() -> None:
    vehicle = tapered(disks=[{"position": 0.2, "mass": 0.01}])
    a, b = RADII
    mass = DENSITY * np.pi * LENGTH / 3 * (a * a + a * b + b * b)
    centre = LENGTH / 4 * (a * a + 2 * a * b + 3 * b * b) / (a * a + a * b + b * b)
    assert vehicle.arms[0].section[0].backbone_mass == pytest.approx(mass, rel=1e-13)
    moment = rigid_inertia(vehicle)[3:6, :3]
    below = 0.05 * (mass + 0.01) + mass * centre + 0.01 * 0.2
    assert abs(moment[0, 1]) == pytest.approx(below, rel=1e-12)
    bare = tapered()
    assert bare.mass - UAV["mass"] == pytest.approx(mass, rel=1e-12)


def test_energy_is_kept_in_flight() -> None:
    vehicle = tapered(twist=0)
    scenario = ca.Scenario("release", bent(vehicle), duration=0.5, gravity=0.0)
    flight = ca.simulate(vehicle, scenario, sample=0.01, rtol=1e-10)
    total = flight["kinetic_energy"] + flight["elastic_energy"]
    assert float(np.ptp(total.values)) < 1e-6 * float(total[0])
    assert float(flight["elastic_energy"].min()) < 0.9 * float(total[0])


def test_implicit_flight_is_the_explicit_one() -> None:
    vehicle = tapered(damping_ratio=0.05)
    scenario = ca.Scenario("release", bent(vehicle), duration=0.2)
    flights = [
        ca.simulate(vehicle, scenario, sample=0.01),
        ca.simulate(vehicle, scenario, step=2e-5, sample=0.01, method="implicit"),
    ]
    ends = [each["strain"].isel(time=-1).values for each in flights]
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-3 * np.abs(ends[0]).max())


def test_batches_have_rows_of_two() -> None:
    one = tapered(bending=1)
    rows = [[0.008, 0.004], [0.006, 0.006], [0.005, 0.003]]
    for start in (one, flying(rod(bending=1))):
        batch = start.replace({"arm.0.section.0.radius": rows})
        assert batch.runs == 3
        for run, radii in enumerate(rows):
            single = one.replace({"arm.0.section.0.radius": radii})
            assert single.runs is None
            assert batch.select(run) == single
            state = drawn(one, 2)
            together, alone = ca.accelerations(batch, **state), ca.accelerations(single, **state)
            for a, b in zip(together, alone, strict=True):
                np.testing.assert_array_equal(a[run], b)
    assert flying(rod(bending=1)).replace({"arm.0.section.0.radius": [0.004, 0.005]}).runs == 2
    uniform = one.replace({"arm.0.section.0.radius": [0.004, 0.005, 0.006]})
    assert uniform.runs == 3
    assert not uniform.arms[0].section[0].tapered


def test_descriptions_round_trip() -> None:
    from continuair.vehicle.vehicle import vehicle_of_run

    vehicle = tapered()
    assert ca.Vehicle(**vehicle.describe()) == vehicle
    assert "0.008" in as_toml(vehicle)
    for changes in ({"uav.mass": [1.0, 2.0]}, {"arm.0.section.0.radius": [RADII, RADII]}):
        batch = vehicle.replace(changes)
        for run in range(2):
            assert vehicle_of_run(batch.describe(), run) == batch.select(run)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"radius": [0.008, 0.0]}, "radius"),
        ({"radius": [0.008, -0.004]}, "radius"),
        ({"radius": [0.008]}, "radius"),
        ({"radius": [0.4, 0.004]}, "radius"),
        ({"drag_coefficient": 1.0}, "drag_coefficient"),
        ({"density": None, "mass_per_length": 0.1}, "mass_per_length"),
        ({"youngs_modulus": None, "bending_stiffness": 0.1}, "bending_stiffness"),
    ],
)
def test_unusable_tapers_are_refused(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(ca.InputError) as refused:
        tapered(**changes)
    assert refused.value.field.endswith(field)


def test_an_arc_has_one_radius() -> None:
    with pytest.raises(ca.InputError) as refused:
        flying(rod(radius=RADII))
    assert refused.value.field.endswith("radius")


def test_controllers_do_not_hold_a_taper() -> None:
    with pytest.raises(ca.InputError):
        ca.hold(tapered(), [0.0, 0.0, 1.0])
    assert ca.hold(tapered(), [0.0, 0.0, 1.0], bend_rate=0.0)


def test_contact_needs_one_radius() -> None:
    obstacle = ca.Sphere(centre=[0.0, 0.0, -5.0], radius=0.1)
    vehicle = tapered()
    with pytest.raises(ca.InputError):
        ca.simulate(vehicle, ca.Scenario("near", bent(vehicle), duration=0.1, obstacles=[obstacle]))
