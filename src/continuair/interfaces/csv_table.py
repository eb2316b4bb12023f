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
from continuair.flight.labels import columns_of_bends, columns_of_moments
from continuair.interfaces.acting import Acting, acting_on, warn_of_lacking
from continuair.interfaces.logged import columns_of
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import OF_NAME, PUSH
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def to_csv(
    dataset: xr.Dataset,
    path: str | os.PathLike[str],
    *,
    vehicle: Vehicle | None = None,
    scenario: Scenario | None = None,
) -> None:
    """Write one flight as a CSV file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of one run of `simulate`.
    path : str or path-like
        Path of the new file.
    vehicle : Vehicle, optional
        The simulated vehicle. Default: that of the result's attributes.
    scenario : Scenario, optional
        The simulated scenario. A result does not hold its functions of time.

    Raises
    ------
    InputError
        If the result is not that of one run, or the file exists.

    Warns
    -----
    ContinuairWarning
        If the file lacks inputs, which it names.

    Notes
    -----
    One row per sample up to the flight's end. The first columns are those that `continuair
    identify` reads: time, position, attitude, bends (with a section whose strain varies, the
    coordinates of all sections, ``strain_`` and their names), and the force, moment and bend
    moments that acted. All other logged signals follow, with units in the headings.
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
    yield from zip(columns_of_bends(motion.vehicle), motion.bend.T, strict=True)


def _inputs(motion: Motion, acting: Acting) -> Iterator[tuple[str, Array]]:
    for name in PUSH:
        if name in acting.inputs:
            bending = name == "bend_moment"
            names = columns_of_moments(motion.vehicle) if bending else OF_NAME[name].components
            yield from zip(names, acting.inputs[name].T, strict=True)


def _others(motion: Motion) -> Iterator[tuple[str, Array]]:
    for column in columns_of(motion):
        if column.variable not in ("position", "attitude", "bend", "strain", "command"):
            name = "_".join([column.variable, *column.labels])
            yield f"{name} [{column.unit}]", column.values
