"""The advice as a table in Markdown."""

from __future__ import annotations

import math
from typing import Any


def as_table(results: dict[str, Any]) -> str:
    """Return verdicts, errors, couplings and costs."""
    arm = results["vehicle"]["arm"]
    lines = [
        f"# May I decouple? Vehicle {results['vehicle']['name']}",
        "",
        results["verdict"] + ".",
        "",
        f"Good enough is a tip within {results['tolerance']:g} of the arm's length "
        f"({1e3 * results['tolerance'] * arm['length']:.3g} mm) and {results['tolerance']:g} rad, "
        f"or |DS| up to {results['pixels']:g} px. Bending frequency of the clamped arm: "
        f"{results['clamped_hz']:.3g} Hz.",
        "",
        f"Coupling {results['groups']['coupling']:.2f}, from 0 (a UAV like a rock) to 1.",
        "",
        "| task | model | verdict |",
        "|---|---|---|",
    ]
    for task, models in results["verdicts"].items():
        lines += [f"| {task} | {model} | {entry['text']} |" for model, entry in models.items()]
    if results["excitations"]:
        lines += [
            "",
            "Errors at half the clamped frequency, and of the coupled model without one coupling:",
            "",
            "| excitation | load | decoupled | independent | up to, decoupled [Hz] | no carriage | "
            "no inertia | no Coriolis |",
            "|---|---|---:|---:|---:|---:|---:|---:|",
        ]
        for name, part in results["excitations"].items():
            models, couplings = part["models"], part["couplings"]
            load = f"{part['load_ratio']:g} ({part['load']})" if part["load_ratio"] else ""
            cells = [
                number(models["decoupled"]["error"]),
                number(models["independent"]["error"]),
                limit(models["decoupled"]["limit_hz"]),
                *(number(couplings[key]) for key in ("carriage", "inertia", "coriolis")),
            ]
            lines.append(f"| {name}: {part['meaning']} | {load} | " + " | ".join(cells) + " |")
    for task, part in results["tracking"].items():
        lines += [
            "",
            f"{task}, gains {part['gains']}: RMS feature error of the coupled plant "
            f"{number(part['rms_px'])} px on the slowest letter; decoupled, |DS| up to "
            f"{number(part['models']['decoupled']['ds_max_px'])} px there.",
        ]
    lines += ["", "The model itself, an arm of constant curvature, errs against a beam by:", ""]
    lines += [
        f"* {name}: {entry['error']:+.1%}"
        for name, entry in results["curvature_error"].items()
        if entry["error"] and "decoupled" not in name
    ]
    ratios = ", ".join(f"{m} {value:.2f}" for m, value in results["step_over_coupled"].items())
    lines += ["", f"Time of a step over that of the coupled model: {ratios}."]
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """An error as the tables print it."""
    if not math.isfinite(value):
        return "lost"
    return "0" if abs(value) < 1e-9 else f"{value:.2g}"


def limit(value: float | None) -> str:
    """A limit as the tables print it."""
    if value is None:
        return ""
    if math.isnan(value):
        return "none"
    return "all" if math.isinf(value) else f"{value:.2g}"
