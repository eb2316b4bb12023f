"""Presets with tendons: what their sources say, and taut tendons at rest and in a hover."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.analysis.plausible import doubts
from continuair.equations import rod_curve

PULLED = ("aet", "dual_arm_hex", "rao", "tentacle", "x500_trunk")

ON_ONE_SIDE = pytest.param("tentacle", marks=pytest.mark.filterwarnings("ignore:tendons saturate"))
"""Its two tendons cannot bend it to the other side, as the controller at times asks."""


def tip_below(vehicle: ca.Vehicle, gravity: float) -> Any:
    """Return the tip's place at rest, from the arm's base, and the axes there."""
    polar = ca.trim(vehicle, gravity=gravity).q[6:].reshape(-1, 2)
    place, axes = np.zeros(3), np.eye(3)
    for section, (kappa, angle) in zip(vehicle.arms[0].section, polar, strict=True):
        bend = kappa * np.array([np.cos(angle), np.sin(angle)])
        points, frames = rod_curve(section.orders, section.length, bend, [section.length])
        place, axes = place + axes @ points[0], axes @ frames[0]
    return place, axes


@pytest.mark.parametrize("name", PULLED)
def test_tendons_of_presets_are_taut_at_rest(name: str) -> None:
    vehicle = ca.load_vehicle(name)
    held = ca.tendon_tensions(vehicle, np.zeros(vehicle.layout.bends))
    assert held.tensions.shape == (vehicle.tendons,)
    assert held.tensions.min() >= 0.3
    groups = [group for arm in vehicle.arms for group in arm.tendon]
    assert all(group.pretension >= group.tension_limits[0] for group in groups)
    assert all(group.pretension > 0.0 for group in groups)


@pytest.mark.parametrize("name", PULLED)
def test_presets_with_tendons_are_plausible(name: str) -> None:
    found = doubts(ca.load_vehicle(name))
    # Silicone as soft as was measured does collapse if it is held level.
    assert [text.split(" is ")[0] for text in found] == (
        ["gravity number g / l ω²"] if name == "tentacle" else []
    )


@pytest.mark.parametrize("name", PULLED)
def test_three_tendons_of_a_group_bend_no_arm_together(name: str) -> None:
    """Their angles are given with digits enough for controllers to find the common tension."""
    for arm in ca.load_vehicle(name).arms:
        for group in arm.tendon:
            if group.count == 3:
                assert abs(np.exp(1j * np.array(group.angles)).sum()) < 1e-6


def test_the_elephant_trunk_has_the_published_lengths_offsets_and_disks() -> None:
    arm = ca.load_vehicle("aet").arms[0]
    assert [section.length for section in arm.section] == [0.21] * 3
    assert [len(section.disks) for section in arm.section] == [7] * 3
    assert [group.offset for group in arm.tendon] == [
        (each, each) for each in (0.0238, 0.024, 0.0208)
    ]
    assert [group.section for group in arm.tendon] == [section.name for section in arm.section]


def test_the_benchmarks_robot_is_bent_as_its_own_model_says() -> None:
    """Tensions 4, 0, 0 and 0, 2, 0 N, by the benchmark's model of arcs from disk to disk."""
    vehicle = ca.load_vehicle("rao")
    arm = vehicle.arms[0]
    assert [len(section.disks) for section in arm.section] == [10, 10]
    for section in arm.section:
        assert section.length == 0.2
        assert section.bending_stiffness == pytest.approx(0.0101830, rel=1e-5)
    tendon = [
        {"angles": [group.angles[index]], "offset": 0.01, "section": group.section,
         "guides": "disks", "pretension": tension}
        for group, index, tension in zip(arm.tendon, (0, 1), (4.0, 2.0), strict=True)
    ]  # fmt: skip
    place, _ = tip_below(vehicle.replace({"arm.robot.tendon": tendon}), gravity=0.0)
    assert place * [1.0, 1.0, -1.0] == pytest.approx((0.12938, 0.14605, 0.33416), abs=5e-6)


def test_the_tentacle_has_the_mass_and_flexibility_of_a_taper_and_bends_as_measured() -> None:
    vehicle = ca.load_vehicle("tentacle")
    arm = vehicle.arms[0]
    ends = np.interp(np.cumsum([0.0, *[section.length for section in arm.section]]),
                     [0.0, 0.305, 0.36], [15.41e-3, 6.42e-3, 4.80e-3])  # fmt: skip
    assert sum(section.length for section in arm.section) == pytest.approx(0.36, rel=1e-12)
    for section, base, end in zip(arm.section, ends[:-1], ends[1:], strict=True):
        area = np.pi * (base**2 + base * end + end**2) / 3.0
        assert section.mass_per_length == pytest.approx(1318.0 * area, rel=1e-3)
        flexible = (end**-3 - base**-3) / (3.0 * (base - end))
        assert section.radius == pytest.approx(flexible**-0.25, rel=1e-3)
        assert section.damping == pytest.approx(0.04 * section.bending_stiffness, rel=0.02)
    group = arm.tendon[0]
    assert np.diff(group.offset)[0] == pytest.approx(-0.0295 * 0.305, abs=1e-5)
    # A motor at 0.1 N m, and a marker 8 mm beyond the tip.
    for index, measured in ((0, (0.0535, 0.1138, -0.3175)), (1, (0.0707, -0.1182, -0.3087))):
        tendon = [{"angles": [group.angles[index]], "offset": group.offset, "section": "outer",
                   "pretension": 0.1 / 0.0325}]  # fmt: skip
        place, axes = tip_below(vehicle.replace({"arm.tentacle.tendon": tendon}), gravity=9.81)
        assert place + axes @ [0.0, 0.0, -0.008] == pytest.approx(measured, abs=0.02)


def test_the_x500_has_its_wheelbase_and_winches() -> None:
    vehicle = ca.load_vehicle("x500_trunk")
    rotors = vehicle.uav.rotors
    assert rotors is not None
    hubs = rotors.hubs
    assert max(np.linalg.norm(hubs[:, None] - hubs, axis=-1).ravel()) == pytest.approx(0.5)
    assert 9.0 <= rotors.limits[0][1] <= 12.0
    for group in vehicle.arms[0].tendon:
        assert (group.command, group.count) == ("length", 3)


def test_the_hexarotor_is_that_of_dual_arm_with_rotors_that_push_sideways() -> None:
    vehicle, other = (ca.load_vehicle(name) for name in ("dual_arm_hex", "dual_arm"))
    assert vehicle.uav.mass == other.uav.mass
    for arm, same in zip(vehicle.arms, other.arms, strict=True):
        assert (arm.mount, arm.attitude) == (same.mount, same.attitude)
        assert [group.count for group in arm.tendon] == [3]


@pytest.mark.long
@pytest.mark.parametrize("name", [each for each in PULLED if each != "tentacle"] + [ON_ONE_SIDE])
def test_presets_with_tendons_hover(name: str) -> None:
    vehicle = ca.load_vehicle(name)
    start = np.zeros(vehicle.layout.coordinates)
    start[2] = 1.0
    goal = ca.Setpoints(position=[0.0, 0.0, 1.0])
    scenario = ca.Scenario(
        "hover", start, controller=ca.flight_controller(vehicle), setpoints=goal, duration=0.2
    )
    flight = ca.simulate(vehicle, scenario, sample=0.01)
    assert float(flight["tendon_slack"].max()) == 0.0
    assert float(flight["tendon_tension"].min()) > 0.0
    assert flight["position"][-1].to_numpy() == pytest.approx([0.0, 0.0, 1.0], abs=2e-3)
