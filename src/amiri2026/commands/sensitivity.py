"""`continuair sensitivity`."""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING, Annotated

import typer

from amiri2026.commands.options import keep_in
from continuair.cli import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    print_table,
    progress_bar,
    results_in,
    tell_where,
    write_json,
)

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from amiri2026.sensitivity.study import Sensitivity


def sensitivity(
    vehicle: VehicleOption = "paper",
    hertz: Annotated[
        bool, typer.Option("--hertz", help="Read the paper's f = 10 as Hz, not as rad/s.")
    ] = False,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Vary a vehicle's parameters one at a time, about its own values, and compare the models.

    Of a vehicle that has the values of the paper's study, such as paper, it varies them as the
    paper does, and judges what the paper says of each.

    With --out, writes tables, verdicts, JSON, CSV, trajectories (netCDF) and figures to that
    folder.
    """
    from continuair.studies import as_json

    check_json(json)
    study = run_sensitivity(vehicle, hertz, out)
    write_json(as_json(study.results), json)


def run_sensitivity(vehicle: str, hertz: bool, out: str | None) -> Sensitivity:
    """Run the study, store it and its figures, and show its table and verdicts."""
    from continuair import load_vehicle

    loaded = load_vehicle(vehicle)
    with progress_bar() as progress:
        from amiri2026.sensitivity.study import sensitivity as run
        from amiri2026.sensitivity.task import of_the_paper

        command = again("sensitivity", vehicle=vehicle, hertz=hertz, out=out)
        name = "sensitivity_hertz" if hertz else "sensitivity"
        with results_in(out, name, command) as folder:
            own = not of_the_paper(loaded)
            study = run(loaded, own=own, hertz=hertz, progress=progress)
            keep_in(folder, name, study, progress)
    _show(study)
    typer.echo(err=True)
    tell_where(out)
    return study


def _show(study: Sensitivity) -> None:
    """Show errors and verdicts on standard error: standard output is for the JSON alone."""
    from amiri2026.sensitivity.report import COLUMNS, VALUES, reading, remarks, rows
    from continuair.studies import number

    shown = ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_xy_m", "angle_rad", "relative_error")
    # The other model is in table.md: a terminal of 80 columns has no room for both.
    table: list[list[str]] = []
    for name, group in groupby(rows(study.results), key=lambda each: each[0]):
        table.append([name] + [""] * len(shown))
        table += [
            [f"  {row['label']}", *(number(entry[key]) for key in shown)]
            for _, row, model, entry in group
            if model == "decoupled"
        ]
    headings = [re.sub(r"_| (?=\[)|(?<=relative) ", "\n", COLUMNS[key]) for key in shown]
    print_table(["decoupled", *headings], table, err=True)
    for line in remarks(study.results):
        typer.echo(line, err=True)
    if study.results["values"] == "own":
        typer.echo(f"{VALUES['own']} {' '.join(reading(study.results))}", err=True)
    for claim in study.results["claims"]:
        typer.echo(f"\n{claim['id']}, {claim['about']}: “{claim['quote']}”", err=True)
        typer.echo(f"  {claim['verdict']}: {claim['evidence']}.", err=True)
