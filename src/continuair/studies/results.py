"""Results of studies: as JSON, and the folder that holds them; nothing outside is touched."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from continuair.errors import InputError
from continuair.files import printed, reason, replace, user_path
from continuair.studies.tables import as_csv

if TYPE_CHECKING:
    import xarray as xr

MARKER = ".continuair"
"""The file that says of a folder that it holds results, and which files they are."""

UNFINISHED = "INCOMPLETE.txt"
"""The file that a folder holds from its first result until all are written."""

_WARNING = "Writing these results was interrupted: some are missing. Run the study again.\n"


class ResultFolder:
    """A folder that holds the results of one study, and of nobody else.

    A new or empty folder is taken, and one that this study has written to before. A marker in it
    lists the files of the study: only those are replaced or removed, and no link is followed. The
    first file written removes those of the run before, so that a folder never mixes two runs, and
    until `finish` the folder says that it is incomplete. As a context manager it gives up a folder
    that it has newly taken if an error comes before the first result, and tells one of writing.
    Folders of parts inside it are the study's own too. command: what makes these results again.
    Raises InputError if the folder holds other things or cannot be written to.
    """

    def __init__(self, path: str | os.PathLike[str], study: str, command: str = "") -> None:
        if not os.fspath(path):
            raise InputError("out is empty; name a folder, such as results (. is this one).")
        self.path = user_path("out", path)
        self.study, self.command = study, command
        self._stale: set[str] = set()
        self._parts: set[str] = set()
        self._earlier_parts: set[str] = set()
        self._written: set[str] = set()
        with self._writing():
            self._made = self._make()
            try:
                self._take()
            except (OSError, InputError):
                self._give_up()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if error is not None and self._new and not self._results() and not self._parts:
            self._give_up()
        if isinstance(error, OSError) and self._written:
            raise self._unusable(error) from None

    def file(self, name: str) -> Path:
        """Return the path of a file of the study, which is now the study's to replace."""
        self.begin()
        self._claim(name)
        return self.path / name

    def write_text(self, name: str, text: str) -> None:
        """Write a text file of the study."""
        with self._writing():
            self.file(name).write_text(text, encoding="utf-8")

    def write_dataset(self, name: str, dataset: xr.Dataset) -> None:
        """Write a dataset of the study as netCDF."""
        with self._writing():
            # In memory first: HDF5 crashes at the end of a process whose disk was full.
            content = dataset.to_netcdf(engine="h5netcdf")
            self.file(name).write_bytes(content)

    def store(
        self,
        results: dict[str, Any],
        table: str,
        rows: Iterable[Mapping[str, Any]] = (),
        datasets: Mapping[str, xr.Dataset] | None = None,
    ) -> None:
        """Write results as <study>.json, the table as table.md, rows as <study>.csv if there are
        any, and every dataset as <study>_<name>.nc."""
        self.write_text(f"{self.study}.json", as_json(results))
        self.write_text("table.md", table)
        if rows := list(rows):
            self.write_text(f"{self.study}.csv", as_csv(rows))
        for name, dataset in (datasets or {}).items():
            self.write_dataset(f"{self.study}_{name}.nc", dataset)

    def begin(self) -> None:
        """Say that results are on their way, as the first file does."""
        if not self._written:
            self._start()

    def check_parts(self, names: Iterable[str]) -> None:
        """Raise InputError if a part's place is taken by something that this study did not make."""
        for name in names:
            ours = name in self._parts | self._earlier_parts
            if os.path.lexists(self.path / name) and (not ours or (self.path / name).is_symlink()):
                raise InputError(
                    f"out is {printed(self.path)}, which holds {name} that this study has not "
                    "written; move it away or name another folder."
                )

    def part(self, name: str) -> Path:
        """Return the path of the folder of a part, which is the study's now."""
        self.begin()
        self.check_parts([name])
        self._parts.add(name)
        self._mark(self._stale | self._written)
        return self.path / name

    def finish(self) -> None:
        """Say that all results are written; a run without any removes those of the run before."""
        self._remove(self._stale)
        self._remove({UNFINISHED} & self._written)
        self._stale = set()
        self._written -= {UNFINISHED}
        self._mark(self._written)

    def _start(self) -> None:
        """Replace the results of the run before by the word that these are incomplete."""
        self._claim(UNFINISHED)
        with self._writing():
            (self.path / UNFINISHED).write_text(_WARNING, encoding="utf-8")
        self._remove(self._stale - {UNFINISHED})
        self._stale = set()
        self._mark(self._written)

    def _claim(self, name: str) -> None:
        self._check_file(name)
        if os.path.lexists(self.path / name) and name not in self._stale | self._written:
            raise InputError(
                f"out is {printed(self.path)}, which holds {name} that this study has not written; "
                "remove that file or name another folder."
            )
        self._written.add(name)
        self._mark(self._stale | self._written)
        # What is written is a new file: the old one may have another name elsewhere.
        self._remove([name])

    def _check_file(self, name: str) -> None:
        if (self.path / name).is_symlink():
            raise InputError(
                f"out is {printed(self.path)}, in which {name} is a link; remove it, or name "
                "another folder for the results."
            )
        if (self.path / name).is_dir():
            raise InputError(
                f"out is {printed(self.path)}, in which {name} is a folder; move it away, or name "
                "another folder for the results."
            )

    def _remove(self, names: Iterable[str]) -> None:
        with self._writing():
            for name in names:
                if not (self.path / name).is_dir():
                    (self.path / name).unlink(missing_ok=True)

    def _make(self) -> list[Path]:
        """Make the folder; return the folders made, outermost first."""
        if os.path.lexists(self.path) and not self.path.is_dir():
            raise InputError(f"out is {printed(self.path)}, which is a file; name a folder.")
        missing = [path for path in (self.path, *self.path.parents) if not path.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        return missing[::-1]

    def _results(self) -> list[str]:
        """The results that have been written, whole or in part."""
        return [name for name in self._written - {UNFINISHED} if (self.path / name).exists()]

    def _give_up(self) -> None:
        if not self._new:
            return
        try:
            (self.path / MARKER).unlink(missing_ok=True)
            if UNFINISHED in self._written:
                (self.path / UNFINISHED).unlink(missing_ok=True)
            for path in reversed(self._made):
                path.rmdir()
        except OSError:
            pass  # somebody else uses the folder by now

    def _take(self) -> None:
        marker = self.path / MARKER
        self._new = not os.path.lexists(marker)
        self._check_file(MARKER)
        if not self._new:
            study, files, self._earlier_parts = _read(marker)
            if study != self.study:
                raise InputError(
                    f"out is {printed(self.path)}, which holds results of another study ({study}); "
                    "name another folder."
                )
            for name in files | {UNFINISHED}:
                self._check_file(name)
            self._stale = files
        elif any(self.path.iterdir()):
            raise InputError(
                f"out is {printed(self.path)}, which holds files that are not results of this "
                "study; name a new or empty folder."
            )
        else:
            self._mark(self._stale)

    def _mark(self, files: Iterable[str]) -> None:
        content = {
            "study": self.study,
            "version": version("continuair"),
            "command": self.command,
            "files": sorted(files),
            "parts": sorted(self._parts),
            "earlier_parts": sorted(self._earlier_parts - self._parts),
        }
        with self._writing():
            replace(self.path / MARKER, json.dumps(content, indent=1) + "\n")

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except InputError:
            raise
        except (OSError, ValueError) as error:
            raise self._unusable(error) from None

    def _unusable(self, error: OSError | ValueError) -> InputError:
        problem = f"out is {printed(self.path)}, which cannot be written to ({reason(error)})"
        return InputError(f"{problem}; name a folder that you may write to.")


def _read(marker: Path) -> tuple[str, set[str], set[str]]:
    """The study that made a folder, its files and its parts."""
    try:
        content = json.loads(marker.read_text(encoding="utf-8"))
        parts = {*content.get("parts", ()), *content.get("earlier_parts", ())}
        return str(content["study"]), bare(content["files"]), bare(parts)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return "unknown", set(), set()


def bare(names: Iterable[Any]) -> set[str]:
    """Return those that are plain names of files: a marker cannot lead to others elsewhere."""
    return {
        name
        for name in names
        if isinstance(name, str) and Path(name).name == name and name not in ("", "..")
    }


def add_file(folder: Path, name: str, text: str) -> Path:
    """Add a text file to a study's finished folder, or replace it if the study wrote it.

    Raises InputError if somebody else's file or a link is in its place, or it cannot be written.
    """
    marker, path = folder / MARKER, folder / name
    try:
        made = json.loads(marker.read_text(encoding="utf-8"))
        if os.path.lexists(path) and (path.is_symlink() or name not in made["files"]):
            raise InputError(
                f"folder is {printed(folder)}, which holds {name} that no study has written; "
                "remove that file."
            )
        replace(path, text)
        made["files"] = sorted({*made["files"], name})
        replace(marker, json.dumps(made, indent=1) + "\n")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        problem = f"folder is {printed(folder)}, which cannot be written to ({reason(error)})"
        raise InputError(f"{problem}; copy it to where you may write.") from None
    return path


def by_model(flights: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the flights of one scenario as one dataset with the leading dimension `model`."""
    import xarray as xr

    return xr.concat(
        [flight.expand_dims(model=[model]) for model, flight in flights.items()],
        dim="model",
        combine_attrs="drop_conflicts",
    )


def as_json(results: dict[str, Any]) -> str:
    """Return the results as JSON; a number that is not finite becomes null."""
    return json.dumps(_finite(results), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(child) for key, child in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(child) for child in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
