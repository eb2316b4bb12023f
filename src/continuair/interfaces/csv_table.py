"""A flight as a CSV file: a row per sample, in the columns that `continuair identify` reads."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator

import numpy as np
import xarray as xr

from continuair.analysis.motion import Motion, motion_of
from continuair.files import new_file, save
from continuair.interfaces.acting import Acting, acting_on, warn_of_lacking
from continuair.interfaces.logged import columns_of
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import OF_NAME, PUSH, numbered
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def to_csv(
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    vehicle: Vehicle | None = None,
    scenario: Scenario | None = None,
) -> None:
    """Write one flight as a CSV file, a row per sample up to its end.

    First come the columns of a recording, as `continuair identify` reads them: time, position,
    attitude, bends, and the force, moment and bend moments that acted. Then all else that was
    logged, with units in the headings. vehicle: by default that of the result's attributes.
    scenario: the one that was flown; a result does not hold its functions of time, and a warning
    names inputs that the file lacks. Raises InputError, also for a file that exists.
    """
    motion = motion_of(dataset, vehicle)
    file = new_file("path", path)
    acting = acting_on(motion, scenario)
    on_tips = [name for name in ("tip_wrench",) if name in acting.inputs]
    warn_of_lacking([*acting.untold, *on_tips], 2, file.name)
    columns = dict([*_measured(motion), *_inputs(motion, acting), *_others(motion)])
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    rows.writerows(np.column_stack(list(columns.values())).tolist())
    save("path", file, text.getvalue())


def _measured(motion: Motion) -> Iterator[tuple[str, Array]]:
    yield "time", motion.time
    yield from zip("xyz", motion.position.T, strict=True)
    yield from zip(("qx", "qy", "qz", "qw"), motion.attitude.T, strict=True)
    bends = motion.bend.reshape(len(motion.time), -1)
    yield from zip(_per_section(motion, ("bend_x", "bend_y")), bends.T, strict=True)


def _inputs(motion: Motion, acting: Acting) -> Iterator[tuple[str, Array]]:
    for name in PUSH:
        if name in acting.inputs:
            names = OF_NAME[name].components
            names = _per_section(motion, names) if name == "bend_moment" else names
            yield from zip(names, acting.inputs[name].T, strict=True)


def _per_section(motion: Motion, names: tuple[str, ...]) -> tuple[str, ...]:
    vehicle = motion.vehicle
    return numbered(names, vehicle.sections if vehicle.has_arm_list else None)


def _others(motion: Motion) -> Iterator[tuple[str, Array]]:
    for column in columns_of(motion):
        if column.variable not in ("position", "attitude", "bend", "command"):
            name = "_".join([column.variable, *column.labels])
            yield f"{name} [{column.unit}]", column.values
