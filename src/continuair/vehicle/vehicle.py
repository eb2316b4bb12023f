"""The vehicle: a multirotor UAV, a continuum arm that hangs from it, and a camera at the arm's tip.

SI units and radians. Body axes: x forward, y left, z up, at the UAV's centre of mass.
All classes are immutable and hold plain numbers and tuples; in a *batched* vehicle, made by
`Vehicle.replace`, the fields that vary hold NumPy arrays with a leading dimension (runs).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import field_validator

from continuair import checks
from continuair.errors import InputError, shown
from continuair.files import Presets
from continuair.vehicle import runs as batch
from continuair.vehicle.arm import Arm
from continuair.vehicle.camera import Camera
from continuair.vehicle.fields import Part, Title
from continuair.vehicle.uav import Uav

PAPER_VEHICLE = "paper"
"""The preset beside which the numbers that the paper prints are shown, and no other vehicle."""

_PRESETS = Presets("vehicle", Path(__file__).parents[1] / "presets")


class Vehicle(Part):
    """An aerial continuum manipulator: UAV, arm and camera; for one run or batched over runs."""

    name: Title
    """the name of the vehicle, for titles and provenance"""

    uav: Uav
    """the UAV's parameters, a table ([uav])"""

    arm: Arm
    """the arm's parameters, a table ([arm])"""

    camera: Camera = Camera()
    """the camera's parameters, a table ([camera])"""

    @field_validator("uav", "arm", "camera", mode="before")
    @classmethod
    def _one_run(cls, value: object) -> object:
        if batch.count(value) is not None:
            raise ValueError("must be of one run (a batched vehicle is made by vehicle.replace)")
        return value

    @property
    def sections(self) -> int:
        """The number of the arm's sections, each of constant curvature."""
        return 1

    @property
    def mass(self) -> float:
        """The mass of UAV and arm [kg]."""
        return self.uav.mass + self.arm.mass

    @property
    def runs(self) -> int | None:
        """The number of runs of a batched vehicle; None for a plain one."""
        return batch.count(self)

    def replace(self, changes: Mapping[str, Any]) -> Vehicle:
        """Return a copy with dotted fields changed, as in `{"arm.radius": 0.01, "uav.mass": 3}`.

        Parameters in a list go by index: "arm.disks.0.mass". A value with one more leading
        dimension than its field is an array over runs and makes the copy batched; all such arrays
        must be of one length. (An inertia of shape (3, 3) is one matrix; give three runs of
        diagonals as (3, 3, 3).) Disks keep their share of an arm whose length changes, unless their
        positions are given too. Raises InputError, naming the run, if any run is not valid.
        """
        if not isinstance(changes, Mapping):
            text = "must be a mapping such as {'arm.radius': 0.01}"
            raise InputError(f"changes is {shown(changes)}, but {text}; give the fields to change.")
        return batch.replace(self, self._moved_disks(changes) | dict(changes))

    def _moved_disks(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Positions of the disks on an arm of another length: one at the tip stays there."""
        length = checks.finite_array(changes.get("arm.length"))
        if length is None or length.ndim > 1 or not (length > 0.0).all():
            return {}
        if changes.keys() & {"arm", "arm.disks"}:
            return {}
        moved = {}
        for index, disk in enumerate(self.arm.disks):
            share = np.divide(disk.position, self.arm.length)
            # Arrays over different numbers of runs are refused by their names.
            if share.ndim == 0 or length.shape in ((), share.shape):
                moved[f"arm.disks.{index}.position"] = share * length
        return moved

    def select(self, run: int) -> Vehicle:
        """Return the plain vehicle of one run; a plain vehicle is the same in every run."""
        if self.runs is None:
            return self
        if not checks.is_whole(run) or not 0 <= run < self.runs:
            valid = f"give a whole number from 0 to {self.runs - 1}"
            raise InputError(f"run is {shown(run)}, but the vehicle has {self.runs} runs; {valid}.")
        selected: Vehicle = batch.pick(self, int(run))
        return selected

    def describe(self) -> dict[str, Any]:
        """Return all parameters as nested dicts and lists that JSON can hold, for provenance."""
        description: dict[str, Any] = batch.plain(self)
        return description


def preset_names() -> tuple[str, ...]:
    """Return the names of the vehicles that come with the package."""
    return _PRESETS.names()


def load_vehicle(name_or_path: str | os.PathLike[str]) -> Vehicle:
    """Return a preset by name, or the vehicle that a TOML file describes.

    Raises InputError if there is no such preset or file, or the file is no valid vehicle.
    """
    file, fields = _PRESETS.read(name_or_path)
    try:
        return Vehicle(**fields)
    except InputError as error:
        raise error.within(f"{file}: ") from None


def check_vehicle(value: Any) -> Vehicle:
    """Return a vehicle, plain or batched; raises InputError for anything else."""
    if not isinstance(value, Vehicle):
        raise InputError(f"vehicle is {shown(value)}; load one with continuair.load_vehicle.")
    return value


def check_single_vehicle(value: Any) -> Vehicle:
    """Return a vehicle that must be of one run; raises InputError for anything else."""
    if check_vehicle(value).runs is not None:
        raise InputError(
            f"vehicle {shown(value.name)} holds {value.runs} runs, but must be of one run; choose "
            "one with vehicle.select(run)."
        )
    return value
