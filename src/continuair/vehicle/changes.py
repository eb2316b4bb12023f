"""Fields of a vehicle that change implicitly when other fields are replaced."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from continuair import checks
from continuair.vehicle.fields import Part, label
from continuair.vehicle.section import EITHER, Section

_PAIRS = EITHER | {"damping": "damping_ratio"}
_OTHER = _PAIRS | {second: first for first, second in _PAIRS.items()}


def implied(vehicle: Part, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that follow from changed ones, by their paths; set these first.

    Disks keep their relative position in a section whose length changes. Of two alternative
    properties, such as density and mass per length, the one that is given replaces the other.
    """
    found: dict[str, Any] = {}
    for path, value in changes.items():
        owner, _, field = path.rpartition(".") if isinstance(path, str) else ("", "", "")
        section = _part(vehicle, owner.split("."))
        if not isinstance(section, Section):
            continue
        if field == "length":
            found |= _moved_disks(section, owner, value)
        elif field in _OTHER and value is not None:
            found[f"{owner}.{_OTHER[field]}"] = None
    return {path: value for path, value in found.items() if path not in changes}


def _moved_disks(section: Section, owner: str, value: Any) -> dict[str, Any]:
    """Return disk positions scaled to a new section length: a disk at the tip stays there."""
    length = checks.finite_array(value)
    if length is None or length.ndim > 1 or not (length > 0.0).all():
        return {}
    moved = {}
    for index, disk in enumerate(section.disks):
        share = np.divide(disk.position, section.length)
        # Arrays over different numbers of runs are rejected later, by field name.
        if share.ndim == 0 or length.shape in ((), share.shape):
            moved[f"{owner}.disks.{index}.position"] = share * length
    return moved


def _part(node: Any, keys: Iterable[str]) -> Any:
    """Return the part of a vehicle at a path, or None."""
    for key in keys:
        if isinstance(node, Part):
            node = dict(node).get(key)
        elif isinstance(node, tuple):
            named = {label(each, i): each for i, each in enumerate(node)}
            indexed = {str(i): each for i, each in enumerate(node)}
            node = (indexed | named).get(key)
        else:
            return None
    return node
