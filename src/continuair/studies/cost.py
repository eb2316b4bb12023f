"""What one sample of control and dynamics costs with each model, and where the time goes."""

from __future__ import annotations

import dataclasses
import platform
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any

import numpy as np

from continuair.controllers.controller import Controller
from continuair.controllers.gain_files import Gains, load_gains
from continuair.flight.prepare import prepare
from continuair.kernels.dynamics import MODELS
from continuair.kernels.laws.probes import carry, look
from continuair.scenario import paths
from continuair.scenario.scenarios import Scenario
from continuair.scenario.targets import Target
from continuair.studies.tracking.task import SETTINGS, equipped, task
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

PRINTED_MS = {"coupled": 32.0, "decoupled": 22.0}
"""Time per sampling instant that Amiri et al. print, of Simulink's profiler [ms]."""

PERIOD, DURATION, REPEATS = 1e-3, 5.0, 25
"""Control period and length of the flight that is timed [s], and how often."""

Progress = Callable[[int, int, str], None]


CARRY = Controller("carry the weight", carry, {"nothing": 0.0}, looks=False)
"""Carries the weight and sees nothing."""

LOOK = Controller("look", look, {"nothing": 0.0})
"""Carries the weight and has the camera's image, which it does not use."""


def cost(
    vehicle: Vehicle,
    gains: Gains | None = None,
    models: Iterable[str] = MODELS,
    *,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Median time per sample [s] of each model, one thread: dynamics, camera, control, total.

    A sample is one RK4 step of 1 ms and one control instant, in roll-outs of 5 s that log nothing
    between. dynamics flies with the weight carried, which the law needs too; camera adds the image
    of the target; control adds the law. The flights alternate, so that noise of the machine hits
    all alike. Raises InputError.
    """
    check_single_vehicle(vehicle)
    flown = equipped(vehicle, SETTINGS["nominal"])
    law = (gains or load_gains("paper")).controller(flown)
    letter = task(flown, ["M"], law, 50.0)
    # Straight and at rest every model stays in place with its weight carried, and in view.
    straight = np.where(np.arange(8) == 6, 0.0, letter.q)
    still = [Target(paths.hold(letter.targets[0].path([0.0])[0][0], DURATION))]
    rest = dataclasses.replace(letter, q=straight, target=still, duration=DURATION)
    scenarios = {
        "dynamics": dataclasses.replace(rest, controller=CARRY, target=None),
        "camera": dataclasses.replace(rest, controller=LOOK),
        "total": letter,
    }
    flights: dict[tuple[str, str], Callable[[], None]] = {}
    plants = list(models)
    for model in plants:
        for part, scenario in scenarios.items():
            flights[model, part] = _flight(flown, scenario, model)
    times: dict[tuple[str, str], list[float]] = {key: [] for key in flights}
    for repeat in range(REPEATS + 1):
        for done, (key, fly) in enumerate(flights.items()):
            if progress:
                progress(repeat * len(flights) + done, (REPEATS + 1) * len(flights), " ".join(key))
            start = perf_counter()
            fly()
            # The first round compiles.
            if repeat:
                times[key].append((perf_counter() - start) / (DURATION / PERIOD))
    medians = {key: float(np.median(values)) for key, values in times.items()}
    return {
        "study": "cost",
        "vehicle": vehicle.describe(),
        "printed_ms": PRINTED_MS,
        "machine": f"{platform.machine()}, {platform.system()}, {_processor()}",
        "dtype": "float64",
        "models": {model: _split(model, medians) for model in plants},
    }


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, beside what the paper prints."""
    lines = [
        f"# Cost of a sample of control and dynamics, vehicle {results['vehicle']['name']}",
        "",
        "One thread, float64, RK4 at 1 ms, medians of one run; the paper's are of Simulink.",
        f"Machine: {results['machine']}.",
        "",
        "| model | dynamics [µs] | camera [µs] | control [µs] | total [µs] | paper [ms] |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for model, entry in results["models"].items():
        printed = results["printed_ms"].get(model)
        cells = " | ".join(
            f"{1e6 * entry[f'{part}_s']:.2f}" for part in ("dynamics", "camera", "control", "total")
        )
        lines.append(f"| {model} | {cells} | {'' if printed is None else f'{printed:g}'} |")
    ratio = ratios(results)
    if ratio:
        lines += [
            "",
            f"Decoupled over coupled: {ratio[0]:.2f} here, {ratio[1]:.2f} in the paper. What "
            "decoupling saves is dynamics; camera and control cost the same with every model.",
        ]
    return "\n".join(lines) + "\n"


def ratios(results: dict[str, Any]) -> tuple[float, float] | None:
    """Time of the decoupled over the coupled model, ours and as printed; None without both."""
    models, printed = results["models"], results["printed_ms"]
    if not {"coupled", "decoupled"} <= set(models):
        return None
    ours = models["decoupled"]["total_s"] / models["coupled"]["total_s"]
    return ours, printed["decoupled"] / printed["coupled"]


def _flight(vehicle: Vehicle, scenario: Scenario, model: str) -> Callable[[], None]:
    """A roll-out alone: everything that can be prepared is."""
    flight = prepare(vehicle, scenario, step=PERIOD, sample=DURATION, duration=DURATION, threads=1)
    engine, cohort = flight.engine(model), next(flight.cohorts())

    def fly() -> None:
        logs = cohort.fly(engine, observe=False)
        assert not logs.status.any(), "a flight that ends early cannot be timed"

    return fly


def _split(model: str, medians: dict[tuple[str, str], float]) -> dict[str, float]:
    dynamics, camera, total = (medians[model, part] for part in ("dynamics", "camera", "total"))
    return {
        "dynamics_s": dynamics,
        "camera_s": camera - dynamics,
        "control_s": total - camera,
        "total_s": total,
    }


def _processor() -> str:
    """The processor's name where the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as info:
            for line in info:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or "processor unknown"
