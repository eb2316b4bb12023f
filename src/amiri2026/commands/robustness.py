"""`continuair robustness`."""

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


def robustness(
    vehicle: VehicleOption = "paper",
    law: LawOption = None,
    gains: LawGainsOption = None,
    model: PlantOption = None,
    mistake: Annotated[
        list[str] | None,
        typer.Option(help="Kind of mismatch, as in the table; repeatable. Default: all."),
    ] = None,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Track a letter with laws that are wrong about their vehicle, its camera or the air.

    With --out, writes a table, JSON, CSV and figures to that folder.
    """
    from continuair.studies import as_json

    check_json(json)
    command = again(
        "robustness", vehicle=vehicle, law=law, gains=gains, model=model, mistake=mistake, out=out,
    )  # fmt: skip
    with progress_bar() as progress:
        from amiri2026.robustness.mistakes import MISTAKES
        from amiri2026.robustness.report import summary
        from amiri2026.robustness.study import robustness as run
        from amiri2026.standard_laws import LAWS
        from continuair import load_gains, load_vehicle
        from continuair.kernels import PLANTS

        with results_in(out, "robustness", command) as folder:
            study = run(
                load_vehicle(vehicle), law or LAWS, model or PLANTS, mistake or MISTAKES,
                load_gains(gains) if gains else None, progress=progress,
            )  # fmt: skip
            keep_in(folder, "robustness", study, progress)
    print_markdown("\n".join(summary(study.results)))
    tell_where(out)
    write_json(as_json(study.results), json)
