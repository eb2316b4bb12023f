"""Results of studies: as JSON, and in a folder of their own."""

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
"""The file that marks a folder of results, and lists its files."""

UNFINISHED = "INCOMPLETE.txt"
"""The file that a folder holds from its first result until all are written."""

_WARNING = "Writing these results was interrupted: some are missing. Run the study again.\n"


class ResultFolder:
    """The folder of one study's results.

    Parameters
    ----------
    path : str or path-like
        A new or empty folder, or one that the same study has written to before.
    study : str
        Name of the study.
    command : str, optional
        Command line that repeats the study.

    Raises
    ------
    InputError
        If the folder holds other things or cannot be written to.

    Notes
    -----
    A marker in the folder lists the study's files. Only those are replaced or removed, and no link
    is followed. The first file written removes those of the run before, so that a folder never
    mixes two runs. Until `finish` the folder is marked as incomplete. As a context manager it
    removes a folder that it created if an error occurs before the first result, and reports errors
    of writing. Folders of parts inside it belong to the study too.
    """

    def __init__(self, path: str | os.PathLike[str], study: str, command: str = "") -> None:
        if not os.fspath(path):
            raise InputError("out", "is empty", "name a folder, such as results (. is this one)")
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
        """Return the path of a file of the study, and allow it to be replaced.

        Parameters
        ----------
        name : str
            Name of the file.

        Returns
        -------
        Path
            Its path.

        Raises
        ------
        InputError
            If a link, a folder or a file of other origin has this name.
        """
        self.begin()
        self._claim(name)
        return self.path / name

    def write_text(self, name: str, text: str) -> None:
        """Write a text file of the study.

        Parameters
        ----------
        name : str
            Name of the file.
        text : str
            Its content.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with self._writing():
            self.file(name).write_text(text, encoding="utf-8")

    def write_dataset(self, name: str, dataset: xr.Dataset) -> None:
        """Write a dataset of the study as netCDF.

        Parameters
        ----------
        name : str
            Name of the file.
        dataset : xarray.Dataset
            The dataset.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        with self._writing():
            # In memory first: HDF5 crashes at the end of a process whose disk was full.
            content = dataset.to_netcdf(engine="h5netcdf")
            self.file(name).write_bytes(content)

    def store(
        self,
        results: Mapping[str, object],
        table: str,
        rows: Iterable[Mapping[str, object]] = (),
        datasets: Mapping[str, xr.Dataset] | None = None,
    ) -> None:
        """Write results as JSON, a table, rows as CSV, and datasets as netCDF.

        Parameters
        ----------
        results : mapping
            Written to <study>.json.
        table : str
            Markdown, written to table.md.
        rows : iterable of mappings, optional
            Written to <study>.csv if there are any.
        datasets : mapping of str to xarray.Dataset, optional
            Written to <study>_<name>.nc.

        Raises
        ------
        InputError
            If a file cannot be written.
        """
        self.write_text(f"{self.study}.json", as_json(results))
        self.write_text("table.md", table)
        if rows := list(rows):
            self.write_text(f"{self.study}.csv", as_csv(rows))
        for name, dataset in (datasets or {}).items():
            self.write_dataset(f"{self.study}_{name}.nc", dataset)

    def begin(self) -> None:
        """Mark the folder as incomplete, as writing the first file does."""
        if not self._written:
            self._start()

    def check_parts(self, names: Iterable[str]) -> None:
        """Raise InputError if a part's folder exists and is not this study's.

        Parameters
        ----------
        names : iterable of str
            Names of parts.

        Raises
        ------
        InputError
            If one of them is a link, or was not written by this study.
        """
        for name in names:
            ours = name in self._parts | self._earlier_parts
            if os.path.lexists(self.path / name) and (not ours or (self.path / name).is_symlink()):
                raise InputError(
                    "out",
                    (
                        f"is {printed(self.path)}, which holds {name} that this study has "
                        "not written"
                    ),
                    "move it away or name another folder",
                )

    def part(self, name: str) -> Path:
        """Return the path of the folder of a part, and reserve it for the study.

        Parameters
        ----------
        name : str
            Name of the part.

        Returns
        -------
        Path
            Its path.

        Raises
        ------
        InputError
            If it is a link, or was not written by this study.
        """
        self.begin()
        self.check_parts([name])
        self._parts.add(name)
        self._mark(self._stale | self._written)
        return self.path / name

    def finish(self) -> None:
        """Mark all results as written; a run without any removes those of the run before."""
        self._remove(self._stale)
        self._remove({UNFINISHED} & self._written)
        self._stale = set()
        self._written -= {UNFINISHED}
        self._mark(self._written)

    def _start(self) -> None:
        """Replace the results of the run before by a note that these are incomplete."""
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
                "out",
                f"is {printed(self.path)}, which holds {name} that this study has not written",
                "remove that file or name another folder",
            )
        self._written.add(name)
        self._mark(self._stale | self._written)
        # A new file is written: the old one may have another name elsewhere.
        self._remove([name])

    def _check_file(self, name: str) -> None:
        if (self.path / name).is_symlink():
            raise InputError(
                "out",
                f"is {printed(self.path)}, in which {name} is a link",
                "remove it, or name another folder for the results",
            )
        if (self.path / name).is_dir():
            raise InputError(
                "out",
                f"is {printed(self.path)}, in which {name} is a folder",
                "move it away, or name another folder for the results",
            )

    def _remove(self, names: Iterable[str]) -> None:
        with self._writing():
            for name in names:
                if not (self.path / name).is_dir():
                    (self.path / name).unlink(missing_ok=True)

    def _make(self) -> list[Path]:
        """Make the folder; return the folders made, outermost first."""
        if os.path.lexists(self.path) and not self.path.is_dir():
            raise InputError("out", f"is {printed(self.path)}, which is a file", "name a folder")
        missing = [path for path in (self.path, *self.path.parents) if not path.exists()]
        self.path.mkdir(parents=True, exist_ok=True)
        return missing[::-1]

    def _results(self) -> list[str]:
        """Return the names of results that have been written, whole or in part."""
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
                    "out",
                    f"is {printed(self.path)}, which holds results of another study ({study})",
                    "name another folder",
                )
            for name in files | {UNFINISHED}:
                self._check_file(name)
            self._stale = files
        elif any(self.path.iterdir()):
            raise InputError(
                "out",
                f"is {printed(self.path)}, which holds files that are not results of this study",
                "name a new or empty folder",
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
        return InputError(
            "out",
            f"is {printed(self.path)}, which cannot be written to ({reason(error)})",
            "name a folder that you may write to",
        )


def _read(marker: Path) -> tuple[str, set[str], set[str]]:
    """Return the study that made a folder, its files and its parts."""
    try:
        content = json.loads(marker.read_text(encoding="utf-8"))
        parts = {*content.get("parts", ()), *content.get("earlier_parts", ())}
        return str(content["study"]), bare(content["files"]), bare(parts)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return "unknown", set(), set()


def bare(names: Iterable[Any]) -> set[str]:
    """Return plain file names only, so that a marker cannot refer to files elsewhere."""
    return {
        name
        for name in names
        if isinstance(name, str) and Path(name).name == name and name not in ("", "..")
    }


def add_file(folder: Path, name: str, text: str) -> Path:
    """Add a text file to a study's finished folder, or replace it.

    Parameters
    ----------
    folder : Path
        The folder.
    name : str
        Name of the file.
    text : str
        Its content.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        If a link or a file of other origin has this name, or the file cannot be written.
    """
    marker, path = folder / MARKER, folder / name
    try:
        made = json.loads(marker.read_text(encoding="utf-8"))
        if os.path.lexists(path) and (path.is_symlink() or name not in made["files"]):
            raise InputError(
                "folder",
                f"is {printed(folder)}, which holds {name} that no study has written",
                "remove that file",
            )
        replace(path, text)
        made["files"] = sorted({*made["files"], name})
        replace(marker, json.dumps(made, indent=1) + "\n")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "folder",
            f"is {printed(folder)}, which cannot be written to ({reason(error)})",
            "copy it to where you may write",
        ) from None
    return path


def by_model(flights: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Combine flights of one scenario with several models into one dataset.

    Parameters
    ----------
    flights : mapping of str to xarray.Dataset
        Results of `simulate` by model.

    Returns
    -------
    xarray.Dataset
        The flights along the leading dimension ``model``.
    """
    import xarray as xr

    return xr.concat(
        [flight.expand_dims(model=[model]) for model, flight in flights.items()],
        dim="model",
        combine_attrs="drop_conflicts",
    )


def as_json(results: Mapping[str, object]) -> str:
    """Return results as JSON.

    Parameters
    ----------
    results : mapping
        Values, arrays and nested containers by name.

    Returns
    -------
    str
        The JSON; a number that is not finite becomes null.
    """
    return json.dumps(_finite(results), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(child) for key, child in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(child) for child in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
