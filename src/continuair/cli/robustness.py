"""`continuair robustness`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli.application import app
from continuair.cli.options import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    results_in,
    tell_where,
    write_json,
)
from continuair.cli.terminal import progress_bar


@app.command()
def robustness(
    vehicle: VehicleOption = "paper",
    law: Annotated[
        list[str] | None,
        typer.Option(help="A law: constant, current or classic; repeatable. Default: all."),
    ] = None,
    gains: Annotated[
        str | None,
        typer.Option(
            help="Gains instead of the preset of the law that they are for, a .toml file."
        ),
    ] = None,
    model: Annotated[
        list[str] | None,
        typer.Option(help="A model as the plant; repeatable. Default: coupled and decoupled."),
    ] = None,
    mistake: Annotated[
        list[str] | None,
        typer.Option(
            help="What the law is wrong about, as in the table; repeatable. Default: all."
        ),
    ] = None,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Track a letter with laws that are wrong about their vehicle, its camera or the air.

    With --out, writes a table, JSON, CSV and figures to that folder.
    """
    from continuair.studies.results import as_json

    check_json(json)
    command = again(
        "robustness", vehicle=vehicle, law=law, gains=gains, model=model, mistake=mistake, out=out,
    )  # fmt: skip
    with progress_bar() as progress:
        from continuair.controllers.gain_files import load_gains
        from continuair.kernels.dynamics import PLANTS
        from continuair.studies.robustness.mistakes import MISTAKES
        from continuair.studies.robustness.report import summary
        from continuair.studies.robustness.study import robustness as run
        from continuair.studies.standard_laws import LAWS
        from continuair.vehicle.vehicle import load_vehicle

        with results_in(out, "robustness", command) as folder:
            study = run(
                load_vehicle(vehicle), law or LAWS, model or PLANTS, mistake or MISTAKES,
                load_gains(gains) if gains else None, progress=progress,
            )  # fmt: skip
            if folder is not None:
                from continuair.report.keeping import keep

                progress(1, 1, "writing results and figures")
                keep("robustness", study, folder)
    typer.echo("\n".join(summary(study.results)), err=True)
    tell_where(out)
    write_json(as_json(study.results), json)
