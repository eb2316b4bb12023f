"""The eye in hand of the device against the readable form, which shares no code with it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations
from continuair.equations.camera import to_pixels
from tests.closed_loop import eye, probes

pytestmark = pytest.mark.targets

STATES = 250
FRAMES = ("untwisted", "frenet")


def first_sample(
    vehicle: ca.Vehicle, q: np.ndarray, qd: np.ndarray, controller: ca.Controller, *names: str
) -> list[np.ndarray]:
    scenario = ca.Scenario(
        name="look",
        q=q,
        qd=qd,
        duration=1e-6,
        controller=controller,
        control_period=1e-6,
        target=eye.held_before(vehicle, q),
    )
    run = ca.simulate(vehicle, scenario, method="RK4", step=1e-6, sample=1e-6, variables=names)
    return [run[name].isel(time=0).to_numpy() for name in names]


def assert_close(found: np.ndarray, expected: np.ndarray) -> None:
    """To rounding, of the size of the whole."""
    assert np.linalg.norm(found - expected) < 1e-12 * np.linalg.norm(expected)


@pytest.mark.long
@pytest.mark.parametrize("tip_frame", FRAMES)
def test_the_device_pushes_along_the_slope_of_the_projection(tip_frame: str) -> None:
    """Every row of J_L in the paper's coordinates, from the pushes J_Lᵀ weights."""
    vehicle = eye.with_frame(eye.MOUNTED, tip_frame)
    q, qd = eye.states(STATES, seed=6)
    rows = [
        eye.in_paper_coordinates(
            first_sample(vehicle, q, qd, probes.along_image(unit), "command")[0], q
        )
        for unit in np.eye(8)
    ]
    for at, J_L in zip(q, np.stack(rows, axis=1), strict=True):
        slope = eye.finite_differences(vehicle, at, eye.in_front(vehicle, at) + eye.CORNERS)
        assert np.abs(J_L - slope).max() < eye.DIFFERENCES * np.abs(slope).max()


@pytest.mark.long
@pytest.mark.parametrize("tip_frame", FRAMES)
def test_camera_pose_twist_and_image_of_the_device_equal_the_readable_form(tip_frame: str) -> None:
    vehicle = eye.with_frame(eye.MOUNTED, tip_frame)
    q, qd = eye.states(STATES, seed=7)
    wrenches = np.random.default_rng(7).normal(size=(STATES, 6))
    controller = ca.stack([probes.wrench_on_camera(wrench) for wrench in wrenches])
    at, attitude, twist, features, depth, command = first_sample(
        vehicle,
        q,
        qd,
        controller,
        *("camera_position", "camera_attitude", "camera_twist", "features", "depth", "command"),
    )
    torque = eye.in_paper_coordinates(command, q)
    axes = Rotation.from_quat(attitude).as_matrix()
    for i in range(STATES):
        position, R = equations.camera_pose(vehicle, q[i])
        J = equations.camera_jacobian(vehicle, q[i])
        image, depths = equations.look(vehicle, q[i], eye.in_front(vehicle, q[i]) + eye.CORNERS)
        assert_close(at[i], position)
        assert_close(axes[i], R)
        assert_close(twist[i], J @ qd[i])
        assert_close(features[i], to_pixels(vehicle.camera, image))
        assert_close(depth[i], depths)
        assert_close(torque[i], J.T @ wrenches[i])


@pytest.mark.long
@pytest.mark.parametrize("spring", [0.0, 1.0], ids=["gravity_only", "literal"])
def test_the_pushes_that_carry_weight_and_spring_are_the_vectors_of_g(spring: float) -> None:
    vehicle = eye.MOUNTED
    q, qd = eye.states(STATES, seed=8)
    (command,) = first_sample(vehicle, q, qd, probes.carried(1.0, spring), "command")
    for at, push in zip(q, eye.in_paper_coordinates(command, q), strict=True):
        G = equations.weight_vector(vehicle, at, nodes=32)
        G = G + spring * equations.elastic_vector(vehicle, at)
        assert_close(push, G)
