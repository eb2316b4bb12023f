"""`continuair tracking` and `continuair tune`."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING, Annotated, Any

import typer

from amiri2026.commands.options import ModelOption, complete_letters, keep_in
from continuair.cli import (
    JsonOption,
    OutOption,
    VehicleOption,
    again,
    check_json,
    complete_gains,
    print_table,
    progress_bar,
    results_in,
    tell_where,
    write_json,
)
from continuair.errors import INTERRUPTED, InputError

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from amiri2026.tracking.study import Tracking

GainsOption = Annotated[
    str,
    typer.Option(
        "--gains",
        help="Gains: a preset's name, or the path of a .toml file.",
        autocompletion=complete_gains,
    ),
]


def tracking(
    letters: Annotated[
        str, typer.Option(help="Letters to write.", autocompletion=complete_letters)
    ] = "MRAL",
    vehicle: VehicleOption = "paper",
    gains: GainsOption = "paper",
    model: ModelOption = None,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Track moving letters with the paper's visual servoing law, on each model as the plant.

    The camera is at the tip of the arm that the vehicle's camera.arm names. All sections of that
    arm start with the bend of the paper's one; other arms start straight.

    With --out, writes a table, JSON, CSV, trajectories (netCDF) and figures to that folder.
    """
    from continuair.studies import as_json

    check_json(json)
    study = run_tracking(vehicle, letters, gains, model, out)
    write_json(as_json(study.results), json)


def tune(
    out: Annotated[str, typer.Option(help="The .toml file to write, for tracking --gains.")],
    vehicle: VehicleOption = "paper",
    candidates: Annotated[int, typer.Option(help="Gain sets per round, a power of two.")] = 128,
    rounds: Annotated[int, typer.Option(help="Rounds of the search, each in a smaller box.")] = 4,
    seed: Annotated[int, typer.Option(help="Seed of the search.")] = 0,
) -> None:
    """Search gains for a vehicle: a batch of candidates flies letters in every setting.

    Writes the best that it found, also when interrupted, and says what they lose and why; exits
    with 1 if they fly no setting.
    """
    from amiri2026.tracking.tuning import as_toml
    from amiri2026.tracking.tuning import tune as search
    from continuair import load_vehicle
    from continuair.files import new_file, reason, write_new
    from continuair.scenario import without_rotors

    path = new_file("out", out)
    flown = load_vehicle(vehicle)
    with progress_bar() as progress:
        found = search(flown, candidates=candidates, rounds=rounds, seed=seed, progress=progress)
    try:
        write_new(path, as_toml(found))
    except OSError as error:
        typer.echo(as_toml(found), nl=False)  # a search is long work
        raise InputError(
            "out",
            f"is {out}, which cannot be written ({reason(error)})",
            "the gains are on standard output instead",
        ) from None
    _show_found(found)
    command = again("tracking", vehicle=vehicle, gains=out)
    if without_rotors(flown)[1]:  # which tracking refuses
        command = shlex.join(
            ["continuair", "advise", vehicle, "--task", "track:M", "--gains", str(out)]
        )
    typer.echo(f"Gains are in {out}; fly them with: {command}", err=True)
    if found["interrupted"] or not found["flies"]:
        raise typer.Exit(INTERRUPTED if found["interrupted"] else 1)


def _show_found(found: dict[str, Any]) -> None:
    """Print the errors of the gains in each setting, and where they fail, on standard error."""
    from continuair.studies import number

    reached, lost = found["record"]["rms_px"], found["record"]["lost"]
    table = [
        [*run.split("."), letter, number(value) if isinstance(value, float) else "lost"]
        for part in (reached, lost)
        for run, letters in part.items()
        for letter, value in letters.items()
    ]
    print_table(["setting", "model", "letter", "RMS after 5 s [px]"], table, err=True)
    for remark in found["remarks"]:
        typer.echo(remark, err=True)


def run_tracking(
    vehicle: str, letters: str, gains: str, models: list[str] | None, out: str | None
) -> Tracking:
    """Run the study, store it and its figures, and show its table."""
    from continuair import load_gains, load_vehicle

    loaded, law = load_vehicle(vehicle), load_gains(gains)
    with progress_bar() as progress:
        from amiri2026.tracking.study import tracking as run
        from continuair import MODELS

        command = again(
            "tracking", vehicle=vehicle, letters=letters, gains=gains, model=models, out=out
        )
        with results_in(out, "tracking", command) as folder:
            study = run(loaded, letters, law, models or MODELS, progress=progress)
            if folder is not None:
                from amiri2026.tracking.law_variants import law_variants

                first = letters[0].upper()
                study.results["variants"] = law_variants(loaded, law, first, progress=progress)
            keep_in(folder, "tracking", study, progress)
    _show(study)
    tell_where(out)
    return study


def _show(study: Tracking) -> None:
    from amiri2026.tracking.report import COLUMNS, counted_from, of_sections, remarks, rows
    from continuair.studies import number

    shown = ("rms_px", "norm_max_px", "tip_rms_m", "ds_max_px_before_2s", "ds_max_px_after_2s")
    columns = ["setting", "letter", "model", *(COLUMNS[key].replace(" [", "\n[") for key in shown)]
    table = [
        [setting, letter, model, *(number(entry.get(key)) for key in shown)]
        for setting, letter, model, entry in rows(study.results)
    ]
    print_table(columns, table, err=True)
    since = counted_from(study.results)
    typer.echo(f"Errors and distances off the target are of {since} s on.", err=True)
    for line in [*of_sections(study.results), *remarks(study.results)]:
        typer.echo(line, err=True)
