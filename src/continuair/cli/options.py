"""Options and outputs that several commands share."""

from __future__ import annotations

import json as json_format
import os
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from continuair.cli import completion
from continuair.errors import InputError
from continuair.files import check_can_be_made, printed, reason, user_path

if TYPE_CHECKING:
    from continuair.studies.results import ResultFolder

VehicleOption = Annotated[
    str,
    typer.Option(
        "--vehicle",
        help="A preset's name, or the path of a .toml file.",
        autocompletion=completion.vehicles,
    ),
]


# Text, which out_folder reads: Typer would take an empty path for the current folder.
OutOption = Annotated[
    str | None,
    typer.Option(
        help="Folder for results, new or of this study. Default: none are written.", metavar="DIR"
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option("--json", help="Also write the JSON here; - for standard output.", metavar="FILE"),
]


def out_folder(text: str) -> Path:
    """Return the folder that --out names; raises InputError."""
    if not text:
        raise InputError("out", "is empty", "name a folder, such as results (. is this one)")
    return user_path("out", text)


@contextmanager
def results_in(out: str | None, study: str, command: str = "") -> Iterator[ResultFolder | None]:
    """Open the result folder of --out before any work, and finish it after the block.

    Parameters
    ----------
    out : str or None
        Path of the folder; None for no folder.
    study : str
        Name of the study.
    command : str, optional
        Command line that repeats the study.

    Yields
    ------
    ResultFolder or None
        The folder, or None if `out` is None.

    Raises
    ------
    InputError
        If the folder cannot be used; see `ResultFolder`.
    """
    if out is None:
        yield None
        return
    from continuair.studies.results import ResultFolder

    with ResultFolder(out_folder(out), study, command) as folder:
        yield folder
        folder.finish()


def again(name: str, **options: object) -> str:
    """Return the command line that repeats a command.

    Parameters
    ----------
    name : str
        Name of the command.
    **options
        Values by option. None and False are left out; a list repeats the option.

    Returns
    -------
    str
        The command line, quoted for a shell.
    """
    words = ["continuair", name]
    for key, value in options.items():
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one not in (None, False):
                words += [f"--{key}"] if one is True else [f"--{key}", str(one)]
    return shlex.join(words)


def refuse_unread(why: str, **options: object) -> None:
    """Raise InputError, with the reason, for a given option that would have no effect."""
    for name, value in options.items():
        if value is not None:
            raise InputError(name, f"is {value}, but {why}", "leave it out")


def tell_where(out: str | None) -> None:
    """Print where results are, or how to keep them, on standard error.

    Parameters
    ----------
    out : str or None
        Path of the result folder; None if there is none.
    """
    where = "Name a folder with --out to keep the results."
    typer.echo(where if out is None else f"Results are in {out}.", err=True)


def check_json(json: str | None) -> None:
    """Raise InputError if the file of --json cannot be written or is not one of ours.

    Parameters
    ----------
    json : str or None
        Path of the file, "-" for standard output, or None.

    Raises
    ------
    InputError
        If the path is empty, is a folder, cannot be written, or names a file of other origin.

    Notes
    -----
    Commands check before they start work. A file is ours if it is empty or holds a JSON object with
    the key "study", which the JSON of every command has.
    """
    if json in (None, "-"):
        return
    if not json:
        raise InputError("json", "is empty", "name a file, or - for standard output")
    path = user_path("json", json)
    try:
        if path.is_symlink() and not path.exists():
            raise _unusable(json, "a link to nothing")
        if path.is_dir():
            raise _unusable(json, "Is a directory")
        if path.is_file() and not _is_ours(path):
            raise InputError(
                "json",
                f"is {printed(json)}, a file that continuair has not written",
                "name another, or remove it",
            )
        if not path.parent.is_dir():
            raise _unusable(json, "No such folder")
        if not path.exists():
            check_can_be_made(path)
        elif not os.access(path, os.W_OK):
            raise _unusable(json, "Permission denied")
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise _unusable(json, reason(error)) from None


def write_json(text: str, json: str | None) -> None:
    """Write a study's JSON to the target of --json.

    Parameters
    ----------
    text : str
        The JSON.
    json : str or None
        Path of the file, "-" for standard output, or None to write nothing.

    Raises
    ------
    InputError
        If the file cannot be written. The text is then printed on standard output, as it may be the
        result of long work.
    """
    if json == "-":
        typer.echo(text, nl=False)
    elif json is not None:
        try:
            check_json(json)
            user_path("json", json).write_text(text, encoding="utf-8")
        except (OSError, InputError) as error:
            typer.echo(text, nl=False)
            known = isinstance(error, InputError)
            raise error if known else _unusable(json, reason(error)) from None


def _is_ours(path: Path) -> bool:
    try:
        text = path.read_text(encoding="utf-8")
        content = json_format.loads(text) if text else {"study": None}
        return isinstance(content, dict) and "study" in content
    except (ValueError, TypeError, RecursionError):
        return False


def _unusable(json: str, why: str) -> InputError:
    return InputError(
        "json",
        f"is {printed(json)}, which cannot be written ({why})",
        "name a file that you may write",
    )


def tell_left_exact(vehicle: str, fitted: Sequence[str]) -> None:
    """Warn of fields with errors in the start's file that a fit of other fields takes as exact."""
    from continuair.identification.fields import left_exact
    from continuair.vehicle.uncertain import load_uncertain

    names = left_exact(load_uncertain(vehicle), fitted)
    if names:
        typer.echo(
            f"warning: the fit takes {', '.join(names)} as exact; their errors in {vehicle} are "
            "neither part of the standard errors nor of the fitted file.",
            err=True,
        )
