"""`continuair advise`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli import completion
from continuair.cli.application import app
from continuair.cli.options import (
    JsonOption,
    OutOption,
    check_json,
    refuse_unread,
    results_in,
    write_json,
)
from continuair.cli.terminal import print_table, progress_bar


@app.command(epilog="Example: continuair advise my_drone.toml --task contact")
def advise(
    vehicle: Annotated[
        str,
        typer.Argument(
            help="The path of a .toml file, or a preset's name.", autocompletion=completion.vehicles
        ),
    ],
    task: Annotated[
        list[str] | None,
        typer.Option(help="hover, fast-flight, contact or track:M (R, A, L); repeatable. All."),
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="Tolerated tip error: share of the arm's length, rad.")
    ] = 0.02,
    pixels: Annotated[
        float | None, typer.Option(help="Tolerated |DS| in tracking [px]. Default: 0.7.")
    ] = None,
    gains: Annotated[
        str | None,
        typer.Option(
            help="Gains for tracking: a preset's name, or the path of a .toml file. "
            "Default: paper.",
            autocompletion=completion.complete_gains,
        ),
    ] = None,
    loop: Annotated[
        str, typer.Option(help="Loop of the hover: position, attitude (and height) or none.")
    ] = "position",
    bandwidth: Annotated[
        float | None,
        typer.Option(
            help="Bandwidth of the attitude loop \\[rad/s]. "
            "Default: the fastest with a delay margin, at most 20."
        ),
    ] = None,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Simulate your vehicle with each model, and print for which tasks a simpler one suffices.

    With --out, writes a table, JSON and figures (errors; its place on the atlas) to that folder.
    """
    from continuair.controllers.gain_files import load_gains
    from continuair.vehicle.uncertain import load_uncertain
    from continuair.vehicle.vehicle import load_vehicle

    check_json(json)
    if task and not any(one.startswith("track") for one in task):
        refuse_unread(
            "no task tracks; add --task track:M, or leave it out", pixels=pixels, gains=gains
        )
    loaded = load_uncertain(vehicle) or load_vehicle(vehicle)
    law = load_gains("paper" if gains is None else gains)
    with progress_bar() as progress:
        from continuair.studies.advise import report, study
        from continuair.studies.results import as_json

        good = study.Tolerance(tolerance, study.PIXELS if pixels is None else pixels)
        with results_in(out, "advise") as folder:
            results = study.advise(
                loaded,
                task or (),
                good,
                law,
                loop=loop,  # type: ignore[arg-type] # what is no loop is refused there
                bandwidth=bandwidth,
                called=vehicle,
                progress=progress,
            )
            if folder is not None:
                from continuair.figures import advise as figures
                from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, OPEN_SUMMARY, load

                folder.store(results, report.as_table(results))
                shipped = CONTROLLED_SUMMARY if loop == "position" else OPEN_SUMMARY
                figures.write(results, load(shipped=shipped), folder.file)
    if results["cost_verdict"]:
        typer.echo(results["cost_verdict"], err=True)
    print_table(["task", "model", "verdict"], report.verdicts(results), err=True)
    typer.echo(results["verdict"].removeprefix(results["cost_verdict"]).strip() + ".", err=True)
    typer.echo(report.loop_of(results), err=True)
    for note in results["notes"]:
        typer.echo(note, err=True)
    if results["varied"]:
        typer.echo(f"{results['varied']} {report.OUTSIDE}", err=True)
    typer.echo(report.step_costs(results), err=True)
    write_json(as_json(results), json)
