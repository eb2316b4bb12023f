"""Files named by a user: paths, and TOML files by preset name or path."""

from __future__ import annotations

import os
import re
import tomllib
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from continuair.errors import InputError, nearest, shown

_LONGEST_PATH = 240
_DEEPEST = 30

DAMAGE = (
    OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, ArithmeticError,
)  # fmt: skip
"""Exceptions from reading files that are damaged or not written by continuair."""


def user_path(name: str, path: str | os.PathLike[str]) -> Path:
    """Return a path with ~ expanded; raise InputError, with the argument's name, if it is invalid.

    Invalid are a missing home or working directory, and names that are too long or contain invalid
    characters. The file itself need not exist.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise InputError(name, f"is {shown(path)}, but must be a path", "give one as text")
    try:
        found = Path(path).expanduser()
    except RuntimeError:
        raise InputError(
            name, f"is {printed(path)}, but that user has no home folder here", "give the full path"
        ) from None
    try:
        here = found.absolute()
    except FileNotFoundError:
        raise InputError(
            name, f"is {printed(path)}, but the working directory is gone", "change to another"
        ) from None
    try:
        here.stat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except (OSError, ValueError) as error:
        raise InputError(
            name, f"is {printed(path)}, which cannot be used ({reason(error)})", "give another path"
        ) from None
    return found


def check_regular(name: str, path: Path) -> None:
    """Raise InputError for a device or a pipe, which may be endless."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(name, f"is {printed(path)}, a device or a pipe", "save it as a file")


def new_file(name: str, path: str | os.PathLike[str]) -> Path:
    """Return the path of a new file; raise InputError if it exists or cannot be written."""
    found = user_path(name, path)
    if not os.fspath(path) or os.path.lexists(found):
        raise InputError(name, f"is {printed(path)!r}, which is not a new file", "name another")
    with writing(name, path):
        check_can_be_made(found)
    return found


@contextmanager
def writing(name: str, path: str | os.PathLike[str]) -> Iterator[None]:
    """Convert OSError while a file is written into InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(
            name,
            f"is {printed(path)}, which cannot be written ({reason(error)})",
            "name a file in an existing folder of yours",
        ) from None


def save(name: str, path: Path, content: str | bytes) -> None:
    """Write a new file, whole or not at all; raise InputError if that fails."""
    with writing(name, path):
        write_new(path, content)


def check_can_be_made(path: Path) -> None:
    """Create and remove a new file; raise OSError if that fails.

    Permissions alone are not sufficient: a file system may be read-only, or hold no files.
    """
    path.open("xb").close()
    path.unlink()


def write_new(path: Path, content: str | bytes) -> None:
    """Write a new file, whole or not at all; raise OSError if that fails."""
    with path.open("xb") as stream:
        try:
            stream.write(content.encode() if isinstance(content, str) else content)
            stream.flush()
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def replace(path: Path, text: str) -> None:
    """Replace a file, without following links; raise OSError if that fails."""
    new = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
    write_new(new, text)
    try:
        os.replace(new, path)
    except OSError:
        new.unlink(missing_ok=True)
        raise


def printed(path: str | os.PathLike[str]) -> str:
    """Return a path as text for messages: on one line, without its middle if it is long."""
    text = os.fspath(path)
    text = text if text.isprintable() else shown(text)
    return text if len(text) <= _LONGEST_PATH else f"{text[:40]}...{text[-40:]}"


def check_version(name: str, path: str | os.PathLike[str], made: str) -> None:
    """Raise InputError for a file written by a newer version of continuair."""
    own = version("continuair")
    if _numbers(made) > _numbers(own):
        raise InputError(
            name,
            f"is {printed(path)}, written by continuair {made}, but this is {own}",
            "update continuair",
        )


def _numbers(text: str) -> list[int]:
    """Return the numbers of a version, in an order that compares as versions."""
    return [int(part) for part in text.split(".") if part.isdecimal()]


def reason(error: Exception) -> str:
    """Return the cause of an error with a file in a few words."""
    if not isinstance(error, (OSError, ValueError)):
        return repr(error)
    number = getattr(error, "errno", None)
    # Libraries add details of their own to `strerror`; use the number only.
    return os.strerror(number) if number else " ".join(str(error).split()) or "no reason given"


def read_toml(path: Path, otherwise: str = "") -> dict[str, Any]:
    """Return the fields of a TOML file; raise InputError if it is missing or cannot be read.

    otherwise: end of a message that suggests another path.
    """
    try:
        return _fields(_text(path, otherwise))
    except InputError as error:
        raise error.located(printed(path)) from None


def _fields(text: str) -> dict[str, Any]:
    nested = InputError(
        "file", f"nests more than {_DEEPEST} tables or lists", "write them side by side"
    )
    try:
        fields = tomllib.loads(text)
    except RecursionError:
        raise nested from None
    except tomllib.TOMLDecodeError as error:
        if name := _table_and_list(text):
            raise InputError(
                "file", f"has both [{name}] and [[{name}]]", "write one of them only"
            ) from None
        last_line = f"at line {text.count(chr(10)) + 1}, the end of the file"
        problem = str(error).replace("at end of document", last_line)
        raise InputError("file", f"is not valid TOML ({problem})", "correct that line") from None
    except ValueError:  # Python reads whole numbers of a few thousand digits at most
        raise InputError(
            "file", "holds a number of thousands of digits", "write it as in 1e9"
        ) from None
    if not _is_shallow(fields, _DEEPEST):
        raise nested
    return fields


def _table_and_list(text: str) -> str | None:
    """Return the name that a text declares both as a table and as a list of tables, or None."""
    lists = re.findall(r"^\s*\[\[\s*([^][]+?)\s*\]\]", text, re.MULTILINE)
    tables = re.findall(r"^\s*\[\s*([^][]+?)\s*\]", text, re.MULTILINE)
    return next((name for name in lists if name in tables), None)


def _is_shallow(value: Any, levels: int) -> bool:
    """Return whether tables and lists are nested in at most `levels` levels."""
    if not isinstance(value, (dict, list)):
        return True
    inside = value.values() if isinstance(value, dict) else value
    return levels > 0 and all(_is_shallow(each, levels - 1) for each in inside)


def _text(path: Path, otherwise: str) -> str:
    check_regular("file", path)
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        problem, remedy = "does not exist", f"correct the path{otherwise}"
    except IsADirectoryError:
        problem, remedy = "is a directory", "give the path of a .toml file in it"
    except UnicodeDecodeError as error:
        problem = f"is not UTF-8 text at byte {error.start}"
        remedy = "save the file as UTF-8"
    except (OSError, ValueError) as error:
        problem = f"cannot be read ({reason(error)})"
        remedy = "correct the path or its permissions"
    raise InputError("file", problem, remedy)


@dataclass(frozen=True)
class Presets:
    """TOML files of a folder of this package; kind: their name in messages."""

    kind: str
    folder: Path

    def names(self) -> tuple[str, ...]:
        """Return the names of the files."""
        return tuple(sorted(path.stem for path in self.folder.glob("*.toml")))

    def read(self, name_or_path: str | os.PathLike[str]) -> tuple[str, dict[str, Any]]:
        """Return the file's name for messages, and its fields.

        Raises InputError if there is no such preset or file, or it is not TOML.
        """
        path = self._path(name_or_path)
        return printed(path), read_toml(path, f", or use a preset ({', '.join(self.names())})")

    def _path(self, name_or_path: str | os.PathLike[str]) -> Path:
        if isinstance(name_or_path, str) and name_or_path in self.names():
            return self.folder / f"{name_or_path}.toml"
        if not isinstance(name_or_path, (str, os.PathLike)):
            raise InputError(
                self.kind,
                f"is {shown(name_or_path)}, but must be the name of a preset or a path",
                nearest("", self.names()),
            )
        path = user_path(self.kind, name_or_path)
        is_name = isinstance(name_or_path, str) and path.suffix != ".toml"
        if is_name and path.name == name_or_path and not os.path.isfile(path):
            raise InputError(
                self.kind,
                f"is {shown(name_or_path)}, but there is no preset of that name",
                f"{nearest(str(name_or_path), self.names())}, or give the path of a .toml file",
            )
        return path
