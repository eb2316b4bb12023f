"""Flights in which errors grow or multiply: `check` tells how much of the result is error."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.scenario.scenarios import Scenario

PAPER, SLENDER = ca.load_vehicle("paper"), ca.load_vehicle("slender")
Flight = tuple[ca.Vehicle, Scenario]


def carried(vehicle: ca.Vehicle, share: float = 1.0) -> list[float]:
    return [0.0, 0.0, share * 9.81 * float(vehicle.mass)]


def released(angle: float, duration: float = 1.0) -> Flight:
    """A light UAV and a large bend, let go: the swing of the arm throws it about."""
    changes = {"uav.mass": 0.3, "uav.inertia": [0.003, 0.003, 0.005], "arm.damping_ratio": 0.0}
    q = [0, 0, 0, 0.3, -0.2, 0, angle / PAPER.arm.length, 0.4]
    return PAPER.replace(changes), Scenario("released", q, duration=duration)


def on_top(mass: float, tip: float, stiffness: float) -> ca.Vehicle:
    """An arm that stands on its UAV, which so falls over slowly under a force that carries it."""
    section = {"length": 0.55, "mass_per_length": 0.08, "bending_stiffness": stiffness}
    arm = {
        "mount": [0.0, 0.0, 0.05],
        "attitude": [1.0, 0.0, 0.0, 0.0],
        "section": [section | {"damping_ratio": 0.03}],
        "tip": {"mass": tip, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]},
    }
    uav = {"mass": mass, "inertia": [0.015, 0.018, 0.027]}
    return ca.Vehicle(name="on top", uav=uav, arm=[arm])


def falling_over(duration: float) -> Flight:
    vehicle = on_top(1.8, 0.2, 3.0)
    q = [0, 0, 3, 0.05, 0, 0, 0.5, 0.4]
    return vehicle, Scenario("lift", q, force=carried(vehicle), duration=duration)


def tumbling() -> Flight:
    """Chaotic once it has fallen over."""
    vehicle = on_top(1.5, 0.1, 0.5)
    q, spin = [0, 0, 5, 0.02, 0, 0, 0.2, 0.3], [0, 0, 0, 0.1, 0.05, 0, 0, 0]
    return vehicle, Scenario("lift", q, spin, force=carried(vehicle), duration=30.0)


def drifting() -> Flight:
    """Rotors in open loop, whose thrust turns with what the arm that is let go leaves of spin."""
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0], "lag": 0.04}
    vehicle = PAPER.replace(
        {"arm.damping_ratio": 0.1, "uav.rotors": {**rotors, "torque_per_thrust": 0.02}}
    )
    command = [9.81 * vehicle.mass / 4.0] * 4
    return vehicle, Scenario(
        "let go", [0, 0, 3, 0, 0, 0, 1.0, 0.4], rotor_command=command, duration=5.0
    )


def limp(controlled: bool) -> Flight:
    """Two sections that swing far, as a double pendulum does, the UAV held or carried."""
    sections = [(0.25, 0.08, 0.161, 0.005), (0.29, 0.113, 0.0198, 0.0)]
    q, duration = [0, 0, 5, 0, 0, 0, 5.76, -2.2, 3.332, -0.85], 10.0
    mass, tip = 4.0, 0.1
    if not controlled:
        sections = [(0.37, 0.074, 0.4015, 0.005), (0.48, 0.078, 0.0282, 0.0)]
        q, duration = [0, 0, 5, 0, 0, 0, 1.264, 2.42, 1.166, 2.88], 40.0
        mass, tip = 0.5, 0.3
    names = ("name", "length", "mass_per_length", "bending_stiffness", "damping_ratio")
    chain = [dict(zip(names, (f"s{i}", *each), strict=True)) for i, each in enumerate(sections)]
    body = {"mass": tip, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]}
    arm = {"mount": [0.0, 0.0, -0.05], "section": chain, "tip": body}
    inertia = [0.01 * mass, 0.012 * mass, 0.018 * mass]
    vehicle = ca.Vehicle(name="limp", uav={"mass": mass, "inertia": inertia}, arm=[arm])
    if controlled:
        law = ca.flight_controller(vehicle, bend_bandwidth=0.0)
        return vehicle, Scenario("swing", q, controller=law, duration=duration)
    rates = [0, 0, 0, -0.02, -0.01, -0.04, 0, 0, 0, 0]
    return vehicle, Scenario("swing", q, rates, force=carried(vehicle), duration=duration)


def whipped(pull: float) -> Flight:
    """A limp arm on a light UAV that a constant force on its tip whips about."""
    uav = {"mass": 0.18, "inertia": [6e-4, 6e-4, 1e-3], "mount": [0.02, 0.0, -0.02]}
    arm = {"length": 0.3, "mass_per_length": 0.02, "bending_stiffness": 0.004}
    vehicle = ca.Vehicle(name="whipped", uav=uav, arm={**arm, "damping_ratio": 0.01})
    return vehicle, Scenario(
        "whip", (0, 0, 5, 0, 0, 0, 2.0, 0.4), force=carried(vehicle), duration=3.0,
        tip_wrench=(0.3 * pull, 0.2 * pull, 0.9 * pull, 0, 0, 0),
    )  # fmt: skip


def thick_air(force: float) -> Flight:
    """Pushed to speeds at which thick air is stiffer than the arm."""
    thick = SLENDER.replace(
        {"arm.youngs_modulus": 4e9, "uav.drag": {"quadratic": [40.0, 40.0, 40.0]}}
    )
    push = (force, 0, 9.81 * thick.mass)
    return thick, Scenario("pushed", (0, 0, 0, 0.1, 0.2, 0, 0.3, 0), force=push, duration=1.0)


def let_go_in_air() -> Flight:
    """An arm that swings at 30 rad/s, in air that stops it at hundreds a second."""
    arm = {"length": 0.6, "mass_per_length": 0.002, "bending_stiffness": 0.01, "radius": 0.02}
    uav = {"mass": 1.0, "inertia": [0.015, 0.018, 0.03], "mount": [0.0, 0.0, -0.05]}
    light = ca.Vehicle(name="light", uav=uav, arm={**arm, "drag_coefficient": 1.2})
    q = (0, 0, 3, 0, 0, 0, 4.0, 0.4)
    return light, Scenario("let go", q, force=carried(light), duration=0.5)


def toppling() -> Flight:
    """Two limp arms on top of their UAV, which fall."""

    def arm(mount: list[float], length: float, mass: float, EI: float, tip: float) -> Any:
        return {
            "mount": mount,
            "attitude": [1.0, 0.0, 0.0, 0.0],
            "section": [{"length": length, "mass_per_length": mass, "bending_stiffness": EI}],
            "tip": {"mass": tip, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]},
        }

    front = {"name": "front"} | arm([0.12, 0.0, 0.05], 0.689, 0.141, 0.1417, 0.0583)
    back = {"name": "back"} | arm([-0.0885, 0.0811, 0.05], 0.2936, 0.00577, 0.000274, 0.1274)
    uav = {"mass": 3.727, "inertia": [0.0863, 0.1007, 0.1583]}
    vehicle = ca.Vehicle(name="two", uav=uav, arm=[front, back], camera={"arm": "back"})
    q = [0, 0, 5, 0, 0, 0, 0, -1.283, 2.928, 0.32]
    return vehicle, Scenario("topples", q, [1.18, 1.15, 0.38, *[0.0] * 7], force=[0, 0, 39.35])


def outwards() -> Flight:
    """A torque outwards along the bend turns with it: errors grow a thousandfold."""
    vehicle = SLENDER.replace({"arm.length": 0.5})
    push = vehicle.arm.bending_stiffness
    return vehicle, Scenario(
        "outwards",
        [0, 0, 3, -0.09628878, 0.01491212, 0.19088877, 0.1225078, -0.44643315],
        [0, 0, 0, 0, 0, 0, 0.70056728, 1.0],
        tau=[0, 0, vehicle.mass * 9.81, 0, 0, 0, push, 0],
        duration=0.6,
    )


def past_straight(offset: float) -> Flight:
    """The arm swings through straight, or past it at an offset [1/m], under a torque on κ."""
    rate = PAPER.arm.clamped_frequency
    push = 0.05 * PAPER.arm.bending_stiffness
    return PAPER, Scenario(
        "past straight", [0, 0, 0, 0, 0, 0, 0.3, 0.7], [0, 0, 0, 0, 0, 0, 0, rate * offset / 0.3],
        gravity=0.0, duration=0.2,
        tau=lambda t: [0, 0, 0, 0, 0, 0, push * np.sin(0.3 * rate * t + 0.5), 0],
    )  # fmt: skip


def past_a_pole() -> Flight:
    """A torque along yaw beside gimbal lock, where it grows as 1/cos θ."""
    q, qd = np.zeros((2, 8))
    q[4], qd[4] = 1.5, 2.0
    return SLENDER, Scenario("yaw", q, qd, tau=1e-3 * np.eye(8)[5], gravity=0.0, duration=0.1)


def far_from_its_target(ratio: float) -> Flight:
    """A law around a camera multiplies errors by hundreds."""
    vehicle = PAPER.replace({"arm.damping_ratio": ratio})
    return vehicle, Scenario(
        "far", [-0.1, 0.1, 2.1 + vehicle.arm.length, 0, 0, 0, 0.1, 0.5],
        controller=ca.servoing(**ca.design(vehicle, bandwidth=4.0)),
        target=ca.Target(ca.paths.letter("R", duration=10.0)), duration=3.0,
    )  # fmt: skip


def slow_loop(rate: float) -> Flight:
    """A slung load: the controller's delays leave it bandwidths of a fifth of a rad/s."""
    load = ca.Vehicle(
        name="slung load",
        uav={"mass": 0.5, "inertia": [0.006, 0.006, 0.011]},
        arm={
            "length": 0.8,
            "bending_stiffness": 0.007,
            "mass_per_length": 0.05,
            "damping_ratio": 0.05,
            "disks": [{"position": 0.8, "mass": 0.25, "inertia": [1e-4, 1e-4]}],
        },
    )
    law = ca.flight_controller(load, bend_bandwidth=0, rate=rate, latency=0.02)
    q, qd = [0, 0, 3, -0.2, 0.1, 0, 1.2, -2.2], [0, 0, 0, -0.4, 0.5, 0.6, 0, 0]
    return load, Scenario("hover", q, qd, controller=law, duration=20.0)


LONG = pytest.mark.long
FLIGHTS: dict[str, Callable[[], Flight]] = {
    "light": lambda: released(6.2),
    "falling over": lambda: falling_over(12.0),
    "drifting": drifting,
    "whipped": lambda: whipped(1.0),
    "thick air": lambda: thick_air(2e3),
    "thicker air": lambda: thick_air(5e4),
    "let go in air": let_go_in_air,
    "toppling": toppling,
    "outwards": outwards,
    "through straight": lambda: past_straight(0.0),
    "past straight": lambda: past_straight(1e-2),
    "past a pole": past_a_pole,
    "far from its target": lambda: far_from_its_target(1.0),
    "a slow loop": lambda: slow_loop(50.0),
}
LONG_FLIGHTS: dict[str, Callable[[], Flight]] = {
    "falling far": lambda: falling_over(20.0),
    "tumbling": tumbling,
    "limp": lambda: limp(controlled=False),
    "limp, controlled": lambda: limp(controlled=True),
    "a faster slow loop": lambda: slow_loop(250.0),
    "far, damped little": lambda: far_from_its_target(0.05),
}


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
@pytest.mark.parametrize(
    "name", [*FLIGHTS, *(pytest.param(name, marks=LONG) for name in LONG_FLIGHTS)]
)
def test_what_a_flight_errs_by_is_told(name: str) -> None:
    """Within a factor of three where it is more than a thousandth of the arm; of a chaotic flight
    both are beyond any use."""
    vehicle, scenario = (FLIGHTS | LONG_FLIGHTS)[name]()
    options: dict[str, Any] = {"sample": 0.02, "variables": ["tip_position"]}
    found = ca.simulate(vehicle, scenario, check=True, **options)
    exact = ca.simulate(vehicle, scenario, rtol=1e-11, **options)
    gap = np.linalg.norm(found.tip_position - exact.tip_position, axis=-1)
    off, told = float(np.nanmax(gap) / np.max(vehicle.reach)), float(found.error_estimate)
    if int(found.status) != int(exact.status):
        off = np.inf
    assert off < max(1e-3, 3.0 * told)


def test_an_error_that_is_large_is_warned_of_once() -> None:
    vehicle, scenario = released(6.2, 6.0)
    options: dict[str, Any] = {"sample": 0.01, "check": True, "variables": ["tip_position"]}
    with pytest.warns(ca.ContinuairWarning, match="error_estimate") as told:
        ca.simulate(vehicle, scenario, rtol=1e-2, **options)
    assert len([each for each in told if "error_estimate" in str(each.message)]) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ca.simulate(vehicle, scenario, rtol=1e-8, **options)
