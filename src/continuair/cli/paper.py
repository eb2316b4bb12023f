"""`continuair paper`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from continuair.cli.application import app
from continuair.cli.open_loop import run_open_loop
from continuair.cli.options import VehicleOption


@app.command()
def paper(
    vehicle: VehicleOption = "paper",
    out: Annotated[Path, typer.Option(help="Folder for results, one folder per study.")] = Path(
        "results"
    ),
) -> None:
    """Run every study of the paper that there is."""
    run_open_loop(vehicle, "ABCD", None, out / "open_loop")
