"""`continuair cost`."""

from __future__ import annotations

from typing import Any

from continuair.cli.application import app
from continuair.cli.options import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    results_in,
    write_json,
)
from continuair.cli.terminal import print_markdown, progress_bar


@app.command(epilog="Example: continuair cost --vehicle my_drone.toml")
def cost(vehicle: VehicleOption = "paper", out: OutOption = None, json: JsonOption = None) -> None:
    """Time a sample of control and dynamics with each model, and where the time goes."""
    from continuair.studies.results import as_json

    check_json(json)
    results = run_cost(vehicle, out)
    write_json(as_json(results), json)


def run_cost(vehicle: str, out: str | None) -> dict[str, Any]:
    """Run the study, store it, and show its table."""
    from continuair.vehicle.vehicle import load_vehicle

    loaded = load_vehicle(vehicle)
    with progress_bar() as progress:
        from continuair.studies import cost as study

        with results_in(out, "cost", again("cost", vehicle=vehicle, out=out)) as folder:
            results = study.cost(loaded, progress=progress)
            if folder is not None:
                folder.store(results, study.as_table(results))
    print_markdown(study.as_table(results))
    return results
