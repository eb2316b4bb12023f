"""Paired flights of the standard excitations over the dimensionless groups."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.groups import GROUPS, coupling, vehicle_of
from continuair.flight.resolution import angles_unread
from continuair.kernels.dynamics import SIMPLER
from continuair.progress import Progress
from continuair.studies.standard_excitations import EXCITATIONS, sample_time, standard_scenario
from continuair.sweeps import run_pairs
from continuair.sweeps.sampling import sobol_box
from continuair.vehicle.runs import take
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

RANGES = {
    "mass_ratio": (0.01, 2.0),
    "inertia_ratio": (0.05, 50.0),
    "gravity_number": (1e-3, 0.3),
    "slenderness": (1e-3, 0.03),
    "damping_ratio": (1e-3, 0.1),
    "bend": (0.02, 1.2),
    "load": (0.02, 0.6),
    "frequency": (0.1, 4.0),
}
"""Range of each group, sampled uniformly in its logarithm."""

FREE = ("mass_ratio", "inertia_ratio", "gravity_number", "slenderness", "damping_ratio", "bend")
"""Groups of a flight on which nothing oscillates."""

ERRORS = {
    "nrmse": "NRMSE of the tip's position",
    "error": "RMSE of the tip's position over the arm's length",
    "angle": "RMS of the angle between the tips [rad]",
}
"""Recorded values of a pair."""

RTOL = 1e-6
"""Tolerance of the flights: 1e-4 leaves errors of weakly coupled vehicles up to a fifth off."""

_CHUNK = 256


def varied(excitation: str) -> tuple[str, ...]:
    """Return the groups that matter in an excitation."""
    return FREE if EXCITATIONS[excitation].on is None else tuple(RANGES)


def sample(excitation: str, runs: int, seed: int) -> dict[str, Array]:
    """Return values (runs,) of the groups of an excitation: a Sobol sequence, scrambled by a seed.

    Raises InputError.
    """
    checks.whole("runs", runs, 1)
    ranges = {name: RANGES[name] for name in varied(excitation)}
    return sobol_box(ranges, runs, [seed, list(EXCITATIONS).index(excitation)])


def fly(
    excitation: str, groups: dict[str, Array], progress: Progress | None = None, rtol: float = RTOL
) -> xr.Dataset:
    """Simulate every run with each model beside the coupled one; rtol: as in `run_pairs`.

    Returns nrmse, error, angle over (run, model), NaN where a run left the model's range, and the
    groups (run), with the coupling.
    """
    vehicle = vehicle_of(groups)
    strength = coupling(vehicle)
    order = np.argsort(strength)
    runs = len(order)
    errors = np.full((len(ERRORS), runs, len(SIMPLER)), np.nan)
    for first in range(0, runs, _CHUNK):
        if progress:
            progress(first, runs, excitation)
        at = order[first : first + _CHUNK]
        errors[:, at] = run_errors(
            excitation, take(vehicle, at), {name: v[at] for name, v in groups.items()}, rtol
        )
    data: dict[str, Any] = {
        name: (("run", "model"), values, {"long_name": ERRORS[name]})
        for name, values in zip(ERRORS, errors, strict=True)
    }
    data |= {name: ("run", values) for name, values in groups.items()}
    data["coupling"] = ("run", strength, {"long_name": GROUPS["coupling"]})
    return xr.Dataset(data, {"model": list(SIMPLER)})


def load_angle(excitation: str, groups: Any) -> Any:
    """Return the angle (runs,) [rad] by which the load or the release bends or turns something.

    It is computed to first order in the load, and without gravity on the bent arm. Errors are
    proportional to it while it is small. A UAV that accelerates steadily by a times gravity bends
    its arm by 10/3 a g / (l ω_c²).
    """
    if EXCITATIONS[excitation].on is None:
        return groups["bend"]
    lateral = groups["gravity_number"] * 10.0 / 3.0 if excitation == "force" else 1.0
    return groups["load"] * lateral


def scenario_of(excitation: str, vehicle: Vehicle, groups: dict[str, Array]) -> Any:
    """Return the standard excitation with the groups of each run."""
    flown: dict[str, Any] = {n: groups[n] for n in ("load", "frequency", "bend") if n in groups}
    return standard_scenario(excitation, vehicle, **flown)


def run_errors(
    excitation: str, vehicle: Vehicle, groups: dict[str, Array], rtol: float = RTOL
) -> Array:
    """Return ERRORS (3, runs, models) of vehicles of one clamped period."""
    scenario = scenario_of(excitation, vehicle, groups)
    # Periods that agree but for rounding are one.
    time = round(sample_time(vehicle), 12)
    with angles_unread():
        found = run_pairs(vehicle, scenario, SIMPLER, sample=time, rtol=rtol)
    found = found.sel(model=list(SIMPLER))
    length = np.asarray(vehicle.arm.length)[:, None]
    rows = found["nrmse_t"], found["rmse_t_m"] / length, found["angle_rad"]
    return np.stack([row.to_numpy() for row in rows])
