"""`continuair paper` and `continuair report`."""

from __future__ import annotations

import signal
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from continuair.cli import (
    JsonOption,
    VehicleOption,
    again,
    check_json,
    print_table,
    progress_bar,
    results_in,
    write_json,
)
from continuair.errors import InputError

# Everything else is imported inside the commands, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.studies import ResultFolder

_FAILED = 1

_PAGE = "report.html"

# A study's folder in that of the paper, and the command that does it alone.
_COMMANDS: dict[str, tuple[str, dict[str, Any]]] = {
    "table": ("paper", {"only": "table"}),
    "open_loop": ("open-loop", {}),
    "sensitivity": ("sensitivity", {}),
    "sensitivity_hertz": ("sensitivity", {"hertz": True}),
    "tracking": ("tracking", {}),
    "cost": ("cost", {}),
}


def paper(
    vehicle: VehicleOption = "paper",
    out: Annotated[
        str | None,
        typer.Option(help="Folder for the report and, in it, one folder per study.", metavar="DIR"),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(
            help="Sentences or parts, with commas, such as IV-B,III-C.8, or table for Table I. "
            "Default: all."
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Leave out long studies.")] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Exit with 1 unless the recorded verdicts come out.")
    ] = False,
    json: JsonOption = None,
) -> None:
    """Judge every sentence of the paper that claims something, and write a report.

    With --out, ends in DIR/report.html, one page with verdicts, figures and tables.
    """
    from continuair.studies import as_json

    check_json(json)
    if check and (vehicle != "paper" or quick):
        whole = "is set, but verdicts are recorded only for a whole run of the vehicle paper"
        raise InputError("check", whole, "leave out --vehicle and --quick")
    chosen = None if only is None else [name.strip() for name in only.split(",")]
    command = again("paper", vehicle=vehicle, out=out, only=only, quick=quick)
    with results_in(out, "paper", command) as folder:
        results = _judged(vehicle, chosen, quick, folder)
        for entry in results["sentences"]:
            entry["redo"] = again("paper", vehicle=vehicle, only=entry["id"], quick=quick)
        if folder is not None:
            _write(results, folder)
    _show(results)
    if out is not None:
        typer.echo(f"The report is {Path(out) / _PAGE}.", err=True)
    write_json(as_json(results), json)
    if check:
        _check(results)


def report(
    folder: Annotated[str, typer.Argument(help="A folder that a study has written with --out.")],
) -> None:
    """Write a study's results as one page that needs nothing else, report.html in its folder."""
    from amiri2026.report.page import page
    from continuair.studies import add_file, read

    contents = read(folder)
    path = add_file(contents.path, _PAGE, page(contents))
    typer.echo(f"The report is {path}.", err=True)


def _judged(
    vehicle: str, only: list[str] | None, quick: bool, folder: ResultFolder | None
) -> dict[str, Any]:
    """Judge the sentences, and write each study to a folder of its own while the next one runs."""
    from continuair import load_vehicle

    loaded = load_vehicle(vehicle)
    if folder is not None:
        folder.check_parts(_COMMANDS)
    with progress_bar() as progress, _writer() as writer:
        from amiri2026.paper.study import paper as run

        writing: list[Future[None]] = []

        def keep(name: str, found: Any) -> None:
            if folder is not None:
                inside = str(folder.part(name))
                writing.append(writer.submit(_keep, name, found, vehicle, inside, quick))

        def settle() -> None:
            for each in writing:
                each.result()

        try:
            results = run(
                loaded, only, quick=quick, progress=progress, keep=keep, before_timing=settle
            )
            progress(1, 1, "writing results and figures")
            settle()
        except BrokenProcessPool:
            raise InputError(
                "out",
                (
                    f"is {folder and folder.path}, but the process that draws its figures "
                    "was ended from outside"
                ),
                "run it again, with more memory",
            ) from None
        except BaseException:
            writer.shutdown(cancel_futures=True)
            raise
        return results


def _writer() -> ProcessPoolExecutor:
    """Return a process that writes and draws, as a thread would compete with the simulations."""
    # Ctrl-C reaches all processes of a terminal; this one ends when its work is taken from it.
    ignored = signal.SIGINT, signal.SIG_IGN
    return ProcessPoolExecutor(1, get_context("spawn"), signal.signal, ignored)


def _keep(name: str, found: Any, vehicle: str, folder: str, quick: bool) -> None:
    """Write a study's results to its folder."""
    from amiri2026.report.keeping import keep
    from continuair.figures.style import pictures_only

    command, options = _COMMANDS[name]
    redo = again(
        command, **({} if name == "table" else {"vehicle": vehicle}), **options, out=folder
    )
    # Alone, sensitivity varies another vehicle about its own values.
    if quick or (command == "sensitivity" and vehicle != "paper"):
        redo = again("paper", vehicle=vehicle, quick=quick)
    with results_in(folder, name, redo) as part:
        assert part is not None
        with pictures_only() if quick else nullcontext():
            keep(name, found, part)


def _write(results: dict[str, Any], folder: ResultFolder) -> None:
    from amiri2026.paper.report import write
    from amiri2026.report.page import page
    from continuair.studies import read

    write(results, folder)
    folder.finish()
    folder.write_text(_PAGE, page(read(folder.path)))


def _show(results: dict[str, Any]) -> None:
    """Show the verdicts on standard error: standard output is for the JSON alone."""
    from amiri2026.paper.overview import summary
    from amiri2026.paper.report import meaning

    rows = [
        [entry["id"], meaning(entry["verdict"]), entry["claims"]] for entry in results["sentences"]
    ]
    print_table(["sentence", "verdict", "name"], rows, err=True)
    typer.echo(summary(results), err=True)


def _check(results: dict[str, Any]) -> None:
    from amiri2026.paper.recorded import differences

    lines = differences(results)
    for line in lines:
        typer.echo(line, err=True)
    if lines:
        typer.echo(f"{len(lines)} of the recorded verdicts and numbers did not come out.", err=True)
        raise typer.Exit(_FAILED)
    typer.echo("All recorded verdicts and numbers came out.", err=True)
