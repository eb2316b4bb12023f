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
    from continuair.engine.engine import Engine
    from continuair.flight.steps import automatic_step
    from continuair.kernels.resolution import STEP_PHASE
    from continuair.vehicle.layout import Layout

    straight = [0.0] * Layout(vehicle.shape).coordinates
    step = float(automatic_step(Engine(vehicle, "coupled"), straight)[0])
    mass = sum(arm.mass for arm in vehicle.arms)
    return [
        ("arm mass", f"{mass:.4g} kg"),
        ("arm mass / UAV mass", f"{mass / vehicle.uav.mass:.4g}"),
        *(_of_sections(vehicle) if vehicle.has_arm_list else _of_arm(vehicle)),
        ("fastest rate, damping included", f"{STEP_PHASE / step:.4g} 1/s"),
        ("automatic step, from rest", f"{1e3 * step:.3g} ms"),
        *([] if vehicle.has_arm_list else _beside_a_beam(vehicle)),
    ]


def _of_arm(vehicle: Vehicle) -> list[tuple[str, str]]:
    """Return the stiffness of the one section, and its frequency."""
    from continuair.analysis.linear import bending_frequencies

    clamped, free = bending_frequencies(vehicle)
    return [
        ("bending stiffness EI", f"{vehicle.arm.bending_stiffness:.4g} N m²"),
        ("bending frequency, UAV clamped", _hertz(clamped)),
        ("bending frequency, UAV free", _hertz(free)),
    ]


def _of_sections(vehicle: Vehicle) -> list[tuple[str, str]]:
    """Return what each section is, and the lowest and highest frequencies of all together."""
    from continuair.analysis.linear import modes

    rows = [
        (
            f"section {arm.name}.{section.name}",
            f"{section.length:.4g} m, {section.mass:.4g} kg, "
            f"EI {section.bending_stiffness:.4g} N m²",
        )
        for arm in vehicle.arms
        for section in arm.section
    ]
    for base in ("clamped", "free"):
        # Without gravity, as the line of one section has it.
        found = modes(vehicle, base=base, gravity=0.0).frequencies
        rows.append((f"lowest bending frequency, UAV {base}", _hertz(found[0])))
        rows.append((f"highest bending frequency, UAV {base}", _hertz(found[-1])))
    return rows


def _beside_a_beam(vehicle: Vehicle) -> list[tuple[str, str]]:
    from continuair.analysis.beam import curvature_error

    return [
        (f"beam: {name}", f"{entry['reference']:.4g} {entry['units']} ({entry['error']:+.1%})")
        for name, entry in curvature_error(vehicle).items()
        if entry["error"] and "decoupled" not in name
    ]


def _hertz(rate: float) -> str:
    from math import pi

    return f"{rate:.4g} rad/s ({rate / (2 * pi):.4g} Hz)"
