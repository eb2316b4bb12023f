"""Storing the open-loop study: JSON, CSV, a table beside the paper's, and the trajectories."""

from __future__ import annotations

import csv
import io
from typing import Any

from continuair.analysis.convergence import CONVERGED, REFERENCE
from continuair.studies.open_loop.study import PRINTED, OpenLoop, percent
from continuair.studies.results import ResultFolder, as_json

METRICS = ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_r_rad", "angle_rad", "step_halving_error")
"""The columns of the tables, as keys of the results."""

_HEADINGS = ("NRMSE_T", "NRMSE_R", "RMSE_T [m]", "RMSE_R [rad]", "angle [rad]", "step error")


def write(study: OpenLoop, folder: ResultFolder) -> None:
    """Write open_loop.json, open_loop.csv, table.md and open_loop_<test>.nc to the folder."""
    folder.write_text("open_loop.json", as_json(study.results))
    folder.write_text("open_loop.csv", as_csv(study.results))
    folder.write_text("table.md", as_table(study.results))
    for letter, dataset in study.datasets.items():
        folder.write_dataset(f"open_loop_{letter}.nc", dataset)


def rows(results: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    """Return (test, model, entry) of every flight, in the order of the results."""
    return [
        (letter, model, entry)
        for letter, entries in results["tests"].items()
        for model, entry in entries.items()
    ]


def as_csv(results: dict[str, Any]) -> str:
    """Return one line per test and model with every number of the entry."""
    flights = rows(results)
    stream = io.StringIO()
    columns = ["test", "model", *flights[0][2]]
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    for letter, model, entry in flights:
        writer.writerow({"test": letter, "model": model, **entry})
    return stream.getvalue()


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown beside the numbers that the paper prints."""
    lines = [
        f"# Open-loop tests, vehicle {results['vehicle']['name']}",
        "",
        "Each model against the coupled one, at the tip. The paper's columns compare its decoupled",
        "model.",
        "",
        results["note"],
        "",
        "| test | model | paper NRMSE_T | paper NRMSE_R | " + " | ".join(_HEADINGS) + " |",
        "|---|---|" + "---:|" * (2 + len(_HEADINGS)),
    ]
    for letter, model, entry in rows(results):
        printed = PRINTED[letter] if model == "decoupled" else {}
        cells = [f"{printed[key]:.4f}" if printed else "" for key in ("nrmse_t", "nrmse_r")]
        cells += [number(entry[key]) for key in METRICS]
        lines.append(f"| {letter} | {model} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "Step error: the change of the tip, or of its difference from the coupled one, when the",
        "step is halved, as a share of that difference (coupled: of the motion beyond free fall);",
        f"up to {percent(CONVERGED)} counts as converged, for a refined step only if it falls with",
        "the step.",
        "",
        *(remarks(results) or ["Every flight has converged at the automatic step."]),
    ]
    return "\n".join([*lines, *_kappa_s_table(results)]) + "\n"


def remarks(results: dict[str, Any]) -> list[str]:
    """Return a sentence for every test that the automatic step did not settle."""
    lines = []
    for letter, entries in results["tests"].items():
        if coarser := results["coarser_steps"][letter]:
            step = entries[REFERENCE]["step_s"]
            share = max(entry["step_halving_error"] for entry in coarser[0].values())
            lines.append(
                f"* Test {letter} is reported at a step of {1e3 * step:.2g} ms: halving the "
                f"automatic one, {1e3 * coarser[0][REFERENCE]['step_s']:.2g} ms, changes it by "
                f"{percent(share)}."
            )
        for model, entry in entries.items():
            if entry["reason"]:
                lines.append(f"* Test {letter}, {model}, has not converged: {entry['reason']}.")
    return lines


def _kappa_s_table(results: dict[str, Any]) -> list[str]:
    """Test C at coarser steps and with other kappa_s, beside what is reported."""
    if not results["kappa_s"]:
        return []
    given = results["vehicle"]["arm"]["kappa_s"]
    coarser = results["coarser_steps"]["C"]
    variants = [(given, entries) for entries in [*coarser, results["tests"]["C"]]]
    variants += [(row["kappa_s"], row["models"]) for row in results["kappa_s"]]
    steps = [entries[REFERENCE]["step_s"] for _, entries in variants[: len(coarser) + 1]]
    steps += [row["step_s"] for row in results["kappa_s"]]
    lines = [
        "",
        "Test C divides Q_psi_a by the bend, and below kappa_s by kappa_s. How far the step and",
        "kappa_s move it:",
        "",
        "| step [ms] | kappa_s [1/m] | model | " + " | ".join(_HEADINGS[:5]) + " |",
        "|---:|---:|---|" + "---:|" * 5,
    ]
    for step, (kappa_s, models) in zip(steps, variants, strict=True):
        for model, metrics in models.items():
            if model != REFERENCE:
                cells = " | ".join(number(metrics[key]) for key in METRICS[:5])
                lines.append(f"| {1e3 * step:.3g} | {kappa_s:g} | {model} | {cells} |")
    return lines


def number(value: float) -> str:
    """Return a metric as the tables print it, in at most eight characters."""
    plain = f"{value:.4f}"
    return f"{value:.1e}" if 0 < abs(value) < 1e-3 or len(plain) > 8 else plain
