"""The vehicle: its derived quantities, its batches, and what it says about unusable input."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from continuair.errors import ContinuairWarning
from continuair.vehicle.camera import Camera
from continuair.vehicle.disk import Disk
from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import load_vehicle, preset_names
from tests.refusals import refused

PAPER = load_vehicle("paper")
PAPER_TOML = Path(__file__).parents[1] / "src/continuair/presets/paper.toml"
# Derived quantities are a few products of floats; 5e-14 is some hundred roundings.
EXACT = 5e-14

lengths = st.floats(0.1, 3.0)
radii = st.floats(1e-4, 0.05)
densities = st.floats(100.0, 2e4)
moduli = st.floats(1e6, 4e11)
arms = st.builds(Section, length=lengths, radius=radii, density=densities, youngs_modulus=moduli)


def test_paper_preset_holds_values_that_the_paper_sweeps_and_our_choices() -> None:
    assert preset_names() == (
        "aet", "dual_arm", "dual_arm_hex", "paper", "rao", "slender", "table1", "tentacle",
        "two_section", "x500_trunk",
    )  # fmt: skip
    assert PAPER.uav.mass == 2.0
    np.testing.assert_array_equal(PAPER.uav.inertia, np.diag([0.024, 0.024, 0.047]))
    arm = PAPER.arm
    assert (arm.length, arm.radius, arm.density, arm.youngs_modulus) == (1.0, 0.005, 7850, 207e9)
    assert (arm.damping, arm.damping_ratio, arm.disks, arm.kappa_s) == (0, None, (), 1e-3)
    assert PAPER.uav.mount == (0, 0, 0)
    assert PAPER.camera == Camera()


def test_paper_preset_has_the_stiffness_and_mass_of_a_10_mm_steel_rod() -> None:
    # Worked by hand: pi/4 (5 mm)^4 = 4.908739e-10 m^4 and pi (5 mm)^2 = 7.853982e-5 m^2.
    assert PAPER.arm.area == pytest.approx(7.853982e-5, rel=1e-6)
    assert PAPER.arm.bending_stiffness == pytest.approx(101.61089, rel=1e-6)
    assert PAPER.arm.mass == pytest.approx(0.6165376, rel=1e-6)
    assert PAPER.mass == pytest.approx(2.6165376, rel=1e-6)


def test_slender_preset_differs_from_paper_only_in_name_and_radius() -> None:
    assert load_vehicle("slender") == PAPER.replace({"name": "slender", "arm.radius": 0.0025})


def test_clamped_frequency_of_paper_is_the_textbook_one_up_to_rotary_inertia() -> None:
    arm = PAPER.arm
    textbook = math.sqrt(20 * arm.bending_stiffness / (arm.mass_per_length * arm.length**4))
    # Rotary inertia adds (rho I l^3/3) / (rho A l^5/20) = (5/3) (r/l)^2 to the modal mass.
    rotary = 5 / 3 * (arm.radius / arm.length) ** 2
    assert arm.clamped_frequency == pytest.approx(
        textbook / math.sqrt(1 + rotary), rel=EXACT, abs=0
    )
    assert rotary < 1e-4


def test_clamped_frequency_is_27_percent_above_a_true_cantilever() -> None:
    arm = PAPER.arm
    # First root of cos(x) cosh(x) = -1, squared.
    stiffness_to_mass = arm.bending_stiffness / (arm.mass_per_length * arm.length**4)
    cantilever = 1.8751040687**2 * math.sqrt(stiffness_to_mass)
    assert arm.clamped_frequency / cantilever == pytest.approx(1.27, abs=0.005)


@given(arms)
def test_section_properties_are_integrals_over_a_disk(arm: Section) -> None:
    # Strips across a unit disk at height sin(t): smooth in t, so that quad is exact to rounding.
    unit_area, _ = quad(lambda t: 2 * math.cos(t) ** 2, -math.pi / 2, math.pi / 2)
    unit_second, _ = quad(lambda t: 2 * (math.sin(t) * math.cos(t)) ** 2, -math.pi / 2, math.pi / 2)
    second = unit_second * arm.radius**4
    assert arm.area == pytest.approx(unit_area * arm.radius**2, rel=EXACT, abs=0)
    assert arm.second_moment == pytest.approx(second, rel=EXACT, abs=0)
    # Perpendicular axes: the polar moment of a plane section is the sum of the other two.
    assert arm.axial_inertia_per_length == 2 * arm.transverse_inertia_per_length
    assert arm.transverse_inertia_per_length == pytest.approx(
        arm.density * second, rel=EXACT, abs=0
    )


@given(arms, st.floats(0, 1), st.floats(0, 1), st.floats(0, 1e-3))
def test_straight_modal_mass_is_twice_the_kinetic_energy_of_unit_bend_rate(
    arm: Section, fraction: float, mass: float, moment: float
) -> None:
    s_disk = fraction * arm.length
    disk = Disk(position=s_disk, mass=mass, inertia=(moment, moment))
    loaded = Section(**{**dict(arm), "disks": (disk,)})
    # At bend 0 and unit bend rate a section moves s^2/2 sideways and turns by s.
    nodes, weights = np.polynomial.legendre.leggauss(5)
    s = arm.length * (nodes + 1) / 2
    ds = arm.length * weights / 2
    twice_energy = ds @ (
        arm.mass_per_length * (s**2 / 2) ** 2 + arm.transverse_inertia_per_length * s**2
    )
    twice_energy += mass * (s_disk**2 / 2) ** 2 + moment * s_disk**2
    assert loaded.straight_modal_mass == pytest.approx(twice_energy, rel=EXACT, abs=0)
    assert loaded.mass == pytest.approx(arm.backbone_mass + mass, rel=EXACT, abs=0)
    assert disk.transverse_inertia == moment


@given(arms, st.floats(1e-3, 0.9))
def test_damping_ratio_sets_the_decay_of_the_clamped_mode(arm: Section, ratio: float) -> None:
    damped = Section(**{**dict(arm), "damping_ratio": ratio})
    # Free motion: M k'' + d l k' + E I l k = 0; its roots' real part is -ratio * frequency.
    roots = np.roots(
        [
            damped.straight_modal_mass,
            damped.structural_damping * damped.length,
            damped.bending_stiffness * damped.length,
        ]
    )
    assert roots[0].real == pytest.approx(-ratio * arm.clamped_frequency, rel=1e-12, abs=0)


def test_a_rod_without_mass_in_floating_point_numbers_is_refused_though_a_disk_has_some() -> None:
    vehicle = load_vehicle("paper")
    with refused("arm.radius"):
        vehicle.replace({"arm.density": 5e-324, "arm.disks": [{"position": 1.0, "mass": 0.2}]})


def test_damping_given_directly_is_the_structural_damping() -> None:
    assert PAPER.replace({"arm.damping": 0.3}).arm.structural_damping == 0.3
    assert PAPER.arm.structural_damping == 0


def test_a_damping_takes_the_place_of_a_ratio_and_conversely_also_where_it_is_0() -> None:
    by_ratio = PAPER.replace({"arm.damping_ratio": 0.1})
    assert by_ratio.arm.structural_damping > 0.0 and by_ratio.arm.damping is None
    undamped = by_ratio.replace({"arm.damping": 0.0})
    assert undamped.arm.structural_damping == 0.0 and undamped.arm.damping_ratio is None
    assert PAPER.replace({"arm.damping": None}).arm.structural_damping == 0.0
    with refused("damping"):
        Section(
            length=1, radius=0.01, density=1e3, youngs_modulus=1e9, damping=0.0, damping_ratio=0.1
        )


def test_numpy_numbers_and_arrays_are_held_as_plain_numbers() -> None:
    uav = Uav(
        mass=np.float32(2.0), inertia=np.diag([0.024, 0.024, 0.047]), mount=np.array([0, 0, -0.1])
    )
    assert uav == Uav(mass=2, inertia=[0.024, 0.024, 0.047], mount=[0, 0, -0.1])
    assert type(uav.mass) is float
    assert Uav(mass=np.array(2.0), inertia=PAPER.uav.inertia).mass == 2.0
    assert Uav(mass=np.int64(2), inertia=tuple(np.eye(3))).inertia[2] == (0, 0, 1)
    disk = {"position": np.array(0.1), "mass": np.float64(0.02), "inertia": (0.0, 0.0)}
    assert PAPER.replace({"arm.disks": [disk]}).arm.disks[0].position == 0.1


def test_equal_vehicles_have_equal_hashes() -> None:
    again = load_vehicle(PAPER_TOML)
    assert again == PAPER
    assert hash(again) == hash(PAPER)
    assert load_vehicle("slender") != PAPER


def test_attitude_is_normalised_when_it_is_nearly_of_norm_one() -> None:
    camera = Camera(attitude=(0.0, 0.7072, 0.0, 0.7070))
    assert math.hypot(*camera.attitude) == pytest.approx(1, abs=3e-15)
    with refused("attitude"):
        Camera(attitude=(0, 0, 0, 2))


@given(st.tuples(*[st.floats(0.01, 1.0)] * 3), st.floats(-3, 3))
def test_inertia_of_any_cloud_of_points_is_accepted_without_warning(
    spread: tuple[float, float, float], angle: float
) -> None:
    # Point masses at +-a on three axes: principal moments a2+a3, a1+a3, a1+a2; then turned.
    a = np.array(spread)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    inertia = turn @ np.diag(a.sum() - a) @ turn.T
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        uav = Uav(mass=1.0, inertia=inertia)
    np.testing.assert_allclose(uav.inertia, inertia, rtol=0, atol=2e-14)


def test_excess_over_the_triangle_inequality_warns_up_to_5_percent_and_is_refused_above() -> None:
    limit = 2 * 0.024
    with pytest.warns(ContinuairWarning, match="uav.inertia"):
        PAPER.replace({"uav.inertia": [0.024, 0.024, limit * 1.049]})
    with refused("uav.inertia"):
        PAPER.replace({"uav.inertia": [0.024, 0.024, limit * 1.051]})
    PAPER.replace({"uav.inertia": [0.024, 0.024, limit]})


def test_disk_obeys_the_triangle_inequality_with_the_thin_disk_as_its_limit() -> None:
    Disk(position=0.5, mass=0.1, inertia=(1e-5, 2e-5))
    Disk(position=0.5, mass=0.1, inertia=(1e-5, 0))
    with pytest.warns(ContinuairWarning, match="disks"):
        Disk(position=0.5, mass=0.1, inertia=(1e-5, 2.09e-5))
    for inertia in [(1e-5, 2.11e-5), (0, 1e-9)]:
        with refused("inertia"):
            Disk(position=0.5, mass=0.1, inertia=inertia)
