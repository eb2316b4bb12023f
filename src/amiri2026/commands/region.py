"""`continuair region`."""

from __future__ import annotations

from typing import Annotated

import typer

from amiri2026.commands.options import LawGainsOption, LawOption, PlantOption, keep_in
from continuair.cli import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    print_markdown,
    progress_bar,
    results_in,
    tell_where,
    write_json,
)


def region(
    vehicle: VehicleOption = "paper",
    law: LawOption = None,
    gains: LawGainsOption = None,
    model: PlantOption = None,
    rate: Annotated[
        list[float] | None, typer.Option(help="A control rate \\[Hz]; repeatable. Default: 1000.")
    ] = None,
    runs: Annotated[int, typer.Option(help="Random starts.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the random starts.")] = 0,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Map from which starts the servoing laws bring the image to where it belongs.

    With --out, writes a table, JSON, all flights (netCDF) and figures to that folder.
    """
    from continuair.studies import as_json

    check_json(json)
    command = again(
        "region", vehicle=vehicle, law=law, gains=gains, model=model, rate=rate,
        runs=runs, seed=seed, out=out,
    )  # fmt: skip
    with progress_bar() as progress:
        from amiri2026.region.report import summary
        from amiri2026.region.study import region as run
        from amiri2026.standard_laws import LAWS
        from continuair import load_gains, load_vehicle
        from continuair.kernels import PLANTS

        with results_in(out, "region", command) as folder:
            study = run(
                load_vehicle(vehicle), law or LAWS, model or PLANTS, rate or (1000.0,), runs, seed,
                load_gains(gains) if gains else None, progress=progress,
            )  # fmt: skip
            keep_in(folder, "region", study, progress)
    print_markdown("\n".join(summary(study.results)))
    tell_where(out)
    write_json(as_json(study.results), json)
