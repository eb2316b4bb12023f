"""`continuair identify`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from continuair.cli.application import app
from continuair.cli.options import JsonOption, check_json, write_json
from continuair.cli.terminal import print_table, progress_bar
from continuair.errors import InputError

# Everything else is imported inside the command, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.identification import Fit


@app.command()
def identify(
    data: Annotated[
        Path | None, typer.Option(help="A recorded flight (CSV) to fit a vehicle to.")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option(help="With --data: where the fit starts, a preset or .toml file.")
    ] = None,
    fit: Annotated[
        str | None,
        typer.Option(
            help="With --data: fields to fit, with commas. Default: Young's modulus and damping."
        ),
    ] = None,
    test: Annotated[
        str | None, typer.Option(help="With --data: the open-loop test that was flown, A to D.")
    ] = None,
    effort: Annotated[
        int | None, typer.Option(min=1, help="Without --data: how long to search. Default: 1.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Without --data: seed of the search. Default: 0.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="With --data: file of the fitted vehicle. Without: folder for results."),
    ] = None,
    json: JsonOption = None,
) -> None:
    """Search for the vehicle behind the paper's table; with --data, fit a vehicle to a flight.

    The search may be interrupted (Ctrl-C): it then reports the best that it has found.
    """
    if data is None:
        _refuse("data", {"vehicle": vehicle, "fit": fit, "test": test})
        _search(1 if effort is None else effort, 0 if seed is None else seed, out, json)
        return
    if vehicle is None:
        raise InputError("vehicle is missing; name with --vehicle the vehicle to start from.")
    if effort is not None or seed is not None:
        name = "effort" if effort is not None else "seed"
        raise InputError(f"{name} is given with data; leave it out, a fit has none.")
    _fit(data, vehicle, fit, test, out, json)


def _refuse(needed: str, given: dict[str, Any]) -> None:
    for name, value in given.items():
        if value is not None:
            raise InputError(
                f"{name} is {value!r}, which needs a recorded flight; name it with --{needed}."
            )


def _search(effort: int, seed: int, out: Path | None, json: str | None) -> None:
    from continuair.studies.results import ResultFolder

    # Folder and file are checked before the flights: a wrong one is told at once.
    check_json(json)
    folder = None if out is None else ResultFolder(out, "identify")
    with progress_bar() as progress:
        from continuair.identification.search import Effort
        from continuair.identification.table import as_table, identify_table, write
        from continuair.studies.results import as_json

        results = identify_table(Effort.times(effort), seed, progress)
    if folder is not None:
        write(results, folder)
    typer.echo(as_table(results), err=True, nl=False)
    where = f"Results are in {folder.path}." if folder else "Name a folder with --out to keep them."
    typer.echo(where, err=True)
    write_json(as_json(results), json)


def _fit(
    data: Path, vehicle: str, fields: str | None, test: str | None, out: Path | None,
    json: str | None,
) -> None:  # fmt: skip
    from continuair.vehicle.vehicle import load_vehicle

    start = load_vehicle(vehicle)
    with progress_bar() as progress:
        from continuair.identification import fit, load_recording
        from continuair.studies.results import as_json
        from continuair.vehicle.vehicle_file import check_file, write_vehicle

        if out is not None:
            check_file(out)
        recording = load_recording(data)
        names = None if fields is None else fields.split(",")
        found = fit(start, recording, names, test=test, progress=progress)
    if out is not None:
        write_vehicle(found.vehicle, out, [f"Fitted to {recording.name} by continuair identify."])
    _show(found, out)
    write_json(as_json(found.describe()), json)


def _show(found: Fit, out: Path | None) -> None:
    """Show estimates with their standard errors, and what the data cannot determine."""
    columns = zip(found.fields, found.start, found.values, found.errors, strict=True)
    rows = [
        [name, f"{start:.5g}", f"{value:.5g}", f"{error:.2g}" if error < float("inf") else "none"]
        for name, start, value, error in columns
    ]
    print_table(["name", "start", "estimate", "standard error"], rows, err=True)
    left = ", ".join(f"{name} {value:.3g}" for name, value in found.deviations.items())
    typer.echo(
        f"Left over (standard deviation): {left}; condition {found.condition:.3g}.", err=True
    )
    if not found.converged:
        typer.echo("warning: the fit has not converged; start nearer, or fit fewer.", err=True)
    for doubt in found.doubts:
        typer.echo(f"warning: {doubt}", err=True)
    where = f"The vehicle is {out}." if out else "Name a file with --out to keep the vehicle."
    typer.echo(where, err=True)
