"""What a result folder holds, read back."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from continuair.errors import InputError
from continuair.files import printed, reason, user_path
from continuair.studies.results import MARKER, UNFINISHED


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
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        why = reason(error) if isinstance(error, (OSError, ValueError)) else repr(error)
        raise InputError(
            f"folder is {printed(path)}, whose results cannot be read ({why}); run the study again."
        ) from None


def _read(path: Path) -> Contents:
    marker = path / MARKER
    if not marker.is_file():
        raise InputError(
            f"folder is {printed(path)}, which holds no results of continuair; name one that a "
            "study has written with --out."
        )
    made = json.loads(marker.read_text(encoding="utf-8"))
    _check_version(path, str(made.get("version", "0")))
    if (path / UNFINISHED).exists():
        raise InputError(
            f"folder is {printed(path)}, whose writing was interrupted; run the study again."
        )
    study = str(made["study"])
    return Contents(
        path,
        study,
        str(made.get("version", "")),
        str(made.get("command", "")),
        json.loads((path / f"{study}.json").read_text(encoding="utf-8")),
        (path / "table.md").read_text(encoding="utf-8"),
        _figures(path, made["files"]),
        [_read(part) for part in sorted(path.iterdir()) if (part / MARKER).is_file()],
    )


def _check_version(path: Path, made: str) -> None:
    own = version("continuair")
    if _numbers(made) > _numbers(own):
        raise InputError(
            f"folder is {printed(path)}, which continuair {made} has written, and this is {own}; "
            "update it."
        )


def _numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(".") if part.isdecimal()]


def _figures(path: Path, files: list[str]) -> dict[str, Path]:
    """The smallest of the files of each figure, as drawing or as picture."""
    found: dict[str, Path] = {}
    for name in sorted(files):
        file = path / name
        if file.suffix in (".svg", ".png") and file.is_file() and not file.is_symlink():
            best = found.get(file.stem, file)
            found[file.stem] = min(best, file, key=lambda each: each.stat().st_size)
    return found
