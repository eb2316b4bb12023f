"""Options and outputs that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from continuair.errors import InputError

VehicleOption = Annotated[
    str, typer.Option("--vehicle", help="A preset's name, or the path of a .toml file.")
]

OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", help="Folder for results, new or of this study. Default: none are written."
    ),
]
JsonOption = Annotated[
    str | None,
    typer.Option("--json", help="Also write the JSON here; - for standard output."),
]


def write_json(text: str, json: str | None) -> None:
    """Write a study's JSON where --json says: nowhere, standard output or a file."""
    if json == "-":
        typer.echo(text, nl=False)
    elif json is not None:
        try:
            Path(json).write_text(text, encoding="utf-8")
        except OSError as error:
            problem = f"json is {json}, which cannot be written ({error.strerror})"
            raise InputError(f"{problem}; name a file that you may write.") from None
