"""`continuair identify`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from continuair.cli import completion
from continuair.cli.application import app
from continuair.cli.options import JsonOption, check_json, tell_left_exact, write_json
from continuair.cli.terminal import print_table, progress_bar

# Everything else is imported inside the command, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.identification import Fit


@app.command(epilog="Example: continuair identify --data FLIGHT.csv --vehicle paper")
def identify(
    data: Annotated[
        Path,
        typer.Option(help="The recorded flight: a .csv file, a PX4 log (.ulg), or a ROS 2 bag."),
    ],
    vehicle: Annotated[
        str,
        typer.Option(
            help="Where the fit starts: a preset or .toml file.", autocompletion=completion.vehicles
        ),
    ],
    fit: Annotated[
        str | None,
        typer.Option(
            help="Fields to fit, with commas. Default: every section's stiffness and damping."
        ),
    ] = None,
    test: Annotated[
        str | None,
        typer.Option(
            help="Open-loop test that was flown, A to D; inputs in the data are not used then."
        ),
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(
            help="Role and topic of a log, such as tip=/arm/tip; repeatable. Of a ROS 2 bag, "
            "bend, bend_moment, rotors and motors alone take fields. Of a PX4 log, TOPIC.1 is the "
            "topic's instance 1.",
            metavar="ROLE=TOPIC[:FIELDS][*SCALE]",
        ),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(help="Rows per second made of a log. Default: as its slowest measurement."),
    ] = None,
    window: Annotated[
        tuple[float, float] | None,
        typer.Option(help="The part of a log to use: seconds since its start.", metavar="FROM TO"),
    ] = None,
    imu: Annotated[
        tuple[float, float, float],
        typer.Option(
            help="The accelerometer's place from the UAV's centre of mass, body axes, z up [m].",
            metavar="X Y Z",
        ),
    ] = (0.0, 0.0, 0.0),
    thrust_curve: Annotated[
        Path | None,
        typer.Option(
            help="Thrusts [N] of a motor's signals, measured on a stand: a CSV file with the "
            "columns signal and thrust, for --topic motors=TOPIC:FIELDS. Default: the vehicle's "
            "thrust_model_factor."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File for the fitted vehicle, with the covariance of its fields."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a vehicle that continuair wrote to --out.")
    ] = False,
    json: JsonOption = None,
) -> None:
    """Fit a vehicle to a recorded flight."""
    from continuair.vehicle.vehicle import load_vehicle

    check_json(json)
    start = load_vehicle(vehicle)
    with progress_bar() as progress:
        from continuair import identification
        from continuair.interfaces.flights import read_flight
        from continuair.studies.results import as_json
        from continuair.vehicle.vehicle import UNCERTAINTY
        from continuair.vehicle.vehicle_file import check_file, write_vehicle

        if out is not None:
            check_file(out, force)
        recording = read_flight(data, start, topic or [], rate, window, imu, thrust_curve)
        names = None if fit is None else fit.split(",")
        found = identification.fit(start, recording, names, test=test, progress=progress)
    if recording.sampling:
        typer.echo(recording.sampling, err=True)
    _show(found)
    tell_left_exact(vehicle, found.fields)
    write_json(as_json(found.describe()), json)
    if out is not None:
        comment = [f"Fitted to {recording.name} by continuair identify."]
        beside = {UNCERTAINTY: found.uncertainty} if found.uncertainty else {}
        write_vehicle(found.vehicle, out, comment, beside=beside, force=force)
    where = f"The vehicle is {out}." if out else "Name a file with --out to keep the vehicle."
    typer.echo(where, err=True)


def _show(found: Fit) -> None:
    """Print estimates with their standard errors, and parameters that the data do not determine."""
    columns = zip(found.fields, found.start, found.values, found.errors, strict=True)
    rows = [
        [name, f"{start:.5g}", f"{value:.5g}", f"{error:.2g}" if error < float("inf") else "none"]
        for name, start, value, error in columns
    ]
    print_table(["name", "start", "estimate", "standard error"], rows, err=True)
    left = ", ".join(f"{name} {value:.3g}" for name, value in found.deviations.items())
    typer.echo(
        f"Left over (standard deviation): {left}; condition {found.condition:.3g}.", err=True
    )
    for name, bias in found.biases.items():
        typer.echo(f"Bias of {name}: {', '.join(f'{x:.3g}' for x in bias)}.", err=True)
    for doubt in found.doubts:
        typer.echo(f"warning: {doubt}", err=True)
