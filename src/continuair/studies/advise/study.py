"""Advice on a vehicle: which model is accurate enough for a task, up to what frequency or speed.

The vehicle itself is simulated, with the standard excitations and with visual tracking; nothing is
tabulated or fitted. An error is the larger of the tip's RMSE over the arm's length and the RMS
angle between the tips [rad].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from continuair import checks
from continuair.analysis.beam import curvature_error
from continuair.analysis.excited import excited_arm
from continuair.analysis.groups import place
from continuair.controllers.controller import Controller
from continuair.controllers.gain_files import Gains, load_gains
from continuair.flight.simulate import simulate
from continuair.kernels.dynamics import REFERENCE, SIMPLER
from continuair.progress import Progress, Steps
from continuair.scenario.letters import LETTERS
from continuair.scenario.tracking_task import without_rotors
from continuair.studies.advise.excitations import attribute, excite, missed
from continuair.studies.advise.frequencies import LONGEST, hovering
from continuair.studies.advise.notes import notes
from continuair.studies.advise.tracking import tracking_limit, tracking_notes
from continuair.studies.advise.verdicts import TASKS, verdict
from continuair.studies.excited_flights import CYCLES, Loop
from continuair.studies.standard_excitations import PERIODS, standard_scenario
from continuair.studies.standard_loops import bent_growth, hover_loop
from continuair.studies.timing import median_ratios
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

PIXELS = 0.7
"""Tolerated |DS| by default [px]."""

_STEPS, _REPEATS = 20_000, 11


@dataclass(frozen=True)
class Tolerance:
    """Tolerances: of the tip [share of l, rad], and of DS [px]."""

    tip: float = 0.02
    pixels: float = PIXELS

    def __post_init__(self) -> None:
        checks.positive("tolerance", self.tip)
        checks.positive("pixels", self.pixels)


def chosen_tasks(tasks: Sequence[str]) -> list[str]:
    """Return the chosen tasks, by default all, or raise InputError."""
    known = [*TASKS, *(f"track:{letter}" for letter in LETTERS)]
    return checks.choices("task", tasks or [*TASKS, "track:M"], known)


def advise(
    vehicle: Vehicle,
    tasks: Sequence[str] = (),
    tolerance: Tolerance = Tolerance(),
    gains: Gains | None = None,
    *,
    loop: str = "position",
    bandwidth: float | None = None,
    called: str | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Return errors, limits, costs and a verdict for each task, JSON-able; raise InputError.

    loop: one of LOOPS, of the hover during an oscillating load; bandwidth: of its attitude [rad/s],
    by default that of `flight_controller`; called: the vehicle's name in commands, its own by
    default.
    """
    check_has_arms(check_single_vehicle(vehicle))
    controller = hover_loop(vehicle, loop, bandwidth)
    chosen, arm = chosen_tasks(tasks), excited_arm(vehicle)
    names = list(dict.fromkeys(name for task in chosen for name in TASKS.get(task, ())))
    letters = {task: task.split(":")[1] for task in chosen if task not in TASKS}
    steps = Steps(progress, len(names) + bool(names) + len(letters) + 1)
    flown, clamped = Loop(loop, bandwidth), float(arm.frequency) / (2.0 * np.pi)
    excitations = _excitations(vehicle, names, tolerance.tip, flown, steps)
    tracked, law = {}, gains or load_gains("paper")
    wrench, told = without_rotors(vehicle)
    told = [*told, *tracking_notes(vehicle)]
    for task, letter in letters.items():
        steps.begin(task)
        tracked[task] = tracking_limit(wrench, letter, law, SIMPLER, tolerance.pixels)
    steps.begin("cost of a step")
    results: dict[str, Any] = {
        "study": "advise",
        "vehicle": vehicle.describe(),
        "called": called or vehicle.name,
        "loop": {
            "name": loop,
            "controller": None if controller is None else controller.describe(),
            "growth_1_s": _growth(vehicle, controller),
            "drifting_s": LONGEST / clamped if flown.closed and not flown.settles else None,
        },
        "tolerance": tolerance.tip,
        "pixels": tolerance.pixels,
        "length_m": float(arm.length),
        "varied": varied(vehicle),
        "clamped_hz": clamped,
        "hovering_hz": hovering(vehicle),
        "least_settled_hz": CYCLES / PERIODS * clamped,
        "groups": _groups(vehicle, controller),
        "excitations": excitations,
        "tracking": tracked,
        "tracking_notes": told if tracked else [],
        "step_over_coupled": step_cost(vehicle),
        "curvature_error": {} if vehicle.has_arm_list else curvature_error(vehicle),
    }
    found = {task: {m: verdict(results, task, m) for m in SIMPLER} for task in chosen}
    sentence = "; ".join(f"{task}: {of['decoupled']['text']}" for task, of in found.items())
    results |= {"verdicts": found, "verdict": sentence}
    return results | {"notes": notes(results)}


def _groups(vehicle: Vehicle, controller: Controller | None) -> dict[str, float]:
    """The vehicle's groups, and the bandwidth of its attitude over the arm's clamped frequency."""
    found = {name: float(value) for name, value in place(vehicle).items()}
    if controller is not None:
        attitude = controller.settings["attitude_bandwidth"]
        found["bandwidth"] = float(attitude) / float(excited_arm(vehicle).frequency)
    return found


def _growth(vehicle: Vehicle, controller: Controller | None) -> float | None:
    """Return the growth rate [1/s] of a small tilt of the vehicle, its arm held bent.

    The arm is held by a constant moment. The rate is negative for a tilt that decays.
    """
    if controller is None:
        return None
    return bent_growth(vehicle, controller, np.asarray(standard_scenario("release", vehicle).q))


def varied(vehicle: Vehicle) -> str:
    """Return a sentence on the excited arm of a vehicle with [[arm]]; empty for one with [arm]."""
    if not vehicle.has_arm_list:
        return ""
    found = excited_arm(vehicle)
    arm = vehicle.arms[found.index]
    names = ", ".join(section.name for section in arm.section)
    several = len(arm.section) > 1
    text = f"Excited is the arm that carries the camera, {arm.name}"
    text += f", its sections {names} bending alike" if several else ""
    return f"{text}; other arms start straight." if len(vehicle.arms) > 1 else f"{text}."


def _excitations(
    vehicle: Vehicle, names: Sequence[str], tolerance: float, loop: Loop, steps: Steps
) -> dict[str, Any]:
    """Return the findings of each excitation, with the coupling that causes its error."""
    found: dict[str, Any] = {}
    for name in names:
        steps.begin(f"excitation {name}")
        found[name] = excite(vehicle, name, tolerance, loop)
    if names:
        steps.begin("couplings, one at a time")
    for name, part in found.items():
        couplings, error = attribute(vehicle, name, loop), part["models"]["decoupled"]["error"]
        part |= {"couplings": couplings, "responsible": missed(couplings, error)}
    return found


def step_cost(vehicle: Vehicle) -> dict[str, float]:
    """Return the median time of a model's step over that of the coupled one, measured in turns."""
    scenario = standard_scenario("release", vehicle)
    options: dict[str, Any] = {
        "method": "RK4",
        "step": scenario.duration / _STEPS,
        "sample": scenario.duration,
        "variables": ["position"],
    }
    flights: dict[str, Callable[[], object]] = {
        model: partial(simulate, vehicle, scenario, model=model, **options)
        for model in (REFERENCE, *SIMPLER)
    }
    return median_ratios(flights, REFERENCE, _REPEATS)
