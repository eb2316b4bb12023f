"""What free flight must keep, and at which order the integrator loses it."""

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.typing import Model
from tests.physics.free_flight import tumbling
from tests.physics.slopes import INSIDE, matrices, slope, spin

pytestmark = pytest.mark.targets


def energy(run: xr.Dataset) -> np.ndarray:
    return (run.kinetic_energy + run.gravity_energy + run.elastic_energy).to_numpy()


def drift(values: np.ndarray) -> float:
    """Largest departure from the start over the size of the start."""
    return float(
        np.max(np.linalg.norm(np.atleast_2d(values.T).T - values[0], axis=-1))
        / np.linalg.norm(values[0])
    )


@pytest.fixture(scope="module")
def flight() -> xr.Dataset:
    vehicle = ca.load_vehicle("slender")
    return ca.simulate(vehicle, tumbling(), method="RK4", step=1e-4, sample=1e-2)


# Steps of 0.1 ms lose 2e-11 of energy and linear momentum in 10 s, and 3e-10 of angular momentum.
def test_coupled_free_flight_conserves_energy(flight: xr.Dataset) -> None:
    assert drift(energy(flight)[:, None]) < 5e-10


@pytest.mark.parametrize(
    ("name", "tolerance"), [("linear_momentum", 5e-10), ("angular_momentum", 5e-9)]
)
def test_coupled_free_flight_conserves_momentum(
    flight: xr.Dataset, name: str, tolerance: float
) -> None:
    assert drift(flight[name].to_numpy()) < tolerance


@pytest.mark.parametrize("model", ["decoupled", "independent"])
def test_decoupled_models_conserve_their_own_energy_under_gravity(model: Model) -> None:
    run = ca.simulate(
        ca.load_vehicle("slender"),
        tumbling(2.0, gravity=9.81),
        model=model,
        method="RK4",
        step=1e-4,
        sample=1e-2,
    )
    # Reached in 2 s: 1e-12.
    assert drift(energy(run)[:, None]) < 5e-11


def test_drift_of_energy_and_momentum_shrinks_at_fourth_order_or_better() -> None:
    vehicle = ca.load_vehicle("slender")
    runs = [
        ca.simulate(vehicle, tumbling(2.0), method="RK4", step=h, sample=0.1) for h in (1e-3, 5e-4)
    ]
    for name in ("linear_momentum", "angular_momentum"):
        coarse, fine = (drift(run[name].to_numpy()) for run in runs)
        # A slope of at least 4 less 0.3 for what is left of higher orders.
        assert np.log2(coarse / fine) > 3.7
    coarse, fine = (drift(energy(run)[:, None]) for run in runs)
    assert np.log2(coarse / fine) > 3.7


def test_structural_damping_takes_exactly_the_energy_that_is_lost() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.05})
    run = ca.simulate(vehicle, tumbling(1.0), method="RK4", step=1e-4, sample=1e-3)
    d = vehicle.arm.structural_damping * vehicle.arm.length
    power = d * (run.bend_rate.to_numpy() ** 2).sum(-1)
    lost = energy(run)[0] - energy(run)[-1]
    h = 1e-3
    simpson = (
        h / 3.0 * (power[0] + power[-1] + 4.0 * power[1:-1:2].sum() + 2.0 * power[2:-1:2].sum())
    )
    assert lost > 0.0
    # Simpson's rule over a vibration of ω = 48 rad/s at h = 1 ms, whose power has twice the ω:
    # (2 ω h)⁴/180 = 5e-7 of what oscillates, which sums to less.
    assert lost == pytest.approx(simpson, rel=5e-7)


def test_inputs_do_exactly_the_work_that_energy_gains() -> None:
    """Tip force, tip moment, world force, body moment and bend moment, all at once."""
    vehicle = ca.load_vehicle("paper").replace(
        {
            "uav.mount": [0.03, -0.05, 0.04],
            "arm.kappa_s": 0.0,
            "arm.disks": [{"position": 1.0, "mass": 0.1, "inertia": [1e-4, 1.5e-4]}],
        }
    )
    wrench = np.array([1.0, -2.0, 3.0, 0.2, 0.1, -0.3])
    scenario = tumbling(0.2, gravity=9.81).replace(
        force=[3.0, -1.0, 20.0],
        moment=[0.1, -0.2, 0.05],
        bend_moment=[4.0, -7.0],
        tip_wrench=wrench,
    )
    interval = 2e-4
    run = ca.simulate(vehicle, scenario, method="RK4", step=2.5e-5, sample=interval)
    R = matrices(run.attitude.to_numpy())
    power = (
        np.einsum("nij,nj->ni", R, run.velocity.to_numpy()) @ [3.0, -1.0, 20.0]
        + run.angular_velocity.to_numpy() @ [0.1, -0.2, 0.05]
        + run.bend_rate.to_numpy() @ [4.0, -7.0]
    )[INSIDE]
    power += slope(run.tip_position.to_numpy(), interval) @ wrench[:3]
    power += spin(run.tip_attitude.to_numpy(), interval) @ wrench[3:]
    gained = slope(energy(run), interval)
    # At every moment. Slopes at ω = 150 rad/s: RK4's err by (ω step)⁴/120 = 2e-12 of the power
    # that spring and masses exchange, and some 20 J are rounded to 1e-15 over the interval.
    assert np.abs(gained - power).max() < 1e-9 * np.abs(power).max()


def test_a_vehicle_at_rest_on_its_trim_stays_there() -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.mount": [0.1, 0.0, -0.02]})
    hover = ca.trim(vehicle, bend=(0.8, -0.3), yaw=0.7)
    scenario = ca.Scenario(
        name="hover",
        q=hover.q,
        force=hover.force,
        moment=hover.moment,
        bend_moment=hover.bend_moment,
        duration=0.2,
    )
    run = ca.simulate(vehicle, scenario, method="RK4", step="auto", variables=["q"])
    # The trim is solved to rounding.
    assert float(np.abs(run.q - hover.q).max()) < 1e-12
