"""`continuair vehicles` and `continuair check`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

import typer

from continuair.cli.application import app
from continuair.cli.terminal import print_table

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.vehicle.vehicle import Vehicle


@app.command()
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


@app.command()
def check(
    file: Annotated[str, typer.Argument(help="The path of a .toml file, or a preset's name.")],
) -> None:
    """Read a vehicle and show what follows from its parameters.

    The lines "beam" are those of an Euler-Bernoulli beam, with the error of constant curvature.
    """
    from continuair.vehicle.vehicle import load_vehicle

    vehicle = load_vehicle(file)
    rows = [[name, value] for name, value in _derived(vehicle)]
    print_table([f"vehicle {vehicle.name}", ""], rows)


def _derived(vehicle: Vehicle) -> list[tuple[str, str]]:
    """Return names and values of what a vehicle's parameters imply."""
    from math import pi

    from continuair.analysis.beam import curvature_error
    from continuair.analysis.linear import bending_frequencies
    from continuair.engine.engine import Engine
    from continuair.flight.steps import automatic_step
    from continuair.kernels.step import STEP_PHASE
    from continuair.vehicle.layout import Layout

    arm = vehicle.arm
    clamped, free = (float(value) for value in bending_frequencies(vehicle))
    straight = [0.0] * Layout(vehicle.shape).coordinates
    step = float(automatic_step(Engine(vehicle, "coupled"), straight)[0])
    hertz = [f"{value:.4g} rad/s ({value / (2 * pi):.4g} Hz)" for value in (clamped, free)]
    return [
        ("arm mass", f"{arm.mass:.4g} kg"),
        ("arm mass / UAV mass", f"{arm.mass / vehicle.uav.mass:.4g}"),
        ("bending stiffness EI", f"{arm.bending_stiffness:.4g} N m²"),
        ("bending frequency, UAV clamped", hertz[0]),
        ("bending frequency, UAV free", hertz[1]),
        ("fastest rate, damping included", f"{STEP_PHASE / step:.4g} 1/s"),
        ("automatic step, from rest", f"{1e3 * step:.3g} ms"),
        *(
            (f"beam: {name}", f"{entry['reference']:.4g} {entry['units']} ({entry['error']:+.1%})")
            for name, entry in curvature_error(vehicle).items()
            if entry["error"] and "decoupled" not in name
        ),
    ]
