"""Laws that compute with another vehicle than the one that flies."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations
from continuair.controllers.gain_files import load_gains
from continuair.equations.camera import interaction_matrix, to_normalised, to_pixels
from tests.closed_loop import eye
from tests.closed_loop.flights import VEHICLE, scenario
from tests.refusals import refused

pytestmark = pytest.mark.targets

STATES = 40
WRONG = {
    "uav.mass": 1.3 * eye.MOUNTED.uav.mass,
    "arm.length": 1.2 * eye.MOUNTED.arm.length,
    "arm.density": 0.8 * eye.MOUNTED.arm.density,
    "arm.youngs_modulus": 0.7 * eye.MOUNTED.arm.youngs_modulus,
    "camera.position": [0.01, 0.03, 0.02],
    "camera.attitude": Rotation.from_euler("xyz", [0.2, -0.1, 0.4]).as_quat().tolist(),
    "camera.focal_length": [760.0, 720.0],
    "camera.principal_point": [500.0, 470.0],
}


def pushes(
    law: ca.Controller, q: np.ndarray, qd: np.ndarray, targets: list[ca.Target]
) -> np.ndarray:
    """The first pushes, in the coordinates of the paper."""
    start = ca.Scenario(
        "believing", q, qd, duration=1e-6, controller=law, control_period=1e-6, target=targets
    )
    run = ca.simulate(
        eye.MOUNTED, start, method="RK4", step=1e-6, sample=1e-6, variables=["command"]
    )
    return eye.in_paper_coordinates(run["command"].isel(time=0).to_numpy(), q)


@pytest.mark.long
@pytest.mark.parametrize("each", [False, True])
def test_a_law_computes_with_the_vehicle_that_it_believes_in(each: bool) -> None:
    """Weight, spring and Jacobian are that one's, one for all runs or one for each; depths and
    pixels are those of the vehicle that flies, read with the intrinsics that are believed in."""
    wrong = eye.MOUNTED.replace(WRONG)
    believed = [wrong] * STATES
    if each:
        masses, lengths = np.linspace(1.0, 4.0, STATES), np.linspace(0.9, 1.3, STATES)
        batch = wrong.replace({"uav.mass": masses, "arm.length": lengths})
        believed = [
            wrong.replace({"uav.mass": m.item(), "arm.length": far.item()})
            for m, far in zip(masses, lengths, strict=True)
        ]
    q, qd = eye.states(STATES, seed=5)
    q[:, 6] *= 0.7
    targets = eye.held_before(eye.MOUNTED, q)
    Kp, Kd = (np.diag(d) + 0.02 for d in np.random.default_rng(3).uniform(0.5, 2.0, (2, 8)))
    law = ca.servoing(Kp, Kd, 1.0, 1e-3, 1e-6, compensation="literal")
    found = pushes(law.believing(batch if each else wrong), q, qd, targets)
    for row, rate, push, target, known in zip(q, qd, found, targets, believed, strict=True):
        points = target.path(np.zeros(1))[0][0] + target.points
        image, depth = equations.look(eye.MOUNTED, row, points)
        image, desired = (
            to_normalised(known.camera, to_pixels(eye.MOUNTED.camera, each))
            for each in (image, target.desired)
        )
        L, J = interaction_matrix(image, depth), equations.camera_jacobian(known, row)
        error, moving = desired - image, L @ J @ rate
        e_a = -1e-3 * moving + error + 1e-6 * np.tanh(error / 1e-3)
        expected = equations.weight_vector(known, row, nodes=32)
        expected += equations.elastic_vector(known, row) + (L @ J).T @ (Kp @ e_a - Kd @ moving)
        assert np.linalg.norm(push - expected) < 1e-10 * np.linalg.norm(expected)


@pytest.mark.long
def test_a_law_that_believes_in_what_flies_flies_as_ever() -> None:
    """Also through a camera with noise, which is that of the camera that flies."""
    noisy = VEHICLE.replace({"camera.noise": 0.5, "camera.frame_rate": 100.0})
    law = load_gains("paper").controller(noisy)
    laws = law, law.believing(noisy), law.believing(noisy.replace({"camera.noise": 9.0}))
    flights = [ca.simulate(noisy, scenario(each, duration=0.2), sample=0.01) for each in laws]
    for other in flights[1:]:
        for name in ("position", "bend", "command"):
            np.testing.assert_allclose(other[name], flights[0][name], rtol=1e-7, atol=1e-9)


@pytest.mark.long
def test_a_flight_controller_feeds_forward_the_arm_that_it_believes_in() -> None:
    """At rest where it is to be, two laws of the same gains differ by the weights of their arms."""
    vehicle = ca.load_vehicle("paper")
    law = ca.flight_controller(vehicle)
    heavier = vehicle.replace({"arm.density": 1.3 * vehicle.arm.density, "arm.length": 1.1})
    q, found = np.array([[0, 0, 1, 0, 0, 0, 0.4, 0.9]]), []
    # Of the same gains, which `believing` refuses for such a vehicle.
    for each in (law, dataclasses.replace(law, believes=heavier)):
        start = ca.Scenario("hover", q[0], controller=each, duration=0.01)
        flight = ca.simulate(vehicle, start, sample=0.01, variables=["command"])
        found.append(flight["command"].isel(time=0).to_numpy()[None])
    more = eye.in_paper_coordinates(found[1] - found[0], q)[0]
    true, believed = (equations.weight_vector(each, q[0], nodes=32) for each in (vehicle, heavier))
    assert abs(more[6]) > 0.1
    np.testing.assert_allclose(more[3:], (believed - true)[3:], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(more[:3], 0.0, atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("feedforward", ["none", "weight", "reaction"])
def test_a_flight_controller_believes_in_the_mass_that_it_was_made_for(feedforward: Any) -> None:
    """Without an integral, too much of a weight lifts by Δm g / (m k_p k_v)."""
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.1})
    heavy = vehicle.replace({"uav.mass": 1.2 * vehicle.uav.mass})
    choices: dict[str, Any] = {
        "integral_share": 0.0,
        "position_bandwidth": 1.5,
        "bend_bandwidth": 0.0,
    }
    law = ca.flight_controller(heavy, feedforward=feedforward, **choices).believing(heavy)
    start = ca.Scenario("hover", np.zeros(8), controller=law, duration=15.0)
    flight = ca.simulate(vehicle, start, sample=0.1, variables=["position"])
    stiffness = law.gains["mass"] * law.gains["position"][2] * law.gains["velocity"][2]
    expected = 9.81 * (heavy.mass - vehicle.mass) / stiffness
    assert float(flight["position"][-1, 2]) == pytest.approx(expected, rel=1e-3)
    slim = heavy.replace({"uav.inertia.2.2": 0.9 * heavy.uav.inertia[2][2]})
    for other in (vehicle, slim):
        with refused("vehicle"):
            law.believing(other)
    law.believing(heavy.replace({"camera.noise": 2.0}))


def test_what_cannot_be_believed_in_is_refused() -> None:
    law = load_gains("paper").controller(VEHICLE)
    with refused("vehicle"):
        law.believing("paper")  # type: ignore[arg-type]
    with refused("believes"):
        other = law.believing(ca.load_vehicle("two_section"))
        ca.simulate(VEHICLE, scenario(other, duration=0.01), sample=0.01)
    with refused("controllers"):
        ca.stack([law, law.believing(VEHICLE)])
    with refused("scenario.q"):
        batch = VEHICLE.replace({"uav.mass": np.array([1.0, 2.0, 3.0])})
        start = scenario(
            law.believing(batch), duration=0.01, q=np.tile([0, 0, 3, 0, 0, 0, 0, 0], (2, 1))
        )
        ca.simulate(VEHICLE, start, sample=0.01)
    with refused("scenario"):
        ca.lyapunov(VEHICLE, scenario(law.believing(VEHICLE)))


@pytest.mark.long
@pytest.mark.parametrize(
    "other",
    [
        {"uav.rotors.lever": 0.14},
        {"uav.rotors.torque_per_thrust": 0.008},
        {"uav.rotors.thrust_limits": [0.0, 30.0]},
        {"uav.drag.linear": [0.5, 0.5, 0.5]},
    ],
)
def test_rotors_and_drag_that_no_law_computes_with_are_those_that_fly(
    other: dict[str, Any],
) -> None:
    rotors = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 25.0]}
    vehicle = VEHICLE.replace(
        {
            "uav.rotors": {**rotors, "torque_per_thrust": 0.016},
            "uav.drag": {"linear": [0.2] * 3},
        }
    )
    law = ca.flight_controller(vehicle).believing(vehicle.replace(other))
    start = ca.Scenario("hover", [0.1, 0, 0, 0, 0, 0, 0.1, 0], duration=0.02, controller=law)
    with refused("believes"):
        ca.simulate(vehicle, start)
