"""The folder that a study writes its results to; nothing outside it is touched."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path

from continuair.errors import InputError

_MARKER = ".continuair"


class ResultFolder:
    """A folder that holds the results of one study, and of nobody else.

    A new or empty folder is taken, and one that this study has written to before. A marker in it
    lists the files of the study: only those are replaced or removed. Raises InputError if the
    folder holds other things or cannot be written to.
    """

    def __init__(self, path: str | os.PathLike[str], study: str) -> None:
        self.path = Path(path).expanduser()
        self.study = study
        self._stale: set[str] = set()
        self._written: set[str] = set()
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._take()
        except OSError as error:
            raise self._unusable(error) from None

    def file(self, name: str) -> Path:
        """Return the path of a file of the study, which is now the study's to replace."""
        existing = self.path / name
        if existing.exists() and name not in self._stale | self._written:
            raise InputError(
                f"out is {self.path}, which holds {name} that this study has not written; "
                "remove that file or name another folder."
            )
        self._written.add(name)
        self._mark(self._stale | self._written)
        return existing

    def write_text(self, name: str, text: str) -> None:
        """Write a text file of the study."""
        try:
            self.file(name).write_text(text, encoding="utf-8")
        except OSError as error:
            raise self._unusable(error) from None

    def finish(self) -> None:
        """Remove files that an earlier run of the study left and this one has not replaced."""
        for name in self._stale - self._written:
            (self.path / name).unlink(missing_ok=True)
        self._stale = set()
        self._mark(self._written)

    def _take(self) -> None:
        marker = self.path / _MARKER
        if marker.is_file():
            study, files = _read(marker)
            if study != self.study:
                raise InputError(
                    f"out is {self.path}, which holds results of another study ({study}); "
                    "name another folder."
                )
            self._stale = files
        elif any(self.path.iterdir()):
            raise InputError(
                f"out is {self.path}, which holds files that are not results of this study; "
                "name a new or empty folder."
            )
        self._mark(self._stale)

    def _mark(self, files: Iterable[str]) -> None:
        content = {"study": self.study, "files": sorted(files)}
        try:
            (self.path / _MARKER).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        except OSError as error:
            raise self._unusable(error) from None

    def _unusable(self, error: OSError) -> InputError:
        reason = error.strerror or str(error)
        problem = f"out is {self.path}, which cannot be written to ({reason})"
        return InputError(f"{problem}; name a folder that you may write to.")


def _read(marker: Path) -> tuple[str, set[str]]:
    try:
        content = json.loads(marker.read_text(encoding="utf-8"))
        # Bare names only: a marker cannot make a study remove files elsewhere.
        files = {name for name in content["files"] if Path(name).name == name}
        return str(content["study"]), files
    except (ValueError, KeyError, TypeError):
        return "unknown", set()
