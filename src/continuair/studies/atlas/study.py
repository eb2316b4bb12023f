"""The atlas: where decoupling holds, over dimensionless groups, and which coupling matters."""

from __future__ import annotations

import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.couplings import attribution, responsible
from continuair.analysis.groups import vehicle_of
from continuair.kernels.dynamics import COUPLINGS
from continuair.progress import Progress
from continuair.studies.atlas.controlled import fly_vehicles, sample_vehicles
from continuair.studies.atlas.flights import RTOL, fly, sample, scenario_of
from continuair.studies.atlas.judging import judge
from continuair.studies.atlas.loops import fly_loops, sample_loops
from continuair.studies.atlas.summary import summarise, summarise_loops
from continuair.studies.standard_excitations import EXCITATIONS, sample_time

RUNS, LEAST = 100_000, 600
"""Open-loop runs by default, and the fewest that are meaningful."""

VEHICLES, LEAST_VEHICLES = 2048, 128
"""Vehicles that are flown with a loop by default, and the fewest that a rule can be made of."""

_LOOPS_PER_RUN, _ATTRIBUTED_PER_RUN = 1 / 50, 1 / 250
_CHECKED = 64
"""Flights of each excitation that are flown again within a tenth of the tolerance."""


def atlas(runs: int = RUNS, seed: int = 0, *, progress: Progress | None = None) -> xr.Dataset:
    """Simulate the atlas, and return its summary.

    runs: in open loop, over all excitations, each with every model, with one closed-loop pair per
    fifty. The summary's attributes record its settings. Raises InputError.
    """
    checks.whole("runs", runs, LEAST)
    checks.whole("seed", seed, 0)
    each, loops = math.ceil(runs / len(EXCITATIONS)), math.ceil(runs * _LOOPS_PER_RUN)
    attributed = math.ceil(each * len(EXCITATIONS) * _ATTRIBUTED_PER_RUN / len(EXCITATIONS))
    names, flights, parts = list(EXCITATIONS), {}, []
    for place, name in enumerate(names):
        told = _told(progress, place * each, len(names) * each)
        groups = sample(name, each, seed)
        flights[name] = fly(name, groups, told)
        parts.append(
            xr.Dataset(
                {
                    **_attributed(name, attributed, seed),
                    "tolerance_error": _tolerance_error(name, groups),
                }
            )
        )
    closed = fly_loops(sample_loops(loops, seed), progress)
    shares = xr.concat(parts, xr.DataArray(names, dims="excitation", name="excitation"))
    summary = xr.merge([summarise(flights), shares, summarise_loops(closed)])
    summary.attrs = {
        "study": "atlas",
        "version": version("continuair"),
        "seed": seed,
        "runs": each * len(names),
        "closed_loop_runs": loops,
        "attributed_runs": attributed * len(names),
    }
    return summary


def check_size(vehicles: int, seed: int) -> None:
    """Raise InputError for sizes that `controlled` would refuse, before any simulation."""
    checks.whole("vehicles", vehicles, LEAST_VEHICLES)
    checks.whole("seed", seed, 0)


def controlled(
    vehicles: int = VEHICLES,
    seed: int = 0,
    *,
    folder: Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate vehicles with a position loop and without; fit the rule on half, test on the rest.

    folder: of results, as for `fly_vehicles`. Returns the result of `judge`; its attributes record
    the settings. Raises InputError.
    """
    check_size(vehicles, seed)
    groups = sample_vehicles(vehicles, seed)
    summary = judge(fly_vehicles(groups, progress, folder=folder), progress)
    summary.attrs = {
        "study": "atlas",
        "version": version("continuair"),
        "seed": seed,
        "vehicles": vehicles,
    }
    return summary


def _attributed(name: str, runs: int, seed: int) -> dict[str, Any]:
    """Return the share of flights in which each coupling's omission errs most, and by how much.

    The error is relative to that of decoupling.
    """
    groups = sample(name, runs, seed + 1)
    vehicle = vehicle_of(groups)
    scenario = scenario_of(name, vehicle, groups)
    found = attribution(vehicle, scenario, round(sample_time(vehicle), 12))
    errors = {without: of_model["rmse_t_m"] for without, of_model in found.items()}
    names = responsible(errors)
    # Where flights ended early nothing is known of them, nor of a share of none.
    known = names[names != ""]
    each = [errors[c] / errors["decoupled"] for c in COUPLINGS]
    ratio = [np.nanmedian(of) if np.isfinite(of).any() else np.nan for of in each]
    share = [np.mean(known == c) if len(known) else np.nan for c in COUPLINGS]
    return {
        "responsible": ("coupling", share),
        "alone": ("coupling", ratio),
        "coupling": list(COUPLINGS),
    }


def _tolerance_error(name: str, groups: dict[str, Any]) -> float:
    """Return the largest relative change of an error at a tenth of the tolerance.

    It covers 9 of 10 flights of decoupled models.
    """
    some = {group: values[:_CHECKED] for group, values in groups.items()}
    errors, finer = (
        fly(name, some, rtol=rtol)["error"].sel(model="decoupled") for rtol in (RTOL, 0.1 * RTOL)
    )
    return float(np.nanquantile(np.abs(errors / finer - 1.0), 0.9))


def _told(progress: Progress | None, before: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, _, what: progress(before + done, total, what)
