"""Gains: what is shorthand for what, and where the gain design puts the poles."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.controllers.gains import designs
from continuair.controllers.servoing import servoings
from continuair.equations.camera import interaction_matrix
from tests.closed_loop import flights
from tests.refusals import refused

NAMES = ("Kp", "Kd", "Cp", "Cd", "Cs")


@pytest.mark.parametrize("mount", [[0.0, 0.0, 0.0], [0.03, -0.05, 0.04]], ids=str)
@pytest.mark.parametrize("bandwidth", [1.0, 3.0])
def test_the_design_gives_every_motion_of_the_frozen_vehicle_the_double_pole(
    bandwidth: float, mount: list[float]
) -> None:
    """Poles of M q̈ + J_Lᵀ (K_p C_d + K_d) J_L q̇ + J_Lᵀ K_p C_p J_L q = 0 with the bend frozen."""
    vehicle = flights.VEHICLE.replace({"arm.kappa_s": 0.0, "uav.mount": mount})
    vehicle = vehicle.replace({"camera.position": [0.02, 0.01, 0.05]})
    gains = ca.servoing(**ca.design(vehicle, bandwidth, conditioning=0.0)).gains
    q = flights.start(x=0.0, z=0.0, kappa=1e-6)
    image = flights.STILL.desired
    L = interaction_matrix(image, 2.0)
    J = (L @ equations.camera_jacobian(vehicle, q))[:, :6]
    M = equations.mass_matrix(vehicle, q)[:6, :6]
    damping = J.T @ (gains["Kp"] @ gains["Cd"] + gains["Kd"]) @ J
    stiffness = J.T @ gains["Kp"] @ J
    eye6, nil = np.eye(6), np.zeros((6, 6))
    rates = np.linalg.inv(M)
    poles = np.linalg.eigvals(np.block([[nil, eye6], [-rates @ stiffness, -rates @ damping]]))
    # W's floor of 1e-6 adds up to 5e-4 of M, and a double pole splits by the root of that.
    np.testing.assert_allclose(poles, -bandwidth, rtol=0, atol=0.03 * bandwidth)


def test_scalars_and_diagonals_are_shorthand_for_matrices() -> None:
    scalar = ca.servoing(2.0, 0.1, 1.0, 0.5, 1e-3)
    values: dict[str, Any] = dict(zip(NAMES, (2.0, 0.1, 1.0, 0.5, 1e-3), strict=True))
    diagonals: dict[str, Any] = {name: np.full(8, x) for name, x in values.items()}
    matrices: dict[str, Any] = {name: x * np.eye(8) for name, x in values.items()}
    diagonal, matrix = ca.servoing(**diagonals), ca.servoing(**matrices)
    for name in NAMES:
        np.testing.assert_array_equal(scalar.gains[name], matrix.gains[name])
        np.testing.assert_array_equal(diagonal.gains[name], matrix.gains[name])
    assert scalar.gains["Kp"].shape == (8, 8)


@pytest.mark.long
def test_gains_of_the_papers_six_rows_fit_three_points() -> None:
    target = ca.Target(ca.paths.hold(), [[0.25, 0.25, 0.0], [-0.25, 0.25, 0.0], [0.0, -0.25, 0.0]])
    gains = ca.design(flights.VEHICLE, 2.0, desired=target.desired)
    assert np.asarray(gains["Kp"]).shape == (6, 6) and gains["points"] == 3
    run = ca.simulate(
        flights.VEHICLE,
        flights.scenario(
            ca.servoing(**gains), 6.0, target=target, q=flights.start(0.01, 0.01, 0.01)
        ),
    )
    assert run.status == 0
    assert np.abs(run.feature_error[0]).max() > 10.0
    assert np.abs(run.feature_error[-1]).max() < 0.05


@pytest.mark.long
@pytest.mark.parametrize("gains", ["constant", "current"])
def test_points_at_several_depths_come_home_as_fast_as_those_of_one(gains: Any) -> None:
    """One depth for all of a target that is not flat leaves a slow motion: 7.7 % after 6 s."""
    corners = ca.square() + np.outer([0.0, 0.1, 0.0, 0.0], [0.0, 0.0, 1.0])
    left = []
    for points in (ca.square(), corners):
        target = ca.Target(ca.paths.hold(), points)
        law = ca.design(
            flights.VEHICLE,
            3.0,
            gains=gains,
            conditioning=0.0,
            desired=target.desired,
            distance=target.depths,
        )
        run = ca.simulate(
            flights.VEHICLE,
            flights.scenario(
                ca.servoing(**law), 6.0, target=target, q=flights.start(0.01, 0.01, 0.01)
            ),
        )
        error = np.abs(run.feature_error).max("pixel")
        left.append(float(error[-1] / error[0]))
    assert max(left) < 1e-5


@pytest.mark.parametrize("setting", ["bandwidth", "damping_ratio", "rate_gain"])
def test_gains_that_no_number_holds_are_refused(setting: str) -> None:
    values: dict[str, Any] = {"bandwidth": 1.0, setting: 1e308}
    with refused("bandwidth"):
        ca.design(flights.VEHICLE, **values)
    with refused("bandwidth"):
        ca.design(flights.VEHICLE, 10**400)
    assert ca.servoing(1e308, 1e308).gains["Kp"][0, 0] == 1e308


def test_a_letter_slower_than_numbers_reach_is_refused() -> None:
    with refused("path"):
        ca.Target(ca.paths.letter("M", duration=1e308))


@pytest.mark.parametrize("runs", [3, 20])
def test_gains_designed_for_many_runs_are_those_designed_for_each(runs: int) -> None:
    masses, rates = np.linspace(1.5, 3.0, runs), np.linspace(2.0, 6.0, runs)
    vehicle = flights.VEHICLE.replace({"uav.mass": masses})
    distances = np.linspace(1.5, 2.5, runs)
    corners = ca.square() + [[0.0, 0.0, 0.1], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -0.2]]
    targets = [ca.Target(ca.paths.hold(), corners, distance) for distance in distances]
    settings: dict[str, Any] = {"bandwidth": rates, "damping_ratio": 0.7, "conditioning": 0.02}
    settings |= {"rate_gain": 1e-4, "sliding": 1e-6}
    seen = [np.stack([getattr(each, name) for each in targets]) for name in ("desired", "depths")]
    gains = designs(vehicle, *seen, **settings)
    together = servoings(gains, np.zeros(runs))
    alone = [
        ca.servoing(
            **ca.design(
                vehicle.select(run),
                rates[run],
                damping_ratio=0.7,
                conditioning=0.02,
                desired=targets[run].desired,
                distance=targets[run].depths,
            )
        )
        for run in range(runs)
    ]
    stacked = ca.stack(alone)
    for name, value in stacked.gains.items():
        np.testing.assert_array_equal(together.gains[name], value)
    assert together.describe() == stacked.describe()


def test_a_run_whose_gains_no_number_holds_is_refused_among_others() -> None:
    settings: dict[str, Any] = {"bandwidth": np.array([1.0, 1e300]), "damping_ratio": 1.0}
    settings |= {"conditioning": 0.0, "rate_gain": 1e-4, "sliding": 1e-6}
    seen = flights.STILL.desired, flights.STILL.depths
    with refused("bandwidth"):
        designs(flights.VEHICLE, *(np.tile(each, (2, 1)) for each in seen), **settings)
