"""`continuair paper`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli.application import app
from continuair.cli.cost import run_cost
from continuair.cli.open_loop import run_open_loop
from continuair.cli.options import VehicleOption, out_folder
from continuair.cli.sensitivity import run_sensitivity
from continuair.cli.tracking import run_tracking


@app.command()
def paper(
    vehicle: VehicleOption = "paper",
    out: Annotated[
        str, typer.Option(help="Folder for results, one folder per study.", metavar="DIR")
    ] = "results",
) -> None:
    """Run every study of the paper that there is."""
    folder = out_folder(out)
    run_open_loop(vehicle, "ABCD", None, str(folder / "open_loop"))
    run_sensitivity(vehicle, False, str(folder / "sensitivity"))
    run_tracking(vehicle, "MRAL", "paper", None, str(folder / "tracking"))
    run_cost(vehicle, str(folder / "cost"))
