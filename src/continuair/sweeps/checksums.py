"""Checksums of a store: of its description, and of the results of every unit.

They detect damage by disks, copies and mistakes. They are not signatures, and do not prevent
forgery.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from continuair.sweeps.contained import read_within

NONE = bytes(8)
"""Stands for the checksum of a unit that is not done."""

LARGEST_FILE = 1 << 29
"""Largest file of a description [bytes]."""

_OWN = "checksum"
_FILES = "files"
# Results depend on these.
_IDENTITY = ("design_hash", "unit_size", "device", "versions")


def sealed(group: Mapping[str, Any], folder: Path, files: Iterable[str]) -> dict[str, Any]:
    """Return the metadata of a store's group with the checksums of its files, and its own."""
    attributes = group["attributes"] | {_FILES: {name: _of_file(folder, name) for name in files}}
    whole = {**group, "attributes": attributes}
    return {**group, "attributes": attributes | {_OWN: _of_group(whole)}}


def damaged_files(group: Mapping[str, Any], folder: Path, name: str) -> list[str]:
    """Return the files of a description that are damaged; name: that of the group's own file."""
    if group["attributes"].get(_OWN) != _of_group(group):
        return [name]
    expected = group["attributes"][_FILES]
    return [file for file, checksum in expected.items() if _of_file(folder, file) != checksum]


def of_unit(attributes: Mapping[str, Any], unit: int, content: bytes) -> bytes:
    """Return eight bytes, not all zero, that depend on content, unit and store."""
    owner = [unit, *(attributes[name] for name in _IDENTITY)]
    found = hashlib.blake2b(content, digest_size=7, key=_brief(_canonical(owner)))
    return found.digest() + b"\x01"


def _of_group(group: Mapping[str, Any]) -> str:
    """Return the checksum of a group's metadata."""
    attributes = {name: value for name, value in group["attributes"].items() if name != _OWN}
    return _brief(_canonical({**group, "attributes": attributes})).hex()


def _of_file(folder: Path, name: str) -> str | None:
    """Return the checksum of a file, or None if there is none."""
    content = read_within(folder, name, LARGEST_FILE)
    return None if content is None else _brief(content).hex()


def _canonical(content: object) -> bytes:
    """Return content as sorted JSON."""
    return json.dumps(content, sort_keys=True).encode()


def _brief(content: bytes) -> bytes:
    """Return a checksum of bytes."""
    return hashlib.blake2b(content, digest_size=16).digest()
