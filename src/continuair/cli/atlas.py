"""`continuair atlas`."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli.application import app
from continuair.cli.options import refuse_unread, results_in
from continuair.cli.terminal import print_markdown, progress_bar


@app.command(epilog="Example: continuair atlas --loop position --out controlled")
def atlas(
    out: Annotated[
        str, typer.Option(help="Folder for the atlas, new or of this study.", metavar="DIR")
    ],
    runs: Annotated[
        int | None,
        typer.Option(
            help="Open-loop flights, each with every model; a fiftieth in addition in closed loop. "
            "Default: 100000."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    loop: Annotated[
        str,
        typer.Option(help="Loop of the hover: none, or position, as in advise."),
    ] = "none",
    vehicles: Annotated[
        int | None,
        typer.Option(help="Vehicles to simulate with --loop position. Default: 2048."),
    ] = None,
) -> None:
    """Map where decoupling holds, over dimensionless groups, for any vehicle.

    100,000 flights, or 2048 vehicles with --loop position, take some ten minutes on two cores.
    """
    from continuair import checks

    checks.choice("loop", loop, ("none", "position"))
    if loop == "position":
        refuse_unread("--loop position flies --vehicles; give those", runs=runs)
        _controlled(out, vehicles, seed)
        return
    refuse_unread("--loop none flies --runs; give those, or --loop position", vehicles=vehicles)
    with progress_bar() as progress:
        from continuair.figures import atlas as figures
        from continuair.studies.atlas import study as study
        from continuair.studies.atlas.collapse import curves
        from continuair.studies.atlas.report import as_table
        from continuair.studies.atlas.summary import save

        with results_in(out, "atlas") as folder:
            assert folder is not None
            summary = study.atlas(study.RUNS if runs is None else runs, seed, progress=progress)
            save(summary, folder.file("atlas.npz"))
            folder.write_text("table.md", as_table(summary))
            figures.write(summary, curves(), folder.file)
    print_markdown(as_table(summary))


def _controlled(out: str, vehicles: int | None, seed: int) -> None:
    """Simulate vehicles with a loop, and write the rule and its accuracy."""
    with progress_bar() as progress:
        from continuair.figures import controlled as figures
        from continuair.studies.atlas import study as study
        from continuair.studies.atlas.page import as_table
        from continuair.studies.atlas.summary import CONTROLLED_SUMMARY, save

        vehicles = study.VEHICLES if vehicles is None else vehicles
        study.check_size(vehicles, seed)
        with results_in(out, "atlas") as folder:
            assert folder is not None
            flown = folder.part("flights")
            summary = study.controlled(vehicles, seed, folder=flown, progress=progress)
            save(summary, folder.file(CONTROLLED_SUMMARY))
            folder.write_text("table.md", as_table(summary))
            figures.write(summary, folder.file)
    print_markdown(as_table(summary))
