"""What a user reads when a closed loop cannot be flown: one sentence, field, value and remedy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.closed_loop import flights, probes
from tests.refusals import refused

SERVOING = flights.designed(2.0)
WITH_NOISE = flights.VEHICLE.replace({"camera.noise": 0.5})
BATCH = flights.VEHICLE.replace({"arm.radius": [0.004, 0.005]})


def fly(controller: Any = SERVOING, vehicle: Any = flights.VEHICLE, **changes: Any) -> xr.Dataset:
    options = {name: changes.pop(name) for name in ("step", "method") if name in changes}
    return ca.simulate(vehicle, flights.scenario(controller, 0.01, **changes), **options)


def rounding(kind: str) -> ca.Controller:
    return ca.Controller("mine", probes.rounding_law(kind), {"idle": 1.0}, looks=False)


def gains(**changes: Any) -> ca.Controller:
    return ca.servoing(**{"Kp": 5.0, "Kd": 0.1, "points": 4} | changes)


def still(x: float, z: float = 0.0) -> ca.Target:
    return ca.Target(ca.paths.hold([x, 0.0, z]))


INDEFINITE = np.diag([1.0, 1, 1, 1, 1, 1, 1, -0.25])
SKEWED = np.eye(8) + np.eye(8, k=1)
TRIANGLE = ca.square()[:3]
REFUSED: dict[str, tuple[Any, str]] = {
    "behind": (
        lambda: fly(target=still(0.0, z=3.0)),
        "target",
    ),
    "out of view": (
        lambda: fly(target=still(1.6)),
        "target",
    ),
    "out of view in a batch": (
        lambda: fly(target=[still(0.0), still(-0.8)]),
        "target",
    ),
    "eigenvalue": (lambda: gains(Kp=INDEFINITE), "Kp"),
    "zero": (lambda: gains(Kd=0.0), "Kd"),
    "asymmetric": (lambda: gains(Cd=SKEWED), "Cd"),
    "gain shape": (lambda: gains(Kp=[1.0] * 6), "Kp"),
    "gain nan": (lambda: gains(Kp=np.nan), "Kp"),
    "gain text": (lambda: gains(Kp="high"), "Kp"),
    "sigma": (lambda: gains(sigma=0.0), "sigma"),
    "points": (lambda: gains(points=2), "points"),
    "damping": (lambda: gains(damping="image"), "damping"),
    "posture": (lambda: gains(posture_damping=-1), "posture_damping"),
    "gains for other points": (
        lambda: fly(gains(points=3)),
        "Kp",
    ),
    "gain left out": (
        lambda: fly(ca.Controller("mine", probes._weight_law, {"weight": 1.0}, looks=False)),
        "spring",
    ),
    "gain too many": (
        lambda: fly(ca.Controller("mine", probes._recording_law, {"idle": 1.0, "x": 2.0})),
        "x",
    ),
    "gain not finite": (
        lambda: fly(ca.Controller("mine", probes._recording_law, {"idle": np.inf})),
        "idle",
    ),
    "law": (lambda: ca.Controller("mine", 3, {}), "law"),  # type: ignore[arg-type]
    "stack of one that looks and one that does not": (
        lambda: ca.stack([replace(SERVOING, looks=looks) for looks in (True, False)]),
        "controllers",
    ),
    "law without a law": (
        lambda: fly(ca.Controller("mine", lambda code: code, {}, looks=False)),  # type: ignore
        "law",
    ),
    **{
        f"number that loses digits, {kind}": (
            lambda kind=kind: fly(rounding(kind)),
            "law",
        )
        for kind, number in (
            ("written", "0.3"),
            ("named", "0.1"),
            ("of_module", "3.141592653589793"),
            ("reckoned", "1.0"),
            ("cast", "float(1)"),
            ("of_type", "0.1"),
            ("of_fraction", "float(1/3)"),
            ("large", "5000000000"),
        )
    },
    **{
        f"quotient of whole numbers, {kind}": (
            lambda kind=kind: fly(rounding(kind)),
            "law",
        )
        for kind, line in (
            ("whole", "return Real(1 / 10) * push"),
            ("whole_name", "return Real(tenths / 10) * push"),
            ("counted", "share = share + Real(i / 10)"),
            ("added", "return Real((1 + 2) / 2) * push"),
            ("shortened", "share /= 2"),
            ("helped", "return Real((i + 1) / 4)"),
        )
    },
    "static expression in a loop": (
        lambda: fly(rounding("looped")),
        "law",
    ),
    "default of a law's function": (
        lambda: fly(rounding("scaled")),
        "law",
    ),
    "camera without a target": (
        lambda: fly(probes.braking(5.0), target=None),
        "target",
    ),
    "law that looks under a controller that does not": (
        lambda: fly(replace(ca.twist_servoing(flights.VEHICLE), looks=False), target=still(0.0)),
        "looks",
    ),
    **{
        f"digits of a vector, {kind}": (
            lambda kind=kind: fly(rounding(kind)),
            "law",
        )
        for kind, name in (("vector", "goal"), ("static", "code.vec3(TENTH, 0.0, 0.0)"))
    },
    "latency of a law that acts at once": (
        lambda: ca.Controller("mine", probes._weight_law, {}, latency=0.02),
        "latency",
    ),
    "guided without a period": (
        lambda: ca.Controller("mine", probes._weight_law, {}, guided=True),
        "period",
    ),
    "guided without a memory": (
        lambda: fly(
            ca.Controller(
                "mine",
                probes._weight_law,
                {"weight": 1.0, "spring": 1.0},
                looks=False,
                guided=True,
                period=1e-3,
            )
        ),
        "guided",
    ),
    "integral of a law that does not look": (
        lambda: ca.Controller("mine", probes._weight_law, {}, looks=False, integral=0.5),
        "integral",
    ),
    "gains": (
        lambda: ca.Controller("mine", probes._weight_law, [1.0]),  # type: ignore[arg-type]
        "gains",
    ),
    "stack of nothing": (lambda: ca.stack([]), "controllers"),
    "stack of a stack": (
        lambda: ca.stack([gains(), ca.stack([gains(), gains()])]),
        "controllers",
    ),
    "stack of laws": (
        lambda: ca.stack([SERVOING, ca.classic(flights.VEHICLE)]),
        "controllers",
    ),
    "stack of sizes": (
        lambda: ca.stack([gains(), gains(points=3)]),
        "controllers",
    ),
    "period no multiple": (
        lambda: fly(method="RK4", step=3e-4),
        "control_period",
    ),
    "period below the step": (
        lambda: fly(method="RK4", step=1e-3, control_period=5e-4),
        "control_period",
    ),
    "period 0": (lambda: fly(control_period=0), "control_period"),
    "period < 0": (lambda: fly(control_period=-1e-3), "control_period"),
    "period nan": (lambda: fly(control_period=np.nan), "control_period"),
    "period text": (lambda: fly(control_period="1ms"), "control_period"),
    "noise at every stage": (
        lambda: fly(vehicle=WITH_NOISE, control_period=None),
        "control_period",
    ),
    "noise": (
        lambda: flights.VEHICLE.replace({"camera.noise": -0.5}),
        "camera.noise",
    ),
    "frame rate": (
        lambda: flights.VEHICLE.replace({"camera.frame_rate": np.inf}),
        "camera.frame_rate",
    ),
    "latency": (
        lambda: flights.VEHICLE.replace({"camera.latency": "slow"}),
        "camera.latency",
    ),
    "latency over runs": (
        lambda: fly(vehicle=flights.VEHICLE.replace({"camera.latency": [0.0, 0.01]})),
        "camera.latency",
    ),
    "no target": (lambda: fly(target=None), "target"),
    "not a target": (lambda: fly(target=3), "target"),
    "empty list of targets": (lambda: fly(target=[]), "target"),
    "target has targets of different points": (
        lambda: fly(target=[flights.STILL, ca.Target(ca.paths.hold(), TRIANGLE)]),
        "target",
    ),
    "targets of moved points": (
        lambda: fly(target=[flights.STILL, ca.Target(ca.paths.hold(), 0.9 * ca.square())]),
        "target",
    ),
    "too few targets": (
        lambda: fly(q=np.tile(flights.start(), (3, 1)), target=[flights.STILL] * 2),
        "scenario.target",
    ),
    "too few controllers": (
        lambda: fly(ca.stack([SERVOING] * 2), q=np.tile(flights.start(), (3, 1))),
        "scenario.controller",
    ),
    "target field": (
        lambda: ca.Target(ca.paths.hold(), distnce=1.0),  # type: ignore[call-arg]
        "distnce",
    ),
    "target path": (lambda: ca.Target("M"), "path"),  # type: ignore[arg-type]
    "target points": (
        lambda: ca.Target(ca.paths.hold(), [[0, 0, 0]]),
        "points",
    ),
    "target distance": (
        lambda: ca.Target(ca.paths.hold(), distance=-1.0),
        "distance",
    ),
    "target distance flag": (
        lambda: ca.Target(ca.paths.hold(), distance=True),
        "distance",
    ),
    "not a controller": (lambda: fly("hold"), "controller"),
    "DOP853": (lambda: fly(method="DOP853"), "method"),
    "bandwidth": (lambda: ca.design(flights.VEHICLE, 0.0), "bandwidth"),
    "distance of design": (
        lambda: ca.design(flights.VEHICLE, 1.0, distance=-2.0),
        "distance",
    ),
    "distances of no points": (
        lambda: ca.design(flights.VEHICLE, 1.0, distance=[2.0, 2.1, 2.0, 2.0]),
        "distance",
    ),
    "distances of other points": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[1, 1, -1, 1, -1, -1], distance=[2.0, 2.1]),
        "distance",
    ),
    "desired": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[0.1, 0.2, 0.3]),
        "desired",
    ),
    "points on a line": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[-0.1, 0, 0.0, 0, 0.1, 0, 0.2, 0]),
        "desired",
    ),
    "design of a batch": (
        lambda: ca.design(BATCH, 1.0),
        "vehicle",
    ),
    "hold of a batch": (
        lambda: ca.hold(BATCH, [0, 0, 3]),
        "vehicle",
    ),
    "classic of a batch": (
        lambda: ca.classic(BATCH),
        "vehicle",
    ),
    "classic of nothing": (
        lambda: ca.classic("paper"),  # type: ignore[arg-type]
        "vehicle",
    ),
    "hold position": (lambda: ca.hold(flights.VEHICLE, [0, 1]), "position"),
    "hold attitude": (
        lambda: ca.hold(flights.VEHICLE, [0, 0, 3], [0, 0, 0, 0]),
        "attitude",
    ),
    "hold rate": (
        lambda: ca.hold(flights.VEHICLE, [0, 0, 3], bend_rate=-1.0),
        "bend_rate",
    ),
    "seed": (lambda: fly(seed=-1), "seed"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_flown_is_refused_in_one_sentence(case: str) -> None:
    act, field = REFUSED[case]
    with refused(field):
        act()


@pytest.mark.long
def test_a_target_beyond_view_is_no_trouble_for_a_controller_that_does_not_look() -> None:
    """Nor is noise that a push at every stage could not have; what it sees changes nothing."""
    hold = ca.hold(flights.VEHICLE, [0, 0, 3.0])
    beyond, before = (fly(hold, target=still(x)) for x in (1.6, 0.0))
    assert beyond.status == 0 and not beyond.in_view.all()
    assert before.in_view.all()
    np.testing.assert_array_equal(beyond.command, before.command)
    noisy, clean = (
        fly(hold, vehicle=vehicle, control_period=None, target=None)
        for vehicle in (WITH_NOISE, flights.VEHICLE)
    )
    assert noisy.status == 0
    np.testing.assert_array_equal(noisy.command, clean.command)


def test_a_path_that_jumps_is_refused() -> None:
    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        still = np.zeros((len(t), 3))
        at = still.copy()
        at[t > 1.0, 0] = 0.1
        return at, still, still

    with refused("path"):
        ca.Target(ca.paths.Path("step", 2.0, motion))


def test_a_motion_of_the_wrong_shape_is_refused() -> None:
    with refused("path"):
        ca.Target(ca.paths.Path("line", 2.0, lambda t: (t, t, t)))


@pytest.mark.long
def test_numbers_made_outside_of_a_law_keep_their_digits() -> None:
    weight = 9.81 * flights.VEHICLE.mass
    pushed = fly(rounding("fine")).command[0, 2]
    assert float(pushed) == pytest.approx(0.5 * (0.3 - 0.25) * weight, rel=1e-14)
