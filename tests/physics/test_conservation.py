"""What free flight must keep, and at which order the integrator loses it."""

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.physics.free_flight import tumbling


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
    return ca.simulate(vehicle, tumbling(), step=1e-4, sample=1e-2)


def test_coupled_free_flight_conserves_energy(flight: xr.Dataset) -> None:
    assert drift(energy(flight)[:, None]) < 1e-8


@pytest.mark.parametrize("name", ["linear_momentum", "angular_momentum"])
def test_coupled_free_flight_conserves_momentum(flight: xr.Dataset, name: str) -> None:
    assert drift(flight[name].to_numpy()) < 1e-8


@pytest.mark.parametrize("model", ["decoupled", "independent"])
def test_decoupled_models_conserve_their_own_energy_under_gravity(model: str) -> None:
    run = ca.simulate(
        ca.load_vehicle("slender"), tumbling(2.0, gravity=9.81), model=model, step=1e-4, sample=1e-2
    )
    assert drift(energy(run)[:, None]) < 1e-8


def test_drift_of_energy_and_momentum_shrinks_at_fourth_order_or_better() -> None:
    vehicle = ca.load_vehicle("slender")
    runs = [ca.simulate(vehicle, tumbling(2.0), step=h, sample=0.1) for h in (1e-3, 5e-4)]
    for name in ("linear_momentum", "angular_momentum"):
        coarse, fine = (drift(run[name].to_numpy()) for run in runs)
        # A slope of at least 4 less 0.3 for what is left of higher orders.
        assert np.log2(coarse / fine) > 3.7
    coarse, fine = (drift(energy(run)[:, None]) for run in runs)
    assert np.log2(coarse / fine) > 3.7


def test_structural_damping_takes_exactly_the_energy_that_is_lost() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.05})
    run = ca.simulate(vehicle, tumbling(1.0), step=1e-4, sample=1e-3)
    d = vehicle.arm.structural_damping * vehicle.arm.length
    power = d * (run.bend_rate.to_numpy() ** 2).sum(-1)
    lost = energy(run)[0] - energy(run)[-1]
    h = 1e-3
    simpson = (
        h / 3.0 * (power[0] + power[-1] + 4.0 * power[1:-1:2].sum() + 2.0 * power[2:-1:2].sum())
    )
    assert lost > 0.0
    # Simpson's rule over a vibration of 200 rad/s at 1 ms.
    assert lost == pytest.approx(simpson, rel=1e-4)


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
    scenario = tumbling(0.5, gravity=9.81).replace(
        force=[3.0, -1.0, 20.0],
        moment=[0.1, -0.2, 0.05],
        bend_moment=[4.0, -7.0],
        tip_wrench=wrench,
    )
    run = ca.simulate(vehicle, scenario, step=2.5e-5, sample=2.5e-4)
    R = _matrices(run.attitude.to_numpy())
    time = run.time.to_numpy()
    tip_spin = _spin(run.tip_attitude.to_numpy(), time)
    velocity = np.einsum("nij,nj->ni", R, run.velocity.to_numpy())
    tip_velocity = np.gradient(run.tip_position.to_numpy(), time, axis=0, edge_order=2)
    power = (
        velocity @ np.array([3.0, -1.0, 20.0])
        + run.angular_velocity.to_numpy() @ np.array([0.1, -0.2, 0.05])
        + run.bend_rate.to_numpy() @ np.array([4.0, -7.0])
        + tip_velocity @ wrench[:3]
        + tip_spin @ wrench[3:]
    )
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))])
    gained = energy(run) - energy(run)[0]
    # Second-order differences and trapezoids of a 150 rad/s vibration sampled at 0.25 ms.
    assert np.max(np.abs(gained - work)) < 2e-3 * np.ptp(gained)


def test_base_reaction_balances_the_uav_alone() -> None:
    vehicle = ca.load_vehicle("paper")
    scenario = tumbling(0.2, gravity=9.81).replace(force=[0.0, 0.0, 25.0])
    run = ca.simulate(vehicle, scenario, step=1e-4, sample=1e-4)
    R = _matrices(run.attitude.to_numpy())
    velocity = np.einsum("nij,nj->ni", R, run.velocity.to_numpy())
    acceleration = np.gradient(velocity, run.time.to_numpy(), axis=0, edge_order=2)
    external = np.array([0.0, 0.0, 25.0 - vehicle.uav.mass * 9.81])
    reaction = np.einsum("nij,nj->ni", R, run.base_force.to_numpy())
    left = vehicle.uav.mass * acceleration - external - reaction
    # Second-order differences of a 150 rad/s vibration at 0.1 ms: (ω h)²/6.
    assert np.max(np.abs(left)) < 1e-3 * np.max(np.abs(reaction))


def test_a_vehicle_at_rest_on_its_trim_stays_there_and_the_base_carries_the_arm() -> None:
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
    run = ca.simulate(vehicle, scenario)
    assert float(np.abs(run.q - hover.q).max()) < 1e-9
    np.testing.assert_allclose(run.base_force[-1], [0, 0, -vehicle.arm.mass * 9.81], atol=1e-8)


def _matrices(quaternions: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternions).as_matrix())


def _spin(quaternions: np.ndarray, time: np.ndarray) -> np.ndarray:
    """World angular velocity by central differences of the attitude."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_quat(quaternions)
    steps = (turn[1:] * turn[:-1].inv()).as_rotvec() / np.diff(time)[:, None]
    middle = 0.5 * (steps[1:] + steps[:-1])
    return np.vstack([steps[:1], middle, steps[-1:]])
