"""What a user reads when a closed loop cannot be flown: one sentence, field, value and remedy."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.closed_loop import flights, probes
from tests.refusals import refused
from tests.test_errors import assert_one_plain_sentence

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
REFUSED: dict[str, tuple[Any, str, str]] = {
    "behind": (
        lambda: fly(target=still(0.0, z=3.0)),
        "target has point 0 behind the camera at the start (depth -0.8",
        "facing the target",
    ),
    "out of view": (
        lambda: fly(target=still(1.6)),
        "target has point 0 out of view at the start, at pixel (",
        "of an image of 1000 by 1000; start",
    ),
    "out of view in a batch": (
        lambda: fly(target=[still(0.0), still(-0.8)]),
        "target has point 1 of run 1 out of view",
        "start closer",
    ),
    "eigenvalue": (lambda: gains(Kp=INDEFINITE), "Kp has the eigenvalue -0.25", "positive"),
    "zero": (lambda: gains(Kd=0.0), "Kd has the eigenvalue 0;", "positive definite"),
    "asymmetric": (lambda: gains(Cd=SKEWED), "Cd is not symmetric", "positive definite"),
    "gain shape": (lambda: gains(Kp=[1.0] * 6), "Kp is [1.0, 1.0", "8 of them"),
    "gain nan": (lambda: gains(Kp=np.nan), "Kp is nan", "finite"),
    "gain text": (lambda: gains(Kp="high"), "Kp is 'high'", "finite"),
    "sigma": (lambda: gains(sigma=0.0), "sigma is 0.0", "above 0"),
    "points": (lambda: gains(points=2), "points is 2", "from 3 to 100"),
    "damping": (lambda: gains(damping="image"), "damping is 'image'", "camera, feature"),
    "posture": (lambda: gains(posture_damping=-1), "posture_damping is -1", "of at least 0"),
    "gains for other points": (
        lambda: fly(gains(points=3)),
        "Kp of the controller DPD-SM-IBVS has shape (6, 6), but 4 feature points call for (8, 8)",
        "target's points",
    ),
    "gain left out": (
        lambda: fly(ca.Controller("mine", probes._weight_law, {"weight": 1.0}, looks=False)),
        "spring is missing from the gains of the controller mine",
        "give weight, spring",
    ),
    "gain too many": (
        lambda: fly(ca.Controller("mine", probes._recording_law, {"idle": 1.0, "x": 2.0})),
        "x is not a field of the law but in the gains",
        "give idle",
    ),
    "gain not finite": (
        lambda: fly(ca.Controller("mine", probes._recording_law, {"idle": np.inf})),
        "idle of the controller mine is inf",
        "finite",
    ),
    "law": (lambda: ca.Controller("mine", 3, {}), "law is 3", "device code"),  # type: ignore[arg-type]
    "stack of one that looks and one that does not": (
        lambda: ca.stack([replace(SERVOING, looks=looks) for looks in (True, False)]),
        "controllers have looks True and False",
        "give all of them the same",
    ),
    "law without a law": (
        lambda: fly(ca.Controller("mine", lambda code: code, {}, looks=False)),  # type: ignore
        "law returns no Gains",
        "a Warp struct, and control",
    ),
    **{
        f"number that loses digits, {kind}": (
            lambda kind=kind: fly(rounding(kind)),
            f"law has the number {number} in its function {kind}",
            "number = code.Real(",
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
            "law divides whole numbers in its function",
            f"({line})",
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
        "law has a wp.static in its function looped",
        "make them gains",
    ),
    "default of a law's function": (
        lambda: fly(rounding("scaled")),
        "law has the default fraction of an argument in its function scaled",
        "give it where the function is called",
    ),
    "camera without a target": (
        lambda: fly(probes.braking(5.0), target=None),
        "target is None, but the law reads camera_push in its function control",
        "give one",
    ),
    "law that looks under a controller that does not": (
        lambda: fly(replace(ca.twist_servoing(flights.VEHICLE), looks=False), target=still(0.0)),
        "looks is False in the controller IBVS by twists, but True in its law",
        "give looks=True",
    ),
    **{
        f"digits of a vector, {kind}": (
            lambda kind=kind: fly(rounding(kind)),
            f"law has {name} in its function {kind}",
            "or make it a gain",
        )
        for kind, name in (("vector", "goal"), ("static", "code.vec3(TENTH, 0.0, 0.0)"))
    },
    "latency of a law that acts at once": (
        lambda: ca.Controller("mine", probes._weight_law, {}, latency=0.02),
        "latency is 0.02, but the controller mine is not guided",
        "give 0",
    ),
    "guided without a period": (
        lambda: ca.Controller("mine", probes._weight_law, {}, guided=True),
        "period is None, but the controller mine is guided",
        "give seconds",
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
        "guided is True in the controller mine, but its law has no Memory",
        "guided=False",
    ),
    "integral of a law that does not look": (
        lambda: ca.Controller("mine", probes._weight_law, {}, looks=False, integral=0.5),
        "integral is 0.5, but the controller mine sums up no error",
        "give 0",
    ),
    "gains": (
        lambda: ca.Controller("mine", probes._weight_law, [1.0]),  # type: ignore[arg-type]
        "gains is [1.0]",
        "by name",
    ),
    "stack of nothing": (lambda: ca.stack([]), "controllers is []", "one Controller per run"),
    "stack of a stack": (
        lambda: ca.stack([gains(), ca.stack([gains(), gains()])]),
        "controllers holds DPD-SM-IBVS for 2 runs already",
        "each of one run",
    ),
    "stack of laws": (
        lambda: ca.stack([SERVOING, ca.classic(flights.VEHICLE)]),
        "controllers holds the laws DPD-SM-IBVS and classic IBVS",
        "one law",
    ),
    "stack of sizes": (
        lambda: ca.stack([gains(), gains(points=3)]),
        "controllers holds gains Kp of shapes (8, 8) and (6, 6)",
        "as many points",
    ),
    "period no multiple": (
        lambda: fly(method="RK4", step=3e-4),
        "control_period is 0.001 s, which is not a multiple of the step, 0.0003 s",
        "step='auto'",
    ),
    "period below the step": (
        lambda: fly(method="RK4", step=1e-3, control_period=5e-4),
        "control_period is 0.0005 s, which is not a multiple of the step, 0.001 s",
        "step='auto'",
    ),
    "period 0": (lambda: fly(control_period=0), "control_period is 0;", "above 0 [s], or None"),
    "period < 0": (lambda: fly(control_period=-1e-3), "control_period is -0.001", "above 0"),
    "period nan": (lambda: fly(control_period=np.nan), "control_period is nan", "above 0"),
    "period text": (lambda: fly(control_period="1ms"), "control_period is '1ms'", "above 0"),
    "noise at every stage": (
        lambda: fly(vehicle=WITH_NOISE, control_period=None),
        "control_period is None, but camera.noise is 0.5",
        "needs updates at a period",
    ),
    "noise": (
        lambda: flights.VEHICLE.replace({"camera.noise": -0.5}),
        "camera.noise is -0.5",
        "standard deviation",
    ),
    "frame rate": (
        lambda: flights.VEHICLE.replace({"camera.frame_rate": np.inf}),
        "camera.frame_rate is inf",
        "frames per second",
    ),
    "latency": (
        lambda: flights.VEHICLE.replace({"camera.latency": "slow"}),
        "camera.latency is 'slow'",
        "exposure",
    ),
    "latency over runs": (
        lambda: fly(vehicle=flights.VEHICLE.replace({"camera.latency": [0.0, 0.01]})),
        "camera.latency is [0.0, 0.01] over the runs",
        "one value for all",
    ),
    "no target": (lambda: fly(target=None), "target is None", "continuair.Target"),
    "not a target": (lambda: fly(target=3), "target is 3", "continuair.Target"),
    "empty list of targets": (lambda: fly(target=[]), "target is []", "continuair.Target"),
    "target has targets of different points": (
        lambda: fly(target=[flights.STILL, ca.Target(ca.paths.hold(), TRIANGLE)]),
        "target has targets of 4 and 3 points",
        "the same points",
    ),
    "targets of moved points": (
        lambda: fly(target=[flights.STILL, ca.Target(ca.paths.hold(), 0.9 * ca.square())]),
        "target has targets of different points",
        "the same points",
    ),
    "too few targets": (
        lambda: fly(q=np.tile(flights.start(), (3, 1)), target=[flights.STILL] * 2),
        "scenario.target has 2 runs, but the batch has 3",
        "one row per run",
    ),
    "too few controllers": (
        lambda: fly(ca.stack([SERVOING] * 2), q=np.tile(flights.start(), (3, 1))),
        "scenario.controller has 2 runs, but the batch has 3",
        "one row per run",
    ),
    "target field": (
        lambda: ca.Target(ca.paths.hold(), distnce=1.0),  # type: ignore[call-arg]
        "distnce is not a field of a target",
        "use distance",
    ),
    "target path": (lambda: ca.Target("M"), "path is 'M'", "paths.letter"),  # type: ignore[arg-type]
    "target points": (
        lambda: ca.Target(ca.paths.hold(), [[0, 0, 0]]),
        "points is [[0, 0, 0]]",
        "at least 3",
    ),
    "target distance": (
        lambda: ca.Target(ca.paths.hold(), distance=-1.0),
        "distance is -1.0",
        "in front of the camera",
    ),
    "target distance flag": (
        lambda: ca.Target(ca.paths.hold(), distance=True),
        "distance is True",
        "in front of the camera",
    ),
    "not a controller": (lambda: fly("hold"), "controller is 'hold'", "continuair.controllers"),
    "DOP853": (lambda: fly(method="DOP853"), "method is 'DOP853'", "Tsit5"),
    "bandwidth": (lambda: ca.design(flights.VEHICLE, 0.0), "bandwidth is 0.0", "above 0"),
    "distance of design": (
        lambda: ca.design(flights.VEHICLE, 1.0, distance=-2.0),
        "distance is -2.0",
        "above 0",
    ),
    "distances of no points": (
        lambda: ca.design(flights.VEHICLE, 1.0, distance=[2.0, 2.1, 2.0, 2.0]),
        "distance is [2.0, 2.1, 2.0, 2.0], of points whose image is not given",
        "give desired",
    ),
    "distances of other points": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[1, 1, -1, 1, -1, -1], distance=[2.0, 2.1]),
        "distance is [2.0, 2.1], 2 numbers, but desired has 3 points",
        "one for each",
    ),
    "desired": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[0.1, 0.2, 0.3]),
        "desired is [0.1, 0.2, 0.3]",
        "x and y of each point",
    ),
    "points on a line": (
        lambda: ca.design(flights.VEHICLE, 1.0, desired=[-0.1, 0, 0.0, 0, 0.1, 0, 0.2, 0]),
        "desired is [-0.1, 0, 0.0, 0, 0.1, 0, ...], which does not determine the camera's pose",
        "not on a line",
    ),
    "design of a batch": (
        lambda: ca.design(BATCH, 1.0),
        "vehicle 'paper' holds 2 runs",
        "vehicle.select",
    ),
    "hold of a batch": (
        lambda: ca.hold(BATCH, [0, 0, 3]),
        "vehicle 'paper' holds 2 runs",
        "vehicle.select",
    ),
    "classic of a batch": (
        lambda: ca.classic(BATCH),
        "vehicle 'paper' holds 2 runs",
        "vehicle.select",
    ),
    "classic of nothing": (
        lambda: ca.classic("paper"),  # type: ignore[arg-type]
        "vehicle is 'paper'",
        "load_vehicle",
    ),
    "hold position": (lambda: ca.hold(flights.VEHICLE, [0, 1]), "position is [0, 1]", "3 finite"),
    "hold attitude": (
        lambda: ca.hold(flights.VEHICLE, [0, 0, 3], [0, 0, 0, 0]),
        "attitude is [0, 0, 0, 0]",
        "unit quaternion",
    ),
    "hold rate": (
        lambda: ca.hold(flights.VEHICLE, [0, 0, 3], bend_rate=-1.0),
        "bend_rate is -1.0",
        "of at least 0",
    ),
    "seed": (lambda: fly(seed=-1), "seed is -1", "whole number"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_flown_is_refused_in_one_sentence(case: str) -> None:
    act, start, remedy = REFUSED[case]
    with pytest.raises(ca.InputError) as caught:
        act()
    text = str(caught.value)
    assert text.startswith(start)
    assert remedy in text
    assert_one_plain_sentence(text)


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


def test_numbers_made_outside_of_a_law_keep_their_digits() -> None:
    weight = 9.81 * flights.VEHICLE.mass
    pushed = fly(rounding("fine")).command[0, 2]
    assert float(pushed) == pytest.approx(0.5 * (0.3 - 0.25) * weight, rel=1e-14)
