"""Axes of aviation: a climb is up, a right turn to the right, and there and back is nothing."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import frames
from tests.refusals import refused

HALF_TURN = Rotation.from_rotvec([np.pi, 0.0, 0.0])


def drawn(*shape: int) -> np.ndarray:
    return np.random.default_rng(1).normal(size=shape)


def test_there_and_back_is_nothing() -> None:
    vectors, wrenches, attitudes = drawn(5, 3), drawn(4, 2, 6), Rotation.random(6, rng=2).as_quat()
    np.testing.assert_array_equal(frames.from_ned(frames.to_ned(vectors)), vectors)
    np.testing.assert_array_equal(frames.from_frd(frames.to_frd(wrenches)), wrenches)
    for first in (False, True):
        there = frames.attitude_to_ned(attitudes, scalar_first=first)
        back = frames.attitude_from_ned(there, scalar_first=first)
        np.testing.assert_array_equal(back, attitudes)


def test_both_orders_hold_the_same_attitude() -> None:
    attitudes = Rotation.random(6, rng=2).as_quat()
    last = frames.attitude_to_ned(attitudes)
    first = frames.attitude_to_ned(attitudes, scalar_first=True)
    np.testing.assert_array_equal(np.roll(first, -1, axis=-1), last)


def test_a_body_vector_ends_up_in_the_world_alike_by_either_way() -> None:
    """In SciPy's rotations: FRD -> NED is NED <- world <- body <- FRD."""
    attitudes, vectors = Rotation.random(8, rng=3), drawn(8, 3)
    independent = HALF_TURN * attitudes * HALF_TURN.inv()
    found = Rotation.from_quat(frames.attitude_to_ned(attitudes.as_quat()))
    np.testing.assert_allclose((found * independent.inv()).magnitude(), 0.0, atol=1e-12)
    world = frames.to_ned(attitudes.apply(vectors))
    np.testing.assert_allclose(found.apply(frames.to_frd(vectors)), world, rtol=0, atol=1e-12)


def test_a_wrench_does_the_same_work_in_either_axes() -> None:
    wrench, twist = drawn(6), np.random.default_rng(4).normal(size=6)
    assert frames.to_frd(wrench) @ frames.to_frd(twist) == pytest.approx(wrench @ twist)


def test_a_climb_and_a_right_turn_are_what_pilots_call_so() -> None:
    vehicle = ca.load_vehicle("paper")
    inertia = ca.rigid_inertia(vehicle)[5, 5]
    push: dict[str, Any] = {"force": [5.0, -4.0, 10.0 * vehicle.mass]}
    push["moment"] = [0.0, 0.0, -inertia]
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    last = ca.simulate(vehicle, ca.Scenario("turn", start, duration=0.5, **push)).isel(time=-1)
    moved = frames.to_ned(last.position) - frames.to_ned(start[:3])
    assert moved[0] > 0.0, "to the north"
    assert moved[1] > 0.0, "to the east"
    assert moved[2] < 0.0, "up"
    assert frames.to_frd(last.angular_velocity)[2] > 0.3, "a yaw rate to the right"
    attitude = Rotation.from_quat(frames.attitude_to_ned(last.attitude))
    nose = attitude.apply([1.0, 0.0, 0.0])
    assert nose[1] > 0.0, "the nose points east of north"
    assert attitude.as_euler("ZYX")[0] > 0.0, "a yaw to the right"


def test_rows_of_a_flight_that_ended_stay_nan() -> None:
    assert np.isnan(frames.to_ned([[1.0, 2.0, 3.0], [np.nan] * 3])[1]).all()


MASKED = np.ma.array([[1.0, 2.0, 3.0]], mask=[[False, True, False]])


@pytest.mark.parametrize("wrong", [3.0, [1.0, 2.0], "up", None, [True, 2.0, 3.0], MASKED])
def test_what_is_no_vector_is_refused(wrong: object) -> None:
    with refused("vectors"):
        frames.to_ned(wrong)
    with refused("attitude"):
        frames.attitude_to_ned(wrong)
