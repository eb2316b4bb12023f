"""Time of one sample of control and dynamics with each model, by part."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, cast

import numpy as np

from amiri2026.probes import carry, look
from continuair import MODELS, Controller, Gains, Scenario, Target, Vehicle, load_gains, paths
from continuair.errors import InputError, shown
from continuair.kernels import PLANTS, STATUS
from continuair.progress import Progress, Steps
from continuair.scenario import SETTINGS, damping_notes, equipped, task
from continuair.studies import as_markdown, flight_alone, median_times, number
from continuair.sweeps import machine
from continuair.typing import Model
from continuair.vehicle import check_one_section, is_paper

PRINTED_MS = {"coupled": 32.0, "decoupled": 22.0}
"""Time per sampling instant that Amiri et al. print, of Simulink's profiler [ms]."""

PERIOD, DURATION, REPEATS = 1e-3, 5.0, 25
"""Control period and length of the flight that is timed [s], and how often."""

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
    """Return the median time per sample [s] of each model: dynamics, camera, control, total.

    It is measured on one thread. A sample is one RK4 step of 1 ms and one control update, in runs
    of 5 s that log nothing between. dynamics includes the compensation of the weight, which the law
    needs too; camera adds the image of the target; control adds the law. The runs alternate, so
    that noise of the machine affects all alike. Raises InputError.
    """
    check_one_section(vehicle)
    flown, plants = equipped(vehicle, SETTINGS["nominal"]), list(models)
    scenarios = _scenarios(flown, (gains or load_gains("paper")).controller(flown))
    flights = {
        (model, part): _flight(flown, scenario, cast(Model, model))
        for model in plants
        for part, scenario in scenarios.items()
    }
    steps = Steps(progress, (REPEATS + 1) * len(flights))
    times = median_times(flights, REPEATS, lambda key: steps.begin(" ".join(key)))
    return {
        "study": "cost",
        "vehicle": vehicle.describe(),
        "notes": damping_notes(vehicle),
        "printed_ms": PRINTED_MS if is_paper(vehicle) else {},
        "machine": machine(),
        "dtype": "float64",
        "models": {model: _split(model, times) for model in plants},
    }


def _scenarios(vehicle: Vehicle, law: Controller) -> dict[str, Scenario]:
    """Return the scenarios of the dynamics, of those with the camera, and of all together."""
    letter = task(vehicle, ["M"], law, 50.0)
    # Straight and at rest every model stays in place with its weight carried, and in view.
    straight = np.where(np.arange(8) == 6, 0.0, letter.q)
    still = [Target(paths.hold(letter.targets[0].path([0.0])[0][0], DURATION))]
    rest = letter.replace(q=straight, target=still, duration=DURATION)
    return {
        "dynamics": rest.replace(controller=CARRY, target=None),
        "camera": rest.replace(controller=LOOK),
        "total": letter.replace(duration=DURATION),
    }


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, those of the paper's vehicle beside the printed ones."""
    parts, printed = ("dynamics", "camera", "control", "total"), results["printed_ms"]
    cells = [
        [model, *(number(1e6 * entry[f"{part}_s"], 3) for part in parts)]
        + [number(printed.get(model))] * bool(printed)
        for model, entry in results["models"].items()
    ]
    headings = ["model", *(f"{part} [µs]" for part in parts)] + ["paper [ms]"] * bool(printed)
    beside = "; the paper's are of Simulink" if printed else ""
    lines = [
        f"# Cost of a sample of control and dynamics, vehicle {results['vehicle']['name']}",
        "",
        f"One thread, float64, RK4 at 1 ms, medians of one run{beside}.",
        f"Machine: {results['machine']}.",
        *results["notes"],
        "",
        *as_markdown(headings, cells, ("model",)),
    ]
    ours = ratio(results["models"])
    if ours is not None:
        paper = f", {ratio_printed():.2f} in the paper" if printed else ""
        lines += [
            "",
            f"Decoupled over coupled: {ours:.2f} here{paper}. Decoupling "
            "can save dynamics alone: camera and control are the same code with every model, and "
            "what differs there is how steadily this machine runs.",
        ]
    return "\n".join(lines) + "\n"


def ratio(models: dict[str, Any]) -> float | None:
    """Return the time of the decoupled over the coupled model as measured; None without both."""
    if not set(PLANTS) <= set(models):
        return None
    return float(models["decoupled"]["total_s"] / models["coupled"]["total_s"])


def ratio_printed() -> float:
    """Return the time of the decoupled over the coupled model that the paper prints."""
    return PRINTED_MS["decoupled"] / PRINTED_MS["coupled"]


def _flight(vehicle: Vehicle, scenario: Scenario, model: Model) -> Callable[[], None]:
    alone = flight_alone(vehicle, scenario, model, step=PERIOD)

    def fly() -> None:
        status = alone()
        if status.any():
            raise InputError(
                "vehicle",
                (
                    f"{shown(vehicle.name)} fails within {DURATION:g} s at steps of "
                    f"{1e3 * PERIOD:g} ms ({model} model: {STATUS[status.max()]})"
                ),
                "give a vehicle that these gains stabilise",
            )

    return fly


def _split(model: str, times: dict[tuple[str, str], float]) -> dict[str, float]:
    """Return the time per sample of each part [s], from times of runs with more and more parts."""
    samples = DURATION / PERIOD
    parts = ("dynamics", "camera", "total")
    dynamics, camera, total = (times[model, part] / samples for part in parts)
    return {
        "dynamics_s": dynamics,
        "camera_s": camera - dynamics,
        "control_s": total - camera,
        "total_s": total,
    }
