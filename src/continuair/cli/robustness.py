"""`continuair robustness`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli.application import app
from continuair.cli.options import (
    JsonOption,
    LawGainsOption,
    LawOption,
    OutOption,
    PlantOption,
    VehicleOption,
    again,
    check_json,
    keep_in,
    results_in,
    tell_where,
    write_json,
)
from continuair.cli.terminal import print_markdown, progress_bar


@app.command(epilog="Example: continuair robustness --law current --mistake heavier")
def robustness(
    vehicle: VehicleOption = "paper",
    law: LawOption = None,
    gains: LawGainsOption = None,
    model: PlantOption = None,
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
            keep_in(folder, "robustness", study, progress)
    print_markdown("\n".join(summary(study.results)))
    tell_where(out)
    write_json(as_json(study.results), json)
