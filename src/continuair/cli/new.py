"""`continuair new`."""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from continuair.cli import completion
from continuair.cli.application import app
from continuair.errors import InputError, shown
from continuair.files import new_file, printed, save

# Everything else is imported inside the command, so that --help answers at once.
if TYPE_CHECKING:
    from continuair.vehicle.template import Outline

QUESTIONS = {
    "mass": "Mass of the UAV without its arm, in kg",
    "layout": "Layout of the rotors, such as quad_x, hex_plus or octo_x",
    "lever": "Distance of the rotors from the centre, in m",
    "length": "Length of the arm, in m",
    "sections": "Sections that the arm bends in",
    "load": "Mass of what its tip carries, in kg",
    "radius": "Radius of the arm's backbone, in m",
}

_NEXT = ("check", "advise", "view")


@app.command(epilog="Example: continuair new my_drone.toml --from two_section")
def new(
    context: typer.Context,
    file: Annotated[str, typer.Argument(help="The .toml file to write; never one that is there.")],
    preset: Annotated[
        str | None,
        typer.Option(
            "--from",
            help="The preset to copy, with comments.",
            autocompletion=completion.preset_vehicles,
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Take every default without questions.")
    ] = False,
) -> None:
    """Write a vehicle file to start from, with the unit and meaning of every field.

    In a terminal it asks for masses, rotors and the arm; Enter takes the default.
    """
    from continuair.vehicle.template import Outline, as_template

    path = _path(file)
    if preset is not None:
        text = _copy(preset, path.stem)
    else:
        outline = Outline(path.stem)
        text = as_template(outline if yes or not asks() else _answered(outline))
    save("file", path, text)
    typer.echo(f"{printed(file)} is written; correct its values, then run:")
    known = context.find_root().command.list_commands(context)  # type: ignore[attr-defined]
    for name in _NEXT:
        if name in known:
            typer.echo(f"  continuair {name} {shlex.quote(file)}")


def asks() -> bool:
    """Return whether input and output are a terminal, so that questions can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def _path(file: str) -> Path:
    """Return the new file, whose name must be valid for a vehicle; raises InputError."""
    if Path(file).suffix != ".toml":
        raise InputError(
            "file",
            f"is {shown(file)}, but vehicles are .toml files",
            "give it a name such as my_drone.toml",
        )
    return new_file("file", file)


def _copy(preset: str, name: str) -> str:
    """Return the text of a preset as a vehicle of another name."""
    from continuair import checks
    from continuair.vehicle.template import renamed
    from continuair.vehicle.vehicle import preset_names, preset_text

    return renamed(preset_text(checks.choice("from", preset, preset_names())), name)


def _answered(outline: Outline) -> Outline:
    """Prompt for each field until the answer is valid for a vehicle."""
    for field, question in QUESTIONS.items():
        while True:
            default = outline.backbone_radius if field == "radius" else getattr(outline, field)
            try:
                answer = typer.prompt(question, default=str(default), err=True)
            except typer.Abort:
                typer.echo(err=True)
                raise InputError(
                    field,
                    "is not answered, since the input has ended",
                    "answer it, or take every default with --yes",
                ) from None
            try:
                outline = replace(outline, **{field: _read(field, answer, type(default))})
                break
            except InputError as error:
                typer.echo(str(error), err=True)
    return outline


def _read(field: str, answer: str, kind: type) -> Any:
    """Return an answer as a value of its kind; raises InputError."""
    try:
        return kind(answer)
    except ValueError:
        noun = "a whole number" if kind is int else "a number, such as 0.5"
        raise InputError(field, f"is {shown(answer)}", f"give {noun}") from None
