"""Bursts between the steps that a probe looks into: every step of a flight is looked at, too."""

from typing import Any

import numpy as np
import pytest

import continuair as ca


@pytest.mark.parametrize("share", [0.3, 0.02, 0.001])
@pytest.mark.parametrize("beside", ["a slow sine in another component", "the weight", "tau"])
@pytest.mark.filterwarnings("ignore:step_error reaches", "ignore:force (changes|jumps) within")
def test_a_burst_hides_behind_nothing_else(beside: str, share: float) -> None:
    """A vibration that stages see as a swell pushes the vehicle away for good; it does not."""
    uav = {"mass": 2.0, "inertia": [0.02, 0.02, 0.04]}
    section = {"length": 0.5, "mass_per_length": 0.03, "bending_stiffness": 4e-3}
    arm = {"section": [section | {"damping_ratio": 0.1}]}
    vehicle = ca.Vehicle(name="limp", uav=uav, arm=[arm])
    weight = 9.81 * vehicle.mass

    def burst(t: float) -> float:
        swell = np.sin(np.pi * (t - 10.19) / 0.36) ** 2 * (10.19 < t < 10.55)
        return float(share * weight * np.cos(2.0 * np.pi * 99.0 * t) * swell)

    ways: dict[str, dict[str, Any]] = {
        "a slow sine in another component": {
            "force": lambda t: [burst(t), np.sin(4.0 * np.pi * t), weight]
        },
        "the weight": {"force": lambda t: [0.0, 0.0, weight + burst(t)]},
        "tau": {"tau": [0, 0, weight, 0, 0, 0, 0, 0], "force": lambda t: [burst(t), 0, 0]},
    }
    q = [0, 0, 3, 0, 0, 0, 0.2, 0]
    scenario = ca.Scenario("burst", q, duration=30.0, **ways[beside])
    found = ca.simulate(vehicle, scenario, sample=0.02)
    fine = ca.simulate(vehicle, scenario, sample=0.02, step=4e-4)
    off = np.linalg.norm(found.tip_position - fine.tip_position, axis=-1).max() / 0.5
    assert 1e-3 < off < float(found.step_error)


@pytest.mark.parametrize("width", [1e-3, 2e-3, 8e-3])
def test_dop853_steps_over_no_tap(width: float) -> None:
    """Its steps at rest are longer; the momentum is all that the tap gives."""
    vehicle = ca.load_vehicle("slender")
    weight, impulse, sample = 9.81 * float(vehicle.mass), 0.64, 0.05
    for begin in np.random.default_rng(0).uniform(0.1, 0.5, 5):

        def tap(t: float, begin: float = begin) -> list[float]:
            share = (t - begin) / width
            on = np.sin(np.pi * share) if 0.0 < share < 1.0 else 0.0
            return [0.5 * np.pi * impulse / width * on, 0.0, weight]

        scenario = ca.Scenario("tap", [0, 0, 3, 0, 0, 0, 0.01, 0], force=tap, duration=0.6)
        found = ca.simulate(vehicle, scenario, sample=sample, method="DOP853")
        assert float(found.linear_momentum[-1, 0]) == pytest.approx(impulse, rel=1e-5)
