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
from tests.test_errors import assert_one_plain_sentence

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


REFUSED: dict[str, tuple[Any, Any, dict[str, Any], tuple[str, ...], str]] = {
    "vehicle number": (3, FALL, {}, ALL, "vehicle is 3"),
    "vehicle name": ("paper", FALL, {}, ALL, "vehicle is 'paper'"),
    "vehicle none": (None, FALL, {}, ALL, "vehicle is None"),
    "scenario name": (PAPER, "A", {}, ALL, "scenario is 'A'"),
    "scenario none": (PAPER, None, {}, ALL, "scenario is None"),
    "step zero": (PAPER, FALL, {"step": 0}, ALL, "step is 0"),
    "step negative": (PAPER, FALL, {"step": -1e-3}, ALL, "step is -0.001"),
    "step nan": (PAPER, FALL, {"step": np.nan}, ALL, "step is nan"),
    "step infinite": (PAPER, FALL, {"step": np.inf}, ALL, "step is inf"),
    "step bool": (PAPER, FALL, {"step": True}, ALL, "step is True"),
    "step none": (PAPER, FALL, {"step": None}, BATCHES, "step is missing"),
    "step text": (PAPER, FALL, {"step": "fine"}, ALL, "step is 'fine'"),
    "step digits": (PAPER, FALL, {"step": "1e-3"}, ALL, "step is '1e-3'"),
    "step list": (PAPER, FALL, {"step": [1e-3, -1.0]}, ALL, "step is -1.0"),
    "steps empty": (PAPER, FALL, {"step": []}, ALL, "step is []"),
    "steps 2d": (TWO, FALL, {"step": np.ones((1, 2))}, BATCHES, "step is [[1.0, 1.0]]"),
    "steps for others": (TWO, FALL, {"step": [1e-4] * 3}, BATCHES, "step has 3 runs"),
    "steps for one": (PAPER, FALL, {"step": [1e-4] * 2}, ALL, "step has 2 runs"),
    "step tiny": (PAPER, FALL, {"step": 1e-9}, BATCHES, "duration is 1 s"),
    "sample zero": (PAPER, FALL, {"sample": 0.0}, BATCHES, "sample is 0.0"),
    "sample negative": (PAPER, FALL, {"sample": -1}, BATCHES, "sample is -1"),
    "sample nan": (PAPER, FALL, {"sample": np.nan}, BATCHES, "sample is nan"),
    "sample bool": (PAPER, FALL, {"sample": True}, BATCHES, "sample is True"),
    "sample none": (PAPER, FALL, {"sample": None}, BATCHES, "sample is None"),
    "sample text": (PAPER, FALL, {"sample": "1 ms"}, BATCHES, "sample is '1 ms'"),
    "sample array": (PAPER, FALL, {"sample": [1e-3]}, BATCHES, "sample is [0.001]"),
    "sample long": (PAPER, FALL, {"sample": 2.0}, BATCHES, "sample is 2.0 s, longer than"),
    "sample tiny": (PAPER, FALL, {"sample": 1e-9}, BATCHES, "duration is 1 s"),
    "duration short": (PAPER, FALL, {"duration": 5e-4}, BATCHES, "sample is 0.001 s, longer"),
    "duration zero": (PAPER, FALL, {"duration": 0}, BATCHES, "duration is 0"),
    "duration negative": (PAPER, FALL, {"duration": -1.0}, BATCHES, "duration is -1.0"),
    "duration nan": (PAPER, FALL, {"duration": np.nan}, BATCHES, "duration is nan"),
    "duration bool": (PAPER, FALL, {"duration": True}, BATCHES, "duration is True"),
    "duration text": (PAPER, FALL, {"duration": "1 s"}, BATCHES, "duration is '1 s'"),
    "duration infinite": (PAPER, FALL, {"duration": np.inf}, BATCHES, "duration is inf"),
    "device number": (PAPER, FALL, {"device": 3}, BATCHES, "device is 3"),
    "device none": (PAPER, FALL, {"device": None}, BATCHES, "device is None"),
    "device unknown": (PAPER, FALL, {"device": "tpu"}, BATCHES, "device is 'tpu'"),
    "device case": (PAPER, FALL, {"device": "CPU"}, BATCHES, "device is 'CPU'"),
    "device absent": (PAPER, FALL, {"device": "cuda:99"}, BATCHES, "device is 'cuda:99'"),
    "threads zero": (PAPER, FALL, {"threads": 0}, BATCHES, "threads is 0"),
    "threads negative": (PAPER, FALL, {"threads": -2}, BATCHES, "threads is -2"),
    "threads part": (PAPER, FALL, {"threads": 1.5}, BATCHES, "threads is 1.5"),
    "threads bool": (PAPER, FALL, {"threads": True}, BATCHES, "threads is True"),
    "threads text": (PAPER, FALL, {"threads": "all"}, BATCHES, "threads is 'all'"),
    "starts": (TWO, FALL.replace(q=[Q] * 3), {}, BATCHES, "vehicle has 2 runs"),
    "rates": (TWO, FALL.replace(qd=np.zeros((3, 8))), {}, BATCHES, "vehicle has 2 runs"),
    "constant inputs": (
        TWO, FALL.replace(force=np.zeros((3, 3))), {}, BATCHES, "vehicle has 2 runs",
    ),
    "inputs over time": (TWO, FALL.replace(force=rows(3)), {}, BATCHES, "vehicle has 2 runs"),
    "inputs apart": (
        PAPER, FALL.replace(force=rows(2), moment=rows(3)), {}, BATCHES, "inputs have different",
    ),
    "input not finite": (
        PAPER, FALL.replace(force=later([np.nan] * 3)), {}, BATCHES, "force is not finite at t =",
    ),
    "input of two numbers": (
        PAPER, FALL.replace(force=later([1.0, 2.0])), {}, BATCHES, "force returns values",
    ),
    "input that raises": (
        PAPER, FALL.replace(force=later(KeyError("t"))), {}, BATCHES, "force raises KeyError",
    ),
    "start too fast": (
        PAPER, FALL.replace(qd=np.full(8, 1e200)), {"step": "auto"}, BATCHES,
        "duration is 1 s, more",
    ),
    "period and step": (
        flights.VEHICLE, SEEING, {"step": 3e-4}, BATCHES, "control_period is 0.001 s, which is not",
    ),
    "period and steps": (
        TWO, SEEING, {"step": [2e-4, 3e-4]}, BATCHES, "control_period is 0.001 s, which is not",
    ),
    "behind": (flights.VEHICLE, before(target=still(0.0, 3.0)), {}, BATCHES, "target has point 0"),
    "out of view": (flights.VEHICLE, before(target=still(1.6)), {}, BATCHES, "target has point 0"),
    "one out of view": (
        flights.VEHICLE, before(target=[still(0.0), still(-0.8)]), {}, BATCHES,
        "target has point 1 of run 1 out of view",
    ),
    "targets": (
        TWO, before(target=[still(0.0)] * 3), {}, BATCHES, "vehicle has 2 runs, but the batch",
    ),
    "controllers": (
        TWO, before(controller=ca.stack([flights.designed(2.0)] * 3)), {}, BATCHES,
        "vehicle has 2 runs, but the batch",
    ),
    "gains for other points": (
        flights.VEHICLE, before(controller=ca.servoing(5.0, 0.1, points=3)), {}, BATCHES,
        "Kp of the controller DPD-SM-IBVS has shape (6, 6)",
    ),
    "noise at every stage": (
        PAPER.replace({"camera.noise": 0.5}), before(control_period=None), {}, BATCHES,
        "control_period is None, but camera.noise is 0.5",
    ),
    "latency over runs": (
        PAPER.replace({"camera.latency": [0.0, 0.01]}), SEEING, {}, BATCHES,
        "camera.latency is [0.0, 0.01] over the runs",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_every_entry_refuses_in_the_same_words(case: str) -> None:
    vehicle, scenario, options, entries, start = REFUSED[case]
    said = [refusal(ENTRIES[entry], vehicle, scenario, **options) for entry in entries]
    assert said == said[:1] * len(entries)
    assert said[0].startswith(start)
    assert_one_plain_sentence(said[0])


def refusal(act: Entry, *given: Any, **options: Any) -> str:
    """What a call is refused with."""
    with pytest.raises(ca.InputError) as caught:
        act(*given, **options)
    return str(caught.value)


@pytest.mark.parametrize("model", ["stiff", 3, None, True, "Coupled"])
def test_an_unknown_model_is_refused_whichever_way_it_is_named(model: Any) -> None:
    said = [refusal(ENTRIES[name], PAPER, FALL, model=model) for name in ("simulate", "Simulation")]
    said.append(refusal(ca.run_pairs, PAPER, FALL, models=[model]))
    assert said[0] == said[1]
    for text, name in zip(said, ("model", "model", "models"), strict=True):
        assert text.startswith(f"{name} is ") and repr(model) in text and "decoupled" in text
        assert_one_plain_sentence(text)


COARSE: dict[str, tuple[ca.Vehicle, ca.Scenario, float, tuple[str, ...]]] = {
    "arm": (PAPER, FALL, 0.05, ALL),
    "damping": (OVERDAMPED, FALL, 1e-3, ALL),
    "spin": (PAPER, FALL.replace(qd=[0, 0, 0, 0, 0, 400.0, 0, 0]), 1e-3, ALL),
    "one run of two": (
        PAPER.replace({"arm.damping_ratio": [0.0, 5.0]}), FALL, 1e-3, BATCHES,
    ),
    "loop": (PAPER.replace({"arm.damping_ratio": 2.0}), SEEING, 1e-3, BATCHES),
}  # fmt: skip


@pytest.mark.parametrize("case", COARSE)
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
    assert said[0].startswith(f"step is {step:g} s, too coarse")
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
