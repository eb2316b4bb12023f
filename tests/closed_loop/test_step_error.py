"""What loops do with the errors of steps: a slow one brings back late what is off."""

from typing import Any

import numpy as np
import pytest

import continuair as ca

# A slung load: the controller's delays leave it bandwidths of a fifth of a rad/s.
LOAD = ca.Vehicle(
    name="slung load",
    uav={"mass": 0.5, "inertia": [0.006, 0.006, 0.011]},
    arm={
        "length": 0.8,
        "bending_stiffness": 0.007,
        "mass_per_length": 0.05,
        "damping_ratio": 0.05,
        "disks": [{"position": 0.8, "mass": 0.25, "inertia": [1e-4, 1e-4]}],
    },
)


def hover(rate: float, q: list[float], qd: list[float], duration: float) -> ca.Scenario:
    law = ca.flight_controller(LOAD, bend_bandwidth=0, rate=rate, latency=0.02)
    return ca.Scenario("hover", q, qd, controller=law, duration=duration)


def off(flight: Any, scenario: ca.Scenario, finer: int) -> float:
    """The largest error of the tip in arm lengths, against a finer step."""
    step = float(flight.attrs["step"]) / finer
    fine = ca.simulate(LOAD, scenario, sample=0.02, step=step, variables=["tip_position"])
    apart = np.linalg.norm(flight.tip_position - fine.tip_position, axis=-1)
    return float(apart.max() / LOAD.arm.length)


@pytest.mark.filterwarnings("ignore:step_error reaches", "ignore:nrmse_r and rmse_r_rad overstate")
@pytest.mark.parametrize(
    ("rate", "q", "qd"),
    [
        (50.0, [0, 0, 3, -0.2, 0.1, 0, 1.2, -2.2], [0, 0, 0, -0.4, 0.5, 0.6, 0, 0]),
        (250.0, [0, 0, 3, -0.24, -0.28, 0, 1.36, -1.11], [0, 0, 0, -0.2, -0.1, 2, 0, 0]),
    ],
)
def test_step_error_knows_that_a_slow_loop_answers_late(
    rate: float, q: list[float], qd: list[float]
) -> None:
    """Single steps err by 4e-4 and 1e-7 arm lengths, which come to 0.03 and 0.02."""
    scenario = hover(rate, q, qd, 30.0)
    flight = ca.simulate(LOAD, scenario, sample=0.02, variables=["tip_position"])
    error = off(flight, scenario, 4)
    assert error > 1e-3
    assert error / 2.0 < float(flight.step_error) < 5.0 * error
    pairs = ca.run_pairs(LOAD, scenario, ["decoupled"], sample=0.02)
    coupled = float(pairs.step_error.sel(model="coupled").item())
    assert coupled == pytest.approx(float(flight.step_error), rel=0.2)


def test_fast_loops_tell_their_slowest_bandwidths_by_their_gains() -> None:
    laws = [ca.flight_controller(LOAD, rate=1000.0, attitude_bandwidth=w) for w in (6.0, 12.0)]
    for law in (*laws, ca.stack(laws)):
        assert law.bandwidths is not None
    found = np.array([law.bandwidths(law.gains) for law in laws if law.bandwidths])
    stacked = ca.stack(laws)
    assert stacked.bandwidths is not None
    np.testing.assert_array_equal(stacked.bandwidths(stacked.gains), found)
    asked = [[law.settings["position_bandwidth"], w] for law, w in zip(laws, (6, 12), strict=True)]
    # The integral's share makes the position a little stiffer.
    np.testing.assert_allclose(found, asked, rtol=0.35)
    np.testing.assert_allclose(found[:, 1], [6.0, 12.0], rtol=1e-12)
