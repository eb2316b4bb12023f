"""`continuair region`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

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
from continuair.cli.terminal import print_table, progress_bar

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.studies.region.study import Region


@app.command()
def region(
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
    rate: Annotated[
        list[float] | None, typer.Option(help="A control rate [Hz]; repeatable. Default: 1000.")
    ] = None,
    runs: Annotated[int, typer.Option(help="Random starts.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random starts.")] = 0,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Map from which starts the servoing laws bring the image to where it belongs.

    With --out, writes a table, JSON, CSV, all flights (netCDF) and figures to that folder.
    """
    from continuair.studies.results import as_json

    check_json(json)
    command = again(
        "region", vehicle=vehicle, law=law, gains=gains, model=model, rate=rate,
        runs=runs, seed=seed, out=out,
    )  # fmt: skip
    with progress_bar() as progress:
        from continuair.controllers.gain_files import load_gains
        from continuair.kernels.dynamics import PLANTS
        from continuair.studies.region.flights import LAWS
        from continuair.studies.region.study import region as run
        from continuair.vehicle.vehicle import load_vehicle

        with results_in(out, "region", command) as folder:
            study = run(
                load_vehicle(vehicle), law or LAWS, model or PLANTS, rate or (1000.0,), runs, seed,
                load_gains(gains) if gains else None, progress=progress,
            )  # fmt: skip
            if folder is not None:
                from continuair.report.keeping import keep

                progress(1, 1, "writing results and figures")
                keep("region", study, folder)
    _show(study)
    tell_where(out)
    write_json(as_json(study.results), json)


def _show(study: Region) -> None:
    from continuair.studies.region.report import name_of, reach
    from continuair.studies.tables import percent

    cases = study.results["cases"]
    rows = [
        [entries[0]["direction"], f"{entries[0]['bend_1_m']:g}", *map(reach, entries)]
        for entries in zip(*(case["directions"] for case in cases), strict=True)
    ]
    names = [name_of(case).replace(", ", "\n") for case in cases]
    # What is in a cell stays on one line.
    whole = [[cell.replace(" ", "\xa0") for cell in row] for row in rows]
    print_table(["off in", "bend", *names], whole, err=True)
    for case in cases:
        found = case["random"]
        typer.echo(
            f"{name_of(case)}: {found['well']} of {found['runs']} random starts end well "
            f"({percent(found['share'])}).",
            err=True,
        )
