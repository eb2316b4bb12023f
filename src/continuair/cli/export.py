"""`continuair export`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli import completion
from continuair.cli.application import app


@app.command(epilog="Example: continuair export flight.nc --to flight.glb")
def export(
    source: Annotated[
        str,
        typer.Argument(
            help="A result (.nc), or for .xml a vehicle: a preset's name or a file.",
            autocompletion=completion.flights,
        ),
    ],
    to: Annotated[
        str, typer.Option(help="The new file: .glb, .mcap, .csv, .nc, or .xml of a vehicle.")
    ],
    model: Annotated[
        str | None, typer.Option(help="Which model's flight, of a result of several.")
    ] = None,
    run: Annotated[int | None, typer.Option(help="Which run, of a result of several.")] = None,
    letter: Annotated[str | None, typer.Option(help="Which letter, of a study of several.")] = None,
    links: Annotated[
        int | None, typer.Option(help="Rigid links of a section, for .xml. Default: 8.")
    ] = None,
) -> None:
    """Write a flight or a vehicle for another program: a viewer, MuJoCo, a spreadsheet."""
    from continuair.interfaces.export import export

    export(source, to, model=model, run=run, letter=letter, links=links)
    typer.echo(f"Wrote {to}.", err=True)
