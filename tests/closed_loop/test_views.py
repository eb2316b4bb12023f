"""The camera reaches the image of a target from the side that is asked for: floors, ceilings and
walls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.equations.camera import facing, project
from tests.refusals import refused

DOWN, UP, FORWARD = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (-0.5, 0.5, -0.5, 0.5)
"""Attitudes of cameras that look along -z, z and x of the world."""

AT = np.array([0.4, -0.3, 3.0])


def resting() -> Any:
    def motion(t: Any) -> Any:
        nothing = np.zeros((len(np.atleast_1d(t)), 3))
        return nothing + AT, nothing, nothing

    return ca.paths.Path("resting", 1.0, motion)


def wall(side: float = 0.5) -> np.ndarray:
    """Corners of a square in the plane of y and z."""
    return np.asarray(ca.square(side))[:, [2, 0, 1]]


def vehicle_with(mount: Any, arm: Any, camera: Any = (0.0, 0.0, 0.0, 1.0)) -> ca.Vehicle:
    """One section of 0.5 m on a mount, whose straight arm's axis is that of `arm` turned."""
    section = {"length": 0.5, "radius": 0.004, "density": 6450.0, "youngs_modulus": 60e9,
               "damping_ratio": 0.03}  # fmt: skip
    return ca.Vehicle(
        name="looking",
        uav={"mass": 2.0, "inertia": [0.024, 0.024, 0.047]},
        arm=[{"name": "a", "mount": mount, "attitude": arm, "section": [section]}],
        camera={"attitude": camera},
    )


ABOVE = vehicle_with([0.0, 0.0, -0.05], [0.0, 0.0, 0.0, 1.0])
BELOW = vehicle_with([0.0, 0.0, 0.05], [1.0, 0.0, 0.0, 0.0])
BESIDE = vehicle_with(
    [0.0, 0.0, -0.05],
    [0.0, 0.0, 0.0, 1.0],
    (Rotation.from_matrix(np.diag([1.0, -1.0, -1.0])) * Rotation.from_quat(FORWARD)).as_quat(),
)
VIEWS = {
    "floor": (ABOVE, ca.square(0.5), DOWN),
    "ceiling": (BELOW, ca.square(0.5), UP),
    "wall": (BESIDE, wall(), FORWARD),
}


def flight(vehicle: ca.Vehicle, target: ca.Target, start: Any, duration: float = 8.0) -> Any:
    gains = ca.design(vehicle, 3.0, desired=target.desired, distance=target.depths)
    scenario = ca.Scenario(
        "view", start, controller=ca.servoing(**gains), target=target, duration=duration
    )
    return ca.simulate(vehicle, scenario, sample=0.01, rtol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("view", VIEWS)
def test_the_camera_comes_to_where_the_desired_image_is_taken(view: str) -> None:
    vehicle, points, attitude = VIEWS[view]
    target = ca.Target(resting(), points, 1.5, attitude)
    place, euler = facing(vehicle, AT, 1.5, attitude)
    start = np.zeros(8)
    start[:3], start[3:6] = place + [0.08, -0.06, 0.07], euler
    start[6] = 0.1
    found = flight(vehicle, target, start)
    assert str(found["status"].item()) == "0"
    axis = Rotation.from_quat(attitude).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(found["camera_position"][-1], AT - 1.5 * axis, atol=2e-3)
    turned = Rotation.from_quat(found["camera_attitude"][-1]) * Rotation.from_quat(attitude).inv()
    assert turned.magnitude() < 2e-3
    assert np.abs(found["feature_error"][-1]).max() < 1.0
    np.testing.assert_allclose(euler, 0.0, atol=1e-12)  # it hovers level


@pytest.mark.parametrize("view", VIEWS)
def test_the_desired_image_is_the_projection_from_the_pose_that_is_asked_for(view: str) -> None:
    _, points, attitude = VIEWS[view]
    leaning = (Rotation.from_rotvec([0.2, -0.1, 0.3]) * Rotation.from_quat(attitude)).as_quat()
    for each in (attitude, leaning):
        target = ca.Target(resting(), points, 1.5, each)
        axes = Rotation.from_quat(each).as_matrix()
        seen = (points + 1.5 * axes[:, 2]) @ axes
        np.testing.assert_allclose(target.desired, project(seen), atol=1e-12)
        np.testing.assert_allclose(target.depths, seen[:, 2], atol=1e-12)


@pytest.mark.parametrize("made", ["the fault", "a wall"])
def test_a_start_on_the_other_side_of_the_desired_image_is_refused(made: str) -> None:
    """A camera that looks up flew off to where nothing is seen, as its desired image was from above
    the target."""
    vehicle, points, attitude = VIEWS["ceiling" if made == "the fault" else "wall"]
    target = ca.Target(resting(), points, 1.5)
    if made == "a wall":
        aside = Rotation.from_euler("z", np.pi).as_quat()
        other = (Rotation.from_quat(aside) * Rotation.from_quat(FORWARD)).as_quat()
        target = ca.Target(resting(), points, 1.5, other)
    start = np.zeros(8)
    start[:3], start[3:6] = facing(vehicle, AT, 1.5, attitude)
    with refused("target"):
        flight(vehicle, target, start, 0.1)


def test_a_vehicle_is_not_turned_upside_down_to_look() -> None:
    with refused("camera"):
        facing(BELOW, AT, 1.5)
    with refused("camera"):
        facing(ABOVE, AT, 1.5, UP)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"camera_attitude": [0.0, 0.0, 0.0]}, "camera_attitude"),
        ({"camera_attitude": [0.0, 0.0, 0.0, 2.0]}, "camera_attitude"),
        ({"camera_attitude": "up"}, "camera_attitude"),
        ({"points": ca.square(0.5) + [0.0, 0.0, 2.1]}, "distance"),
        ({"points": ca.square(0.5) - [0.0, 0.0, 2.1], "camera_attitude": UP}, "distance"),
    ],
)
def test_views_that_there_cannot_be_are_refused(given: dict[str, Any], field: str) -> None:
    with refused(field):
        ca.Target(resting(), **given)
