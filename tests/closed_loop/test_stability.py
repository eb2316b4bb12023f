"""What the loop must do with energy: the power balance, and V of a still target never rises."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.typing import Model
from tests.closed_loop import flights

SIGMA = 0.02
MATRIX = np.asarray(ca.design(flights.VEHICLE, 2.0)["Kp"])
INVERSE = (np.linalg.inv(MATRIX) + np.linalg.inv(MATRIX).T) / 2
# K_p C_p symmetric positive definite, K_p C_s diagonal, K_p C_d with a positive symmetric part.
GAINS: dict[str, dict[str, Any]] = {
    "scalars": {"Kp": 20.0, "Kd": 0.5, "Cp": 1.5, "Cd": 0.1, "Cs": 0.05},
    "diagonals": {
        "Kp": np.linspace(10.0, 30.0, 8),
        "Kd": np.linspace(0.5, 0.2, 8),
        "Cp": np.linspace(1.0, 2.0, 8),
        "Cd": np.linspace(0.1, 0.2, 8),
        "Cs": np.linspace(0.02, 0.1, 8),
    },
    "matrix": {
        "Kp": MATRIX,
        "Kd": 0.01 * MATRIX,
        "Cp": 1.0,
        "Cd": 0.5,
        "Cs": 1e-6 * INVERSE,
    },
}


def still(gains: dict[str, Any], compensation: Any, duration: float) -> ca.Scenario:
    controller = ca.servoing(**gains, sigma=SIGMA, compensation=compensation)
    return flights.scenario(controller, duration, control_period=None)


def flight(scenario: ca.Scenario, model: Model, step: float) -> xr.Dataset:
    run = ca.simulate(flights.VEHICLE, scenario, model=model, method="RK4", step=step, sample=step)
    assert run.status == 0
    return run


def of_size(gain: Any) -> np.ndarray:
    gain = np.asarray(gain, float)
    return gain if gain.ndim == 2 else gain * np.eye(8)


def sound_v(run: xr.Dataset, gains: dict[str, Any], elastic: bool) -> np.ndarray:
    e = run.feature_error.to_numpy() / 800.0
    Kp, Cp, Cs = (of_size(gains[name]) for name in ("Kp", "Cp", "Cs"))
    stored = 0.5 * np.einsum("ni,ij,nj->n", e, Kp @ Cp, e)
    sliding = SIGMA * np.log(np.cosh(e / SIGMA)) @ np.diag(Kp @ Cs)
    V = run.kinetic_energy.to_numpy() + stored + sliding
    return V + elastic * run.elastic_energy.to_numpy()


@pytest.mark.parametrize("model", ["coupled", pytest.param("decoupled", marks=pytest.mark.long)])
@pytest.mark.parametrize("compensation", ["gravity_only", "literal"])
@pytest.mark.parametrize("kind", GAINS)
def test_the_sound_v_of_a_still_target_never_rises(
    kind: str, compensation: str, model: Model
) -> None:
    gains = GAINS[kind]
    scenario = still(gains, compensation, duration=2.0)
    run = flight(scenario, model, step=2.5e-4)
    found = ca.lyapunov(flights.VEHICLE, scenario, run)
    assert not found.broken("sound")
    V = found.over_time.lyapunov_sound.to_numpy()
    expected = sound_v(run, gains, elastic=compensation == "gravity_only")
    np.testing.assert_allclose(V, expected, rtol=1e-12)
    # What RK4 adds to a vibration of 150 rad/s in a step of 0.25 ms is below 1e-9 of V.
    assert np.diff(V).max() < 1e-9 * V[0]
    assert V[-1] < 0.7 * V[0]


@pytest.mark.parametrize("model", ca.MODELS)
def test_energy_grows_by_the_power_of_the_push_less_damping(model: Model) -> None:
    h = 2.5e-5
    run = flight(still(GAINS["scalars"], "literal", duration=0.2), model, step=h)
    command = run.command.to_numpy()
    R = _matrices(run.attitude.to_numpy())
    velocity = np.einsum("nij,nj->ni", R, run.velocity.to_numpy())
    bend_rate = run.bend_rate.to_numpy()
    rates = np.hstack([velocity, run.angular_velocity.to_numpy(), bend_rate])
    arm = flights.VEHICLE.arm
    dissipated = arm.structural_damping * arm.length * (bend_rate**2).sum(-1)
    power = (command * rates).sum(-1) - dissipated
    energy = (run.kinetic_energy + run.gravity_energy + run.elastic_energy).to_numpy()
    work = h / 3 * (power[0] + power[-1] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum())
    # Simpson's rule, of fourth order, over motions that decay at up to 2,000 1/s.
    assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-7 * np.abs(power).sum() * h)


def _matrices(quaternions: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternions).as_matrix())
