"""Integral action of the servoing law: what it adds, what it removes, and when it waits."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.analysis.lyapunov import lyapunov
from continuair.controllers.gain_files import Gains, load_gains
from continuair.equations.camera import interaction_matrix
from tests.closed_loop import eye, flights
from tests.refusals import refused

RATE = 0.5
PUSHED = (0.5, 0.0, 0.0)
"""A side force [N]."""


def law(gains: str, integral: float = RATE) -> ca.Controller:
    """A preset's law with integral action."""
    settings = load_gains(gains).settings | {"integral": integral}
    return Gains("with integral", settings).controller(flights.VEHICLE)


@pytest.mark.long
@pytest.mark.parametrize("gains", ["paper", "current"])
def test_a_steady_side_force_leaves_no_error_where_without_it_leaves_centimetres(
    gains: str,
) -> None:
    q = flights.start(0.0, 0.0, 0.0)
    off = []
    for controller in (law(gains, 0.0), law(gains)):
        scenario = flights.scenario(controller, 20.0, q=q, force=PUSHED)
        run = ca.simulate(
            flights.VEHICLE, scenario, sample=0.1, variables=["camera_position", "feature_error"]
        )
        assert run["status"] == 0
        off.append(float(abs(run["camera_position"][-1] - run["camera_position"][0]).max()))
    assert off[0] > 0.01 and off[1] < 1e-4


def test_what_it_adds_is_the_error_summed_up_at_its_rate() -> None:
    gains: dict[str, Any] = {"Kp": 3.0, "Kd": 0.1, "Cd": 0.5, "Cs": 1e-3, "sigma": 0.05}
    rate, period = 4.0, 1e-3
    controller = ca.servoing(**gains, integral=rate)
    scenario = flights.scenario(
        controller, 0.02, q=flights.start(0.05, 0.04, 0.02), control_period=period
    )
    names = ["command", "q", "camera_twist"]
    run = ca.simulate(
        flights.VEHICLE, scenario, method="RK4", step=period, sample=period, variables=names
    )
    total = np.zeros(8)
    for k, q in enumerate(run["q"].to_numpy()[:-1]):
        image, depth = equations.look(flights.VEHICLE, q, flights.STILL.points)
        error = flights.STILL.desired - image
        total += period * error * (k > 0)
        led = error + rate * total
        L = interaction_matrix(image, depth)
        J = L @ equations.camera_jacobian(flights.VEHICLE, q)
        moved = L @ run["camera_twist"].to_numpy()[k]
        e_a = -0.5 * moved + led + 1e-3 * np.tanh(led / 0.05)
        expected = equations.weight_vector(flights.VEHICLE, q, nodes=32)
        expected += J.T @ (3.0 * e_a - 0.1 * moved)
        found = eye.in_paper_coordinates(run["command"].to_numpy()[k : k + 1], q[None])[0]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert np.abs(rate * total).max() > 1e-3


@pytest.mark.long
def test_far_errors_are_not_summed_up_and_runs_have_the_same_bits_alone() -> None:
    q = np.tile(flights.start(0.0, 0.0, 0.1), (5, 1))
    q[:, 1], q[:, 5] = np.linspace(0.0, 0.5, 5), np.linspace(0.0, 1.0, 5)
    scenario = flights.scenario(law("current"), 10.0, q=q)
    together = ca.simulate(flights.VEHICLE, scenario, sample=0.1, variables=["feature_error"])
    assert (together["status"] == 0).all()
    assert abs(together["feature_error"].isel(time=-1)).max() < 1.0
    alone = ca.simulate(
        flights.VEHICLE, scenario.replace(q=q[4]), sample=0.1, variables=["feature_error"]
    )
    np.testing.assert_array_equal(alone["feature_error"], together["feature_error"][4])


def test_what_cannot_be_is_refused() -> None:
    with refused("integral"):
        ca.servoing(2.0, 0.1, integral=-1)
    scenario = flights.scenario(law("paper"), 0.1, control_period=None)
    with refused("control_period"):
        ca.simulate(flights.VEHICLE, scenario)
    with refused("controllers"):
        ca.stack([law("paper"), law("paper", 0.0)])
    with refused("scenario"):
        lyapunov(flights.VEHICLE, flights.scenario(law("paper"), 0.1))
