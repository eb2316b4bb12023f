"""`continuair paper`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from continuair.cli.application import app
from continuair.cli.cost import run_cost
from continuair.cli.open_loop import run_open_loop
from continuair.cli.options import VehicleOption, out_option
from continuair.cli.sensitivity import run_sensitivity
from continuair.cli.tracking import run_tracking


@app.command()
def paper(
    vehicle: VehicleOption = "paper",
    out: Annotated[Path, out_option("Folder for results, one folder per study.")] = Path("results"),
) -> None:
    """Run every study of the paper that there is."""
    run_open_loop(vehicle, "ABCD", None, out / "open_loop")
    run_sensitivity(vehicle, False, out / "sensitivity")
    run_tracking(vehicle, "MRAL", "paper", None, out / "tracking")
    run_cost(vehicle, out / "cost")
