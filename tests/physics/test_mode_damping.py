"""Damping of modes: that of the linear system, also of arms that are almost alike."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.refusals import refused

pytestmark = pytest.mark.targets


def twins(first: float, second: float, tilt: float = 0.0) -> ca.Vehicle:
    """Two arms alike but for their damping ratios."""

    def arm(name: str, side: float, ratio: float) -> dict[str, Any]:
        section = {"length": 0.3, "mass_per_length": 0.08, "bending_stiffness": 0.15}
        attitude = Rotation.from_euler("ZX", [side * tilt, side * tilt]).as_quat()
        return {
            "name": name,
            "mount": [0.0, 0.15 * side, -0.05],
            "attitude": attitude.tolist(),
            "section": [section | {"damping_ratio": ratio}],
            "tip": {"mass": 0.05, "inertia": [2e-5] * 3},
        }

    arms = [arm("one", 1.0, first), arm("other", -1.0, second)]
    return ca.Vehicle(name="twins", uav={"mass": 2.0, "inertia": [0.02, 0.022, 0.04]}, arm=arms)


@pytest.mark.parametrize("ratios", [(0.02, 0.2), (0.02, 0.4), (0.1, 0.1), (2.0, 0.02)])
def test_damping_is_that_of_the_linear_system_whose_frequencies_are_close(
    ratios: tuple[float, float],
) -> None:
    """Arms alike but for their damping do not swing with the mean of both."""
    vehicle = twins(*ratios)
    A, _ = ca.linearize(vehicle, np.zeros(10), gravity=0.0)
    roots = np.linalg.eigvals(A)
    roots = roots[roots.imag > 1e-3 * np.abs(roots).max()]
    order = np.argsort(np.abs(roots))
    found = ca.modes(vehicle)
    np.testing.assert_allclose(found.frequencies, np.abs(roots)[order], rtol=1e-8)
    np.testing.assert_allclose(
        found.damping, (-roots.real / np.abs(roots))[order], rtol=0, atol=1e-7
    )


def test_what_creeps_back_has_a_ratio_above_one_as_it_is_given() -> None:
    """Each arm alone on a clamped base, the one of them twice critically damped."""
    vehicle = twins(0.3, 5.0)
    found = ca.modes(vehicle, base="clamped", gravity=0.0)
    # A tip makes both slower by the same share.
    np.testing.assert_allclose(found.frequencies, found.frequencies[0], rtol=1e-9)
    np.testing.assert_allclose(found.damping[2:], 5.0 / 0.3 * found.damping[:2], rtol=1e-9)
    assert found.damping[0] < 1.0 < found.damping[3]
    bends = np.abs(found.shapes)
    np.testing.assert_allclose(bends, np.eye(4), atol=1e-9)


def test_arms_on_a_clamped_base_swing_each_with_its_own_damping_wherever_they_point() -> None:
    found = ca.modes(twins(0.02, 0.4, tilt=0.4), base="clamped", gravity=0.0)
    np.testing.assert_allclose(found.damping[2:], 20.0 * found.damping[:2], rtol=1e-9)
    assert np.abs(found.shapes[2:, :2]).max() < 1e-9 and np.abs(found.shapes[:2, 2:]).max() < 1e-9


def test_modes_of_a_batch_have_a_row_for_each_run() -> None:
    batch = ca.load_vehicle("slender").replace({"arm.youngs_modulus": [2e9, 8e9, 32e9]})
    found = ca.modes(batch, base="clamped", gravity=0.0)
    np.testing.assert_allclose(found.frequencies[1:], 2.0 * found.frequencies[:-1], rtol=1e-9)
    alone = ca.modes(batch.select(2), base="clamped", gravity=0.0)
    np.testing.assert_array_equal(found.shapes[2], alone.shapes)
    np.testing.assert_array_equal(found.damping[2], alone.damping)


def test_the_run_of_a_batch_that_buckles_is_named() -> None:
    """On its head, the softer arm falls over."""
    batch = ca.load_vehicle("slender").replace({"arm.youngs_modulus": [8e11, 2e7]})
    with refused("q", place="run 1"):
        ca.modes(batch, [0, 0, 0, 0, np.pi, 0, 0, 0], base="clamped")


@pytest.mark.long
def test_a_mode_decays_as_a_flight_from_its_shape_does() -> None:
    """Of arms nearly alike, so that the damping, not the coupling, tells which of them swings."""
    vehicle = twins(0.02, 0.4)
    found = ca.modes(vehicle)
    slow = int(np.argmin(found.damping))
    q, bends = np.zeros(10), 1e-3 * found.shapes[6:, slow]
    q[6::2] = np.hypot(bends[::2], bends[1::2])
    q[7::2] = np.arctan2(bends[1::2], bends[::2])
    period = 2.0 * np.pi / (found.frequencies[slow] * np.sqrt(1.0 - found.damping[slow] ** 2))
    scenario = ca.Scenario("ring", q, gravity=0.0, duration=4.0 * period)
    run = ca.simulate(vehicle, scenario, method="RK4", step=1e-3, sample=period)
    swing = np.linalg.norm(run.bend.to_numpy().reshape(len(run.time), -1), axis=1)
    decay = np.log(swing[1] / swing[4]) / (3.0 * period)
    assert decay == pytest.approx(found.damping[slow] * found.frequencies[slow], rel=0.05)


def creeping() -> ca.Vehicle:
    """Sections of which one is far beyond critical damping, the other next to it."""
    sections = [
        {"length": 0.4, "mass_per_length": 0.26, "bending_stiffness": 0.024, "damping_ratio": 3.5},
        {"length": 0.27, "mass_per_length": 0.12, "bending_stiffness": 0.43, "damping_ratio": 0.8},
    ]
    uav = {"mass": 1.5, "inertia": [0.02, 0.02, 0.035]}
    arm = {"section": sections, "tip": {"mass": 0.04}}
    return ca.Vehicle(name="creeping", uav=uav, arm=[arm])


def test_the_slowest_motion_that_creeps_back_is_a_mode() -> None:
    """Its root is that of the linear system nearest to 0, and of a flight from its shape."""
    vehicle = creeping()
    A, _ = ca.linearize(vehicle, np.zeros(10), gravity=0.0)
    roots = np.linalg.eigvals(A)
    slowest = -roots[np.abs(roots) > 1e-4 * np.abs(roots).max()].real.max()
    found = ca.modes(vehicle)
    ratio, frequency = found.damping[0], found.frequencies[0]
    assert ratio > 1.0
    slow = frequency * (ratio - np.sqrt(ratio**2 - 1.0))
    assert slow == pytest.approx(slowest, rel=1e-8)
    q, bends = np.zeros(10), 1e-3 * found.shapes[6:, 0]
    q[6::2] = np.hypot(bends[::2], bends[1::2])
    q[7::2] = np.arctan2(bends[1::2], bends[::2])
    run = ca.simulate(vehicle, ca.Scenario("creep", q, gravity=0.0, duration=3.0 / slow))
    size = np.linalg.norm(run.bend.to_numpy().reshape(len(run.time), -1), axis=1)
    first, last = len(size) // 2, len(size) - 1
    decay = np.log(size[first] / size[last]) / float(run.time[last] - run.time[first])
    assert decay == pytest.approx(slow, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.999999, 1.0, 1.000001])
def test_nothing_jumps_where_damping_is_critical(ratio: float) -> None:
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": ratio})
    found = ca.modes(vehicle, base="clamped", gravity=0.0)
    np.testing.assert_allclose(found.damping, ratio, rtol=1e-7)
    np.testing.assert_allclose(found.frequencies, vehicle.arm.clamped_frequency, rtol=1e-7)
    np.testing.assert_allclose(np.abs(found.shapes), np.eye(2), atol=1e-6)
