"""The hold and the visual servoing of vehicles with several sections and arms."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair import equations
from continuair.controllers.inertias import bend_inertia, rigid_inertia
from continuair.equations.camera import axes_on_body, interaction_matrix, on_body
from continuair.vehicle.coordinates import euler_to_body_rates
from tests.refusals import refused

TWO, DUAL = (ca.load_vehicle(name) for name in ("two_section", "dual_arm"))
POSITION, ATTITUDE = [0.3, -0.2, 4.0], Rotation.from_euler("ZYX", [1.0, 0.2, -0.1])
START = [0.1, 0.0, 3.1, 0, 0, 0, 0.3, 0.4, 0.5, -1.0]


def held(vehicle: ca.Vehicle, bend: Any, duration: float = 10.0, **rates: Any) -> xr.Dataset:
    law = ca.hold(vehicle, POSITION, ATTITUDE.as_quat(), bend, **rates)
    scenario = ca.Scenario("hold", START, duration=duration, controller=law)
    return ca.simulate(vehicle, scenario, sample=0.01)


@pytest.mark.long
@pytest.mark.parametrize(
    ("vehicle", "bend"),
    [(TWO, [0.5, -0.3, -0.8, 0.4]), (DUAL, [0.3, 0.2, -0.4, 0.1])],
    ids=lambda value: getattr(value, "name", None),
)
def test_it_reaches_position_attitude_and_every_bend_and_keeps_them(
    vehicle: ca.Vehicle, bend: list[float]
) -> None:
    run = held(vehicle, bend).isel(time=slice(900, None))
    assert run.status == 0
    # A loop of 3 rad/s leaves (1 + 27) exp(-27) = 5e-11 of its start.
    np.testing.assert_allclose(run.position, np.tile(POSITION, (101, 1)), rtol=0, atol=1e-8)
    np.testing.assert_allclose(
        run.bend, np.tile(np.reshape(bend, (2, 2)), (101, 1, 1)), rtol=0, atol=1e-8
    )
    turn = Rotation.from_quat(run.attitude.to_numpy()) * ATTITUDE.inv()
    assert turn.magnitude().max() < 1e-8


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_bend_inertia_is_what_moments_on_the_bends_move_on_a_clamped_base(
    vehicle: ca.Vehicle,
) -> None:
    state: dict[str, Any] = {"bend": np.zeros((2, 2)), "model": "independent", "gravity": 0.0}
    answers = [
        np.ravel(ca.accelerations(vehicle, **state, bend_moment=unit.reshape(2, 2))[2])
        for unit in np.eye(4)
    ]
    np.testing.assert_allclose(np.stack(answers) @ bend_inertia(vehicle), np.eye(4), atol=1e-6)


@pytest.mark.long
def test_every_section_gets_to_its_bend_at_the_rate_that_was_asked_for_it() -> None:
    """On a base too heavy to be moved, critically damped loops leave (1 + w t) exp(-w t), where the
    arm has next to no spring of its own."""
    heavy = TWO.replace({"uav.mass": 1e4, "uav.inertia": [1e4] * 3})
    heavy = heavy.replace({f"arm.0.section.{k}.youngs_modulus": 1.0 for k in (0, 1)})
    small = np.array([0.02, 0.01, -0.01, 0.03])
    law = ca.hold(heavy, [0, 0, 3], bend=np.zeros(4), bend_rate=[4.0, 6.0])
    q = np.zeros(10)
    q[2], q[6::2] = 3.0, np.hypot(small[::2], small[1::2])
    q[7::2] = np.arctan2(small[1::2], small[::2])
    scenario = ca.Scenario("rates", q, duration=0.5, controller=law, control_period=None)
    run = ca.simulate(heavy, scenario, sample=0.5)
    left = [(1 + w * 0.5) * np.exp(-w * 0.5) for w in (4.0, 4.0, 6.0, 6.0)]
    # The bends are small, not 0: angles of 0.01 make some ten-thousandths.
    np.testing.assert_allclose(run.bend[-1].to_numpy().ravel() / small, left, rtol=2e-3)


@pytest.mark.long
def test_an_arm_whose_rate_is_zero_is_left_to_its_spring() -> None:
    run = held(DUAL, [0.0, 0.0, -0.4, 0.1], duration=1.0, bend_rate=[0.0, 5.0])
    pushed = run.command.sel(actuator=["bend_moment_x_1", "bend_moment_y_1"])
    arm = DUAL.arms[0].section[0]
    # What is left is the weight's moment on the bend, at most m g l²/6.
    assert np.abs(pushed).max() < 9.81 * arm.mass * arm.length**2 / 6


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"bend": [0.1, 0.2]}, "bend"),
        ({"bend_rate": [1.0, 2.0, 3.0]}, "bend_rate"),
        ({"bend_rate": [1.0, -2.0]}, "bend_rate"),
        (
            {"bend": [0.0, 0.0, 0.3, 0.0], "bend_rate": [1.0, 0.0]},
            "bend",
        ),
    ],
)
def test_a_hold_for_other_bends_is_refused_in_one_sentence(
    arguments: dict[str, Any], field: str
) -> None:
    with refused(field):
        ca.hold(TWO, POSITION, **arguments)


def test_a_hold_of_another_vehicle_is_refused_in_one_sentence() -> None:
    law = ca.hold(ca.load_vehicle("paper"), POSITION)
    with refused("bend"):
        ca.simulate(TWO, ca.Scenario("hold", START, controller=law))


STILL = ca.Target(ca.paths.hold())


def above(vehicle: ca.Vehicle, offset: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """q with straight arms and the camera where it sees the desired image, off by an offset."""
    turn = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]) @ axes_on_body(vehicle).T)
    q = np.zeros(6 + 2 * vehicle.sections)
    q[:3] = [0.0, 0.0, STILL.distance] - turn.apply(on_body(vehicle)) + np.asarray(offset)
    q[3:6] = turn.as_euler("ZYX")[::-1]
    return q


def served(vehicle: ca.Vehicle, q: Any, law: ca.Controller, **fields: Any) -> xr.Dataset:
    scenario = ca.Scenario("servoing", q, controller=law, target=STILL, **fields)
    return ca.simulate(vehicle, scenario, sample=0.02, rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_servoing_brings_the_image_home_from_bent_arms_on_the_coupled_plant(
    vehicle: ca.Vehicle,
) -> None:
    q = above(vehicle, [0.1, -0.05, 0.1])
    q[6::2], q[7::2] = 0.1, [0.3, 2.0]
    run = served(vehicle, q, ca.servoing(**ca.design(vehicle, 6.0)), duration=12.0)
    assert run.status == 0
    assert np.abs(run.feature_error[0]).max() > 25.0
    assert np.abs(run.feature_error[-1]).max() < 1e-3
    # Bends of all arms come to rest straight.
    assert np.abs(run.bend[-1]).max() < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_with_current_gains_the_image_comes_home_from_far_with_arms_carried(
    vehicle: ca.Vehicle,
) -> None:
    q = above(vehicle, [0.4, -0.3, 0.5])
    law = ca.servoing(**ca.design(vehicle, 3.0, gains="current"))
    run = served(vehicle, q, law, duration=12.0)
    assert run.status == 0
    assert np.abs(run.feature_error[0]).max() > 100.0
    assert np.abs(run.feature_error[-1]).max() < 1.0
    assert np.abs(run.bend[-1]).max() < 1e-2


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_with_arms_carried_the_camera_has_the_double_pole_of_its_design(
    vehicle: ca.Vehicle,
) -> None:
    """From rest a double pole leaves (1 + ω t) exp(-ω t), and the arms stay straight."""
    law = ca.servoing(**ca.design(vehicle, 3.0, conditioning=0.0))
    run = served(vehicle, above(vehicle, [1e-3, 0, 0]), law, duration=1.0, control_period=None)
    error = np.linalg.norm(run.feature_error, axis=-1)
    left = (1.0 + 3.0 * run.time) * np.exp(-3.0 * run.time)
    np.testing.assert_allclose(error / error[0], left, rtol=0, atol=5e-3)
    tips = vehicle.reach * np.abs(run.bend).max()
    assert tips < 1e-4


def moved(vehicle: ca.Vehicle, law: ca.Controller) -> tuple[np.ndarray, ...]:
    """q, q̇ and the first push, in paper coordinates, of a vehicle in motion."""
    rng = np.random.default_rng(5)
    q = above(vehicle, [0.1, -0.05, 0.1])
    q[3:6] += [0.05, -0.04, 0.3]
    q[6:] = rng.uniform(0.2, 0.6, len(q) - 6)
    qd = 0.1 * rng.normal(size=len(q))
    run = served(vehicle, q, law, qd=qd, duration=0.02, control_period=1e-3)
    push = run.command[0].to_numpy()
    euler = euler_to_body_rates(q[None])[0].T @ push[3:6]
    return q, qd, np.concatenate([push[:3], euler, in_polar(q, push[6:])])


def in_polar(q: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """(Q_κ, Q_ψa) of each section from moments on its bend vector."""
    cosine, sine = np.cos(q[7::2]), np.sin(q[7::2])
    x, y = moments[::2], moments[1::2]
    return np.column_stack([cosine * x + sine * y, q[6::2] * (cosine * y - sine * x)]).ravel()


def as_printed(vehicle: ca.Vehicle, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """J_Lᵀ (K_p e_a - K_d J_L q̇) through all coordinates, K_p = 2, K_d = 0.1, C_d = 0.5."""
    image, depth = equations.look(vehicle, q, STILL.points)
    J = interaction_matrix(image, depth) @ equations.camera_jacobian(vehicle, q)
    error = STILL.desired - image
    e_a = -0.5 * J @ qd + error + 1e-6 * np.tanh(error / 1e-3)
    return np.asarray(J.T @ (2.0 * e_a - 0.1 * J @ qd))


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_without_carrying_the_law_is_the_papers_through_all_bends(vehicle: ca.Vehicle) -> None:
    q, qd, push = moved(vehicle, ca.servoing(2.0, 0.1, Cd=0.5))
    expected = equations.weight_vector(vehicle, q, nodes=32) + as_printed(vehicle, q, qd)
    np.testing.assert_allclose(push, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.long
@pytest.mark.parametrize("vehicle", [TWO, DUAL], ids=lambda vehicle: vehicle.name)
def test_carried_arms_get_what_inertia_asks_for_and_loops_of_their_own(
    vehicle: ca.Vehicle,
) -> None:
    law = ca.servoing(2.0, 0.1, Cd=0.5, arms=ca.design(vehicle, 3.0, bend_rate=7.0)["arms"])
    q, qd, push = moved(vehicle, law)
    wrench = as_printed(vehicle, q, qd)[:6]
    weight = equations.weight_vector(vehicle, q, nodes=32)
    np.testing.assert_allclose(push[:6], weight[:6] + wrench, rtol=0, atol=1e-9)
    body = (
        equations.rotation(q).T @ wrench[:3],
        np.linalg.solve(euler_to_body_rates(q[None])[0].T, wrench[3:]),
    )
    # A rigid body's acceleration under that push bends straight arms by moments -M k̈.
    rigid = np.linalg.solve(rigid_inertia(vehicle), np.concatenate(body))
    cosine, sine = np.cos(q[7::2]), np.sin(q[7::2])
    bend = np.column_stack([q[6::2] * cosine, q[6::2] * sine]).ravel()
    rate = np.column_stack(
        [
            qd[6::2] * cosine - q[6::2] * qd[7::2] * sine,
            qd[6::2] * sine + q[6::2] * qd[7::2] * cosine,
        ]
    ).ravel()
    held = bend_inertia(vehicle) @ (49.0 * bend + 14.0 * rate)
    expected = weight[6:] + in_polar(q, coupled(vehicle) @ rigid - held)
    # The law's inertia is that of arms bent by 1e-4 rad.
    np.testing.assert_allclose(push[6:], expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def coupled(vehicle: ca.Vehicle) -> np.ndarray:
    """Moments on the bends of straight arms per acceleration of the body (bends, 6) as a rigid
    one, weightless: those that undo what the bends do without them."""
    state: dict[str, Any] = {"bend": np.zeros((2, 2)), "gravity": 0.0}
    answers = []
    M = rigid_inertia(vehicle)
    for k in range(6):
        pushed = M[:, k]
        bent = ca.accelerations(vehicle, **state, force=pushed[:3], moment=pushed[3:])[2]
        answers.append(np.ravel(bent))
    free = np.stack(
        [
            np.ravel(ca.accelerations(vehicle, **state, bend_moment=unit.reshape(2, 2))[2])
            for unit in np.eye(4)
        ],
        axis=-1,
    )
    return np.asarray(-np.linalg.solve(free, np.stack(answers, axis=-1)))


@pytest.mark.long
def test_gains_designed_for_another_vehicle_are_refused_in_one_sentence() -> None:
    law = ca.servoing(**ca.design(TWO, 3.0))
    paper = ca.load_vehicle("paper")
    with refused("per_push"):
        served(paper, above(paper), law)
    with refused("arms"):
        ca.servoing(1.0, 1.0, arms=3)  # type: ignore[arg-type]
    with refused("bend_rate"):
        ca.design(TWO, 3.0, bend_rate=-1.0)
