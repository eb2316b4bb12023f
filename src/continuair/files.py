"""Paths that a user names."""

from __future__ import annotations

import os
from pathlib import Path

from continuair.errors import InputError, shown

_LONGEST_PATH = 240


def user_path(name: str, path: str | os.PathLike[str]) -> Path:
    """Return a path with ~ expanded; InputError, naming the argument, if there is no such home."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise InputError(
            f"{name} is {printed(path)}, but that user has no home folder here; give the path in "
            "full."
        ) from None


def new_file(name: str, path: str) -> Path:
    """Return the path of a file that is to be written; InputError if it exists or cannot be."""
    found = user_path(name, path)
    if not path or os.path.lexists(found):
        raise InputError(f"{name} is {printed(path)!r}, which is not a new file; name another.")
    if not os.access(found.parent, os.W_OK):
        raise InputError(
            f"{name} is {printed(path)}, where nothing can be written; name a file in a folder "
            "that is there and yours."
        )
    return found


def printed(path: str | os.PathLike[str]) -> str:
    """Return a path as messages print it: on one line, and its middle left out if it is long."""
    text = os.fspath(path)
    text = text if text.isprintable() else shown(text)
    return text if len(text) <= _LONGEST_PATH else f"{text[:40]}...{text[-40:]}"


def reason(error: OSError | ValueError) -> str:
    """Return why the system refused a file, in its own few words."""
    number = getattr(error, "errno", None)
    # Libraries put their own story into `strerror`; only the number is to the point.
    return os.strerror(number) if number else " ".join(str(error).split()) or "no reason given"
