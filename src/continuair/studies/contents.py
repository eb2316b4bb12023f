"""Result folders read back."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from continuair.errors import InputError
from continuair.files import (
    DAMAGE,
    check_regular,
    check_version,
    printed,
    reason,
    user_path,
)
from continuair.studies.results import MARKER, UNFINISHED, bare

Json: TypeAlias = dict[str, Any]
"""A JSON object."""


@dataclass(frozen=True)
class Contents:
    """The results of one study, read from its folder.

    Parameters
    ----------
    path : Path
        The folder.
    study : str
        Name of the study.
    version : str
        Version of the package that wrote it.
    command : str
        Command line that repeats the study.
    results : dict
        Its JSON.
    table : str
        Its table in Markdown.
    figures : dict of str to Path
        The smallest file of each figure, by name.
    parts : list of Contents
        Results of the study's parts.
    """

    path: Path
    study: str
    version: str
    command: str
    results: Json
    table: str
    figures: dict[str, Path]
    parts: list[Contents]


def read(folder: str | os.PathLike[str]) -> Contents:
    """Read a result folder and those inside it.

    Parameters
    ----------
    folder : str or path-like
        The folder.

    Returns
    -------
    Contents
        Its results.

    Raises
    ------
    InputError
        If it is no result folder, or is incomplete, damaged, or of a later version.
    """
    path = user_path("folder", folder)
    try:
        return _read(path)
    except InputError:
        raise
    except DAMAGE as error:
        raise damaged(path, error) from None


def damaged(path: Path, error: Exception) -> InputError:
    """Return the error of a folder whose files are damaged.

    Parameters
    ----------
    path : Path
        The folder.
    error : Exception
        The error that reading raised.

    Returns
    -------
    InputError
        An error that names folder, reason and remedy.
    """
    return InputError(
        "folder",
        f"is {printed(path)}, whose results cannot be read ({reason(error)})",
        "run the study again",
    )


def _read(path: Path, inside: bool = False) -> Contents:
    """Read a result folder; if it is inside another, no link to it is followed."""
    marker = path / MARKER
    if not marker.is_file() or marker.is_symlink() or (inside and path.is_symlink()):
        raise InputError(
            "folder",
            f"is {printed(path)}, which holds no results of continuair",
            "name one that a study has written with --out",
        )
    made = _object(_text(marker))
    check_version("folder", path, str(made.get("version", "0")))
    if (path / UNFINISHED).exists():
        raise InputError(
            "folder", f"is {printed(path)}, whose writing was interrupted", "run the study again"
        )
    (study,) = bare([made["study"]])
    numbers = path / f"{study}.json"
    results = _object(_text(numbers)) if os.path.lexists(numbers) else {}
    _object(results.get("vehicle", {}))
    return Contents(
        path,
        study,
        str(made.get("version", "")),
        str(made.get("command", "")),
        results,
        _text(path / "table.md"),
        _figures(path, bare(made["files"])),
        [_read(path / part, inside=True) for part in sorted(bare(made.get("parts", ())))],
    )


def _text(path: Path) -> str:
    """Return the text of a regular file; follow no link, and read nothing that may never end."""
    if path.is_symlink():
        raise ValueError(f"{path.name} is a link")
    check_regular("folder", path)
    return path.read_text(encoding="utf-8")


def _object(value: str | Any) -> dict[str, Any]:
    """Return a JSON object, from its text or already read."""
    found = json.loads(value) if isinstance(value, str) else value
    if not isinstance(found, dict):
        raise ValueError("what should be a JSON object is none")
    return found


def _figures(path: Path, files: set[str]) -> dict[str, Path]:
    """Return the smallest file of each figure, SVG or PNG, by name."""
    found: dict[str, Path] = {}
    for name in sorted(files):
        file = path / name
        if file.suffix in (".svg", ".png") and file.is_file() and not file.is_symlink():
            best = found.get(file.stem, file)
            found[file.stem] = min(best, file, key=lambda each: each.stat().st_size)
    return found
