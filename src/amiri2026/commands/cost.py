"""`continuair cost`."""

from __future__ import annotations

from typing import Any

from continuair.cli import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    print_markdown,
    progress_bar,
    results_in,
    write_json,
)


def cost(vehicle: VehicleOption = "paper", out: OutOption = None, json: JsonOption = None) -> None:
    """Time a sample of control and dynamics with each model, and where the time goes."""
    from continuair.studies import as_json

    check_json(json)
    results = run_cost(vehicle, out)
    write_json(as_json(results), json)


def run_cost(vehicle: str, out: str | None) -> dict[str, Any]:
    """Run the study, store it, and show its table."""
    from continuair import load_vehicle

    loaded = load_vehicle(vehicle)
    with progress_bar() as progress:
        from amiri2026 import cost as study

        with results_in(out, "cost", again("cost", vehicle=vehicle, out=out)) as folder:
            results = study.cost(loaded, progress=progress)
            if folder is not None:
                folder.store(results, study.as_table(results))
    print_markdown(study.as_table(results))
    return results
