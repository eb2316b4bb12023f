"""Writing a vehicle as the TOML file that `continuair.load_vehicle` reads."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from typing import Any

from continuair.errors import InputError
from continuair.files import printed, reason, user_path
from continuair.vehicle.vehicle import Vehicle


def as_toml(vehicle: Vehicle, comment: Iterable[str] = ()) -> str:
    """A plain vehicle as TOML, all its fields, under comment lines."""
    fields = vehicle.describe()
    disks = fields["arm"].pop("disks")
    inertia = fields["uav"]["inertia"]
    if not (inertia[0][1] or inertia[0][2] or inertia[1][2]):
        fields["uav"]["inertia"] = [inertia[i][i] for i in range(3)]
    lines = [f"# {line}".rstrip() for line in comment]
    lines.append(f"name = {json.dumps(fields['name'], ensure_ascii=False)}")
    lines += _table("[uav]", fields["uav"]) + _table("[arm]", fields["arm"])
    for disk in disks:
        lines += _table("[[arm.disks]]", disk)
    return "\n".join([*lines, *_table("[camera]", fields["camera"])]) + "\n"


def check_file(path: str | os.PathLike[str]) -> None:
    """Raise InputError, before any work, if a file could not be written there."""
    found = user_path("out", path)
    folder = found.parent
    if found.is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
        raise _unusable(path, "it is a folder" if found.is_dir() else "no folder to write to")


def write_vehicle(
    vehicle: Vehicle, path: str | os.PathLike[str], comment: Iterable[str] = ()
) -> None:
    """Write a plain vehicle to a TOML file. Raises InputError if it cannot be written."""
    try:
        user_path("out", path).write_text(as_toml(vehicle, comment), encoding="utf-8")
    except OSError as error:
        raise _unusable(path, reason(error)) from None


def _unusable(path: str | os.PathLike[str], why: str) -> InputError:
    return InputError(
        f"out is {printed(path)}, which cannot be written ({why}); name a file that you may write."
    )


def _table(heading: str, fields: dict[str, Any]) -> list[str]:
    # JSON writes numbers, text and lists as TOML does; an absent field has no TOML form.
    rows = [f"{name} = {json.dumps(value)}" for name, value in fields.items() if value is not None]
    return ["", heading, *rows]
