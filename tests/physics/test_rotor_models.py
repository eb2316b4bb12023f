"""Thrust curves, unequal lags, and drag and lift of moving rotors, against a motion in NumPy."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused

Array = np.ndarray
MASS, INERTIA = 1.2, np.diag([0.012, 0.014, 0.02])
LEVER, HEIGHT, HIGHEST, TORQUE = 0.2, 0.03, 8.0, 0.016
UP, DOWN, CURVE = 0.03, 0.06, 0.6
DRAG, LIFT = (0.09, 0.17), 0.004
ROTORS: dict[str, Any] = {
    "layout": "quad_x",
    "lever": LEVER,
    "height": HEIGHT,
    "thrust_limits": [0.0, HIGHEST],
    "torque_per_thrust": TORQUE,
    "lag": UP,
    "lag_down": DOWN,
    "thrust_model_factor": CURVE,
    "hub_drag": DRAG,
    "translational_lift": LIFT,
}
QUAD = ca.Vehicle(name="quad", uav={"mass": MASS, "inertia": INERTIA, "rotors": ROTORS})
START = [0.1, -0.2, 2.0, 0.1, -0.2, 0.3]
RATES = [3.0, -2.0, 1.0, 0.5, -0.4, 0.3]


def commands(t: float) -> Array:
    """Thrusts that rise and fall again."""
    return 3.0 + 1.5 * np.sin(9.0 * t + np.arange(4.0))


def breeze(t: float) -> Array:
    return np.array([2.0 + np.sin(2.0 * t), -1.0, 0.5 * np.cos(3.0 * t)])


def commanded_speed(thrust: Array) -> Array:
    """The positive root of f u² + (1 - f) u = thrust / greatest."""
    b = 1.0 - CURVE
    return (-b + np.sqrt(b * b + 4.0 * CURVE * thrust / HIGHEST)) / (2.0 * CURVE)


@cache
def spins_and_hubs() -> tuple[Array, Array]:
    rotors = QUAD.uav.rotors
    assert rotors is not None
    # c of the drag torque -s c z f: what the thrust does about the hub.
    about = [column[5] / TORQUE for column in rotors.allocation.T]
    return np.array(about), rotors.hubs


def motion(t: float, y: Array) -> Array:
    """Newton and Euler for the body, each rotor by itself, as RotorPy writes it."""
    v, w, u = y[3:6], y[10:13], y[13:]
    turn = Rotation.from_quat(y[6:10])
    spins, hubs = spins_and_hubs()
    local = turn.inv().apply(v - breeze(t)) + np.cross(w, hubs)
    thrust = HIGHEST * (CURVE * u**2 + (1.0 - CURVE) * u)
    pull = -u[:, None] * local * [DRAG[0], DRAG[0], DRAG[1]]
    pull[:, 2] += thrust + LIFT * (local[:, 0] ** 2 + local[:, 1] ** 2)
    force = pull.sum(0)
    moment = np.cross(hubs, pull).sum(0) + [0.0, 0.0, TORQUE * (spins @ thrust)]
    behind = commanded_speed(commands(t)) - u
    spun = behind / np.where(behind > 0.0, UP, DOWN)
    q = y[6:10] / np.linalg.norm(y[6:10])
    q_dot = 0.5 * np.append(q[3] * w + np.cross(q[:3], w), -q[:3] @ w)
    w_dot = np.linalg.solve(INERTIA, moment - np.cross(w, INERTIA @ w))
    v_dot = turn.apply(force) / MASS - [0.0, 0.0, 9.81]
    return np.concatenate([v, v_dot, q_dot, w_dot, spun])


@pytest.mark.long
def test_a_flight_is_that_of_newton_and_euler_with_each_rotor_by_itself() -> None:
    scenario = ca.Scenario(
        "flight", START, RATES, duration=0.6, rotor_command=commands, wind=breeze
    )
    flight = ca.simulate(QUAD, scenario, rtol=1e-10, sample=0.1)
    first = flight.isel(time=0)
    turn = Rotation.from_quat(first["attitude"].to_numpy())
    y = np.concatenate(
        [
            first["position"], turn.apply(first["velocity"].to_numpy()), first["attitude"],
            first["angular_velocity"], commanded_speed(commands(0.0)),
        ]
    )  # fmt: skip
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12, "max_step": 2e-3}
    direct = solve_ivp(motion, (0.0, 0.6), y, t_eval=flight["time"], **options).y.T
    np.testing.assert_allclose(flight["position"], direct[:, :3], rtol=0, atol=1e-7)
    np.testing.assert_allclose(flight["angular_velocity"], direct[:, 10:13], rtol=0, atol=1e-6)
    speeds = direct[:, 13:]
    thrusts = HIGHEST * (CURVE * speeds**2 + (1.0 - CURVE) * speeds)
    np.testing.assert_allclose(flight["rotor_thrust"], thrusts, rtol=0, atol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("curve", [0.0, 0.3, 1.0])
def test_a_curve_holds_the_thrust_that_is_commanded(curve: float) -> None:
    """Whatever the curve, thrusts settle where commands are, and numbers come back."""
    rotors = {**ROTORS, "hub_drag": (0.0, 0.0), "translational_lift": 0.0}
    vehicle = QUAD.replace({"uav.rotors": {**rotors, "thrust_model_factor": curve}})
    given = np.array([1.0, 2.0, 3.0, 0.0])
    scenario = ca.Scenario(
        "settle", START, duration=1.5, rotor_command=given, rotor_thrust=4 * [2.0]
    )
    thrust = ca.simulate(vehicle, scenario, sample=0.5)["rotor_thrust"].to_numpy()
    np.testing.assert_allclose(thrust[0], 2.0, rtol=1e-12)
    np.testing.assert_allclose(thrust[-1], given, rtol=0, atol=1e-6)
    made = vehicle.uav.rotors
    assert made is not None
    np.testing.assert_allclose(made.thrusts_of(made.speeds_of(given)), given, rtol=1e-12)


@pytest.mark.long
def test_rotors_without_lag_drag_by_the_speed_of_their_command() -> None:
    lagged = {**ROTORS, "lag": 1e-5, "lag_down": 1e-5}
    prompt = {**ROTORS, "lag": 0.0, "lag_down": 0.0}
    scenario = ca.Scenario("flight", START, RATES, duration=0.1, rotor_command=commands)
    places = [
        ca.simulate(QUAD.replace({"uav.rotors": rotors}), scenario, sample=0.05)["position"]
        for rotors in (lagged, prompt)
    ]
    np.testing.assert_allclose(places[1], places[0], rtol=0, atol=1e-5)


def test_drag_brakes_and_the_lift_needs_no_speed_along_the_axis() -> None:
    """In hover that starts sideways the rate of the speed is minus the sum of the rotors' drags."""
    q, hover = np.zeros(6), MASS * 9.81 / 4.0
    level = ca.Scenario(
        "sideways", q, [2.0, 0, 0, 0, 0, 0], duration=1e-3, rotor_command=4 * [hover]
    )
    flight = ca.simulate(QUAD, level, sample=1e-4, rtol=1e-10)
    rates = np.gradient(flight["velocity"].to_numpy(), 1e-4, axis=0)[0]
    speed = commanded_speed(np.array(hover))
    assert rates[0] == pytest.approx(-4.0 * DRAG[0] * speed * 2.0 / MASS, rel=1e-3)
    assert rates[2] == pytest.approx(4.0 * LIFT * 2.0**2 / MASS, rel=2e-2)


@pytest.mark.long
def test_runs_of_a_batch_have_numbers_of_their_own() -> None:
    several: dict[str, Any] = {
        "uav.rotors.lag_down": [0.06, 0.09],
        "uav.rotors.thrust_model_factor": [1.0, 0.3],
        "uav.rotors.hub_drag": [[0.09, 0.17], [0.0, 0.3]],
        "uav.rotors.translational_lift": [0.004, 0.0],
    }
    scenario = ca.Scenario("flight", START, RATES, duration=0.2, rotor_command=commands)
    both = ca.simulate(QUAD.replace(several), scenario, sample=0.1)["position"]
    for run in (0, 1):
        alone = QUAD.replace({name: values[run] for name, values in several.items()})
        place = ca.simulate(alone, scenario, sample=0.1)["position"]
        np.testing.assert_allclose(both.isel(run=run), place, rtol=0, atol=1e-9)


@pytest.mark.long
def test_the_implicit_method_flies_them_on_an_arm() -> None:
    vehicle = ca.load_vehicle("two_section").replace(
        {"uav.rotors": {**ROTORS, "thrust_limits": [0.0, 12.0]}}
    )
    q = np.zeros(10)
    q[6::2] = 0.2
    scenario = ca.Scenario("arm", q, [1.0, *9 * [0.0]], duration=0.1, rotor_command=4 * [5.0])
    rough = ca.simulate(vehicle, scenario, method="implicit", step=5e-4, sample=0.05)
    fine = ca.simulate(vehicle, scenario, sample=0.05, rtol=1e-8)
    np.testing.assert_allclose(rough["position"], fine["position"], rtol=0, atol=1e-4)


def test_a_vehicle_file_holds_them() -> None:
    import tomllib

    again = ca.Vehicle(**tomllib.loads(as_toml(QUAD)))
    assert again.describe() == QUAD.describe()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lag", 0.0),
        ("lag_down", -1.0),
        ("thrust_model_factor", 1.5),
        ("hub_drag", 0.1),
        ("hub_drag", [-1, 0]),
        ("translational_lift", -1.0),
    ],
)
def test_what_no_rotor_has_is_refused_in_a_sentence(name: str, value: Any) -> None:
    with refused(f"uav.rotors.{name}"):
        ca.Vehicle(
            name="quad", uav={"mass": 1.0, "inertia": INERTIA, "rotors": ROTORS | {name: value}}
        )


def test_the_papers_equations_say_what_they_lack() -> None:
    heavy = {"uav.rotors": {**ROTORS, "thrust_limits": [0.0, 12.0]}}
    vehicle = ca.load_vehicle("paper").replace(heavy)
    with refused("vehicle"):
        ca.equations.check_without_drag(vehicle)
