"""Read regular files in a folder that others may have made, and none outside it."""

from __future__ import annotations

import os
import stat
from pathlib import Path

_FLAGS = os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK


def read_within(folder: Path, name: str, most: int) -> bytes | None:
    """Return the content of a file by its path in a folder, or None.

    None: there is no such file, it is larger than `most` bytes, or it or a part of its path is a
    link, device or pipe. Raises PermissionError.
    """
    *parents, last = parts = name.split("/")
    if any(part in ("", ".", "..") or "\0" in part for part in parts):
        return None
    try:
        at = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except (FileNotFoundError, NotADirectoryError):
        return None
    try:
        for parent in parents:
            below = os.open(parent, _FLAGS | os.O_DIRECTORY, dir_fd=at)
            os.close(at)
            at = below
        return _content(at, last, most)
    except PermissionError:
        raise
    except OSError:  # nothing there, a link, a file for a folder, or a name that is too long
        return None
    finally:
        os.close(at)


def is_linked(folder: Path, name: str) -> bool:
    """Return whether a part of a path in a folder is a link."""
    found = folder
    for part in name.split("/"):
        found = found / part
        if found.is_symlink():
            return True
    return False


def _content(folder: int, name: str, most: int) -> bytes | None:
    # To open a device may do something; what is there is asked for first.
    if not stat.S_ISREG(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
        return None
    with open(os.open(name, _FLAGS, dir_fd=folder), "rb") as stream:
        found = os.fstat(stream.fileno())
        if not stat.S_ISREG(found.st_mode) or found.st_size > most:
            return None
        content = stream.read(most + 1)
    return content if len(content) <= most else None
