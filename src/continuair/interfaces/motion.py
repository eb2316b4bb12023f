"""The motion of one flight, as files of other programs have it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair.errors import InputError, shown
from continuair.flight.reading import vehicle_of
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

Array = np.ndarray

_NEEDED = {"position": "axis", "attitude": "quaternion", "bend": "bend_axis"}


@dataclass(frozen=True)
class Motion:
    """A flight up to its end; rows are samples.

    time (n,) [s], position (n, 3), attitude (n, 4) x y z w, bend (n, sections, 2) [1/m]; dataset:
    all that was logged, as far.
    """

    vehicle: Vehicle
    time: Array
    position: Array
    attitude: Array
    bend: Array
    dataset: xr.Dataset

    def at(self, rate: float) -> Motion:
        """With samples as they are, but at most so many a second, the last among them."""
        since = np.floor((self.time - self.time[0]) * rate * (1.0 + 1e-9)).astype(int)
        kept = np.unique(np.append(np.unique(since, return_index=True)[1], len(self.time) - 1))
        return _rows(self, kept)


def motion_of(dataset: Any, vehicle: Any = None) -> Motion:
    """The motion of a result; raises InputError unless it is that of one flight.

    vehicle: by default that of the attributes.
    """
    if not isinstance(dataset, xr.Dataset):
        raise InputError(f"dataset is {shown(dataset)}; give a result of continuair.simulate.")
    missing = [name for name in ("time", *_NEEDED) if name not in dataset.variables]
    if missing:
        raise InputError(
            f"dataset has no {' and no '.join(missing)}; keep position, attitude and bend among "
            "the variables of simulate."
        )
    for dimension in dataset["position"].dims:
        if dimension not in ("time", "axis"):
            raise InputError(
                f"dataset has the dimension {dimension}; give one flight, such as "
                f"dataset.isel({dimension}=0)."
            )
    vehicle = check_single_vehicle(vehicle or vehicle_of(dataset))
    n = len(dataset["time"])
    bend = dataset["bend"].to_numpy().reshape(n, -1, 2)
    if bend.shape[1] != vehicle.sections:
        raise InputError(
            f"dataset has {bend.shape[1]} sections, but the vehicle {shown(vehicle.name)} has "
            f"{vehicle.sections}; give the vehicle that flew."
        )
    position, attitude = (dataset[name].to_numpy() for name in ("position", "attitude"))
    found = Motion(vehicle, dataset["time"].to_numpy(), position, attitude, bend, dataset)
    valid = np.isfinite(np.column_stack([position, attitude, bend.reshape(n, -1)])).all(axis=1)
    if not valid.any():
        raise InputError("dataset holds no finite sample; give a flight that did not fail at once.")
    return _rows(found, np.flatnonzero(valid))


def _rows(motion: Motion, kept: Array) -> Motion:
    return Motion(
        motion.vehicle, motion.time[kept], motion.position[kept], motion.attitude[kept],
        motion.bend[kept], motion.dataset.isel(time=kept),
    )  # fmt: skip
