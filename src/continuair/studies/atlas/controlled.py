"""Paired flights of vehicles of all kinds, each with a position loop and without, over frequency.

They are the flights that `advise` makes of one vehicle, with the same moderate loads, so that their
limits are comparable.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.groups import coupling, vehicle_of
from continuair.flight.limits import limits_untold
from continuair.progress import Progress
from continuair.studies.atlas.flights import RANGES
from continuair.studies.atlas.kept import kept
from continuair.studies.excited_flights import NO_LOOP, Loop, flown_errors, least_periods
from continuair.studies.standard_excitations import EXCITATIONS, PERIODS
from continuair.studies.standard_loops import hover_loops
from continuair.sweeps.sampling import sobol_box
from continuair.typing import Model
from continuair.vehicle.runs import take
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

CONTROLLED_RANGES = {
    "mass_ratio": RANGES["mass_ratio"],
    "inertia_ratio": RANGES["inertia_ratio"],
    "gravity_number": (2e-3, 2.0),
    "slenderness": RANGES["slenderness"],
    "damping_ratio": RANGES["damping_ratio"],
    "bandwidth": (0.2, 4.0),
}
"""Range of each group, sampled uniformly in its logarithm.

bandwidth: of the loop's attitude, over the arm's clamped frequency.
"""

FREQUENCIES = (0.15, 0.25, 0.42, 0.55, 0.7, 0.85, 1.0, 1.2, 1.45, 1.7, 2.0)
"""Frequencies over the clamped one at which every vehicle is flown.

About resonance they are nearer than a flight of ten periods is sharp.
"""

LOADS = tuple(name for name, excitation in EXCITATIONS.items() if excitation.on is not None)
"""Excitations that oscillate."""

CONTROLLED = ("none", "position")
"""Loops that every vehicle is flown in."""

PERIOD = 0.4
"""Clamped period [s]: a hundred instants at which the loop acts, as of real arms at 250 Hz."""

_CHUNK = 256
_MODEL: Model = "decoupled"


def sample_vehicles(vehicles: int, seed: int) -> dict[str, Array]:
    """Return values (vehicles,) of CONTROLLED_RANGES: a Sobol sequence, scrambled by a seed."""
    checks.whole("vehicles", vehicles, 1)
    return sobol_box(CONTROLLED_RANGES, vehicles, [seed, 200])


def controlled_vehicle(groups: dict[str, Array]) -> Vehicle:
    """Return the batch of vehicles, plain ones as `vehicle_of` makes them."""
    return vehicle_of(groups, PERIOD)


def attitude_bandwidth(groups: dict[str, Array]) -> Array:
    """Return the bandwidth of each vehicle's attitude loop [rad/s]."""
    return np.asarray(groups["bandwidth"] * 2.0 * np.pi / PERIOD)


def fly_vehicles(
    groups: dict[str, Array], progress: Progress | None = None, *, folder: Path | None = None
) -> xr.Dataset:
    """Simulate every vehicle at FREQUENCIES, in each of CONTROLLED, decoupled and coupled.

    folder: of results, from which existing ones are reused. Returns error (loop, excitation,
    frequency, vehicle), infinite where a run failed, as all do of a vehicle whose loop is unstable;
    stable (vehicle,), the groups, and the coupling.
    """
    count, parts = len(groups["bandwidth"]), []
    for first in range(0, count, _CHUNK):
        some = {name: values[first : first + _CHUNK] for name, values in groups.items()}
        told = _told(progress, first, len(some["bandwidth"]), count)
        parts.append(kept(folder, f"vehicles_{first:05d}", some, partial(_flights, some, told)))
    return xr.concat(
        parts, "vehicle", data_vars="minimal", coords="minimal", compat="equals", join="exact",
        combine_attrs="drop",
    )  # fmt: skip


def _flights(groups: dict[str, Array], progress: Progress | None) -> xr.Dataset:
    """Return the result of `fly_vehicles` for a batch."""
    vehicle = controlled_vehicle(groups)
    errors, stable = _flown(vehicle, attitude_bandwidth(groups), progress)
    data: dict[str, Any] = {name: ("vehicle", values) for name, values in groups.items()}
    data["error"] = (("loop", "excitation", "frequency", "vehicle"), errors)
    data["stable"] = ("vehicle", stable)
    data["coupling"] = ("vehicle", coupling(vehicle))
    coordinates = {"loop": list(CONTROLLED), "excitation": list(LOADS)}
    return xr.Dataset(data, coordinates | {"frequency": list(FREQUENCIES)})


def errors_at(vehicle: Vehicle, bandwidths: Array, name: str, frequencies: Array) -> Array:
    """Return the error (runs,) of each vehicle of a batch in its loop, each at its own frequency.

    It is infinite where the loop is unstable or the run failed. All runs last as long as the
    slowest needs. Loops are position loops.
    """
    found = np.full(len(frequencies), np.inf)
    held, stable = hover_loops(vehicle, bandwidths)
    if held is not None:
        flown, at = take(vehicle, np.flatnonzero(stable)), frequencies[stable]
        longest = float(least_periods(at).max())
        loop = Loop("position", held=held)
        found[stable] = _error(flown, name, at, loop, longest)
    return found


def _flown(vehicle: Vehicle, bandwidths: Array, progress: Progress | None) -> tuple[Array, Array]:
    """Errors (loop, excitation, frequency, runs) of a batch, and whose loops are stable (runs,)."""
    held, stable = hover_loops(vehicle, bandwidths)
    errors = np.full((len(CONTROLLED), len(LOADS), len(FREQUENCIES), len(stable)), np.inf)
    controlled = take(vehicle, np.flatnonzero(stable))
    for i, name in enumerate(LOADS):
        if progress:
            progress(i, len(LOADS), name)
        for j, frequency in enumerate(FREQUENCIES):
            errors[0, i, j] = _error(vehicle, name, frequency, NO_LOOP, PERIODS)
            if held is not None:
                loop, periods = Loop("position", held=held), float(least_periods(frequency))
                errors[1, i, j, stable] = _error(controlled, name, frequency, loop, periods)
    return errors, stable


def _error(vehicle: Vehicle, name: str, frequency: Any, loop: Loop, periods: float) -> Array:
    with limits_untold():
        found = flown_errors(vehicle, name, frequency, loop, periods, [_MODEL])[_MODEL]
    return np.where(np.isnan(found), np.inf, found)


def _told(progress: Progress | None, before: int, runs: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, of, what: progress(before + done * runs // of, total, what)
