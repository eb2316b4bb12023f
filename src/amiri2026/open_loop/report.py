"""Storing the open-loop study: JSON, CSV, a table beside the paper's, and the trajectories."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from amiri2026.open_loop.study import OpenLoop
from amiri2026.overstated_angles import of_overstated_angles
from amiri2026.still_rotors import of_still_rotors
from continuair.analysis import CONVERGED, percent
from continuair.kernels import REFERENCE
from continuair.studies import ResultFolder, as_markdown, number

METRICS = {
    "nrmse_t": "NRMSE_T",
    "nrmse_r": "NRMSE_R",
    "rmse_t_m": "RMSE_T [m]",
    "rmse_r_rad": "RMSE_R [rad]",
    "angle_rad": "angle [rad]",
    "relative_error": "relative error",
}
"""The columns of the tables, as keys of the results."""


def write(study: OpenLoop, folder: ResultFolder) -> None:
    """Write open_loop.json, open_loop.csv, table.md and open_loop_<test>.nc to the folder."""
    results = study.results
    folder.store(results, as_table(results), records(results), study.datasets)


def records(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row per test and model with every number of the entry."""
    for letter, model, entry in rows(results):
        yield {"test": letter, "model": model, **entry}


def rows(results: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    """Return (test, model, entry) of every flight, in the order of the results."""
    return [
        (letter, model, entry)
        for letter, entries in results["tests"].items()
        for model, entry in entries.items()
    ]


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown, those of the preset `paper` beside the printed ones."""
    lines = [
        f"# Open-loop tests, vehicle {results['vehicle']['name']}",
        "",
        "Each model against the coupled one, at the tip. The paper prints numbers of its decoupled",
        "model, and they stand beside those of the preset `paper` alone.",
        "",
        results["note"],
        "",
        *_errors_table(results),
        "",
        "Relative error: what a tenth of the tolerance changes of both tips, as a share of their",
        "difference (coupled: of the tip's motion beyond free fall); up to "
        f"{percent(CONVERGED)} counts as converged.",
        "",
        *(remarks(results) or ["Every flight has converged."]),
        *of_angles(results),
        *of_still_rotors(results),
    ]
    return "\n".join([*lines, *_kappa_s_table(results)]) + "\n"


def _errors_table(results: dict[str, Any]) -> list[str]:
    beside = bool(results["printed"])
    columns = ["paper NRMSE_T", "paper NRMSE_R"] if beside else []
    headings = ["test", "model", *columns, *METRICS.values()]
    cells = []
    for letter, model, entry in rows(results):
        printed = results["printed"][letter] if beside and model == "decoupled" else {}
        paper = [f"{printed[key]:.4f}" if printed else "" for key in ("nrmse_t", "nrmse_r")]
        told = paper if beside else []
        cells.append([letter, model, *told, *(number(entry[key]) for key in METRICS)])
    return as_markdown(headings, cells, ("test", "model"))


def remarks(results: dict[str, Any]) -> list[str]:
    """Return a sentence for every test of which a flight has not converged."""
    lines = []
    for letter, entries in results["tests"].items():
        reasons = dict.fromkeys(entry["reason"] for entry in entries.values() if entry["reason"])
        for reason in reasons:
            alike = [model for model, entry in entries.items() if entry["reason"] == reason]
            models = " and ".join(alike)
            lines.append(f"* Test {letter}, {models}, has not converged: {reason}.")
    return lines


def of_angles(results: dict[str, Any]) -> list[str]:
    """Return a sentence if Euler angles do not describe the rotation."""
    return of_overstated_angles(
        (f"Test {letter}, {model}", entry)
        for letter, model, entry in rows(results)
        if model != REFERENCE
    )


def _kappa_s_table(results: dict[str, Any]) -> list[str]:
    """Return Test C with other kappa_s, beside the reported result."""
    if not results["kappa_s"]:
        return []
    variants = [(results["vehicle"]["arm"]["kappa_s"], results["tests"]["C"])]
    variants += [(row["kappa_s"], row["models"]) for row in results["kappa_s"]]
    keys = [key for key in METRICS if key != "relative_error"]
    headings = ["kappa_s [1/m]", "model", *(METRICS[key] for key in keys)]
    cells = [
        [f"{kappa_s:g}", model, *(number(metrics[key]) for key in keys)]
        for kappa_s, models in variants
        for model, metrics in models.items()
        if model != REFERENCE
    ]
    return [
        "",
        "Test C divides Q_psi_a by the bend, and below kappa_s by kappa_s. How far that",
        "moves it:",
        "",
        *as_markdown(headings, cells, ("model",)),
    ]
