"""Random vehicles, scenarios, controllers and batch shapes, each the same from its number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import continuair as ca
from continuair.kernels.dynamics import SIMPLER
from continuair.typing import Model

Array = np.ndarray
Rng = np.random.Generator

_RATIOS = (0.0, 0.02, 0.3, 1.0, 2.0, 5.0)
_SAMPLES = (1e-3, 2e-3, 5e-3, 1e-2)
_PERIODS = (1e-3, 5e-3, None)
_WIDTHS = {"tau": 8, "force": 3, "moment": 3, "bend_moment": 2, "tip_wrench": 6}


@dataclass(frozen=True)
class Case:
    """Arguments of `run_pairs`; `options` are those of `simulate` too."""

    vehicle: ca.Vehicle
    scenario: ca.Scenario
    models: tuple[Model, ...]
    settle: float
    options: dict[str, Any]

    def __str__(self) -> str:
        choices = f"models {self.models}, settle {self.settle!r}, {self.options}"
        return f"{self.scenario.name}: {choices}\n{self.vehicle!r}"


@dataclass(frozen=True)
class Shape:
    """How many runs there are, None for a plain flight, and what chance decides."""

    rng: Rng
    runs: int | None

    def rows(self, draw: Callable[[], Any]) -> Array:
        """One value, or a value per run in half of the batches."""
        if self.runs is None or self.rng.random() < 0.5:
            return np.asarray(draw())
        return np.array([draw() for _ in range(self.runs)])


@dataclass(frozen=True)
class Swings:
    """offset + amplitude sin(rate t), and after a jump at `since` once more the offset.

    It tells its frequency, which the automatic step resolves.
    """

    offset: Array
    amplitude: Array
    fastest: Array
    since: float

    def __call__(self, t: float) -> Array:
        wave = self.amplitude * np.sin(self.fastest * t)[..., None]
        return np.asarray(self.offset * (1.0 + (t > self.since)) + wave)


def open_case(number: int) -> Case:
    """A vehicle under inputs that are constant or change over time."""
    rng = np.random.default_rng([7, number])
    shape = Shape(rng, [None, 1, 2, 3, 5][number % 5])
    vehicle = _vehicle(shape)
    duration, sample = _times(rng)
    since = 0.37 * duration
    violent = number % 20 == 7
    scenario = ca.Scenario(
        f"open {number}",
        shape.rows(lambda: _start(rng)),
        shape.rows(lambda: rng.uniform(-1, 1, 8) * [1, 1, 1, *[8.0 * (number % 3)] * 3, 1, 1]),
        **_inputs(shape, since, strength=60.0 if violent else 1.0),
        tip_wrench_sign=int(rng.choice([1, -1])),
        gravity=float(rng.choice([0.0, 9.81])),
        jumps=(since,),
        duration=1.0 if number % 4 == 0 else duration,
    )
    # A step beyond what RK4 is stable with would amplify rounding.
    quick = np.any(np.greater(_ratio(vehicle), 0.5))
    choices = [1e-4, 5e-5] if quick else [2e-3, 1e-3, 3e-4]
    step = "auto" if violent else _step(rng, shape.runs, choices)
    options = _method(number, step) | {"sample": sample, "duration": duration}
    others = rng.permutation(SIMPLER)[: 1 + number % 2].tolist()
    return Case(vehicle, scenario, tuple(others), 0.0, options)


def closed_case(number: int) -> Case:
    """The paper's law before targets, or, every fifth time, a law that does not look."""
    rng = np.random.default_rng([8, number])
    shape = Shape(rng, [None, 1, 2, 3, 5][(number // 3) % 5])
    period = _PERIODS[number % 3]
    vehicle = _seeing(shape, every_stage=period is None)
    duration, sample = _times(rng)
    since = 0.37 * duration
    looks = number % 5 != 4
    if looks:
        fields = _before_targets(shape, vehicle)
    else:
        fields = {"q": shape.rows(lambda: _start(rng, calm=True))}
        fields["controller"] = _each(shape, lambda run: _hold(rng, _one(vehicle, run)))
    if rng.random() < 0.4:
        push = _Draw(rng, np.full(3, 0.3), since)
        fields["force"] = push.function(shape)
    if number % 16 == 11:
        # No arm holds that: some runs end bent beyond a full circle.
        fields["bend_moment"] = shape.rows(lambda: [float(rng.choice([0.0, 6e3])), 0.0])
    scenario = ca.Scenario(
        f"closed {number}",
        **fields,
        control_period=period,
        jumps=(since,),
        duration=duration,
        seed=number,
    )
    parts = [1, 2, 5, 10]
    step = _step(rng, shape.runs, [(period or 1e-3) / n for n in parts])
    options = _method(number, step) | {"sample": sample}
    models: tuple[Model, ...] = (SIMPLER[number % 2],) if looks else ()
    return Case(vehicle, scenario, models, round(0.31 * duration, 5), options)


def _method(number: int, step: Any) -> dict[str, Any]:
    """Every other case flies with steps of one length."""
    return {"method": "RK4", "step": step} if number % 2 else {}


def _times(rng: Rng) -> tuple[float, float]:
    """Duration, a multiple of the sample in half of the cases, and sample [s]."""
    sample = float(rng.choice(_SAMPLES))
    duration = float(rng.uniform(0.03, 0.1))
    return (max(2, round(duration / sample)) * sample if rng.random() < 0.5 else duration), sample


def _step(rng: Rng, runs: int | None, choices: list[float]) -> Any:
    """Automatic, one for all, or one per run [s]."""
    chance = rng.random()
    if chance < 0.6:
        return "auto"
    if chance < 0.8 or runs is None:
        return float(rng.choice(choices))
    return rng.choice(choices, runs)


def _vehicle(shape: Shape) -> ca.Vehicle:
    rng = shape.rng
    vehicle = ca.load_vehicle(str(rng.choice(["paper", "slender"])))
    disk = {"position": 0.4, "mass": 0.05, "inertia": [2e-5, 3e-5]}
    plain: dict[str, Any] = {"arm.disks": [disk] if rng.random() < 0.4 else []}
    changes: dict[str, Callable[[], Any]] = {
        "uav.mass": lambda: rng.uniform(0.8, 4.0),
        "uav.mount": lambda: rng.uniform(-0.04, 0.04, 3),
        "uav.inertia": lambda: _inertia(rng),
        "arm.length": lambda: rng.uniform(0.5, 1.5),
        "arm.radius": lambda: rng.uniform(0.0015, 0.006),
        "arm.damping_ratio": lambda: float(rng.choice(_RATIOS)),
    }
    varied = {name: shape.rows(draw) for name, draw in changes.items() if rng.random() < 0.7}
    return vehicle.replace(plain | varied)


def _ratio(vehicle: ca.Vehicle) -> Any:
    return 0.0 if vehicle.arm.damping_ratio is None else vehicle.arm.damping_ratio


def _inertia(rng: Rng) -> Array:
    """Of a cloud of points: a full tensor that a rigid body can have."""
    points = rng.normal(size=(8, 3)) * [0.12, 0.12, 0.06]
    return 2.0 * (np.sum(points**2) * np.eye(3) - points.T @ points) / len(points)


def _start(rng: Rng, calm: bool = False) -> Array:
    bend = 0.0 if rng.random() < 0.1 else rng.uniform(-0.3, 0.3) if calm else rng.uniform(-3, 3)
    tilt = 0.1 if calm else 1.0
    return np.array([*rng.uniform(-1, 1, 3), *(tilt * rng.uniform(-1, 1, 3)), bend, rng.normal()])


def _inputs(shape: Shape, since: float, strength: float) -> dict[str, Any]:
    """Some of all inputs; strong enough, they bend an arm beyond a full circle."""
    scales = {"tau": [20.0] * 3 + [0.2] * 3 + [2.0, 0.05], "force": [20.0] * 3}
    scales |= {"moment": [0.2] * 3, "bend_moment": [30.0] * 2, "tip_wrench": [5.0] * 3 + [0.3] * 3}
    found: dict[str, Any] = {}
    for name, width in _WIDTHS.items():
        if shape.rng.random() < 0.35:
            draw = _Draw(shape.rng, strength * np.array(scales[name]), since)
            timed = shape.rng.random() < 0.6
            found[name] = draw.function(shape) if timed else shape.rows(draw.row)
            assert len(draw.scale) == width
    return found


@dataclass(frozen=True)
class _Draw:
    """Draws inputs of a scale."""

    rng: Rng
    scale: Array
    since: float

    def row(self) -> Array:
        return np.asarray(self.scale * self.rng.uniform(-1, 1, len(self.scale)))

    def function(self, shape: Shape) -> Swings:
        rate = shape.rows(lambda: 10 ** self.rng.uniform(0.5, 2.5))
        return Swings(shape.rows(self.row), shape.rows(self.row), rate, self.since)


def _seeing(shape: Shape, every_stage: bool) -> ca.Vehicle:
    """A vehicle that its camera can guide, with noise where there are control instants."""
    rng = shape.rng
    changes: dict[str, Any] = {
        "arm.damping_ratio": shape.rows(lambda: rng.uniform(0.02, 2.0)),
        "arm.radius": shape.rows(lambda: rng.uniform(0.004, 0.007)),
        "camera.focal_length": shape.rows(lambda: rng.uniform(600, 900, 2)),
    }
    if not every_stage:
        changes["camera.noise"] = shape.rows(lambda: rng.uniform(0.0, 1.0))
        changes["camera.frame_rate"] = float(rng.choice([0.0, 50.0]))
        changes["camera.latency"] = float(rng.choice([0.0, 0.01]))
    return ca.load_vehicle("paper").replace(changes)


def _before_targets(shape: Shape, vehicle: ca.Vehicle) -> dict[str, Any]:
    """Start, controller and target: one for all runs, or one per run."""
    rng = shape.rng

    def target(run: int) -> ca.Target:
        path = ca.paths.letter("MRAL"[run % 4], duration=float(rng.uniform(8, 20)))
        start = path(0.0)[0][0]
        moved = ca.paths.letter(path.name, duration=path.duration, centre=-start)
        return ca.Target(moved, distance=float(rng.uniform(1.9, 2.2)))

    def controller(run: int) -> ca.Controller:
        gains = ca.design(_one(vehicle, run), float(rng.uniform(1.0, 4.0)), conditioning=0.02)
        return ca.servoing(**gains, feed_forward=bool(rng.random() < 0.5))

    def start() -> Array:
        return np.array([*rng.uniform(-0.1, 0.1, 2), rng.uniform(3.0, 3.2), 0, 0, 0, 0.1, 0])

    targets = target(0)
    if shape.runs is not None and rng.random() < 0.5:
        targets = [target(run) for run in range(shape.runs)]  # type: ignore[assignment]
    q = shape.rows(start)
    return {"q": q, "target": targets, "controller": _each(shape, controller)}


def _each(shape: Shape, make: Callable[[int], ca.Controller]) -> ca.Controller:
    """A controller for all runs, or one per run."""
    if shape.runs is None or shape.rng.random() < 0.5:
        return make(0)
    return ca.stack([make(run) for run in range(shape.runs)])


def _hold(rng: Rng, vehicle: ca.Vehicle) -> ca.Controller:
    return ca.hold(vehicle, rng.uniform(-1, 1, 3), bend_rate=float(rng.choice([0.0, 5.0])))


def _one(vehicle: ca.Vehicle, run: int) -> ca.Vehicle:
    return vehicle if vehicle.runs is None else vehicle.select(run)
