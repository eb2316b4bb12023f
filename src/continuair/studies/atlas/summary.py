"""Summary of the atlas: maps of the error over the two governing groups, and their importance."""

from __future__ import annotations

import io
import json
import math
import os
import zlib
from importlib import resources
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import xarray as xr

from continuair.analysis.importance import importance
from continuair.errors import InputError, shortened
from continuair.files import DAMAGE, check_regular, printed, reason, user_path
from continuair.kernels.dynamics import PLANTS, SIMPLER
from continuair.studies.atlas.flights import ERRORS, RANGES, load_angle, varied
from continuair.studies.atlas.loops import LOOP_ERRORS, LOOP_RANGES
from continuair.studies.standard_excitations import EXCITATIONS

Array = np.ndarray

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles over all the other groups, in every cell of a map and over the whole atlas."""

COLUMNS, ROWS = 12, 10
COUPLING = (0.015, 0.88)
"""Cells of a map, and the ends of its coupling."""

OPEN_SUMMARY, CONTROLLED_SUMMARY = "atlas.npz", "controlled.npz"
"""Summaries that the package ships, of flights in open loop and of vehicles with a loop."""

_LARGEST_LOOP_CELLS = 6

_LARGEST = 1 << 28
"""Largest unpacked size of a file's arrays [bytes]."""

_LONGEST_REASON = 200


def column_group(excitation: str) -> str:
    """Return the group along a map: the frequency, or the damping where nothing oscillates."""
    return "damping_ratio" if EXCITATIONS[excitation].on is None else "frequency"


def edges(group: str, cells: int) -> Array:
    """Return the ends (cells + 1,) of a map's cells: even in the logarithm, or in the logit."""
    if group == "coupling":
        low, high = (np.log(c / (1.0 - c)) for c in COUPLING)
        return np.asarray(1.0 / (1.0 + np.exp(-np.linspace(low, high, cells + 1))))
    low, high = (LOOP_RANGES | RANGES)[group]
    return np.geomspace(low, high, cells + 1)


def summarise(flights: dict[str, xr.Dataset]) -> xr.Dataset:
    """Return maps, quantiles and importance of the flights of each excitation.

    <error>_map (excitation, model, quantile, row, column): nrmse; error and angle per radian of the
    load's angle. count (excitation, row, column): flights of a cell. <error>_spread (excitation,
    model, quantile): as flown. first, total (excitation, error, model, group): importance for the
    logarithm; explained: by the expansion in all groups; by_map: by the map's two axes alone. lost
    (excitation,): share of flights that left the model's range.
    """
    parts = [_summary(name, flight) for name, flight in flights.items()]
    index = xr.DataArray(list(flights), dims="excitation", name="excitation")
    found: xr.Dataset = xr.concat(parts, index)
    found["coupling_edges"] = ("row_edge", edges("coupling", ROWS))
    found["frequency_edges"] = ("column_edge", edges("frequency", COLUMNS))
    found["damping_edges"] = ("column_edge", edges("damping_ratio", COLUMNS))
    return found.assign_coords(
        model=list(SIMPLER), quantile=list(QUANTILES), group=list(RANGES), error=list(ERRORS)
    )


def summarise_loops(loops: xr.Dataset) -> xr.Dataset:
    """Return the closed loops' part of the summary, over loop_error and loop_group."""
    names = list(LOOP_ERRORS)
    spread = [np.nanquantile(loops[name], QUANTILES) for name in names]
    unit = np.stack([_unit(loops[name].to_numpy(), LOOP_RANGES[name]) for name in LOOP_RANGES], -1)
    log = np.log10(loops["ds_px"].to_numpy())
    known = np.isfinite(log)
    shares = importance(unit[known], log[known])
    cells = _LARGEST_LOOP_CELLS
    row = _cell(loops["coupling"].to_numpy(), edges("coupling", cells))
    column = _cell(loops["speed"].to_numpy(), edges("speed", cells))
    return xr.Dataset(
        {
            "loop_spread": (("loop_error", "quantile"), spread),
            "loop_first": ("loop_group", shares.first),
            "loop_total": ("loop_group", shares.total),
            "loop_explained": shares.explained,
            "ds_map": (
                ("quantile", "loop_row", "loop_column"),
                _quantiles(loops["ds_px"].to_numpy(), row, column, (cells, cells)),
            ),
            "loop_lost": ("plant", [float(loops[f"lost_{p}"].mean()) for p in PLANTS]),
            "loop_alike": float(np.mean(loops["lost_coupled"] == loops["lost_decoupled"])),
        },
        {"loop_error": names, "loop_group": list(LOOP_RANGES), "plant": list(PLANTS)},
    )


def _summary(name: str, flight: xr.Dataset) -> xr.Dataset:
    angle = np.asarray(load_angle(name, flight))[:, None]
    scales = {"nrmse": np.ones((1, 1)), "error": angle, "angle": angle}
    group = column_group(name)
    row = _cell(flight["coupling"].to_numpy(), edges("coupling", ROWS))
    column = _cell(flight[group].to_numpy(), edges(group, COLUMNS))
    shape, data = (ROWS, COLUMNS), dict[str, Any]()
    dims = ("model", "quantile", "row", "column")
    for error, scale in scales.items():
        values = flight[error].to_numpy()
        cells = [_quantiles(v, row, column, shape) for v in (values / scale).T]
        data[f"{error}_map"] = (dims, np.array(cells, np.float32))
        data[f"{error}_spread"] = (dims[:2], np.nanquantile(values, QUANTILES, axis=0).T)
    inside = (row >= 0) & (column >= 0)
    count = np.bincount(row[inside] * COLUMNS + column[inside], minlength=ROWS * COLUMNS)
    data["count"] = (("row", "column"), count.reshape(shape).astype(np.int32))
    data["lost"] = float(np.isnan(flight["error"].to_numpy()).any(axis=1).mean())
    return xr.Dataset(data | _governed(name, flight, row * COLUMNS + column, inside))


def _governed(name: str, flight: xr.Dataset, cell: Array, inside: Array) -> dict[str, Any]:
    """Return the importance of every group for every error's logarithm, and the map's share."""
    names = varied(name)
    unit = np.stack([_unit(flight[g].to_numpy(), RANGES[g]) for g in names], axis=-1)
    place = [list(RANGES).index(g) for g in names]
    shape = (len(ERRORS), len(SIMPLER))
    first, total = (np.full((*shape, len(RANGES)), np.nan) for _ in range(2))
    explained, by_map = (np.empty(shape) for _ in range(2))
    angle = np.asarray(load_angle(name, flight))
    for i, error in enumerate(ERRORS):
        for j, model in enumerate(SIMPLER):
            values = flight[error].sel(model=model).to_numpy()
            log = np.log10(values)
            known = np.isfinite(log)
            shares = importance(unit[known], log[known])
            first[i, j, place], total[i, j, place] = shares.first, shares.total
            explained[i, j] = shares.explained
            relative = log if error == "nrmse" else log - np.log10(angle)
            by_map[i, j] = _explained_by(cell[known & inside], relative[known & inside])
    dims = ("error", "model")
    return {
        "first": ((*dims, "group"), first),
        "total": ((*dims, "group"), total),
        "explained": (dims, explained),
        "by_map": (dims, by_map),
    }


def _explained_by(cell: Array, values: Array) -> float:
    """Return the share of the variance between cells, corrected for degrees of freedom.

    Each cell's mean takes one degree of freedom; NaN if none remains.
    """
    count = np.bincount(cell)
    mean = np.bincount(cell, values) / np.maximum(count, 1)
    free = len(values) - int(np.count_nonzero(count))
    if free < 1:
        return np.nan
    within = float(np.sum((values - mean[cell]) ** 2)) / free
    return 1.0 - within / float(np.var(values, ddof=1))


def _unit(values: Array, ends: tuple[float, float]) -> Array:
    return np.asarray(np.log(values / ends[0]) / np.log(ends[1] / ends[0]))


def _cell(values: Array, ends: Array) -> Array:
    """Return the index of the cell of each value, -1 outside."""
    found = np.searchsorted(ends, values, side="right") - 1
    return np.where((found >= 0) & (found < len(ends) - 1), found, -1)


def _quantiles(values: Array, row: Array, column: Array, shape: tuple[int, int]) -> Array:
    """Quantiles (quantile, rows, columns) of the values in each cell, NaN where it is empty."""
    found = np.full((len(QUANTILES), *shape), np.nan)
    known = np.isfinite(values)
    for i in range(shape[0]):
        for j in range(shape[1]):
            here = values[known & (row == i) & (column == j)]
            if len(here):
                found[:, i, j] = np.quantile(here, QUANTILES)
    return found


def save(summary: xr.Dataset, file: str | os.PathLike[str]) -> None:
    """Write a summary as .npz: its variables, and the rest of it as JSON; no pickle."""
    names = [*summary.data_vars, *summary.coords]
    header = {
        "dims": {str(name): [str(d) for d in summary[name].dims] for name in names},
        "coords": [str(name) for name in summary.coords],
        "attrs": summary.attrs,
    }
    arrays: dict[str, Any] = {str(name): summary[name].to_numpy() for name in names}
    content = io.BytesIO()
    np.savez_compressed(content, header=np.array(json.dumps(header)), **arrays)
    Path(file).write_bytes(content.getvalue())


def load(file: str | os.PathLike[str] | None = None, *, shipped: str = OPEN_SUMMARY) -> xr.Dataset:
    """Return a summary that comes with the package, or one that `continuair atlas` has written.

    shipped: OPEN_SUMMARY or CONTROLLED_SUMMARY, without a file. Raises InputError.
    """
    if file is None:
        data = resources.files("continuair.studies.atlas").joinpath(shipped).read_bytes()
    else:
        path = user_path("atlas", file)
        check_regular("atlas", path)
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(
                "atlas",
                f"is {printed(file)}, which cannot be read ({reason(error)})",
                "give the atlas.npz of a folder of continuair atlas",
            ) from None
    try:
        return _dataset(data)
    except (*DAMAGE, EOFError, BadZipFile, zlib.error) as error:
        raise InputError(
            "atlas",
            (
                f"is {printed(file or shipped)}, which is no summary of an atlas "
                f"({shortened(reason(error), _LONGEST_REASON)})"
            ),
            "give atlas.npz as continuair atlas writes it",
        ) from None


def _dataset(data: bytes) -> xr.Dataset:
    """Return the summary in the content of a file."""
    _check_sizes(data)
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        header = json.loads(str(arrays["header"]))
        parts = {name: (dims, arrays[name]) for name, dims in header["dims"].items()}
    coords = {name: parts.pop(name) for name in header["coords"]}
    return xr.Dataset(parts, coords, header["attrs"])


def _check_sizes(data: bytes) -> None:
    """Raise ValueError for arrays that unpack to more than a summary can hold."""
    with ZipFile(io.BytesIO(data)) as arrays:
        if sum(info.file_size for info in arrays.infolist()) > _LARGEST:
            raise ValueError(f"its arrays unpack to more than {_LARGEST >> 20} MiB")
        for info in arrays.infolist():
            with arrays.open(info) as stream:
                version = np.lib.format.read_magic(stream)
                old = version == (1, 0)
                read = (
                    np.lib.format.read_array_header_1_0
                    if old
                    else (np.lib.format.read_array_header_2_0)
                )
                shape, _, dtype = read(stream)
            if math.prod(shape) * dtype.itemsize > info.file_size:
                raise ValueError(f"{info.filename} holds fewer numbers than it says")
