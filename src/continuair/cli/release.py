"""`continuair fit-release` and `continuair validate-release`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from continuair.cli import completion
from continuair.cli.application import app
from continuair.cli.options import check_json, tell_left_exact, write_json
from continuair.cli.terminal import print_table, progress_bar
from continuair.errors import InputError

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.identification import JointFit

RateOption = Annotated[float, typer.Option(help="Samples per second of the recording.")]
JsonToOutput = Annotated[
    str,
    typer.Option(help='File for the JSON, "-" for standard output.', metavar="FILE"),
]


@app.command(epilog="Example: continuair fit-release R.csv --payload 0.2 --vehicle V.toml --out F")
def fit_release(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Recorded releases (.csv), columns ID, x1, y1, z1, x2 …", metavar="FILES"
        ),
    ],
    payload: Annotated[
        list[float], typer.Option(help="Mass that the tip carried [kg]; one for each file.")
    ],
    vehicle: Annotated[
        str,
        typer.Option(
            help="Where the fit starts: a .toml file with a [bench] table.",
            autocompletion=completion.vehicles,
        ),
    ],
    out: Annotated[Path, typer.Option(help="File for the fitted vehicle.")],
    fit: Annotated[
        str | None,
        typer.Option(
            help="Fields to fit, with commas. Default: every section's stiffness and damping."
        ),
    ] = None,
    rate: RateOption = 100.0,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a vehicle that continuair wrote to --out.")
    ] = False,
) -> None:
    """Fit a vehicle's arm to recorded releases: bent, let go, swinging below a fixed base."""
    if len(payload) != len(files):
        raise InputError(
            "payload", f"is given {len(payload)} times for {len(files)} files", "give one for each"
        )
    with progress_bar() as progress:
        from continuair.identification import fit_jointly, load_bench, load_releases
        from continuair.identification.fields import fitted_fields
        from continuair.vehicle.vehicle import BENCH, UNCERTAINTY, load_vehicle
        from continuair.vehicle.vehicle_file import check_file, write_vehicle

        check_file(out, force)
        start, bench = load_vehicle(vehicle), load_bench(vehicle)
        each = zip(files, payload, strict=True)
        recordings = [load_releases(file, bench, payload=mass, rate=rate) for file, mass in each]
        names = fitted_fields(start, None if fit is None else fit.split(",")).names
        found = fit_jointly(start, recordings, names, progress=progress)
    _show_fit(found)
    tell_left_exact(vehicle, names)
    comment = [
        f"Fitted to {', '.join(each.name for each in recordings)} by continuair fit-release."
    ]
    beside: dict[str, dict[str, Any]] = {BENCH: bench.describe()}
    if found.uncertainty:
        beside[UNCERTAINTY] = found.uncertainty
    write_vehicle(found.vehicle, out, comment, beside=beside, force=force)
    typer.echo(f"The vehicle is {out}.", err=True)


def _show_fit(found: JointFit) -> None:
    """Print estimates with their standard errors, and what the recordings leave free."""
    columns = zip(found.fields, found.values, found.errors, strict=True)
    rows = [
        [name, f"{value:.4g}", f"{error:.2g}" if error < float("inf") else "none"]
        for name, value, error in columns
    ]
    print_table(["name", "estimate", "standard error"], rows, err=True)
    for name, rms in found.rms.items():
        typer.echo(f"Left over of {name}: {1e3 * rms:.1f} mm (root mean square).", err=True)
    for combination in found.free:
        typer.echo(
            f"warning: the recordings cannot tell {' and '.join(combination)} apart; fit fewer.",
            err=True,
        )
    if not found.converged:
        typer.echo("warning: the fit has not converged; start from closer values.", err=True)


@app.command(
    epilog="Example: continuair validate-release RELEASES.csv --payload 0.3 --fit fit.toml"
)
def validate_release(
    file: Annotated[
        Path, typer.Argument(help="Recorded releases (.csv), columns ID, x1, y1, z1, x2 …")
    ],
    payload: Annotated[float, typer.Option(help="Mass that the tip carried [kg].")],
    fit: Annotated[
        Path,
        typer.Option(help="The vehicle, a .toml file with a [bench] table, as of fit-release."),
    ],
    rate: RateOption = 100.0,
    json: JsonToOutput = "-",
) -> None:
    """Predict recorded releases of an arm, with another payload than it was fitted to."""
    check_json(json)
    from continuair.identification import load_bench, load_releases, validate_releases
    from continuair.studies.results import as_json
    from continuair.vehicle.vehicle import load_vehicle

    vehicle, bench = load_vehicle(str(fit)), load_bench(fit)
    releases = load_releases(file, bench, payload=payload, rate=rate)
    found = validate_releases(vehicle, releases).describe()
    _show_validation(found)
    write_json(as_json(found), json)


def _show_validation(found: dict[str, Any]) -> None:
    """Print measured and predicted values, and the error of the markers."""
    labels = {
        "frequency_hz": "frequency [Hz]",
        "damping_ratio": "damping ratio",
        "rms_mm": "motion of the tip, RMS [mm]",
    }
    rows = []
    for key, label in labels.items():
        row = found[key]
        error = row["standard_error"]
        scatter = "" if error is None else f" ± {error:.2g}"
        rows.append([label, f"{row['measured']:.3g}{scatter}", f"{row['predicted']:.3g}"])
    print_table(["", "measured", "predicted"], rows, err=True)
    typer.echo(
        f"Markers are {found['error_mm']:.1f} mm from their predicted places (root mean square, "
        f"{found['releases']} releases).",
        err=True,
    )
