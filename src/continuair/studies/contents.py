"""What a result folder holds, read back."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True)
class Contents:
    """One study's results: its JSON, its table in Markdown, its figures, and those of its parts.

    command: what makes them again; figures: paths by name, of the smallest file of each.
    """

    path: Path
    study: str
    version: str
    command: str
    results: dict[str, Any]
    table: str
    figures: dict[str, Path]
    parts: list[Contents]


def read(folder: str | os.PathLike[str]) -> Contents:
    """Read a result folder, and those inside it.

    Raises InputError, in one sentence, if it is none, is incomplete, damaged, or of a version to
    come.
    """
    path = user_path("folder", folder)
    try:
        return _read(path)
    except InputError:
        raise
    except DAMAGE as error:
        raise damaged(path, error) from None


def damaged(path: Path, error: Exception) -> InputError:
    """The refusal of a folder whose files are not as a study writes them."""
    return InputError(
        f"folder is {printed(path)}, whose results cannot be read ({reason(error)}); run the "
        "study again."
    )


def _read(path: Path, inside: bool = False) -> Contents:
    """Read a result folder, or one inside another, to which no link is followed."""
    marker = path / MARKER
    if not marker.is_file() or marker.is_symlink() or (inside and path.is_symlink()):
        raise InputError(
            f"folder is {printed(path)}, which holds no results of continuair; name one that a "
            "study has written with --out."
        )
    made = _object(_text(marker))
    check_version("folder", path, str(made.get("version", "0")))
    if (path / UNFINISHED).exists():
        raise InputError(
            f"folder is {printed(path)}, whose writing was interrupted; run the study again."
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
    """The text of a plain file: no link is followed, and nothing that may never end is read."""
    if path.is_symlink():
        raise ValueError(f"{path.name} is a link")
    check_regular("folder", path)
    return path.read_text(encoding="utf-8")


def _object(value: str | Any) -> dict[str, Any]:
    """A JSON object, from its text or already read."""
    found = json.loads(value) if isinstance(value, str) else value
    if not isinstance(found, dict):
        raise ValueError("what should be a JSON object is none")
    return found


def _figures(path: Path, files: set[str]) -> dict[str, Path]:
    """The smallest of the files of each figure, as drawing or as picture."""
    found: dict[str, Path] = {}
    for name in sorted(files):
        file = path / name
        if file.suffix in (".svg", ".png") and file.is_file() and not file.is_symlink():
            best = found.get(file.stem, file)
            found[file.stem] = min(best, file, key=lambda each: each.stat().st_size)
    return found
