"""Linearisation, modes and trim."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import continuair as ca
from continuair.linear import bending_frequencies

VEHICLE = ca.load_vehicle("paper")


def test_clamped_modes_are_those_of_the_modal_mass_and_gravity() -> None:
    """ω² = (E I l + g ρA l⁴/12) / M₇₇: gravity stiffens the hanging arm."""
    arm = VEHICLE.arm
    stiffness = arm.bending_stiffness * arm.length + 9.81 * arm.mass_per_length * arm.length**4 / 12
    found = ca.modes(VEHICLE, base="clamped").frequencies
    np.testing.assert_allclose(found, np.sqrt(stiffness / arm.straight_modal_mass), rtol=1e-8)


def test_without_gravity_the_clamped_frequency_is_the_arms_own() -> None:
    found = ca.modes(VEHICLE, base="clamped", gravity=0.0).frequencies
    np.testing.assert_allclose(found, VEHICLE.arm.clamped_frequency, rtol=1e-8)


def test_a_very_heavy_base_is_a_clamped_one() -> None:
    heavy = VEHICLE.replace({"uav.mass": 1e7, "uav.inertia": [1e7, 1e7, 1e7]})
    clamped, free = bending_frequencies(heavy)
    assert free == pytest.approx(clamped, rel=1e-5)


def test_a_free_base_raises_the_bending_frequency() -> None:
    clamped, free = bending_frequencies(VEHICLE)
    assert free > 2.0 * clamped


def test_a_damping_ratio_is_what_the_clamped_mode_shows() -> None:
    damped = VEHICLE.replace({"arm.damping_ratio": 0.03})
    np.testing.assert_allclose(
        ca.modes(damped, base="clamped", gravity=0.0).damping, 0.03, rtol=1e-8
    )


def test_a_free_vibration_rings_at_the_free_mode() -> None:
    frequency = ca.modes(VEHICLE).frequencies[0]
    scenario = ca.Scenario(name="ring", q=[0, 0, 0, 0, 0, 0, 1e-4, 0], gravity=0.0, duration=0.5)
    bend = ca.simulate(VEHICLE, scenario, step=1e-4).bend.sel(bend_axis="x")
    np.testing.assert_allclose(bend, 1e-4 * np.cos(frequency * bend.time), atol=1e-9)


def test_small_motions_follow_the_linear_system() -> None:
    hover = ca.trim(VEHICLE, bend=(0.5, -0.2), yaw=0.3)
    held: dict[str, Any] = {
        "force": hover.force,
        "moment": hover.moment,
        "bend_moment": hover.bend_moment,
    }
    A, B = ca.linearize(VEHICLE, hover.q, **held)
    # From rest at the trim, a small extra bend moment; forced response by the matrix exponential.
    push = np.concatenate([np.zeros(6), [1e-3, 2e-3]])
    block = np.zeros((17, 17))
    block[:16, :16], block[:16, 16] = A, B @ push
    expected = expm(block * 0.05)[:16, 16]
    scenario = ca.Scenario(
        name="push",
        q=hover.q,
        duration=0.05,
        **(held | {"bend_moment": hover.bend_moment + push[6:]}),
    )
    run = ca.simulate(VEHICLE, scenario, step=1e-4)
    moved = (run.bend[-1] - run.bend[0]).to_numpy()
    np.testing.assert_allclose(moved, expected[6:8], rtol=1e-4)


def test_a_tip_force_bends_the_arm_as_the_energy_says() -> None:
    """E I l k + gravity = J_tᵀ F: tip deflection 0.25 F l³/(E I) for constant curvature."""
    tip_force = 0.05
    found = ca.trim(VEHICLE, tip_wrench=[tip_force, 0, 0, 0, 0, 0], gravity=0.0)
    expected = tip_force * VEHICLE.arm.length / (2.0 * VEHICLE.arm.bending_stiffness)
    assert found.q[6] == pytest.approx(expected, rel=1e-4)


def test_trim_refuses_a_wrench_without_equilibrium_and_a_bad_bend() -> None:
    with pytest.raises(ca.InputError, match="bend"):
        ca.trim(VEHICLE, bend=(1.0, 2.0, 3.0))
    with pytest.raises(ca.InputError, match="base"):
        ca.modes(VEHICLE, base="flying")
