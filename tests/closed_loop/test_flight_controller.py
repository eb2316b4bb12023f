"""The flight controller: the motion that its bandwidths promise, and its limits."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.signal import StateSpace, step
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.controllers.cascade_gains import position_gains
from continuair.errors import ContinuairWarning

PAPER = ca.load_vehicle("paper")
# An arm of 0.6 g, which moves nothing and swings at 57 rad/s: the rigid vehicle.
RIGID = PAPER.replace(
    {
        "arm.length": 0.1,
        "arm.density": 78.5,
        "arm.youngs_modulus": 2e5,
        "arm.damping_ratio": 0.1,
    }
)
QUAD = {"layout": "quad_x", "lever": 0.23, "torque_per_thrust": 0.016, "lag": 0.04}
ROTORS = PAPER.replace({"uav.rotors": QUAD | {"thrust_limits": [0.2, 14.0]}})
HOME = np.array([0, 0, 3.0, 0, 0, 0, 0, 0])


def fly(vehicle: ca.Vehicle, controller: ca.Controller, q: Any = HOME, **fields: Any) -> xr.Dataset:
    options = {"duration": 4.0} | fields
    names = ["position", "attitude", "bend", "q", "angular_velocity", "command"]
    scenario = ca.Scenario("flight", q, controller=controller, **options)
    return ca.simulate(vehicle, scenario, sample=0.01, variables=names)


def tilt(run: xr.Dataset) -> np.ndarray:
    x, y = (run.attitude.sel(quaternion=axis).to_numpy() for axis in "xy")
    return np.arccos(1.0 - 2.0 * (x * x + y * y))


def test_a_climb_has_the_poles_and_the_zeros_of_the_designed_position_loop() -> None:
    """No attitude lags behind a climb: z = (k_v s + k_i) k_p / ((s² + 2ω s + ω²)(s + ω/5))."""
    w = 2.0
    k_p, k_v, k_i = position_gains(w, 1.0, 0.2)
    np.testing.assert_allclose(
        np.sort(np.roots([1, k_v, k_v * k_p + k_i, k_i * k_p])), [-w, -w, -0.2 * w], rtol=1e-6
    )
    law = ca.flight_controller(RIGID, position_bandwidth=w, rate=1000.0, speed=100.0)
    run = fly(RIGID, law, setpoints=ca.Setpoints(position=[0, 0, 3.5]))
    A = np.array([[-k_v, -k_v * k_p - k_i, -k_i * k_p], [1, 0, 0], [0, 1, 0]])
    loop = StateSpace(A, [[1], [0], [0]], [[0, k_v * k_p, k_i * k_p]], [[0]])
    expected = 3.0 + 0.5 * step(loop, T=run.time.to_numpy())[1]
    # A push held for 1 ms lags by 0.5 ms, in which z moves by at most 0.5 m ω 0.5 ms.
    np.testing.assert_allclose(run.position.sel(axis="z"), expected, rtol=0, atol=5e-4)


def test_a_turn_has_the_poles_of_the_designed_attitude_loop() -> None:
    """(1 + ω t) exp(-ω t) of a small turn is left, in yaw as in roll."""
    law = ca.flight_controller(
        RIGID, attitude_bandwidth=10.0, yaw_bandwidth=4.0, position_bandwidth=0.02, rate=1000.0
    )
    run = fly(RIGID, law, HOME + [0, 0, 0, 0.02, 0, 0, 0, 0], duration=1.0,
              setpoints=ca.Setpoints(velocity=[0, 0, 0], yaw=0.02))  # fmt: skip
    t = run.time.to_numpy()
    left = (1.0 + 4.0 * t) * np.exp(-4.0 * t)
    np.testing.assert_allclose(run.q.sel(coordinate="yaw"), 0.02 * (1 - left), atol=0.02 * 4e-3)
    # Meanwhile the vehicle drifts, and leans back a little against that.
    left = (1.0 + 10.0 * t) * np.exp(-10.0 * t)
    np.testing.assert_allclose(run.q.sel(coordinate="roll"), 0.02 * left, atol=0.02 * 0.015)


def test_it_turns_back_from_170_degrees_the_short_way() -> None:
    law = ca.flight_controller(RIGID, attitude_bandwidth=12.0, tilt=0.5)
    start = np.tile(HOME, (3, 1))
    start[:, 2], start[:, 3] = 40.0, np.radians(170.0)
    start[:, 5] = [0.0, 2.0, -3.0]
    goal = ca.Setpoints(position=[0, 0, 40], yaw=0.0)
    with pytest.warns(ContinuairWarning, match="3 of 3 runs: thrust .*t = 0 s"):
        run = fly(RIGID, law, start, duration=20.0, setpoints=goal)
    assert (run.status == 0).all()
    assert np.abs(run.position.to_numpy()[:, -1] - [0, 0, 40]).max() < 0.05
    assert tilt(run)[:, -1].max() < 0.01
    turned = np.trapezoid(np.linalg.norm(run.angular_velocity, axis=-1), run.time, axis=-1)
    # To upright and to the yaw takes no more than 170° and half a turn; unwinding a whole turn.
    assert (turned < np.radians(170.0) + np.pi + 1.0).all()


def test_a_yaw_beyond_half_a_turn_is_reached_the_short_way() -> None:
    law = ca.flight_controller(RIGID)
    run = fly(RIGID, law, setpoints=ca.Setpoints(yaw=np.radians(350.0)))
    yaw = run.q.sel(coordinate="yaw").to_numpy()
    assert yaw[-1] == pytest.approx(np.radians(-10.0), abs=1e-3) and yaw.max() < 1e-3


def test_the_heading_that_is_kept_is_that_of_the_start_by_either_of_its_euler_angles() -> None:
    one = np.array([0.0, 0.0, 3.0, 0.1, -0.2, 0.4, 0.3, 0.5])
    other = one + [0.0, 0.0, 0.0, np.pi, np.pi + 0.4, np.pi, 0.0, 0.0]
    law = ca.flight_controller(PAPER)
    first, second = (fly(PAPER, law, q, duration=1.0) for q in (one, other))
    np.testing.assert_allclose(second["position"], first["position"], atol=1e-9)
    assert abs(turned(first)[-1] - 0.4) < 0.02
    assert abs(turned(second)[-1] - 0.4) < 0.02


def turned(run: xr.Dataset) -> np.ndarray:
    """Headings (samples,) [rad]."""
    return Rotation.from_quat(run["attitude"].to_numpy()).as_euler("ZYX")[:, 0]


@pytest.mark.parametrize(("share", "feedforward"), [(0.0, "none"), (0.2, "weight")])
def test_the_integral_removes_what_a_steady_force_leaves(share: float, feedforward: Any) -> None:
    """Without it F / (m ω²) is left of a force F, as the loop's stiffness is ω² m."""
    law = ca.flight_controller(
        RIGID, position_bandwidth=2.0, integral_share=share, feedforward=feedforward
    )
    run = fly(RIGID, law, force=[0.5, -0.3, -1.0], duration=20.0)
    off = run.position.to_numpy()[-1] - HOME[:3]
    stays = np.array([0.5, -0.3, -1.0]) / (4.0 * RIGID.mass)
    np.testing.assert_allclose(off, stays if share == 0.0 else 0.0, rtol=0.03, atol=1e-4)


def test_the_integral_carries_an_arm_that_the_controller_does_not_know_of() -> None:
    """Gains for a UAV whose arm weighs a hundredth: 0.6 kg are carried by the integral alone."""
    known = PAPER.replace({"arm.density": 78.5, "arm.youngs_modulus": 207e7})
    law = ca.flight_controller(
        known, attitude_bandwidth=15.0, position_bandwidth=1.0, bend_bandwidth=0.0,
        feedforward="none", rate=500.0,
    )  # fmt: skip
    vehicle = PAPER.replace({"arm.damping_ratio": 0.03})
    run = fly(vehicle, law, duration=40.0)
    sank = 3.0 - run.position.sel(axis="z").to_numpy()
    assert run.status == 0 and sank.max() > 0.3
    assert np.abs(run.position.to_numpy()[-1] - HOME[:3]).max() < 2e-3


def test_thrust_tilt_and_moment_stay_within_their_limits_and_the_integral_does_not_wind_up() -> (
    None
):
    law = ca.flight_controller(
        RIGID, tilt=0.3, thrust=[12.0, 26.0], moment=[0.05, 0.05, 0.02], attitude_bandwidth=6.0,
        speed=20.0,
    )  # fmt: skip
    goals = np.array([[8.0, 0, 3], [0, -8.0, 20.0], [0, 0, -9.0]])
    with pytest.warns(ContinuairWarning, match="3 of 3 runs: thrust, moment"):
        run = fly(RIGID, law, np.tile(HOME, (3, 1)), duration=40.0,
                  setpoints=ca.Setpoints(position=goals))  # fmt: skip
    command = run.command.to_numpy()
    thrust = np.linalg.norm(command[..., :3], axis=-1)
    assert thrust.min() > 12.0 - 1e-9 and thrust.max() < 26.0 + 1e-9
    assert thrust.min() < 12.1 and thrust.max() > 25.9
    assert (np.abs(command[..., 3:6]) <= np.array([0.05, 0.05, 0.02]) + 1e-12).all()
    # Critically damped: what is asked for is not overshot but by the moment that is missing.
    assert 0.27 < tilt(run).max() < 0.33
    beyond = (run.position.to_numpy() - goals[:, None]) * np.sign(goals - HOME[:3])[:, None]
    assert beyond.max() < 1.5
    np.testing.assert_allclose(run.position.to_numpy()[:, -1], goals, atol=0.02)


def test_thrust_is_along_the_body_and_turns_with_it_between_the_law_s_instants() -> None:
    law = ca.flight_controller(
        RIGID, rate=20.0, attitude_bandwidth=4.0, position_bandwidth=0.5, bend_bandwidth=0.0
    )
    run = fly(RIGID, law, duration=2.0, setpoints=ca.Setpoints(position=[1.0, 0.5, 3.0]))
    x, y, z, w = run.attitude.to_numpy().T
    body_z = np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], -1)
    force = run.command.to_numpy()[:, :3]
    across = np.linalg.norm(np.cross(force, body_z), axis=-1)
    assert tilt(run).max() > 0.02 and across.max() < 1e-9 * np.linalg.norm(force, axis=-1).max()


@pytest.mark.parametrize(
    ("vehicle", "feedforward"),
    [
        (PAPER, "weight"),
        pytest.param(PAPER, "reaction", marks=pytest.mark.long),
        (ROTORS, "weight"),
    ],
)
def test_the_preset_is_held_within_a_centimetre_and_a_degree_while_its_arm_swings(
    vehicle: ca.Vehicle, feedforward: Any
) -> None:
    """By half a radian at 0.25 Hz: the arm's recoil alone moves the base by 20 mm. With rotors that
    lag by 40 ms, too."""
    law = ca.flight_controller(vehicle, feedforward=feedforward)
    swing = ca.Setpoints(bend=lambda t: [0.56 * np.sin(0.5 * np.pi * t), 0.0])
    run = fly(vehicle, law, duration=24.0, setpoints=swing).sel(time=slice(16.0, None))
    assert np.abs(run.bend.to_numpy()[:, 0]).max() > 0.5
    assert np.linalg.norm(run.position.to_numpy() - HOME[:3], axis=-1).max() < 0.01
    assert np.degrees(tilt(run).max()) < 1.0


@pytest.mark.parametrize("hertz", [0.25, 1.0])
def test_the_base_moves_by_as_much_of_the_recoil_as_the_tilt_leaves(hertz: float) -> None:
    """Upright rotors accelerate the centre of mass by g θ, so that a base that is off it by s moves
    by at least s - g θ/ω², whatever the controller; half a radian of the arm makes s 19 mm."""
    w, law = 2.0 * np.pi * hertz, ca.flight_controller(ROTORS)
    swing = ca.Setpoints(bend=lambda t: [0.6 * np.sin(w * t), 0.0])
    run = fly(ROTORS, law, duration=20.0, setpoints=swing).sel(time=slice(20.0 - 2.0 / hertz, None))
    angle = np.abs(run.bend.to_numpy()[:, 0]).max() * PAPER.arm.length
    aside = PAPER.arm.length * (1.0 - np.sin(angle) / angle) / angle
    recoil = aside * PAPER.arm.mass / PAPER.mass
    least = recoil - 9.81 * float(np.tan(tilt(run).max())) / w**2
    moved = np.linalg.norm(run.position.to_numpy()[:, :2], axis=-1).max()
    assert moved > least - 1e-4
    assert moved < recoil + 9.81 * float(np.tan(tilt(run).max())) / w**2


@pytest.mark.long
@pytest.mark.parametrize("seed", [3, 4])
def test_position_is_held_within_ten_centimetres_of_turbulence_and_its_mean(seed: int) -> None:
    """For 60 s from calm on, by rotors that lag by 40 ms."""
    vehicle = ROTORS.replace({"uav.drag": {"linear": [0.3, 0.3, 0.15]}, "arm.damping_ratio": 0.03})
    law = ca.flight_controller(vehicle, position_bandwidth=3.0, feedforward="reaction")
    wind = ca.dryden(5.0, 10.0, 5.0, seed=seed, mean=(5.0, 0.0, 0.0), duration=60.0)
    run = fly(vehicle, law, duration=60.0, wind=wind)
    off = np.linalg.norm(run.position.to_numpy() - HOME[:3], axis=-1)
    assert off.max() < 0.1
    assert off[run.time.to_numpy() > 5.0].max() < 0.03


def test_a_bend_servo_has_its_lag_and_its_largest_speed_and_a_free_arm_none() -> None:
    law = ca.flight_controller(PAPER, bend_bandwidth=4.0, bend_speed=0.5, rate=500.0)
    run = fly(PAPER, law, duration=3.0, setpoints=ca.Setpoints(bend=[0.4, -0.05]))
    t, bend = run.time.to_numpy(), run.bend.to_numpy()
    # x goes at 0.5 1/(m s) until 0.125 is left, which takes 0.55 s, and then as exp(-4 t).
    left = np.where(t < 0.55, 0.4 - 0.5 * t, 0.125 * np.exp(-4.0 * (t - 0.55)))
    np.testing.assert_allclose(bend[:, 0], 0.4 - left, atol=0.012)
    np.testing.assert_allclose(bend[:, 1], -0.05 * (1 - np.exp(-4.0 * t)), atol=0.002)
    free = ca.flight_controller(PAPER, bend_bandwidth=0.0)
    hung = fly(PAPER, free, HOME + [0, 0, 0, 0, 0, 0, 0.02, 0], duration=0.5)
    assert np.abs(hung.command.to_numpy()[:, 6:]).max() == 0.0


@pytest.mark.parametrize("runs", [1, 3])
def test_a_vehicle_that_turns_over_has_lost_control_and_says_so(runs: int) -> None:
    """A moment that the controller does not withstand; in a batch only the runs that it meets."""
    moments = np.array([[3.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, -3.0, 0.0]])[:runs]
    law = ca.flight_controller(PAPER, moment=(1.0, 1.0, 1.0))
    start = ca.Scenario("pushed", HOME, controller=law, moment=moments, duration=3.0)
    with pytest.warns(ContinuairWarning, match="limits.*: .*moment"):
        flight = ca.simulate(PAPER, start, sample=0.01, variables=["attitude"])
    told = flight["status"].to_numpy().ravel()
    assert told.tolist() == [4, 0, 4][:runs]
    x, y = (flight["attitude"].sel(quaternion=axis).to_numpy() for axis in "xy")
    up = 1.0 - 2.0 * (x * x + y * y)
    assert np.nanmin(up.reshape(runs, -1)[0]) > -0.2 and float(flight["end_time"].min()) < 2.0


def test_limits_of_bends_are_told_but_not_those_of_sections_that_hang_free() -> None:
    bend = ca.Setpoints(bend=[0.3, 0.0])
    held = ca.flight_controller(PAPER, bend_moment=0.5, latency=0.001)
    start = ca.Scenario("bend", HOME, controller=held, setpoints=bend, duration=1.0)
    with pytest.warns(ContinuairWarning, match="limits: bend moment"):
        flight = ca.simulate(PAPER, start, sample=0.01)
    assert float(np.abs(flight["command"][:, 6:]).max()) == pytest.approx(0.5)
    # Nothing is told, though a free section's moment is always at its only value, 0.
    free = ca.flight_controller(PAPER, bend_bandwidth=0.0, bend_moment=0.5, latency=0.001)
    ca.simulate(PAPER, start.replace(controller=free, setpoints=None), sample=0.01)


def test_a_flight_that_starts_upside_down_is_not_ended_by_it() -> None:
    law = ca.flight_controller(RIGID, attitude_bandwidth=10.0)
    start = np.array([0, 0, 30.0, 2.4, 0, 0, 0, 0])
    recover = ca.Scenario("recover", start, controller=law, duration=4.0)
    with pytest.warns(ContinuairWarning, match="limits: thrust .*t = 0 s"):
        run = ca.simulate(RIGID, recover, sample=0.01)
    assert int(run["status"]) == 0
    assert tilt(run)[-1] < 0.1
