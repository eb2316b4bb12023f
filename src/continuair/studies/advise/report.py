"""The advice as a table in Markdown."""

from __future__ import annotations

import math
from typing import Any

from continuair.kernels.dynamics import COUPLINGS
from continuair.studies.standard_loops import OWN
from continuair.studies.tables import as_markdown, number, number_below


def as_table(results: dict[str, Any]) -> str:
    """Return verdicts, errors, couplings and costs."""
    lines = [
        f"# May I decouple? Vehicle {results['vehicle']['name']}",
        "",
        results["verdict"] + ".",
        "",
        _scope(results),
        "",
        loop_of(results),
        "",
        f"Coupling {results['groups']['coupling']:.2f}, from 0 (an immovable UAV) to 1.",
        "",
        *_verdicts(results),
        *_errors(results),
        "",
        *(f"* {note}" for note in results["notes"]),
    ]
    for task, part in results["tracking"].items():
        ds = part["models"]["decoupled"]["ds_max_px"]
        lines += [
            "",
            f"{task}, {_law(part)}: RMS feature error of the coupled plant "
            f"{_error(part['rms_px'])} px on the slowest letter; decoupled, |DS| up to "
            f"{_error(ds)} px there.",
        ]
    lines += ["", *(_beside_a_beam(results) or [OUTSIDE])]
    return "\n".join([*lines, "", step_costs(results)]) + "\n"


def _law(part: dict[str, Any]) -> str:
    """What tracks, in words."""
    return f"gains {part['gains']}" if part["gains"] else f"controller {part['controller']}"


OUTSIDE = (
    "The atlas of other flights and the comparison with a beam are of one arm of one section: this "
    "vehicle lies outside of both."
)
"""Note on a vehicle with [[arm]] in place of both."""


def _beside_a_beam(results: dict[str, Any]) -> list[str]:
    if not results["curvature_error"]:
        return []
    return [
        "The model itself, an arm of constant curvature, errs against a beam by:",
        "",
        *(
            f"* {name}: {entry['error']:+.1%}"
            for name, entry in results["curvature_error"].items()
            if entry["error"] and "decoupled" not in name
        ),
    ]


def step_costs(results: dict[str, Any]) -> str:
    """Return the sentence about the time of a step."""
    ratios = ", ".join(f"{m} {value:.2f}" for m, value in results["step_over_coupled"].items())
    return f"Time of a step over that of the coupled model: {ratios}."


def verdicts(results: dict[str, Any]) -> list[list[str]]:
    """Return task, model and verdict of every task and model."""
    return [
        [task, model, entry["text"]]
        for task, models in results["verdicts"].items()
        for model, entry in models.items()
    ]


def _scope(results: dict[str, Any]) -> str:
    length, tolerance = results["length_m"], results["tolerance"]
    varied = results["varied"]
    return (
        f"Tolerance: a tip within {tolerance:g} of the arm's length "
        f"({1e3 * tolerance * length:.3g} mm) and {tolerance:g} rad, "
        f"or |DS| up to {results['pixels']:g} px. Bending frequency of the clamped arm: "
        f"{results['clamped_hz']:.3g} Hz without gravity; modes of the hovering vehicle, with "
        f"gravity: {_modes(results)}." + (f" {varied}" if varied else "")
    )


def _modes(results: dict[str, Any]) -> str:
    told = list(dict.fromkeys(f"{hz:.3g}" for hz in results["hovering_hz"]))
    return f"{', '.join(told)} Hz" if told else "none, as it has no stable equilibrium"


def loop_of(results: dict[str, Any]) -> str:
    """Return the sentence about the loop that holds the hover."""
    law = results["loop"]["controller"]
    if not results["excitations"]:
        return "Loop: only that of the camera, in tracking."
    if law is None:
        return "Loop: none; constant forces hold the hover."
    if results["loop"]["name"] == OWN:
        return f"Loop: the controller {law['name']}, which was given."
    place = law.get("position_bandwidth", law.get("height_bandwidth"))
    what = "place" if "position_bandwidth" in law else "height, sideways nothing"
    return (
        f"Loop: {results['loop']['name']}; attitude {law['attitude_bandwidth']:.3g} rad/s, yaw "
        f"{law['yaw_bandwidth']:.3g}, {what} {place:.3g}, at {law['rate']:g} Hz; the arm is held "
        "by no servo."
    )


def _verdicts(results: dict[str, Any]) -> list[str]:
    headings = ("task", "model", "verdict")
    return as_markdown(headings, verdicts(results), headings)


def _errors(results: dict[str, Any]) -> list[str]:
    if not results["excitations"]:
        return []
    headings = ["excitation", "load", "decoupled", "independent", "up to, decoupled [Hz]"]
    headings += ["no carriage", "no inertia", "no Coriolis"]
    cells = []
    for name, part in results["excitations"].items():
        decoupled, independent = (part["models"][m] for m in ("decoupled", "independent"))
        cells.append(
            [
                f"{name}: {part['meaning']}",
                f"{part['load_ratio']:g} ({part['load']})" if part["load_ratio"] else "",
                _error(decoupled["error"]),
                _error(independent["error"]),
                _limit(decoupled["limit_hz"]),
                *(_error(part["couplings"][coupling]) for coupling in COUPLINGS),
            ]
        )
    return [
        "",
        "Errors at half the clamped frequency, and of the coupled model without one coupling:",
        "",
        *as_markdown(headings, cells, ("excitation", "load")),
    ]


def _error(value: float) -> str:
    if not math.isfinite(value):
        return "lost"
    return number(value, 2) if abs(value) >= 1e-9 else "0"


def _limit(value: float | None) -> str:
    if value is None:
        return ""
    if math.isfinite(value):
        return number_below(value)
    return "none" if math.isnan(value) else "all"
