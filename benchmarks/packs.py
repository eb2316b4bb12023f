"""Kernels of packs against kernels of single runs: time per run and step, and to compile.

    python benchmarks/packs.py [--quick] [--out packs.json]
    python benchmarks/packs.py --sections

The second command compares arms in packs: time per evaluation of the accelerations, over that of an
arc and, with tendons, over that of the same arm without.

Only launches of the roll-outs are timed, everything already where they read it, all kernels of a
case in turn, and the medians of REPEATS told; ratios hold on a machine that does other work, too.
Runs differ in mass and start, and log every ten steps.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Any

import numpy as np
import warp as wp
from machine import described_machine

import continuair as ca
from continuair.device.numbers import LANES, NARROW
from continuair.engine.engine import Drive, Engine, Start
from continuair.engine.factory import Closing, closed_loop, packed_loop
from continuair.engine.lanes import packs_of
from continuair.engine.law_made import made_law
from continuair.engine.loop import PackedLoop
from continuair.flight.cohorts import Cohort
from continuair.flight.prepare import prepare
from continuair.flight.time_grid import grid_of, marks_of
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, PAPER, TENDONS, TIP

STEP, STEPS, RUNS, REPEATS = 1e-4, 1000, 16, 15


@dataclass(frozen=True)
class Case:
    """A vehicle flown with a model and a precision, in open loop with groups of inputs, or not.

    push: all inputs but the force, in their SI units; runs must not bend so far that they stop.
    """

    name: str
    vehicle: ca.Vehicle
    model: str = "coupled"
    precision: str = "float64"
    groups: int = GENERAL
    closed: bool = False
    push: float = 0.1


def cases(quick: bool) -> Iterator[Case]:
    paper = batch(ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.03}))
    for precision in ("float64", "float32"):
        for model in ("coupled", "decoupled", "independent"):
            yield Case(model, paper, model, precision)
    if quick:
        return
    yield Case("coupled, Euler and polar torques, tip wrench", paper, groups=GENERAL + PAPER + TIP)
    two = batch(ca.load_vehicle("two_section"))
    yield Case("two sections, coupled", two)
    yield Case("two sections, decoupled", two, "decoupled")
    yield Case("closed loop at 1 kHz", paper, closed=True)
    yield Case("closed loop at 1 kHz", paper, precision="float32", closed=True)


def arms() -> dict[str, tuple[Case, str]]:
    """Arms in packs, and the name of the arm that each is compared with."""
    linear = {"strain": {"bending": 1}, "nodes": 6}
    twisted = {"strain": {"bending": 1, "twist": 1}, "nodes": 8, "poisson_ratio": 0.25}
    tendons = {"tendon": [{"angles": [0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi], "offset": 0.01}]}
    given: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
        "arc": ("arc", {}, {}),
        "linear bending, 6 nodes": ("arc", linear, {}),
        "linear bending and twist, 8 nodes": ("arc", twisted, {}),
        "arc, four parallel tendons": ("arc", {}, tendons),
        "linear bending, four parallel tendons": ("linear bending, 6 nodes", linear, tendons),
    }
    return {
        name: (
            Case(
                name,
                batch(one_arm(section, others)),
                groups=GENERAL + TENDONS * bool(others),
                push=0.01,
            ),
            beside,
        )
        for name, (beside, section, others) in given.items()
    }


def one_arm(section: dict[str, Any], others: dict[str, Any]) -> ca.Vehicle:
    """A vehicle with an arm of one section; others: fields of the arm."""
    rod = {"length": 0.5, "radius": 0.006, "density": 1500.0, "youngs_modulus": 5e7}
    uav = {"mass": 1.5, "inertia": [0.02, 0.03, 0.04]}
    arm = {"mount": [0.0, 0.0, -0.05], "section": [rod | section], **others}
    return ca.Vehicle(name="one arm", uav=uav, arm=[arm])


def batch(vehicle: ca.Vehicle) -> ca.Vehicle:
    return vehicle.replace({"uav.mass": np.linspace(1.0, 3.0, RUNS)})


def open_loop(case: Case) -> tuple[Engine, Start, Any, Drive]:
    """Slightly bent, turning slowly, and held up against gravity: all terms are at work."""
    engine = Engine(case.vehicle, case.model, case.precision)
    layout = engine.layout
    q, qd = np.zeros((2, RUNS, 6 + layout.bends))
    q[:, 2], q[:, 6::2] = 5.0, np.linspace(0.05, 0.5, RUNS)[:, None]
    qd[:, 3:6] = 0.1
    table = np.full((1, RUNS, layout.inputs), case.push)
    table[..., layout.force] = 0.0, 0.0, 9.81 * 2.0
    start = Start(state_from_paper(q, qd, layout), branches_of(q, layout))
    grid = grid_of(marks_of(STEPS * STEP, 10 * STEP), STEP)
    return engine, start, grid, Drive(table, False, case.groups, 9.81)


def servoing(case: Case) -> tuple[Engine, Cohort]:
    """Under the paper's law, which acts and has a frame every ten steps."""
    law = ca.servoing(**ca.design(case.vehicle.select(RUNS // 2), 2.0))
    scenario = ca.Scenario(
        "servoing",
        (0.1, 0, 3.1, 0, 0, 0, 0.1, 0),
        duration=STEPS * STEP,
        controller=law,
        control_period=10 * STEP,
        target=ca.Target(ca.paths.circle(radius=0.2, period=10.0)),
    )
    flight = prepare(case.vehicle, scenario, step=STEP, sample=10 * STEP, threads=1)
    (cohort,) = flight.cohorts()
    return flight.engine(case.model, case.precision), cohort


def launches(case: Case, lanes: int) -> Callable[[], None]:
    """A call that flies all runs of a case with packs of so many, or one by one."""
    if case.closed:
        engine, cohort = servoing(case)
        start, grid, drive = cohort.start, cohort.grid, cohort.drive
        closed = packed(cohort.loop, engine, lanes)
        rollout, loop = closed.kernels.rollout, closed.struct(engine, cohort.runs)
    else:
        engine, start, grid, drive = open_loop(case)
        rollout, loop = engine.kernels_of(lanes).rollout, engine.no_loop()
    everything = slice(None)
    log = np.zeros((RUNS, len(grid.samples), engine.layout.log))
    status, last = (engine.upload(np.zeros(RUNS), wp.int32) for _ in range(2))
    arguments = [
        *(engine.vehicles(everything, engine.kernels_of(lanes)), engine.start(start, everything)),
        *(engine.drive(drive, everything, 3), engine.steps(grid), loop),
        *(engine.upload(log), status, last, engine.upload(np.zeros((RUNS, 1)))),
    ]

    def fly() -> None:
        engine.launch(rollout, packs_of(RUNS, lanes), arguments)
        assert not status.numpy().any()

    return fly


def packed(loop: Any, engine: Engine, lanes: int) -> PackedLoop:
    """A loop packed for an engine, with kernels of so many lanes."""
    of = loop.controller.law, engine.dtype.name, engine.tree, loop.points, lanes
    law, how = made_law(*of), Closing(loop.timing.every_stage)
    found = loop.on(engine, 1)
    made = closed_loop if lanes == 1 else packed_loop
    kernels = made(law, engine.model, how)
    assert kernels is not None
    return PackedLoop(loop, kernels, found.cameras, found.gains)


def measured(case: Case) -> dict[str, Any]:
    """Microseconds per run and step, by lanes; seconds of the first launch, which may compile."""
    lanes = 1, NARROW[case.precision], LANES[case.precision]
    calls = [launches(case, each) for each in lanes]
    first = []
    for call in calls:
        begun = perf_counter()
        call()
        first.append(perf_counter() - begun)
    microseconds = np.array([per_step(times) for times in timed(calls)])
    return {
        "case": case.name,
        "precision": case.precision,
        "lanes": lanes,
        "us_per_run_and_step": microseconds.round(4).tolist(),
        "faster": (microseconds[0] / microseconds).round(2).tolist(),
        "first_launch_s": np.round(first, 2).tolist(),
    }


def timed(calls: list[Callable[[], None]]) -> np.ndarray:
    """Seconds of the processor of each call (calls, REPEATS), all calls in turn."""
    for call in calls:
        call()
    times = np.empty((len(calls), REPEATS))
    for repeat in range(REPEATS):
        for row, call in zip(times, calls, strict=True):
            begun = thread_time()
            call()
            row[repeat] = thread_time() - begun
    return times


def per_step(times: np.ndarray) -> float:
    """Microseconds per run and step, the median."""
    return 1e6 * float(np.median(times)) / RUNS / STEPS


def compared() -> Iterator[dict[str, Any]]:
    """Microseconds per run and evaluation of the accelerations, four of them per step."""
    found = arms()
    calls = {name: launches(case, LANES[case.precision]) for name, (case, _) in found.items()}
    times = dict(zip(calls, timed(list(calls.values())), strict=True))
    for name, (_, beside) in found.items():
        yield {
            "arm": name,
            "us_per_run_and_evaluation": round(per_step(times[name]) / 4, 4),
            "over": beside,
            "ratio": round(float(np.median(times[name] / times[beside])), 2),
        }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true", help="open loops of one section only")
    parser.add_argument("--sections", action="store_true", help="kinds of sections, and tendons")
    parser.add_argument("--out", help="a JSON file to write as well")
    arguments = parser.parse_args()
    rows = []
    found = compared() if arguments.sections else map(measured, cases(arguments.quick))
    for row in found:
        rows.append(row)
        print(json.dumps(rows[-1]), flush=True)
    if arguments.out:
        with open(arguments.out, "w", encoding="utf-8") as stream:
            json.dump({"machine": described_machine(), "cases": rows}, stream, indent=1)


if __name__ == "__main__":
    main()
