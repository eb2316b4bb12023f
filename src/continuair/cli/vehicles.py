"""`continuair vehicles` and `continuair check`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

import typer

from continuair.cli import completion
from continuair.cli.application import app
from continuair.cli.terminal import print_table, progress_bar

# Everything else is imported inside the commands, so that --help answers at once.


@app.command(epilog="Example: continuair vehicles")
def vehicles() -> None:
    """List the vehicles that come with the package."""
    from continuair.vehicle.vehicle import load_vehicle, preset_names

    rows = []
    for name in preset_names():
        preset = load_vehicle(name)
        sections = [section for arm in preset.arms for section in arm.section]
        rows.append(
            [name, f"{preset.uav.mass:g}", f"{sum(arm.mass for arm in preset.arms):.3g}"]
            + [" and ".join(str(number) for number in preset.shape)]
            + [_each(section.length for section in sections)]
            + [_each(section.bending_stiffness for section in sections)]
        )
    columns = ["name", "UAV [kg]", "arms [kg]", "sections", "length [m]", "EI [N m²]"]
    print_table(columns, rows)


def _each(values: Iterable[float]) -> str:
    """Return the different values among those of the sections, in order."""
    return ", ".join(dict.fromkeys(f"{value:.3g}" for value in values))


@app.command(epilog="Example: continuair check my_drone.toml")
def check(
    file: Annotated[
        str,
        typer.Argument(
            help="The path of a .toml file, or a preset's name.", autocompletion=completion.vehicles
        ),
    ],
) -> None:
    """Print properties that follow from a vehicle's parameters.

    The lines "beam" are those of an Euler-Bernoulli beam, with the error of constant curvature.
    """
    from continuair.vehicle.uncertain import load_uncertain
    from continuair.vehicle.vehicle import load_vehicle

    uncertain = load_uncertain(file)
    vehicle = uncertain.vehicle if uncertain else load_vehicle(file)
    with progress_bar() as progress:
        progress(0, 1, "finding rest, modes and steps")
        from continuair.analysis.plausible import doubts

        # First of all: what is hardly meant may have no rest, modes or steps.
        for doubt in doubts(vehicle):
            typer.echo(f"Warning: {doubt}", err=True)
        from continuair.studies.check import BANDS, MODES, at_rest, bands_of, facts, modes_of

        rest = at_rest(vehicle)
        known, found = facts(vehicle, rest), modes_of(vehicle, rest)
        bands = bands_of(uncertain) if uncertain else []
    print_table([f"vehicle {vehicle.name}", ""], [list(line) for line in known])
    if found:
        print_table(list(MODES), [list(line) for line in found])
    if bands:
        print_table(list(BANDS), [list(line) for line in bands])
