"""Storing the sensitivity study: JSON, CSV, tables and verdicts in Markdown, and trajectories."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from amiri2026.overstated_angles import of_overstated_angles
from amiri2026.sensitivity.measures import MEASURES
from amiri2026.sensitivity.study import ERROR_SHARE, Sensitivity
from amiri2026.still_rotors import of_still_rotors
from continuair.analysis import CONVERGED, percent
from continuair.kernels import SIMPLER
from continuair.studies import ResultFolder, as_csv, as_markdown, number

COLUMNS = {
    "nrmse_t": "NRMSE_T",
    "nrmse_r": "NRMSE_R",
    "rmse_t_m": "RMSE_T [m]",
    "rmse_r_rad": "RMSE_R [rad]",
    "angle_rad": "angle [rad]",
    "rmse_xy_m": "RMSE xy [m]",
    "relative_error": "relative error",
}
"""Columns of the tables, as keys of a model's entry."""


VALUES = {
    "paper": "The values are the paper's, which prints neither its vehicle nor numbers in this "
    "section. The verdicts (holds, fails, undecided) are about this vehicle and this reading of f; "
    "`continuair paper` judges each sentence over several.",
    "own": "The values are about the vehicle's own, which is the middle one of each field; initial "
    "bends and rolls, the force and its time are those of the study of the paper, whose sentences "
    "are of its own values and are not judged here.",
}
"""Notes on the values that are compared."""


def write(study: Sensitivity, folder: ResultFolder) -> None:
    """Write sensitivity.json, two CSV files, table.md and sensitivity_<parameter>.nc."""
    results = study.results
    named = {
        "".join(c for c in name.lower().replace(" ", "_") if c.isalnum() or c == "_"): dataset
        for name, dataset in study.datasets.items()
    }
    folder.store(results, as_table(results), compared(results), named)
    folder.write_text("sensitivity_between.csv", as_csv(between(results)))


def rows(results: dict[str, Any]) -> list[tuple[str, dict[str, Any], str, dict[str, Any]]]:
    """Return (parameter, row, model, entry) of every flight compared, in the order of the study."""
    return [
        (name, row, model, row["models"][model])
        for name, sweep in results["sweeps"].items()
        for row in sweep["rows"]
        for model in SIMPLER
    ]


def compared(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row per parameter, value and model, with every number of it."""
    for name, row, model, entry in rows(results):
        numbers = {key: value for key, value in row.items() if key != "models"}
        numbers |= {key: value for key, value in entry.items() if not isinstance(value, list)}
        yield {"parameter": name, "model": model} | numbers


def between(results: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row per parameter and value between, with measures and differences."""
    for name, sweep in results["sweeps"].items():
        columns = dict(sweep["between"])
        del columns["ended_early"], columns["unresolved"], columns["follows"]
        for model, errors in columns.pop("rmse_xy_m").items():
            columns[f"rmse_xy_m_{model}"] = errors
        for row in zip(*columns.values(), strict=True):
            yield {"parameter": name} | dict(zip(columns, row, strict=True))


def as_table(results: dict[str, Any]) -> str:
    """Return the results in Markdown: verdicts on the paper's sentences, then the numbers."""
    judged = ["## The paper's sentences", "", *verdict_table(results), ""]
    lines = [
        f"# Parameter sensitivity, vehicle {results['vehicle']['name']}",
        "",
        f"Force of 100 N with {results['reading_of_f']}, f = 10, 5 s; each model against the",
        f"coupled one. {VALUES[results['values']]}",
        "",
        *(judged if results["values"] == "paper" else ["## How the error changes", ""]),
        *reading(results),
        "",
        "## Values compared",
        "",
        *_errors_table(results),
        "",
        *remarks(results),
        "",
        "## The coupled flights",
        "",
        *_measures_table(results),
    ]
    return "\n".join(lines) + "\n"


def _errors_table(results: dict[str, Any]) -> list[str]:
    cells = [
        [name, row["label"], model, *(number(entry[key]) for key in COLUMNS)]
        for name, row, model, entry in rows(results)
    ]
    headings = ["parameter", "value", "model", *COLUMNS.values()]
    return as_markdown(headings, cells, ("parameter", "model"))


def verdict_table(results: dict[str, Any]) -> list[str]:
    """Return the lines of a table of sentences, verdicts and numbers."""
    headings = ("sentence", "about", "the paper", "verdict", "numbers")
    cells = [
        (claim["id"], claim["about"], claim["quote"], f"**{claim['verdict']}**", claim["evidence"])
        for claim in results["claims"]
    ]
    return as_markdown(headings, cells, headings)


def reading(results: dict[str, Any]) -> list[str]:
    """Return how to read the verdicts, with how far the error scatters between the values."""
    ratios = ", ".join(
        f"{name} {number(neighbour_ratio(sweep), 2)}" for name, sweep in results["sweeps"].items()
    )
    closer = {name: closer_share(sweep) for name, sweep in results["sweeps"].items()}
    shares = ", ".join(
        f"{name} {percent(share) if math.isfinite(share) else '-'}"
        for name, share in closer.items()
    )
    trends = [
        "A trend holds if the values compared show it and the rank correlation over many values",
        "between is at least 0.5. It fails if they do not show it and the correlation is at most",
        "0.2. Otherwise it is undecided.",
    ]
    return [
        "Error: RMS horizontal distance of the decoupled model's tip from the coupled one's.",
        *(trends if results["values"] == "paper" else _spread(results)),
        "From one of the many values to the next the error changes by",
        f"factors of up to: {ratios}. Share of these values at which `independent` is closer to",
        f"coupled than `decoupled` is: {shares}.",
    ]


def _spread(results: dict[str, Any]) -> list[str]:
    """Return the range of the error over each parameter's values, the widest first."""
    ends = {}
    for name, sweep in results["sweeps"].items():
        errors = sweep["between"]["rmse_xy_m"]["decoupled"]
        if errors:
            values = [sweep["scale"] * sweep["between"]["value"][at] for at in (0, -1)]
            where = f"{name} {number(values[0])} to {number(values[1])} {sweep['units']}"
            ends[where] = min(errors), max(errors)
    widest = sorted(ends, key=lambda where: ends[where][0] - ends[where][1])
    told = [
        f"{where}: between {number(ends[where][0])} and {number(ends[where][1])} m"
        for where in widest
    ]
    listed = "; ".join(told)
    return [f"It lies, the parameter over which it varies the most first, over {listed}."]


def neighbour_ratio(sweep: dict[str, Any]) -> float:
    """Return the largest factor between errors at neighbouring values of a parameter, or NaN."""
    errors, follows = sweep["between"]["rmse_xy_m"]["decoupled"], sweep["between"]["follows"]
    pairs = zip(errors, errors[1:], follows, strict=False)
    ratios = [b / a for a, b, next_one in pairs if next_one and a > 0 and b > 0]
    return max((max(ratio, 1 / ratio) for ratio in ratios), default=math.nan)


def closer_share(sweep: dict[str, Any]) -> float:
    """Return the share of values at which `independent` is closer to coupled than `decoupled`.

    NaN if there are none.
    """
    errors = sweep["between"]["rmse_xy_m"]
    pairs = list(zip(errors["independent"], errors["decoupled"], strict=True))
    if not pairs:
        return math.nan
    return sum(independent < decoupled for independent, decoupled in pairs) / len(pairs)


def remarks(results: dict[str, Any]) -> list[str]:
    """Return sentences on the errors of the flights in every row."""
    lines = [
        "Relative error: what a tenth of the tolerance changes of both tips, as a share of their "
        f"difference; up to {percent(CONVERGED)} counts as converged."
    ]
    unsettled = []
    for name, sweep in results["sweeps"].items():
        for row in sweep["rows"]:
            for model, entry in row["models"].items():
                if not entry["converged"]:
                    why = f"status {entry['status']}" if entry["status"] else _unsettled(entry)
                    unsettled.append(f"* {name} {row['label']}, {model}, has not converged: {why}.")
        if early := len(sweep["between"]["ended_early"]):
            unsettled.append(
                f"* {name}: {early} of the values between are left out, as a flight ended early."
            )
        if coarse := len(sweep["between"]["unresolved"]):
            unsettled.append(
                f"* {name}: {coarse} of the values between are left out, as errors may make more "
                f"than {percent(ERROR_SHARE)} of their differences."
            )
    return [
        *lines,
        *(unsettled or ["Every row has converged."]),
        *_unfollowed(results),
        *of_overstated_angles(
            (f"{name} {row['label']}, {model}", entry) for name, row, model, entry in rows(results)
        ),
        *of_still_rotors(results),
    ]


def _unfollowed(results: dict[str, Any]) -> list[str]:
    """Return a sentence where flights to the end have no error in Euler angles."""
    lost = any(not entry["status"] and math.isnan(entry["nrmse_r"]) for *_, entry in rows(results))
    told = "of a flight to its end is none where samples do not follow roll, pitch and yaw"
    return [f"NRMSE_R and RMSE_R: - {told}."] if lost else []


def _unsettled(entry: dict[str, Any]) -> str:
    share = entry["relative_error"]
    if not math.isfinite(share):
        return "it ends otherwise at a tenth of the tolerance"
    return f"relative error {percent(share)}"


def _measures_table(results: dict[str, Any]) -> list[str]:
    columns = {"mass_kg": "mass of the vehicle", "arm_inertia_kg_m2": "inertia of the arm"}
    columns |= MEASURES
    cells = [
        [name, row["label"], *(number(row[key]) for key in columns)]
        for name, sweep in results["sweeps"].items()
        for row in sweep["rows"]
    ]
    table = as_markdown(["parameter", "value", *columns], cells, ("parameter",))
    return [*table, "", "; ".join(f"{key}: {text}" for key, text in columns.items()) + "."]
