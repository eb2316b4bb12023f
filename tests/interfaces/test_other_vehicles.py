"""Vehicles by the parameters of RotorPy, drone-models and Crazyflow."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.oracles import test_crazyflow as crazyflow
from tests.oracles import test_rotorpy as rotorpy
from tests.refusals import refused

GRAVITY = 9.81
CORNERS = np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]]) * 0.12
QUAD: dict[str, Any] = {
    "mass": 0.5, "Ixx": 3.65e-3, "Iyy": 3.68e-3, "Izz": 7.03e-3, "Ixy": 0.0, "Iyz": 0.0, "Ixz": 0.0,
    "num_rotors": 4, "rotor_radius": 0.1, "rotor_pos": dict(zip("abcd", CORNERS, strict=True)),
    "rotor_directions": np.array([1, -1, 1, -1]), "rI": np.zeros(3), "c_Dx": 0.5e-2, "c_Dy": 0.7e-2,
    "c_Dz": 1e-2, "k_eta": 5.57e-6, "k_m": 1.36e-7, "k_d": 1.19e-4, "k_z": 2.32e-4, "k_flap": 0.0,
    "tau_m": 0.005, "rotor_speed_min": 100, "rotor_speed_max": 1500, "motor_noise_std": 50.0,
}  # fmt: skip
"""In the form of RotorPy's hummingbird_params."""

DRONES = """
[linear]
gravity_vec = [0.0, 0.0, -9.81]
mass = 0.04338
L = 0.035
J = [[25e-6, 0.0, 0.0], [0.0, 28e-6, 0.0], [0.0, 0.0, 49e-6]]
rpm2thrust = [0.0, 2.5e-6, 3.0e-10]
rpm2torque = [0.0, 2.4e-9, 2.4e-12]
thrust_tau = 0.08
mixing_matrix = [[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0], [-1.0, 1.0, -1.0, 1.0]]
pwm_max = 65535
thrust_min = 0.03
thrust_max = 0.18
vmotor2rpm = [4304.9, 3948.9]
prop_radius = 27.5e-3
prop_inertia = 38.93e-9

[asymmetric]
mass = 0.0328
J = [[16.8e-6, 0.0, 0.0], [0.0, 16.8e-6, 0.0], [0.0, 0.0, 29.8e-6]]
thrust_min = 0.0128
thrust_max = 0.12
L = 0.03253
prop_inertia = 34.52e-9
rpm2thrust = [0.0, -5.4e-7, 2.46e-10]
rpm2torque = [0.0, 1.4e-9, 1.46e-12]
rotor_dyn_coef = [7.36, 0.0, 0.0, 2.44e-4]
mixing_matrix = [[-1.0, -1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0], [-1.0, 1.0, -1.0, 1.0]]
drag_matrix = [[-0.0147, 0.0, 0.0], [0.0, -0.0148, 0.0], [0.0, 0.0, -0.0128]]
"""
"""In the forms of drone-models' data/params.toml, and of Crazyflow's first principles."""


@pytest.fixture
def drones(tmp_path: Path) -> Path:
    path = tmp_path / "params.toml"
    path.write_text(DRONES, encoding="utf-8")
    return path


def rotors_of(vehicle: ca.Vehicle) -> Any:
    assert vehicle.uav.rotors is not None
    return vehicle.uav.rotors


@pytest.mark.long
def test_rotorpys_quadrotor_hovers_and_slows_down_as_its_coefficients_say() -> None:
    vehicle = ca.rotorpy_vehicle(QUAD)
    hover, v = 0.5 * GRAVITY / 4.0, 2.0
    speed = np.sqrt(hover / 5.57e-6)
    start = ca.Scenario("sideways", np.zeros(6), [v, 0, 0, 0, 0, 0], duration=1e-3)
    flight = ca.simulate(vehicle, start, sample=1e-4, rtol=1e-10)
    np.testing.assert_allclose(flight.rotor_thrust[0], hover, rtol=1e-9)
    rate = np.gradient(flight.velocity.to_numpy(), 1e-4, axis=0)[0, 0]
    assert rate == pytest.approx(-(4.0 * 1.19e-4 * speed * v + 0.5e-2 * v * v) / 0.5, rel=1e-3)


def test_rotorpys_limits_and_torques() -> None:
    rotors = rotors_of(ca.rotorpy_vehicle(QUAD))
    np.testing.assert_allclose(rotors.limits, 4 * [[5.57e-6 * 1e4, 5.57e-6 * 1500.0**2]])
    # The torque has the sign of its direction: RotorPy's yaw row.
    np.testing.assert_allclose(rotors.allocation[5], np.array([1, -1, 1, -1]) * 1.36e-7 / 5.57e-6)
    assert rotors.hub_drag == pytest.approx((1.19e-4 * 1500.0, 2.32e-4 * 1500.0))
    assert rotors.lag == 0.005 and rotors.radius == 0.1


def test_parameters_that_rotorpy_itself_runs_give_the_vehicle_that_is_compared_with_it() -> None:
    inertia = np.array(rotorpy.INERTIA)
    params = {f"I{a}{b}": inertia["xyz".index(a), "xyz".index(b)] for a, b in
              ("xx", "yy", "zz", "xy", "xz", "yz")}  # fmt: skip
    params |= {"mass": rotorpy.MASS, "num_rotors": 4, "rotor_pos": rotorpy.HUBS}
    params |= {"rotor_directions": rotorpy.DIRECTIONS, "rotor_speed_max": rotorpy.FULL}
    params |= {"k_eta": rotorpy.COEFFICIENT, "k_m": rotorpy.TORQUE, "tau_m": rotorpy.LAG}
    params |= dict(zip(("c_Dx", "c_Dy", "c_Dz"), rotorpy.DRAG, strict=True))
    found, expected = ca.rotorpy_vehicle(params, name="rigid").uav, rotorpy.rigid().uav
    assert found.rotors == expected.rotors and found.drag == expected.drag
    assert found == expected


def test_parameters_that_crazyflow_itself_runs_give_the_vehicle_that_is_compared_with_it() -> None:
    lag = crazyflow.LAG
    params = {"mass": crazyflow.MASS, "L": crazyflow.LEVER, "J": np.array(crazyflow.INERTIA)}
    params |= {"rpm2thrust": [0.0, 0.0, crazyflow.COEFFICIENT], "mixing_matrix": crazyflow.MIXING}
    params |= {"rpm2torque": [0.0, 0.0, crazyflow.TORQUE], "prop_inertia": 0.0}
    params |= {"thrust_min": 0.0, "thrust_max": crazyflow.COEFFICIENT * crazyflow.FULL**2}
    params |= {"drag_matrix": -np.diag(crazyflow.DRAG)}
    params |= {"rotor_dyn_coef": [1.0 / lag, 0.0, 1.0 / lag, 0.0]}
    found, expected = ca.drone_models_vehicle(params).uav, crazyflow.rigid().uav
    mine, theirs = rotors_of(ca.drone_models_vehicle(params)), rotors_of(crazyflow.rigid())
    np.testing.assert_allclose(mine.allocation, theirs.allocation, rtol=1e-14, atol=1e-17)
    assert found.inertia == expected.inertia and found.drag == expected.drag
    assert (mine.lag, mine.lag_down) == (pytest.approx(lag, rel=1e-14), None)
    assert mine.thrust_model_factor == pytest.approx(1.0, rel=1e-14)
    np.testing.assert_array_equal(mine.limits, theirs.limits)


def test_a_thrust_curve_with_a_linear_term_is_its_thrust_model_factor(drones: Path) -> None:
    rotors = rotors_of(ca.drone_models_vehicle(drones, "linear"))
    # 2.5e-6 n + 3e-10 n² = 0.18 N at the greatest speed; at half of it the curve gives this thrust.
    full = (-2.5e-6 + np.sqrt(2.5e-6**2 + 4.0 * 3e-10 * 0.18)) / 6e-10
    half = 2.5e-6 * full / 2.0 + 3e-10 * full**2 / 4.0
    np.testing.assert_allclose(rotors.thrusts_of(np.full(4, 0.5)), half, rtol=1e-12)
    np.testing.assert_array_equal(rotors.limits, 4 * [[0.03, 0.18]])
    hovering = 0.04338 * GRAVITY / 4.0
    n = (-2.5e-6 + np.sqrt(2.5e-6**2 + 4.0 * 3e-10 * hovering)) / 6e-10
    assert rotors.torque_per_thrust == pytest.approx((2.4e-9 * n + 2.4e-12 * n * n) / hovering)
    assert (rotors.lag, rotors.lag_down, rotors.radius) == (0.08, None, 27.5e-3)


def test_lags_of_crazyflow_are_those_at_hover(drones: Path) -> None:
    vehicle = ca.drone_models_vehicle(drones, "asymmetric")
    rotors, hovering = rotors_of(vehicle), 0.0328 * GRAVITY / 4.0
    n = (5.4e-7 + np.sqrt(5.4e-7**2 + 4.0 * 2.46e-10 * hovering)) / (2.0 * 2.46e-10)
    assert rotors.lag == pytest.approx(1.0 / 7.36, rel=1e-12)
    assert rotors.lag_down == pytest.approx(1.0 / (2.0 * 2.44e-4 * n), rel=1e-12)
    assert rotors.thrust_model_factor == 1.0
    assert vehicle.uav.drag is not None and vehicle.uav.drag.linear == (0.0147, 0.0148, 0.0128)


def test_the_thrusts_of_a_mixing_matrix_turn_as_it_says(drones: Path) -> None:
    rotors = rotors_of(ca.drone_models_vehicle(drones, "asymmetric"))
    mixing = np.array([[-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]])
    np.testing.assert_allclose(rotors.allocation[3:5], 0.03253 * mixing[:2], atol=1e-17)
    np.testing.assert_allclose(rotors.allocation[5], rotors.torque_per_thrust * mixing[2])


def test_an_arm_is_added_by_replace() -> None:
    arm = {"length": 0.3, "mass_per_length": 0.1, "bending_stiffness": 0.5}
    vehicle = ca.rotorpy_vehicle(QUAD).replace({"arm": arm})
    assert vehicle.arm.length == 0.3 and vehicle.mass == pytest.approx(0.53)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"k_flap": 1e-7}, "params.k_flap"),
        ({"rotor_inertia": 1e-5}, "params.rotor_inertia"),
        ({"mass": "0.5"}, "params.mass"),
        ({"mass": -0.5}, "params.mass"),
        ({"k_d": -1e-4}, "params.k_d"),
        ({"tau_m": None}, "params.tau_m"),
        ({"num_rotors": 6}, "params.num_rotors"),
        ({"rotor_directions": [1, -1, 1]}, "params.rotor_directions"),
        ({"rotor_directions": [1, -1, 1, 0.5]}, "params.rotor_directions"),
        ({"rotor_speed_min": 1500}, "params.rotor_speed_min"),
        ({"rotor_speed_max": 1e200}, "uav.rotors.thrust_limits"),
        ({"rotor_speed_max": 300.0}, "uav.rotors.thrust_limits"),
        ({"rotor_pos": {}}, "params.rotor_pos"),
        ({"rotor_pos": {"a": [0.1, 0.1]}, "num_rotors": 1}, "params.rotor_pos.a"),
        ({"rotor_pos": dict.fromkeys(range(1000), [0, 0, 0])}, "params.rotor_pos"),
    ],
)
def test_what_rotorpys_parameters_cannot_be_is_refused(changes: dict[str, Any], field: str) -> None:
    with refused(field):
        ca.rotorpy_vehicle(QUAD | changes)


def test_parameters_that_are_missing_are_named() -> None:
    with refused("params.k_eta"):
        ca.rotorpy_vehicle({name: value for name, value in QUAD.items() if name != "k_eta"})
    with refused("params"):
        ca.rotorpy_vehicle([1.0, 2.0])  # type: ignore[arg-type]
    with refused("drone.J"):
        ca.drone_models_vehicle({"mass": 0.03})


@pytest.mark.parametrize(
    ("line", "other", "field"),
    [
        ("rpm2thrust = [0.0, 2.5e-6, 3.0e-10]", "rpm2thrust = [0.01, 0.0, 3e-10]", "rpm2thrust"),
        ("rpm2thrust = [0.0, 2.5e-6, 3.0e-10]", "rpm2thrust = [0.0, 1e-6, 0.0]", "rpm2thrust"),
        ("rpm2torque = [0.0, 2.4e-9, 2.4e-12]", "rpm2torque = [0.0, 0.0, 0.0]", "rpm2torque"),
        ("thrust_tau = 0.08", "", "thrust_tau"),
        ("thrust_tau = 0.08", "rotor_dyn_coef = [0.0, 0.0, 9.0, 0.0]", "rotor_dyn_coef"),
        ("thrust_tau = 0.08", "rotor_dyn_coef = [9.0, 9.0]", "rotor_dyn_coef"),
        ("thrust_min = 0.03", "thrust_min = 0.2", "thrust_min"),
        ("L = 0.035\n", "L = 0.0\n", "L"),
        ("[-1.0, 1.0, -1.0, 1.0]]", "[-0.5, 1.0, -1.0, 1.0]]", "mixing_matrix"),
        ("pwm_max = 65535", "drag_matrix = [[-1, 0, 1], [0, -1, 0], [0, 0, -1]]", "drag_matrix"),
        ("pwm_max = 65535", "drag_matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "drag_matrix"),
    ],
)
def test_what_a_drone_cannot_be_is_refused(
    line: str, other: str, field: str, tmp_path: Path
) -> None:
    path = tmp_path / "drones.toml"
    assert line in DRONES
    path.write_text(DRONES.split("[asymmetric]")[0].replace(line, other), encoding="utf-8")
    with refused(f"linear.{field}"):
        ca.drone_models_vehicle(path)


def test_a_file_with_another_drone_or_too_large_is_refused(drones: Path) -> None:
    with refused("drone"):
        ca.drone_models_vehicle(drones)
    with refused("drone"):
        ca.drone_models_vehicle(drones, "cf2x")
    drones.write_text("a = 1\n", encoding="utf-8")
    with refused("source"):
        ca.drone_models_vehicle(drones, "cf2x")
    drones.write_text("#" * 2**21, encoding="utf-8")
    with refused("source"):
        ca.drone_models_vehicle(drones, "cf2x")
