"""Notes to the advice: its origin and its limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from continuair.analysis.decoupling_rule import allowed, beyond
from continuair.controllers.margins import STEADY
from continuair.kernels.dynamics import SIMPLER
from continuair.studies.atlas.controlled import CONTROLLED_RANGES
from continuair.studies.atlas.flights import RANGES
from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, load
from continuair.studies.standard_excitations import EXCITATIONS
from continuair.studies.standard_loops import OWN
from continuair.studies.tables import number, number_below

_FURTHER = 1.5
"""Ratio of limits from which a note reports them."""

_UNEQUAL = 0.1
"""Relative difference of the inertia in roll and pitch from which a note reports it."""

_GROUPS = ("mass_ratio", "inertia_ratio", "gravity_number", "slenderness", "damping_ratio")


def notes(results: dict[str, Any]) -> list[str]:
    """Return sentences about verdicts, loop, settling and the atlas."""
    return [
        *_better(results),
        *(note for task in results["verdicts"] for note in _alone(results, task)),
        *_unstable(results),
        *_unsettled(results),
        *_from(results),
        *_slower(results),
        *_lost(results),
        *_one_plane(results),
        *_outside(results),
        *_ruled(results),
        *results["tracking_notes"],
        *_of_the_arm(results),
    ]


def _of_the_arm(results: dict[str, Any]) -> list[str]:
    """Return notes on the error of an uncertain vehicle's own arm, beside that of decoupling."""
    found = []
    if "draws" in results and results["tracking"]:
        found.append("Tracking is that of the medians: drawn vehicles do not fly it.")
    error = results.get("model_error_m")
    if error is not None and results["excitations"]:
        adds = {
            name: part["models"]["decoupled"]["error"] * results["length_m"]
            for name, part in results["excitations"].items()
        }
        told = ", ".join(f"{1e3 * each:.2g} mm ({name})" for name, each in adds.items())
        found.append(
            f"The model of the arm errs by {1e3 * error:.2g} mm, which its fit left over; at the "
            f"moderate load decoupling adds up to {told}."
        )
    return found


def _better(results: dict[str, Any]) -> list[str]:
    """Return a note where the model without any coupling to the UAV beats the decoupled one."""
    found = []
    for task, of in results["verdicts"].items():
        limits = [of[model]["limit"] for model in ("independent", "decoupled")]
        held = set(of["decoupled"].get("except", ())) - set(of["independent"].get("except", ()))
        start = f"{task}: independent does better than decoupled"
        if _printed(limits[0]) > _printed(limits[1]):
            told = f"it {_up_to(limits[0])}, decoupled {_up_to(limits[1])}"
            found.append(f"{start}: {told} [{of['decoupled']['unit']}].")
        elif held and _printed(limits[0]) == _printed(limits[1]):
            found.append(f"{start}: it holds in {' and '.join(sorted(held))}, too.")
    return found


def _printed(limit: float) -> float:
    """Format a limit."""
    return float(number_below(limit)) if math.isfinite(limit) else _rank(limit)


def _alone(results: dict[str, Any], task: str) -> list[str]:
    """Return a note where one excitation sets the limit, and the others would allow much more."""
    limits = results["verdicts"][task]["decoupled"].get("limits", {})
    if not limits:
        return []
    worst = min(limits, key=lambda name: _rank(limits[name]))
    others = {name: limit for name, limit in limits.items() if name != worst}
    if not others:
        return [f"{task}: {EXCITATIONS[worst].meaning}, and nothing else."]
    if math.isinf(limits[worst]) or _rank(min(others.values(), key=_rank)) < _FURTHER * max(
        _rank(limits[worst]), 0.0
    ):
        return []
    told = " and ".join(f"{name} {_up_to(limit)}" for name, limit in others.items())
    return [f"{task}: the limit is that of {worst} alone; {told} [Hz]."]


def _rank(limit: float) -> float:
    return -1.0 if math.isnan(limit) else limit


def _up_to(limit: float) -> str:
    if math.isnan(limit):
        return "allows nothing tried"
    if math.isinf(limit):
        return "allows all tried"
    return f"allows {number_below(limit)}"


def _unstable(results: dict[str, Any]) -> list[str]:
    """Return a note where a loop that is stable with the arm at rest is unstable with it bent."""
    growth = results["loop"]["growth_1_s"]
    oscillating = any(
        "hz" in of for part in results["excitations"].values() for of in part["models"].values()
    )
    if growth is None or growth <= STEADY or not oscillating:
        return []
    return [
        "With the arm bent by a constant moment the loop is unstable: a small tilt grows by "
        f"{number(growth, 2)} 1/s, which affects limits of oscillating loads. Give a stiffer arm, "
        "or a servo for the arm (flight_controller)."
    ]


def _unsettled(results: dict[str, Any]) -> list[str]:
    """Return a note on errors that do not rest on settled cycles."""
    if not results["excitations"]:
        return []
    if results["loop"]["name"] == "none":
        least = results["least_settled_hz"]
        return [
            "Without a loop nothing settles: flights last ten periods of the clamped arm, which "
            f"are fewer than three cycles below {number(least, 2)} Hz."
        ]
    if (drifting := results["loop"]["drifting_s"]) is not None:
        return [
            "This loop does not hold the position, so that the models drift apart sideways. "
            f"Errors and limits are those of flights of {number(drifting, 2)} s, at every "
            "frequency, and smaller in shorter ones."
        ]
    found = []
    for name, part in results["excitations"].items():
        for model in SIMPLER:
            entry = part["models"][model]
            at = {"": "half the clamped frequency", "limit_": "the limit"}
            longer = [
                f"{_error(entry[f'{key}longer_error'])} at {where}"
                for key, where in at.items()
                if entry.get(f"{key}settled") is False
            ]
            if longer:
                found.append(
                    f"{name}, {model}: the error has not settled: in a flight longer by the "
                    f"loop's settling time it is {' and '.join(longer)}."
                )
    return found


def _error(value: float) -> str:
    return number(value, 2) if math.isfinite(value) else "undefined, as the flight stops early,"


def _from(results: dict[str, Any]) -> list[str]:
    """Return a note on the lowest frequency tried."""
    if not (tried := _tried(results)):
        return []
    begins = max(min(hz) for hz in tried)
    return [f"Oscillating loads were tried from {number(begins, 2)} Hz on, none slower."]


def _slower(results: dict[str, Any]) -> list[str]:
    """Return a note where the arm swings under gravity faster than any frequency tried."""
    ends = min((max(hz) for hz in _tried(results)), default=np.inf)
    swing = min(results["hovering_hz"], default=0.0)
    if swing <= ends:
        return []
    return [
        f"The hovering vehicle swings at {number(swing, 2)} Hz, above the highest frequency tried, "
        f"{number_below(ends)} Hz; the verdicts do not extend beyond it."
    ]


def _tried(results: dict[str, Any]) -> list[list[float]]:
    """Return the frequencies [Hz] tried of each oscillating excitation and model."""
    parts = results["excitations"].values()
    return [of["hz"] for part in parts for of in part["models"].values() if "hz" in of]


def _lost(results: dict[str, Any]) -> list[str]:
    """Return a note on flights that ended early, and on errors that are therefore missing."""
    found = []
    for name, part in results["excitations"].items():
        for model, of in part["models"].items():
            errors = np.asarray(of.get("errors", ()), float)
            for whose, lost, so in (
                ("the coupled model", np.isnan(errors), "so that errors are undefined"),
                (model, np.isinf(errors), "which counts as beyond every tolerance"),
            ):
                if lost.any():
                    hz = np.asarray(of["hz"])[lost]
                    span = " to ".join(dict.fromkeys(number(each, 2) for each in (hz[0], hz[-1])))
                    found.append(
                        f"{name}: flights of {whose} ended early at {lost.sum()} of {len(lost)} "
                        f"frequencies tried for {model} ({span} Hz), {so}; curves have a gap "
                        "there."
                    )
    return found


def _one_plane(results: dict[str, Any]) -> list[str]:
    """Return a note that loads act along x only, if the inertias about x and y differ."""
    roll, pitch, _ = np.diagonal(results["vehicle"]["uav"]["inertia"])
    if not results["excitations"] or not _are_unequal(roll, pitch):
        return []
    return [
        f"Loads act along x and about y alone, where the UAV's inertia is {number(pitch, 2)} "
        f"kg m², and {number(roll, 2)} about x; rotate the vehicle by 90° about z to test the "
        "other direction."
    ]


def _are_unequal(roll: float, pitch: float) -> bool:
    return bool(abs(roll / pitch - 1.0) > _UNEQUAL)


def _outside(results: dict[str, Any]) -> list[str]:
    """Return notes on properties of a vehicle with [arm], and of its flights, outside the atlas."""
    vehicle = results["vehicle"]
    if not isinstance(vehicle["arm"], dict):
        return []
    found = [
        f"{name.replace('_', ' ')} {number(value, 2)} ({low:g} to {high:g} there)"
        for name, value, (low, high) in _beyond(results)
    ]
    uav, arm = vehicle["uav"], vehicle["arm"]
    roll, pitch, _ = np.diagonal(uav["inertia"])
    found += ["disks"] * bool(arm.get("disks"))
    found += ["a mount off the centre"] * any(uav["mount"])
    found += ["rotors"] * bool(uav.get("rotors"))
    found += ["drag"] * bool(uav.get("drag") or arm.get("drag_coefficient"))
    found += [f"the term {each['term']}" for each in vehicle.get("terms", ())]
    found += ["unequal inertia in roll and pitch"] * _are_unequal(roll, pitch)
    loop = results["loop"]["name"]
    own = f"the controller {results['loop']['controller']['name']}" if loop == OWN else ""
    outside = own or f"the loop {loop}" * (loop == "attitude")
    found += [outside] * bool(outside and results["excitations"])
    return [f"Outside the atlas of other flights: {', '.join(found)}."] if found else []


def _beyond(results: dict[str, Any]) -> list[tuple[str, float, tuple[float, float]]]:
    """Groups of the vehicle beyond the ranges that the atlas holds, of its loop or of none."""
    controlled = results["loop"]["name"] == "position"
    ranges, groups = CONTROLLED_RANGES if controlled else RANGES, results["groups"]
    found = [
        (name, groups[name], ranges[name])
        for name in (*_GROUPS, "bandwidth")
        if name in ranges and name in groups  # an arm by its stiffness has no slenderness
        if not ranges[name][0] <= groups[name] <= ranges[name][1]
    ]
    if controlled:
        told = {name for name, *_ in found}
        rule = load(shipped=CONTROLLED_SUMMARY)
        found += [each for each in beyond(rule, groups) if each[0] not in told]
    return found


def _ruled(results: dict[str, Any]) -> list[str]:
    """Return what the atlas's rule of controlled vehicles predicts, where it holds."""
    plain = isinstance(results["vehicle"]["arm"], dict)
    if results["loop"]["name"] != "position" or not plain or _beyond(results):
        return []
    summary = load(shipped=CONTROLLED_SUMMARY)
    if not summary["accepted"].min() <= results["tolerance"] <= summary["accepted"].max():
        return []
    groups = {name: np.array([value]) for name, value in results["groups"].items()}
    limits = allowed(summary, "position", groups, results["tolerance"])[:, 0]
    told = [
        f"{name} {_ruled_limit(limit * results['clamped_hz'])}"
        for name, limit in zip(summary["excitation"].to_numpy(), limits, strict=True)
        if name in results["excitations"]
    ]
    start = "The atlas's rule, fitted to other vehicles in this loop, allows"
    return [f"{start} {', '.join(told)}; the simulations above take precedence."] if told else []


def _ruled_limit(hertz: float) -> str:
    if math.isnan(hertz):
        return "nothing"
    return "all tried" if math.isinf(hertz) else f"{number_below(hertz)} Hz"
