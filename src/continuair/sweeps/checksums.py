"""Checksums of a store: of its description, and of the results of every unit.

They find what disks, copies and slips of the hand do to a store. They are no signature: who means
to deceive can compute them anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from continuair.sweeps.contained import read_within

NONE = bytes(8)
"""In the place of the checksum of a unit that is not done."""

LARGEST_FILE = 1 << 29
"""Bytes of a file of a description, at most."""

_OWN = "checksum"
_FILES = "files"
# What results depend on: those of another design, unit size, device or version are not these.
_IDENTITY = ("design_hash", "unit_size", "device", "versions")


def sealed(group: Mapping[str, Any], folder: Path, files: Iterable[str]) -> dict[str, Any]:
    """The metadata of a store's group with the checksums of its files, and its own."""
    attributes = group["attributes"] | {_FILES: {name: _of_file(folder, name) for name in files}}
    whole = {**group, "attributes": attributes}
    return {**group, "attributes": attributes | {_OWN: _of_group(whole)}}


def damaged_files(group: Mapping[str, Any], folder: Path, name: str) -> list[str]:
    """The files of a description that are not what was sealed; name: that of the group's own."""
    if group["attributes"].get(_OWN) != _of_group(group):
        return [name]
    expected = group["attributes"][_FILES]
    return [file for file, checksum in expected.items() if _of_file(folder, file) != checksum]


def of_unit(attributes: Mapping[str, Any], unit: int, content: bytes) -> bytes:
    """Eight bytes, not all zero, that belong to the content of this unit of this store only."""
    owner = [unit, *(attributes[name] for name in _IDENTITY)]
    found = hashlib.blake2b(content, digest_size=7, key=_brief(_canonical(owner)))
    return found.digest() + b"\x01"


def _of_group(group: Mapping[str, Any]) -> str:
    attributes = {name: value for name, value in group["attributes"].items() if name != _OWN}
    return _brief(_canonical({**group, "attributes": attributes})).hex()


def _of_file(folder: Path, name: str) -> str | None:
    content = read_within(folder, name, LARGEST_FILE)
    return None if content is None else _brief(content).hex()


def _canonical(content: Any) -> bytes:
    return json.dumps(content, sort_keys=True).encode()


def _brief(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=16).digest()
