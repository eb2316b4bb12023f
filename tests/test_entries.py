"""Every way into a flight refuses the same things in the same words, and warns alike."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026 import open_loop_test
from tests.closed_loop import flights
from tests.refusals import refused

PAPER = ca.load_vehicle("paper")
FALL = open_loop_test("B")
TWO = PAPER.replace({"arm.radius": [0.004, 0.005]})
OVERDAMPED = PAPER.replace({"arm.damping_ratio": 5.0})
Q = np.asarray(FALL.q)
SEEING = flights.scenario(flights.designed(2.0), 0.01)

Entry = Callable[..., Any]


def fixed(function: Entry) -> Entry:
    """Fly by RK4 where a step is given."""

    def fly(*given: Any, **options: Any) -> Any:
        return function(*given, **({"method": "RK4"} if "step" in options else {}) | options)

    return fly


ENTRIES: dict[str, Entry] = {
    "simulate": fixed(ca.simulate),
    "run_pairs": fixed(ca.run_pairs),
    "Simulation": ca.Simulation,
}
BATCHES = ("simulate", "run_pairs")
ALL = (*BATCHES, "Simulation")


def still(x: float, z: float = 0.0) -> ca.Target:
    return ca.Target(ca.paths.hold([x, 0.0, z]))


def later(value: Any) -> Callable[[float], Any]:
    """A force until 0.01 s, and then something else."""

    def force(t: float) -> Any:
        if t <= 0.01:
            return [0.0, 0.0, 1.0]
        if isinstance(value, Exception):
            raise value
        return value

    return force


def rows(n: int) -> Callable[[float], Any]:
    """A force that has a row for each of n runs."""
    return lambda t: np.zeros((n, 3))


def before(**changes: Any) -> ca.Scenario:
    return SEEING.replace(**changes)


VALUES: list[tuple[tuple[str, ...], str, list[Any]]] = [
    (ALL, "step", [0, -1e-3, np.nan, np.inf, True, "1e-3", [1e-3, -1.0], [], [1e-4] * 2]),
    (BATCHES, "step", [None]),
    (BATCHES, "sample", [0.0, -1, np.nan, True, None, "1 ms", [1e-3], 2.0]),
    (BATCHES, "duration", [0, -1.0, np.nan, np.inf, True, "1 s"]),
    (BATCHES, "device", [3, None, "tpu", "CPU", "cuda:99"]),
    (BATCHES, "threads", [0, -2, 1.5, True, "all"]),
]
REFUSED: list[Any] = [
    *(
        (PAPER, FALL, {name: value}, entries, name)
        for entries, name, values in VALUES
        for value in values
    ),
    (3, FALL, {}, ALL, "vehicle"),
    ("paper", FALL, {}, ALL, "vehicle"),
    (None, FALL, {}, ALL, "vehicle"),
    (PAPER, "A", {}, ALL, "scenario"),
    (PAPER, None, {}, ALL, "scenario"),
    (PAPER, FALL, {"step": 1e-9}, BATCHES, "duration"),
    (PAPER, FALL, {"sample": 1e-9}, BATCHES, "duration"),
    (PAPER, FALL, {"duration": 5e-4}, BATCHES, "sample"),
    (PAPER, FALL.replace(qd=np.full(8, 1e200)), {"step": "auto"}, BATCHES, "duration"),
    # Runs of other numbers.
    (TWO, FALL, {"step": np.ones((1, 2))}, BATCHES, "step"),
    (TWO, FALL, {"step": [1e-4] * 3}, BATCHES, "step"),
    (TWO, FALL.replace(q=[Q] * 3), {}, BATCHES, "vehicle"),
    (TWO, FALL.replace(qd=np.zeros((3, 8))), {}, BATCHES, "vehicle"),
    (TWO, FALL.replace(force=np.zeros((3, 3))), {}, BATCHES, "vehicle"),
    (TWO, FALL.replace(force=rows(3)), {}, BATCHES, "vehicle"),
    (PAPER, FALL.replace(force=rows(2), moment=rows(3)), {}, BATCHES, "inputs"),
    (TWO, before(target=[still(0.0)] * 3), {}, BATCHES, "vehicle"),
    (TWO, before(controller=ca.stack([flights.designed(2.0)] * 3)), {}, BATCHES, "vehicle"),
    # Inputs that cannot be used later on.
    pytest.param(
        PAPER, FALL.replace(force=later([np.nan] * 3)), {}, BATCHES, "force", marks=pytest.mark.long
    ),
    (PAPER, FALL.replace(force=later([1.0, 2.0])), {}, BATCHES, "force"),
    (PAPER, FALL.replace(force=later(KeyError("t"))), {}, BATCHES, "force"),
    # Closed loops.
    (flights.VEHICLE, SEEING, {"step": 3e-4}, BATCHES, "control_period"),
    (TWO, SEEING, {"step": [2e-4, 3e-4]}, BATCHES, "control_period"),
    (flights.VEHICLE, before(target=still(0.0, 3.0)), {}, BATCHES, "target"),
    (flights.VEHICLE, before(target=still(1.6)), {}, BATCHES, "target"),
    (flights.VEHICLE, before(target=[still(0.0), still(-0.8)]), {}, BATCHES, "target"),
    pytest.param(
        flights.VEHICLE,
        before(controller=ca.servoing(5.0, 0.1, points=3)),
        {},
        BATCHES,
        "Kp",
        marks=pytest.mark.long,
    ),
    (
        PAPER.replace({"camera.noise": 0.5}),
        before(control_period=None),
        {},
        BATCHES,
        "control_period",
    ),
    (PAPER.replace({"camera.latency": [0.0, 0.01]}), SEEING, {}, BATCHES, "camera.latency"),
]


@pytest.mark.parametrize(("vehicle", "scenario", "options", "entries", "field"), REFUSED)
def test_every_entry_refuses_in_the_same_words(
    vehicle: Any, scenario: Any, options: dict[str, Any], entries: tuple[str, ...], field: str
) -> None:
    said = set()
    for entry in entries:
        with refused(field) as caught:
            ENTRIES[entry](vehicle, scenario, **options)
        said.add(str(caught.value))
    assert len(said) == 1


@pytest.mark.parametrize("model", ["stiff", 3, None, True, "Coupled"])
def test_an_unknown_model_is_refused_whichever_way_it_is_named(model: Any) -> None:
    for entry, field, value in (
        (ENTRIES["simulate"], "model", model),
        (ENTRIES["Simulation"], "model", model),
        (ca.run_pairs, "models", [model]),
    ):
        given: dict[str, Any] = {field: value}
        with refused(field) as caught:
            entry(PAPER, FALL, **given)
        assert repr(model) in caught.value.problem and "decoupled" in caught.value.remedy


COARSE: dict[str, tuple[ca.Vehicle, ca.Scenario, float, tuple[str, ...]]] = {
    "arm": (PAPER, FALL, 0.05, ALL),
    "damping": (OVERDAMPED, FALL, 1e-3, ALL),
    "spin": (PAPER, FALL.replace(qd=[0, 0, 0, 0, 0, 400.0, 0, 0]), 1e-3, ALL),
    "one run of two": (
        PAPER.replace({"arm.damping_ratio": [0.0, 5.0]}), FALL, 1e-3, BATCHES,
    ),
    "loop": (PAPER.replace({"arm.damping_ratio": 2.0}), SEEING, 1e-3, BATCHES),
}  # fmt: skip


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[pytest.mark.long] * (case == "loop")) for case in COARSE]
)
def test_every_entry_warns_of_a_coarse_step_in_the_same_words_and_where_it_was_called(
    case: str,
) -> None:
    vehicle, scenario, step, entries = COARSE[case]
    scenario = scenario.replace(duration=0.1)
    said = []
    for entry in entries:
        options = {"control_period": step} if entry == "Simulation" else {"sample": step}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ca.ContinuairWarning)
            warnings.filterwarnings("ignore", "nrmse_r and rmse_r_rad")
            ENTRIES[entry](vehicle, scenario, step=step, **options)
        assert [warned.filename for warned in caught] == [__file__]
        said.append(str(caught[0].message))
    assert said == said[:1] * len(entries)
    assert said[0].startswith(f"step is {step:g} s")
    assert "step='auto'" in said[0]


@pytest.mark.parametrize("vehicle", [PAPER, OVERDAMPED], ids=["undamped", "overdamped"])
@pytest.mark.parametrize("spin", [0.0, 400.0])
def test_every_entry_takes_the_same_automatic_step(vehicle: ca.Vehicle, spin: float) -> None:
    scenario = FALL.replace(qd=[0, 0, 0, 0, 0, spin, 0, 0], duration=0.02)
    options: dict[str, Any] = {"method": "RK4", "step": "auto"}
    step = ca.simulate(vehicle, scenario, **options).attrs["step"]
    assert ca.run_pairs(vehicle, scenario, **options)["step"].values.tolist() == [step]
    assert ca.Simulation(vehicle, scenario).trajectory().attrs["step"] == step
    batch = vehicle.replace({"uav.mass": [vehicle.uav.mass, 3.0]})
    assert ca.simulate(batch, scenario, **options)["step"].values[0] == step
    assert ca.run_pairs(batch, scenario, **options)["step"].values[0] == step
