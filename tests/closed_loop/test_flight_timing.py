"""The flight controller's rate, latency and noise, and what its gains bear of them."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov

import continuair as ca
from continuair.controllers.hover import hover, resting
from continuair.controllers.margins import LinearLoop
from tests.closed_loop.test_flight_controller import HOME, PAPER, RIGID, ROTORS, fly
from tests.refusals import refused

DUAL = ca.load_vehicle("dual_arm")
LONG_LIGHT_ARM = Path(__file__).parents[1] / "long_light_arm.toml"


def nudged(vehicle: ca.Vehicle, controller: ca.Controller, duration: float) -> np.ndarray:
    """Sizes of roll over a flight that starts a little rolled."""
    start = np.zeros(6 + 2 * vehicle.sections)
    start[2], start[3] = 3.0, 1e-4
    run = fly(vehicle, controller, start, duration=duration, setpoints=ca.Setpoints(yaw=0.0))
    return np.abs(run.q.sel(coordinate="roll").to_numpy())


# One that goes unstable may end, or turn faster than its samples show.
@pytest.mark.long
@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
@pytest.mark.parametrize("feedforward", ["none", "weight", "reaction"])
@pytest.mark.parametrize("vehicle", [PAPER, RIGID], ids=["paper", "rigid"])
def test_a_flight_goes_unstable_at_the_latency_that_is_told(
    vehicle: ca.Vehicle, feedforward: Any
) -> None:
    law = ca.flight_controller(vehicle, feedforward=feedforward)
    margin = law.settings["latency_margin"]
    assert 1e-3 < margin < 0.2
    for share, grows in ((0.9, False), (1.1, True)):
        late = dataclasses.replace(law, latency=share * margin)
        size = nudged(vehicle, late, 6.0)
        before, after = size[100:200].max(), size[500:].max()
        # One that grows ends before the flight does, or in a limit cycle, which it may reach early.
        assert (not after <= (0.5 if grows else 1.0) * before) == grows, share


SIDEWAYS = ca.Vehicle(
    name="sideways",
    uav={
        "mass": 3.4,
        "inertia": [0.05, 0.05, 0.09],
        "rotors": {
            "layout": "quad_x",
            "lever": 0.25,
            "thrust_limits": [0.2, 35.0],
            "torque_per_thrust": 0.015,
            "lag": 0.02,
        },
    },
    arm=[
        {
            "name": "arm",
            "mount": [0.0, 0.0, -0.05],
            "attitude": [0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)],
            "section": 2
            * [
                {
                    "length": 0.2,
                    "bending_stiffness": 0.2,
                    "mass_per_length": 0.2,
                    "damping_ratio": 0.02,
                }
            ],
            "tip": {"mass": 0.7, "inertia": [1e-4, 1e-4, 1e-4]},
        }
    ],
)
"""Two sections to the side, with as much at their end as a fifth of the UAV."""


def spun(law: ca.Controller, bend: float) -> tuple[float, float]:
    """Largest spin [rad/s] of SIDEWAYS from 2 to 4 s, and in the last 2 of 10 s, with its arm held
    at a bend [1/m]."""
    start = [0.0, 0.0, 3.0, 1e-4, 0.0, 0.0, bend, 0.0, bend, 0.0]
    run = fly(SIDEWAYS, law, start, duration=10.0, setpoints=ca.Setpoints(yaw=0.0))
    spin = np.linalg.norm(run["angular_velocity"].to_numpy(), axis=1)
    count = len(spin) // 10
    return float(spin[2 * count : 4 * count].max()), float(spin[8 * count :].max())


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
@pytest.mark.slow
def test_an_arm_that_is_held_bent_bears_less_and_its_margin_is_found_too() -> None:
    bend = 0.5 / 0.4
    straight = ca.flight_controller(SIDEWAYS, latency=0.01)
    assert straight.settings["latency_margin"] > 5e-3
    early, late = spun(straight, bend)
    assert not late < early
    held = [bend, 0.0, bend, 0.0]
    with refused("attitude_bandwidth"):
        ca.flight_controller(SIDEWAYS, latency=0.01, bend=held)
    law = ca.flight_controller(SIDEWAYS, latency=0.005, bend=held)
    assert law.settings["latency_margin"] > 0.0
    early, late = spun(law, bend)
    assert late < 0.5 * early
    asked = {
        f"{name}_bandwidth": straight.settings[f"{name}_bandwidth"]
        for name in ("position", "attitude", "yaw", "bend")
    }
    # Where the told latency ends, so do flights, with the arm bent as it was told.
    quick = ca.flight_controller(SIDEWAYS, **asked, bend=[held, [0.0, 0.0, 0.0, 0.0]])
    most = quick.settings["latency_margin"]
    for share, grows in ((0.9, False), (1.1, True)):
        early, late = spun(dataclasses.replace(quick, latency=share * most), bend)
        assert (not late <= early) == grows, share


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
def test_what_leaning_rotors_push_sideways_as_they_turn_the_vehicle_counts_in_the_margin() -> None:
    """They lean inwards by 0.35 rad: a moment comes with a force, which costs a quarter of it."""
    turns = np.radians([45.0, 135.0, 225.0, 315.0])
    c, s, lean = np.cos(turns), np.sin(turns), 0.35
    rotor = [
        {
            "position": [0.2 * x, 0.2 * y, 0.0],
            "axis": [-np.sin(lean) * x, -np.sin(lean) * y, np.cos(lean)],
            "spin": spin,
        }
        for x, y, spin in zip(c, s, [1, -1, 1, -1], strict=True)
    ]
    table = {"rotor": rotor, "thrust_limits": [0.0, 25.0], "torque_per_thrust": 0.016}
    vehicle = ca.load_vehicle("slender").replace({"uav.rotors": table})
    asked: Any = {"attitude_bandwidth": 30.0, "position_bandwidth": 6.0, "rate": 1000.0}
    law = ca.flight_controller(vehicle, **asked)
    most = law.settings["latency_margin"]
    upright = ca.flight_controller(vehicle.replace({"uav.rotors": None}), **asked)
    assert most < 0.8 * upright.settings["latency_margin"]
    start = [0.0, 0.0, 3.0, 1e-4, 1e-4, 0.0, 1e-6, 0.0]
    for share, grows in ((0.9, False), (1.1, True)):
        late = dataclasses.replace(law, latency=share * most)
        run = fly(vehicle, late, start, duration=6.0, setpoints=ca.Setpoints(yaw=0.0))
        spin = np.linalg.norm(run["angular_velocity"].to_numpy(), axis=1)
        early, last = spin[: len(spin) // 3].max(), spin[-len(spin) // 3 :].max()
        assert last > 0.1 if grows else last < 1e-2 * early, share


def slanted(stiffness: float, sections: int, angle: float = np.pi / 4.0) -> ca.Vehicle:
    """A quadrotor whose arm leaves it forward, by an angle from hanging."""
    part = {"length": 0.9 / sections, "bending_stiffness": stiffness, "mass_per_length": 0.2}
    changes = {"mass": 2.5, "inertia": [0.02, 0.02, 0.036]}
    uav = SIDEWAYS.uav.model_dump() | changes
    half = angle / 2.0
    arm = {
        "name": "arm",
        "mount": [0.1, 0.0, 0.0],
        "attitude": [0.0, -np.sin(half), 0.0, np.cos(half)],
        "section": sections * [part | {"damping_ratio": 0.02}],
        "tip": {"mass": 0.3, "inertia": [1e-4, 1e-4, 1e-4]},
    }
    return ca.Vehicle(name="slanted", uav=uav, arm=[arm])


# The last two leave the vehicle upwards and hang over.
@pytest.mark.long
@pytest.mark.parametrize(
    ("stiffness", "sections", "angle"),
    [(0.45, 2, 0.8), (2.0, 1, 0.8), (0.6, 3, 0.8), (0.6, 1, 2.4), (0.3, 2, 1.9)],
)
def test_free_sections_rest_where_trim_has_them(
    stiffness: float, sections: int, angle: float
) -> None:
    vehicle = slanted(stiffness, sections, angle)
    found = np.array(resting(vehicle, 9.81, np.ones(sections, bool))).reshape(-1, 2)
    q = ca.trim(vehicle).q
    assert np.abs(found).max() > 0.2
    np.testing.assert_allclose(np.hypot(*found.T), q[6::2], rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-6)
    assert not np.any(resting(vehicle, 9.81, np.zeros(sections, bool)))


@pytest.mark.long
def test_an_arm_that_hangs_free_is_held_steady_where_it_rests() -> None:
    vehicle = slanted(0.45, 2)
    law = ca.flight_controller(vehicle, bend_bandwidth=0.0, rotor_lag=0.03)
    start = ca.trim(vehicle).q.copy()
    start[2:4] = 3.0, 3e-3
    run = fly(vehicle, law, start, duration=12.0, setpoints=ca.Setpoints(yaw=0.0))
    spin = np.linalg.norm(run["angular_velocity"].to_numpy(), axis=1)
    count = len(spin) // 12
    assert spin[10 * count :].max() < 0.6 * spin[2 * count : 4 * count].max()
    rest = hover(vehicle, 9.81, resting(vehicle, 9.81, np.ones(2, bool)))
    assert LinearLoop(rest, law.gains, "weight", 0.03).growth(0.0) < -0.05
    with refused("attitude_bandwidth"):
        ca.flight_controller(vehicle, attitude_bandwidth=6.83, bend_bandwidth=0.0, rotor_lag=0.03)


@pytest.mark.parametrize(("bend", "told"), [([1.0], "bend"), ([40.0, 0.0, 0.0, 0.0], "bend")])
def test_a_posture_that_no_arm_has_is_refused(bend: list[float], told: str) -> None:
    with refused(told):
        ca.flight_controller(SIDEWAYS, bend=bend)


def test_a_margin_ends_where_the_loop_is_first_unstable_though_it_is_stable_again_beyond() -> None:
    vehicle = ca.load_vehicle("dual_arm")
    free: dict[str, Any] = {"feedforward": "reaction", "bend_bandwidth": 0.0}
    law = ca.flight_controller(vehicle, **free)
    loop = LinearLoop(hover(vehicle, 9.81), law.gains, "reaction")
    grows = [loop.growth(late) > 1e-3 for late in np.arange(0.0, 0.024, 2e-4)]
    first = 2e-4 * np.argmax(grows)
    assert 0.019 < first < 0.021 and not grows[-1]
    assert first - 2e-4 - 1e-3 * first < law.settings["latency_margin"] < first
    with refused("attitude_bandwidth"):
        ca.flight_controller(vehicle, **free, attitude_bandwidth=20.0, latency=0.0205)


def test_a_loop_that_is_slow_enough_bears_latencies_beyond_those_that_are_searched() -> None:
    slow: dict[str, Any] = {"attitude_bandwidth": 0.2, "bend_bandwidth": 0.0, "rate": 20.0}
    law = ca.flight_controller(RIGID, **slow, latency=0.4)
    assert law.settings["latency_margin"] >= 0.19


def test_a_flight_is_the_linear_loop_that_its_margin_is_of() -> None:
    """Flexible arm, lateness between two instants, integral: every sample of a small motion."""
    law = ca.flight_controller(PAPER, latency=0.0058, rate=200.0, bend_bandwidth=3.0)
    loop = LinearLoop(hover(PAPER, 9.81), law.gains, "weight")
    q = HOME + np.array([2e-4, 1e-4, -2e-4, 3e-5, 1e-4, 0, 0, 0])
    run = fly(PAPER, law, q, duration=0.5, setpoints=ca.Setpoints(position=HOME[:3], yaw=0.0))
    step, found = loop.matrix(0.0058), []
    x = np.zeros(len(step))
    x[:6] = q[:6] - HOME[:6]
    # Until the first push arrives by its latency, it acts from the start on.
    n, known = loop.A.shape[0], loop.A.shape[0] + len(loop.memory)
    first = loop.K[:, :n] @ x[:n]
    x[known:] = np.tile(first, (len(x) - known) // len(first))
    for _ in range(100):
        found.append(x[:3].copy())
        x = step @ x
    flown = fly(PAPER, law, q, duration=0.5, setpoints=ca.Setpoints(position=HOME[:3], yaw=0.0))
    np.testing.assert_array_equal(flown.position, run.position)
    expected = np.array(found)[::2]
    np.testing.assert_allclose(
        run.position.to_numpy()[:50] - HOME[:3], expected, rtol=0, atol=2e-3 * 2e-4
    )


def test_rotors_that_lag_lower_the_margin_and_gains_too_fast_are_refused_with_it() -> None:
    free: dict[str, Any] = {"bend_bandwidth": 0.0, "rate": 1000.0, "yaw_bandwidth": 3.0}
    quick = ca.flight_controller(RIGID, attitude_bandwidth=15.0, position_bandwidth=0.02, **free)
    # L = (ω² + 2ω s) / s² crosses 1 at 2.058 ω, with atan(2 · 2.058) of phase left.
    margin = np.arctan(2 * 2.058) / (2.058 * 15.0) - 0.5e-3
    assert quick.settings["latency_margin"] == pytest.approx(margin, rel=0.02)
    slow = ca.flight_controller(RIGID, attitude_bandwidth=15.0, rotor_lag=0.04, **free)
    assert slow.settings["latency_margin"] < 0.7 * margin
    # A lag T alone makes s² (1 + T s) + 2ω s + ω² unstable from T = 2/ω on.
    for lag, fits in ((1.7 / 20.0, True), (2.1 / 20.0, False)):
        given: dict[str, Any] = {
            "attitude_bandwidth": 20.0, "position_bandwidth": 0.2, "yaw_bandwidth": 5.0,
            "bend_bandwidth": 0.0, "rate": 2000.0, "rotor_lag": lag,
        }  # fmt: skip
        if fits:
            ca.flight_controller(RIGID, **given)
            continue
        with refused("attitude_bandwidth"):
            ca.flight_controller(RIGID, **given)
    with refused("attitude_bandwidth"):
        ca.flight_controller(
            RIGID, attitude_bandwidth=20.0, position_bandwidth=2.0, yaw_bandwidth=8.0,
            bend_bandwidth=0.0, latency=0.1,
        )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", ["paper", "slender", "two_section", "dual_arm", LONG_LIGHT_ARM])
def test_the_defaults_bear_more_than_their_delays(name: str | Path) -> None:
    vehicle = ca.load_vehicle(name)
    law = ca.flight_controller(vehicle, latency=0.005, rotor_lag=0.03)
    assert law.settings["latency_margin"] > 1e-3
    start = np.zeros(6 + 2 * vehicle.sections)
    start[:3] = 0.3, -0.2, 3.0
    run = fly(vehicle, law, start, duration=40.0, setpoints=ca.Setpoints(position=[0, 0, 3]))
    assert run.status == 0
    assert np.abs(run.position.to_numpy()[-1] - [0, 0, 3]).max() < 0.02


def test_noise_moves_the_yaw_as_much_as_the_loop_says_and_repeats_with_its_seed() -> None:
    w, period, size = 6.0, 0.004, 0.02
    law = ca.flight_controller(RIGID, yaw_bandwidth=w, noise={"gyro": size})
    runs = 64

    def flown(seed: int, start: np.ndarray) -> np.ndarray:
        seeds = [runs * seed + run for run in range(runs)]
        run = fly(RIGID, law, start, duration=6.0, seed=seeds)
        return np.asarray(run.q.sel(coordinate="yaw").to_numpy())

    yaw = flown(1, np.tile(HOME, (runs, 1)))
    # The yaw is a double integrator that holds -ω² ψ - 2 ω (ψ̇ + n) for a period.
    B = np.array([[period**2 / 2], [period]])
    A = np.array([[1, period], [0, 1]]) + B @ [[-w * w, -2 * w]]
    predicted = solve_discrete_lyapunov(A, B @ B.T * (2 * w * size) ** 2)[0, 0]
    # Yaw forgets within 2/ω: 15 independent values per run in 5 s, whose squares have 2 variances.
    late = yaw[:, 100:]
    assert late.var() == pytest.approx(predicted, rel=4 * np.sqrt(2 / (15 * runs)))
    assert abs(np.corrcoef(late[0], late[1])[0, 1]) < 0.9
    np.testing.assert_array_equal(yaw, flown(1, np.tile(HOME, (runs, 1))))
    assert np.abs(yaw - flown(2, np.tile(HOME, (runs, 1)))).max() > 1e-4


def test_noise_of_position_velocity_and_attitude_moves_what_it_should() -> None:
    start = np.tile(HOME, (16, 1))
    sizes = {"position": 0.02, "velocity": 0.05, "attitude": 0.01}
    climb = {}
    for name, size in sizes.items():
        law = ca.flight_controller(RIGID, noise={name: size})
        k_p, k_v = law.settings["position"][2], law.settings["velocity"][2]
        flown = fly(RIGID, law, start, duration=2.0, seed=list(range(16)))
        thrust = flown.command.to_numpy()[:, 1:-1, :3]
        climb[name] = np.linalg.norm(thrust, axis=-1).std() / RIGID.mass
        # What is asked for at once, before anything has moved: k_v k_p n or k_v n.
        at_once = {"position": k_v * k_p * size, "velocity": k_v * size, "attitude": 0.0}[name]
        assert climb[name] == pytest.approx(at_once, rel=0.2, abs=0.03)


def test_the_lag_and_the_thrust_are_the_rotors_own() -> None:
    settings = ca.flight_controller(ROTORS).settings
    assert settings["rotor_lag"] == 0.04
    np.testing.assert_allclose(settings["thrust"], [0.1 * 9.81 * ROTORS.mass, 4 * 14.0])
    with refused("thrust"):
        ca.flight_controller(ROTORS, thrust=[1.0, 20.0])


def test_a_rate_whose_margin_would_take_minutes_is_refused() -> None:
    with refused("rate"):
        ca.flight_controller(RIGID, rate=1e9)


def test_a_rate_that_is_no_multiple_of_the_step_is_refused() -> None:
    scenario = ca.Scenario("x", HOME, controller=ca.flight_controller(RIGID, rate=300.0))
    with refused("the period of the controller's rate"):
        ca.simulate(RIGID, scenario, method="RK4", step=1e-3)
