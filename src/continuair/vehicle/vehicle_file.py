"""Write a vehicle as a TOML file for `continuair.load_vehicle`."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from continuair.errors import InputError, shown
from continuair.files import new_file, printed, replace, user_path, write_new, writing
from continuair.vehicle.vehicle import Vehicle

_MARK = "A vehicle written by continuair; without this line it is not replaced."


def as_toml(
    vehicle: Vehicle,
    comment: Iterable[str] = (),
    beside: Mapping[str, dict[str, Any]] = MappingProxyType({}),
) -> str:
    """Return the TOML text of a plain vehicle with all its fields, below comment lines.

    beside: tables of the file that are no part of the vehicle, by name.

    Raises InputError for a vehicle with user-defined terms.
    """
    if vehicle.terms:
        raise InputError(
            "vehicle",
            (
                f"{shown(vehicle.name)} has the term {type(vehicle.terms[0]).__name__}, "
                "code that a file cannot hold"
            ),
            "leave it out with vehicle.replace({'terms': ()})",
        )
    fields: dict[str, Any] = vehicle.describe()
    uav, arms = fields["uav"], fields["arm"]
    if vehicle.arms and vehicle.has_arm_list:
        del uav["mount"]
        below = [line for arm in arms for line in _arm(arm)]
    else:
        below = _section("[arm]", "arm", arms) if vehicle.arms else []
    lines = [f"# {line}".rstrip() for line in comment]
    lines.append(f"name = {json.dumps(fields['name'], ensure_ascii=False)}")
    lines += _uav(uav) + below
    lines += _table("[camera]", fields["camera"])
    for name, table in beside.items():
        lines += _table(f"[{name}]", table)
    return "\n".join(lines) + "\n"


def _uav(fields: dict[str, Any]) -> list[str]:
    rotors, drag = fields.pop("rotors"), fields.pop("drag")
    lines = _table("[uav]", _short_inertia(fields))
    if rotors is not None:
        each = rotors.pop("rotor")
        lines += _table("[uav.rotors]", rotors)
        for rotor in each or ():
            lines += _table("[[uav.rotors.rotor]]", rotor)
    return lines + (_table("[uav.drag]", drag) if drag is not None else [])


def _arm(fields: dict[str, Any]) -> list[str]:
    """Return the lines of an arm of a list, then those of its parts, as TOML requires."""
    sections, tip, tendons = (fields.pop(name) for name in ("section", "tip", "tendon"))
    lines = _table("[[arm]]", fields)
    for section in sections:
        lines += _section("[[arm.section]]", "arm.section", section)
    lines += _table("[arm.tip]", _short_inertia(tip)) if tip else []
    return lines + [line for each in tendons for line in _table("[[arm.tendon]]", each)]


def _section(heading: str, path: str, fields: dict[str, Any]) -> list[str]:
    disks, tendons = fields.pop("disks"), fields.pop("tendon")
    lines = _table(heading, fields)
    for disk in disks:
        lines += _table(f"[[{path}.disks]]", disk)
    return lines + [line for each in tendons for line in _table(f"[[{path}.tendon]]", each)]


def _short_inertia(fields: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a body, a diagonal inertia as 3 numbers."""
    inertia = fields["inertia"]
    if inertia[0][1] or inertia[0][2] or inertia[1][2]:
        return fields
    return fields | {"inertia": [inertia[i][i] for i in range(3)]}


def check_file(path: str | os.PathLike[str], force: bool = False) -> None:
    """Raise InputError if `write_vehicle` cannot write a file to a path."""
    found = user_path("out", path)
    if not os.path.lexists(found):
        new_file("out", path)
        return
    if found.is_symlink() or not found.is_file():
        raise InputError("out", f"is {printed(path)}, a link, folder or device", "name a file")
    if not force:
        raise InputError(
            "out",
            f"is {printed(path)}, which exists already",
            "name a new file, or replace a vehicle that continuair wrote with --force",
        )
    if not _is_ours(found):
        raise InputError(
            "out",
            f"is {printed(path)}, which continuair has not written",
            "name another, or remove it",
        )


def write_vehicle(
    vehicle: Vehicle,
    path: str | os.PathLike[str],
    comment: Iterable[str] = (),
    *,
    beside: Mapping[str, dict[str, Any]] = MappingProxyType({}),
    force: bool = False,
) -> None:
    """Write a plain vehicle to a new TOML file, or with `force` over one written by continuair.

    beside: as in `as_toml`.

    Raises InputError if the file cannot be written.
    """
    check_file(path, force)
    found, text = user_path("out", path), as_toml(vehicle, [_MARK, *comment], beside)
    with writing("out", path):
        (replace if force else write_new)(found, text)


def _is_ours(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.readline() == f"# {_MARK}\n".encode()
    except OSError:
        return False


def _table(heading: str, fields: dict[str, Any]) -> list[str]:
    return ["", heading, *_rows(fields)]


def _rows(fields: dict[str, Any]) -> list[str]:
    """Return a line for each field; an absent one has no TOML form."""
    given = {name: value for name, value in fields.items() if value not in (None, "")}
    return [f"{name} = {_value(value)}" for name, value in given.items()]


def _value(value: Any) -> str:
    """Return a value in TOML, which writes numbers, text and lists as JSON does."""
    if isinstance(value, dict):
        return f"{{ {', '.join(_rows(value))} }}"
    return json.dumps(value)
