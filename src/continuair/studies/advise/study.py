"""Advice on a vehicle: which model is accurate enough for a task, up to what frequency or speed.

The vehicle itself is simulated, with the standard excitations and with visual tracking; nothing is
tabulated or fitted. An error is the larger of the tip's RMSE over the arm's length and the RMS
angle between the tips [rad].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from continuair import checks
from continuair.analysis.beam import curvature_error
from continuair.analysis.excited import excited_arm
from continuair.analysis.groups import place
from continuair.controllers.controller import Controller
from continuair.controllers.gain_files import Gains, load_gains
from continuair.kernels.dynamics import SIMPLER
from continuair.progress import Progress, Steps
from continuair.scenario.letters import LETTERS
from continuair.scenario.tracking_task import without_rotors
from continuair.studies.advise.draws import cautious, draw_all, settle_verdicts
from continuair.studies.advise.excitations import attribute, compile_all, excite, missed
from continuair.studies.advise.frequencies import LONGEST, hovering
from continuair.studies.advise.notes import notes
from continuair.studies.advise.own_law import check_own, own_loop
from continuair.studies.advise.step_cost import step_cost
from continuair.studies.advise.tracking import tracking_limit, tracking_notes
from continuair.studies.advise.verdicts import TASKS, cost_verdict, verdict
from continuair.studies.excited_flights import CYCLES, NO_LOOP, Loop
from continuair.studies.standard_excitations import PERIODS, standard_scenario
from continuair.studies.standard_loops import bent_growth, hover_loop
from continuair.vehicle.uncertain import UncertainVehicle
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

PIXELS = 0.7
"""Tolerated |DS| by default [px]."""

_LIFT_AND_MOMENTS = 4
"""Rank of the wrench of a law that tilts to move."""


Advice: TypeAlias = dict[str, Any]
"""What `advise` returns; plain numbers and texts by name."""


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
    vehicle: Vehicle | UncertainVehicle,
    tasks: Sequence[str] = (),
    tolerance: Tolerance = Tolerance(),
    gains: Gains | None = None,
    *,
    loop: Literal["position", "attitude", "none"] = "position",
    bandwidth: float | None = None,
    controller: Controller | None = None,
    called: str | None = None,
    progress: Progress | None = None,
) -> Advice:
    """Fly a vehicle with each model, and return for which task the simpler ones will do.

    Parameters
    ----------
    vehicle : Vehicle or UncertainVehicle
        One vehicle with an arm. Of an uncertain one the medians are flown as usual, and 256 draws
        at the moderate load.
    tasks : sequence of str, optional
        Of "hover", "fast-flight", "contact" and "track:M" (or R, A, L). Default: these four.
    tolerance : Tolerance, optional
        The errors that are good enough: ``tip``, a share of the arm's length and an angle [rad],
        and ``pixels``. Default: 0.02 and 0.7 px.
    gains : Gains, optional
        For tracking. Default: those of the preset "paper".
    loop : {"position", "attitude", "none"}, default "position"
        The flight controller that holds the hover while a load oscillates.
    bandwidth : float, optional
        Of its attitude [rad/s]. Default: what `flight_controller` gives the vehicle.
    controller : Controller, optional
        A controller of your own. One that looks at a target tracks, in place of `gains`. Another
        holds the hover, in place of `loop`, at the origin of the world or at its set-points.
    called : str, optional
        The vehicle in commands that the advice gives. Default: its name.
    progress : callable, optional
        Called with (done, total, what) before each part.

    Returns
    -------
    dict
        Errors, limits, costs, ``verdicts`` by task and model, and ``verdict``, a sentence; plain
        numbers and texts that JSON can hold. ``cost_verdict`` says that there is no reason to
        decouple where a decoupled step costs what a coupled one does; it is empty elsewhere, and
        `verdict` begins with it. Of an uncertain vehicle also ``draws``: errors at the moderate
        load, and in each verdict ``agree``, the share of the draws that agree with the answer that
        most of them give; *cannot tell* where it is below 0.95.

    Raises
    ------
    InputError
        If an argument cannot be used, such as a controller that does not hold the hover.

    Notes
    -----
    Your controller acts every 1 ms unless it has a period. Constant bend moments hold the bent arm
    against a load, less what the controller itself asks of the arm at the start. How fast its
    slowest motion is, is known only of a `flight_controller`: of others no frequency is tried below
    0.05 of the arm's clamped one, and whether errors settle is told by flights of twice the length.
    """
    uncertain = vehicle if isinstance(vehicle, UncertainVehicle) else None
    if isinstance(vehicle, UncertainVehicle):
        vehicle = vehicle.vehicle
    check_has_arms(check_single_vehicle(vehicle, strain=True))
    chosen, arm = chosen_tasks(tasks), excited_arm(vehicle)
    check_own(controller, chosen, loop, bandwidth, gains)
    holds = controller is not None and not controller.looks
    held = controller if holds else hover_loop(vehicle, loop, bandwidth)
    names = list(dict.fromkeys(name for task in chosen for name in TASKS.get(task, ())))
    letters = {task: task.split(":")[1] for task in chosen if task not in TASKS}
    parts = len(names) + bool(names) + len(letters) + 1 + (uncertain is not None)
    steps = Steps(progress, parts)
    flown = own_loop(vehicle, controller) if controller and holds else Loop(loop, bandwidth)
    clamped = float(arm.frequency) / (2.0 * np.pi)
    excitations = _excitations(vehicle, names, tolerance.tip, flown, steps)
    tracked = {}
    law = controller if controller and not holds else gains or load_gains("paper")
    # A law that pushes in any direction flies without rotors that cannot.
    any_way = not isinstance(law, Controller) or (law.asks or 0) > _LIFT_AND_MOMENTS
    wrench, told = without_rotors(vehicle) if any_way else (vehicle, [])
    told = [*told, *tracking_notes(vehicle)]
    for task, letter in letters.items():
        steps.begin(task)
        tracked[task] = tracking_limit(wrench, letter, law, SIMPLER, tolerance.pixels)
    steps.begin("cost of a step")
    cost = step_cost(vehicle, flown if names else NO_LOOP)
    results: dict[str, Any] = {
        "study": "advise",
        "vehicle": vehicle.describe(),
        "called": called or vehicle.name,
        "loop": {
            "name": flown.name,
            "controller": None if held is None else held.describe(),
            "growth_1_s": None if holds else _growth(vehicle, held),
            "drifting_s": LONGEST / clamped if flown.closed and not flown.settles else None,
        },
        "tolerance": tolerance.tip,
        "pixels": tolerance.pixels,
        "length_m": float(arm.length),
        "varied": varied(vehicle),
        "clamped_hz": clamped,
        "hovering_hz": hovering(vehicle),
        "least_settled_hz": CYCLES / PERIODS * clamped,
        "groups": _groups(vehicle, held),
        "excitations": excitations,
        "tracking": tracked,
        "tracking_notes": told if tracked else [],
        "step_over_coupled": cost,
        "curvature_error": curvature_error(vehicle) if vehicle.is_one_arc else {},
    }
    judged = results
    if uncertain is not None:
        steps.begin("drawn vehicles")
        loop_of_medians = replace(flown, held=held)
        draws = draw_all(uncertain, loop_of_medians, tolerance.tip, excitations)
        results |= {"draws": draws, "model_error_m": uncertain.model_error}
        judged = results | {"excitations": cautious(excitations, draws)}
    found = {task: {m: verdict(judged, task, m) for m in SIMPLER} for task in chosen}
    if uncertain is not None:
        settle_verdicts(found, results["draws"])
    sentence = "; ".join(f"{task}: {of['decoupled']['text']}" for task, of in found.items())
    first = cost_verdict(cost)
    results |= {"cost_verdict": first, "verdicts": found}
    results |= {"verdict": f"{first} {sentence}" if first else sentence}
    return results | {"notes": notes(results)}


def _groups(vehicle: Vehicle, controller: Controller | None) -> dict[str, float]:
    """The vehicle's groups, and the bandwidth of its attitude over the arm's clamped frequency."""
    found = {name: float(value) for name, value in place(vehicle).items()}
    if controller is not None and "attitude_bandwidth" in controller.settings:
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
    if vehicle.is_one_arc:
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
    if names:
        compile_all(vehicle, loop)
    for name in names:
        steps.begin(f"excitation {name}")
        found[name] = excite(vehicle, name, tolerance, loop)
    if names:
        steps.begin("couplings, one at a time")
    for name, part in found.items():
        couplings, error = attribute(vehicle, name, loop), part["models"]["decoupled"]["error"]
        part |= {"couplings": couplings, "responsible": missed(couplings, error)}
    return found
