"""RotorPy, run live in an environment of its own: rotors, lag, drag and allocation."""

import json
import subprocess
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.oracles.conftest import Claim
from tests.oracles.peers import python_with

SOURCE = "RotorPy 3.0.0"
PERIOD, PERIODS = 0.05, 10
FULL, COEFFICIENT, TORQUE = 800.0, 1.9e-5, 2.6e-7
"""Greatest speed [rad/s], thrust [N] and torque [N m] per squared speed."""

HUBS = {"r1": [0.17, 0.13, 0.02], "r2": [-0.15, 0.14, 0.02], "r3": [-0.16, -0.15, 0.02],
        "r4": [0.14, -0.16, 0.02]}  # fmt: skip
DIRECTIONS = [1, -1, 1, -1]
INERTIA = [[0.021, 0.001, -0.002], [0.001, 0.023, 0.0015], [-0.002, 0.0015, 0.035]]
DRAG = [0.05, 0.08, 0.12]
MASS, LAG = 1.7, 0.04
WIND = [2.0, -1.0, 0.5]
START = {"x": [0.1, 0.2, 3.0], "v": [1.0, -0.5, 0.3], "w": [0.6, -0.8, 1.1]}
EULER = [0.2, -0.3, 0.5]
RNG = np.random.default_rng(4)
SPEEDS = RNG.uniform(350.0, 650.0, (PERIODS, 4))
WRENCHES = np.column_stack([RNG.uniform(12.0, 22.0, 20), RNG.uniform(-0.2, 0.2, (20, 3))])
WRENCHES[:, 3] *= 0.2
LOOKS = 40
"""States from which the control law is asked for a push."""


def rigid() -> ca.Vehicle:
    """The arm weighs 1e-13 of the vehicle: what it does is lost in rounding."""
    listed = [
        {"position": at, "spin": -way} for at, way in zip(HUBS.values(), DIRECTIONS, strict=True)
    ]
    return ca.Vehicle(
        name="rigid",
        uav={
            "mass": MASS,
            "inertia": INERTIA,
            "rotors": {
                "rotor": listed,
                "thrust_limits": [0.0, COEFFICIENT * FULL**2],
                "torque_per_thrust": TORQUE / COEFFICIENT,
                "lag": LAG,
            },
            "drag": {"quadratic": DRAG},
        },
        arm={"length": 0.1, "mass_per_length": 1e-12, "bending_stiffness": 1e-14},
    )


@pytest.fixture(scope="module")
def theirs() -> Any:
    """What RotorPy makes of the case."""
    names = [(f"I{a}{b}", INERTIA["xyz".index(a)]["xyz".index(b)]) for a in "xyz" for b in "xyz"]
    params = {"mass": MASS, **dict(names), "num_rotors": 4, "rotor_pos": HUBS}
    params |= {"rotor_directions": DIRECTIONS, "rotor_speed_min": 0.0, "rotor_speed_max": FULL}
    params |= {"k_eta": COEFFICIENT, "k_m": TORQUE, "tau_m": LAG}
    params |= {f"c_D{axis}": value for axis, value in zip("xyz", DRAG, strict=True)}
    start = START | {"q": attitude(), "wind": WIND, "rotor_speeds": SPEEDS[0].tolist()}
    case = {"params": params, "start": start, "speeds": SPEEDS.tolist(), "period": PERIOD}
    case |= {"wrenches": WRENCHES.tolist(), "gains": their_gains(), "looks": looks()}
    script = Path(__file__).with_name("rotorpy_quad.py")
    # Of what RotorPy asks for, its vehicle needs these.
    wanted = ["--no-deps", "rotorpy==3.0.0", f"numpy=={np.__version__}", "scipy"]
    python = python_with("rotorpy", "rotorpy_rigid", *wanted)
    run = subprocess.run(
        [python, str(script)], input=json.dumps(case), capture_output=True, text=True, check=True
    )
    return json.loads(run.stdout)


def attitude() -> list[float]:
    from scipy.spatial.transform import Rotation

    return list(Rotation.from_euler("ZYX", EULER[::-1]).as_quat())


def euler_rates(euler: Any = EULER, spin: Any = START["w"]) -> np.ndarray:
    """Of an angular velocity, body axes."""
    (sφ, sθ), (cφ, cθ) = np.sin(euler[:2]), np.cos(euler[:2])
    E = np.array([[1, 0, -sθ], [0, cφ, sφ * cθ], [0, -sφ, cφ * cθ]])
    return np.linalg.solve(E, spin)


def law() -> ca.Controller:
    """The cascade without its integral, and without limits that are reached."""
    return ca.flight_controller(
        rigid(), integral_share=0.0, tilt=1.4, thrust=(0.01, 500.0), speed=50.0
    )


def their_gains() -> dict[str, Any]:
    """Of a position's loop within which there is none for velocity."""
    given = law().gains
    return {
        "kp_pos": (given["velocity"] * given["position"]).tolist(),
        "kd_pos": given["velocity"].tolist(),
        "kp_att": given["attitude"].tolist(),
        "kd_att": given["spin"].tolist(),
    }


def seen() -> tuple[np.ndarray, ...]:
    """Positions, Euler angles, velocities and angular velocities, and what is to be reached."""
    rng = np.random.default_rng(11)
    position, velocity, spin, goal = rng.uniform(-0.5, 0.5, (4, LOOKS, 3)) * [
        [[2]],
        [[2]],
        [[4]],
        [[2]],
    ]
    euler = rng.uniform(-0.7, 0.7, (LOOKS, 3)) * [1, 1, 4]
    return position, euler, velocity, spin, goal, rng.uniform(-3.0, 3.0, LOOKS)


def looks() -> list[Any]:
    """The same as RotorPy has it."""
    from scipy.spatial.transform import Rotation

    return [
        (
            {"x": x.tolist(), "v": v.tolist(), "w": w.tolist(),
             "q": Rotation.from_euler("ZYX", angles[::-1]).as_quat().tolist()},
            {"x": goal.tolist(), "x_dot": [0.0, 0.0, 0.0], "yaw": yaw},
        )
        for x, angles, v, w, goal, yaw in zip(*seen(), strict=True)
    ]  # fmt: skip


def test_motion_of_a_rigid_quadrotor_in_wind(claim: Claim, theirs: Any) -> None:
    """Unequal rotors and products of inertia, tumbling; commands change every 50 ms."""
    thrusts = COEFFICIENT * SPEEDS**2
    jumps = PERIOD * np.arange(1, PERIODS)

    def command(t: float) -> np.ndarray:
        return np.asarray(thrusts[np.searchsorted(jumps, t, side="right")])

    scenario = ca.Scenario(
        "rigid",
        [*START["x"], *EULER, 0.0, 0.0],
        [*START["v"], *euler_rates(), 0.0, 0.0],
        rotor_command=command,
        wind=WIND,
        duration=PERIOD * PERIODS,
        jumps=tuple(jumps),
    )
    flight = ca.simulate(rigid(), scenario, sample=PERIOD, rtol=1e-12)
    flown = {name: np.array([s[name] for s in theirs["flown"]]) for name in theirs["flown"][0]}
    turned = np.abs((flight.attitude[1:].to_numpy() * flown["q"]).sum(1))
    speed = np.sqrt(flight.rotor_thrust[1:].to_numpy() / COEFFICIENT)
    apart = {
        "position [m]": np.abs(flight.position[1:].to_numpy() - flown["x"]).max(),
        "attitude, |1 - |q·q'||": np.abs(1.0 - turned).max(),
        "angular velocity [rad/s]": np.abs(
            flight.angular_velocity[1:].to_numpy() - flown["w"]
        ).max(),
        "rotor speed over its greatest": np.abs(speed - flown["rotor_speeds"]).max() / FULL,
    }
    for name, reached in apart.items():
        claim(
            f"rigid quadrotor over 0.5 s in wind: {name}, largest difference", SOURCE, 1e-9, reached
        )


def test_allocation_of_lift_and_moments(claim: Claim, theirs: Any) -> None:
    rotors = rigid().uav.rotors
    assert rotors is not None
    wanted = np.hstack([np.zeros((len(WRENCHES), 2)), WRENCHES])
    ours = wanted @ rotors.inverse.T
    found = COEFFICIENT * np.square(theirs["commands"])
    assert (ours > 0.0).all()
    claim(
        "thrusts that share out 20 random lifts and moments, largest relative difference",
        SOURCE,
        1e-9,
        float(np.abs(ours / found - 1.0).max()),
    )


def test_attitude_law(claim: Claim, theirs: Any) -> None:
    """Lee's law, from states that tumble, towards positions and yaws at random."""
    position, euler, velocity, spin, goal, yaw = seen()
    rates = np.array([euler_rates(*each) for each in zip(euler, spin, strict=True)])
    bends = np.zeros((LOOKS, 2))
    start = ca.Scenario(
        "looks",
        np.hstack([position, euler, bends]),
        np.hstack([velocity, rates, bends]),
        controller=law(),
        setpoints=ca.Setpoints(position=goal, yaw=yaw),
        duration=0.004,
    )
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # rotors saturate, which is not what is compared
        flight = ca.simulate(rigid(), start, sample=0.004, variables=["command"])
    ours = flight["command"].isel(time=0).to_numpy()
    found = np.array(theirs["pushes"])
    lift = np.linalg.norm(ours[:, :3], axis=1)
    claim(
        "thrust of the flight controller from 40 random states, largest relative difference",
        SOURCE, 1e-9, float(np.abs(lift / np.abs(found[:, 0]) - 1.0).max()),
    )  # fmt: skip
    size = np.abs(found[:, 1:]).max()
    claim(
        "moment of the flight controller on SO(3), largest difference over the largest moment",
        SOURCE, 1e-9, float(np.abs(ours[:, 3:6] - found[:, 1:]).max() / size),
    )  # fmt: skip
