"""`continuair open-loop`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from amiri2026.commands.options import ModelOption, complete_tests, keep_in
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
    from amiri2026.open_loop.study import OpenLoop


def open_loop(
    vehicle: VehicleOption = "paper",
    tests: Annotated[
        str, typer.Option(help="Letters of the tests to run.", autocompletion=complete_tests)
    ] = "ABCD",
    model: ModelOption = None,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Run the paper's open-loop tests A to D and compare the models.

    Every section of every arm starts with the bend, and has the torques, of the paper's one
    section; the tip wrench acts on the arm that carries the camera. Errors are of each arm's tip.

    With --out, writes a table, JSON, CSV, trajectories (netCDF) and figures to that folder.
    """
    from continuair.studies import as_json

    check_json(json)
    study = run_open_loop(vehicle, tests, model, out)
    write_json(as_json(study.results), json)


def run_open_loop(vehicle: str, tests: str, models: list[str] | None, out: str | None) -> OpenLoop:
    """Run the study, store it and its figures, and show its table."""
    from continuair import load_vehicle

    loaded = load_vehicle(vehicle)
    with progress_bar() as progress:
        from amiri2026.open_loop.study import open_loop as run
        from continuair import MODELS

        command = again("open-loop", vehicle=vehicle, tests=tests, model=models, out=out)
        with results_in(out, "open_loop", command) as folder:
            study = run(loaded, tests, models or MODELS, progress=progress)
            keep_in(folder, "open_loop", study, progress)
    _show(study)
    tell_where(out)
    return study


def _show(study: OpenLoop) -> None:
    """Show the table on standard error: standard output is for the JSON alone."""
    from amiri2026.open_loop.report import (
        METRICS,
        label,
        labels_of,
        of_angles,
        of_sections,
        remarks,
        rows,
    )
    from amiri2026.still_rotors import of_still_rotors
    from continuair.studies import number

    columns = [*labels_of(study.results), "NRMSE\nT", "NRMSE\nR", "RMSE T\n[m]", "RMSE R\n[rad]"]
    columns += ["angle\n[rad]", "relative\nerror"]
    table = [
        [*label(test, arm, model), *(number(entry[key]) for key in METRICS)]
        for test, arm, model, entry in rows(study.results)
    ]
    print_table(columns, table, err=True)
    told = [*remarks(study.results), *of_angles(study.results), *of_still_rotors(study.results)]
    for line in [*of_sections(study.results), *told, study.results["note"]]:
        typer.echo(line, err=True)
