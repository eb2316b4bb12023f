"""The command line: each command reads its input, calls the library and shows what came out."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from continuair.errors import ContinuairWarning, InputError

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.studies.folder import ResultFolder
    from continuair.studies.open_loop import OpenLoop, Progress
    from continuair.vehicle import Vehicle

_INTERRUPTED = 130  # what shells report for a process ended by Ctrl-C
_UNUSABLE_INPUT = 2
_COMPILING = "compiling kernels (first run only, some seconds)"


class _Reporting(TyperGroup):
    """Tells a user's error in its own sentence, and no traceback."""

    def invoke(self, ctx: Any) -> Any:
        try:
            with _plain_warnings():
                return super().invoke(ctx)
        except InputError as error:
            typer.echo(str(error), err=True)
            raise typer.Exit(_UNUSABLE_INPUT) from None
        except KeyboardInterrupt:
            typer.echo("Interrupted; what was not yet written is lost.", err=True)
            raise typer.Exit(_INTERRUPTED) from None


app = typer.Typer(
    cls=_Reporting,
    help="Simulation of aerial continuum manipulators: a multirotor, and a continuum arm under it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

VehicleOption = Annotated[
    str, typer.Option("--vehicle", help="A preset's name, or the path of a .toml file.")
]


def main() -> None:
    """Run the command line."""
    app()


def _show_version(wanted: bool) -> None:
    if wanted:
        from continuair import __version__

        typer.echo(f"continuair {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


@app.command("open-loop")
def open_loop(
    vehicle: VehicleOption = "paper",
    tests: Annotated[str, typer.Option(help="Letters of the tests to run.")] = "ABCD",
    model: Annotated[
        list[str] | None,
        typer.Option(help="A model to compare with the coupled one; repeatable. Default: all."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for results, new or of this study. Default: none are written."),
    ] = None,
    json: Annotated[
        str | None, typer.Option(help="Also write the JSON here; - for standard output.")
    ] = None,
) -> None:
    """Run the paper's open-loop tests A to D and compare the models.

    With --out, writes a table, JSON, CSV, trajectories (netCDF) and figures to that folder.
    """
    from continuair.studies import open_loop_output

    study = _run_open_loop(vehicle, tests, model, out)
    text = open_loop_output.as_json(study.results)
    if json == "-":
        typer.echo(text, nl=False)
    elif json is not None:
        try:
            Path(json).write_text(text, encoding="utf-8")
        except OSError as error:
            problem = f"json is {json}, which cannot be written ({error.strerror})"
            raise InputError(f"{problem}; name a file that you may write.") from None


@app.command()
def vehicles() -> None:
    """List the vehicles that come with the package."""
    from continuair.vehicle import load_vehicle, preset_names

    rows = []
    for name in preset_names():
        preset = load_vehicle(name)
        arm = preset.arm
        rows.append(
            [name, f"{preset.uav.mass:g}", f"{arm.mass:.3g}", f"{arm.length:g}"]
            + [f"{1e3 * arm.radius:g}", f"{arm.youngs_modulus / 1e9:g}"]
        )
    columns = ["name", "UAV [kg]", "arm [kg]", "length [m]", "radius [mm]", "E [GPa]"]
    _print_table(columns, rows)


@app.command()
def check(
    file: Annotated[str, typer.Argument(help="The path of a .toml file, or a preset's name.")],
) -> None:
    """Read a vehicle and show what follows from its parameters."""
    from continuair.vehicle import load_vehicle

    vehicle = load_vehicle(file)
    rows = [[name, value] for name, value in _derived(vehicle)]
    _print_table([f"vehicle {vehicle.name}", ""], rows)


@app.command()
def paper(
    vehicle: VehicleOption = "paper",
    out: Annotated[Path, typer.Option(help="Folder for results, one folder per study.")] = Path(
        "results"
    ),
) -> None:
    """Run every study of the paper that there is."""
    _run_open_loop(vehicle, "ABCD", None, out / "open_loop")


def _derived(vehicle: Vehicle) -> list[tuple[str, str]]:
    """Return names and values of what a vehicle's parameters imply."""
    from math import pi

    from continuair.linear import STEP_PHASE, bending_frequencies

    arm = vehicle.arm
    clamped, free = (float(value) for value in bending_frequencies(vehicle))
    hertz = [f"{value:.4g} rad/s ({value / (2 * pi):.4g} Hz)" for value in (clamped, free)]
    return [
        ("arm mass", f"{arm.mass:.4g} kg"),
        ("arm mass / UAV mass", f"{arm.mass / vehicle.uav.mass:.4g}"),
        ("bending stiffness EI", f"{arm.bending_stiffness:.4g} N m²"),
        ("bending frequency, UAV clamped", hertz[0]),
        ("bending frequency, UAV free", hertz[1]),
        ("step for accurate results", f"{1e3 * STEP_PHASE / max(clamped, free):.3g} ms"),
    ]


def _run_open_loop(
    vehicle: str, tests: str, models: list[str] | None, out: Path | None
) -> OpenLoop:
    """Run the study, store it and its figures, and show its table."""
    from continuair.studies.folder import ResultFolder
    from continuair.vehicle import load_vehicle

    loaded = load_vehicle(vehicle)
    with _progress() as progress:
        from continuair.simulation import MODELS
        from continuair.studies.open_loop import choose
        from continuair.studies.open_loop import open_loop as run

        choose(tests, models or MODELS)
        # The folder is claimed before the flights: a wrong one is told at once.
        folder = None if out is None else ResultFolder(out, "open_loop")
        study = run(loaded, tests, models or MODELS, progress=progress)
        if folder is not None:
            progress(1, 1, "writing results and figures")
            _store(study, folder)
    _show_open_loop(study, folder.path if folder else None)
    return study


def _store(study: OpenLoop, folder: ResultFolder) -> None:
    from continuair.figures import open_loop as figures
    from continuair.studies import open_loop_output

    open_loop_output.write(study, folder)
    figures.write(study.results, study.datasets, folder.file)
    folder.finish()


def _show_open_loop(study: OpenLoop, path: Path | None) -> None:
    """Show the table on standard error: standard output is for the JSON alone."""
    from continuair.studies.open_loop_output import METRICS, number, remarks, rows

    columns = ["test", "model", "NRMSE\nT", "NRMSE\nR", "RMSE T\n[m]", "RMSE R\n[rad]"]
    columns += ["angle\n[rad]", "step\nerror"]
    table = [
        [test, model, *(number(entry[key]) for key in METRICS)]
        for test, model, entry in rows(study.results)
    ]
    _print_table(columns, table, err=True)
    where = f"Results are in {path}." if path else "Name a folder with --out to keep the results."
    for line in [*remarks(study.results), study.results["note"], where]:
        typer.echo(line, err=True)


def _print_table(columns: list[str], rows: list[list[str]], err: bool = False) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    words = {"test", "model", "name", columns[0]}
    for column in columns:
        table.add_column(
            Text(column), justify="left" if column in words else "right", overflow="fold"
        )
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    Console(stderr=err).print(table)


@contextmanager
def _progress() -> Iterator[Progress]:
    """Yield a function that shows (done, total, what) as a bar, on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, SpinnerColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    columns = (
        SpinnerColumn(),
        BarColumn(20),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("loading", total=None)

        def show(done: int, total: int, what: str) -> None:
            note = f": {_COMPILING}" if done == 0 else ""
            bar.update(task, completed=done, total=total, description=what + note)

        yield show


@contextmanager
def _plain_warnings() -> Iterator[None]:
    """Print the project's own warnings as one line on standard error."""
    with warnings.catch_warnings():
        show = warnings.showwarning

        def one_line(message: Any, category: type[Warning], *rest: Any, **named: Any) -> None:
            if issubclass(category, ContinuairWarning):
                print(f"warning: {' '.join(str(message).split())}", file=sys.stderr)
            else:
                show(message, category, *rest, **named)

        warnings.showwarning = one_line
        yield
