"""The rule of a controlled vehicle, fitted: an error that few vehicles of some numbers exceed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.optimize import linprog
from scipy.sparse import eye, hstack

from continuair.analysis.decoupling_rule import scaled, terms
from continuair.studies.atlas.controlled import CONTROLLED_RANGES
from continuair.studies.atlas.summary import COUPLING

Array = np.ndarray

LEVEL = 0.97
"""Share of vehicles whose error, at a frequency, is to lie below the rule's."""

NUMBERS = {
    "none": ("coupling", "gravity_number"),
    "position": ("coupling", "gravity_number", "bandwidth", "mass_ratio"),
}
"""Variables of a rule in each loop, besides the frequency."""

ENDS = {"coupling": COUPLING} | CONTROLLED_RANGES
"""Range of each number."""

_FAILED = 10.0
"""Error of a flight that failed, where a polynomial goes by it."""


def products(flights: xr.Dataset, names: Sequence[str]) -> Array:
    """Return terms (vehicle, terms) of some numbers of the simulated vehicles."""
    return terms([scaled(name, flights[name].to_numpy(), ENDS[name]) for name in names])


def logarithm(errors: Array) -> Array:
    """Return the logarithm of errors, those of failed flights included."""
    return np.log(np.minimum(errors, _FAILED))


def fit(flights: xr.Dataset, names: Sequence[str], loop: str) -> Array:
    """Return coefficients (excitation, frequency, terms) of a rule that uses some numbers.

    flights: of vehicles with a stable loop, as `fly_vehicles` returns them.
    """
    known = products(flights, names)
    logs = logarithm(flights["error"].sel(loop=loop).to_numpy())
    return np.array([[quantile_fit(known, row, LEVEL) for row in load] for load in logs])


def quantile_fit(known: Array, values: Array, level: float) -> Array:
    """Coefficients (terms,) of terms (runs, terms) that a share of the values (runs,) lies below.

    The linear programme of R. Koenker and G. Bassett (1978).
    """
    runs, count = known.shape
    above, below = np.full(runs, level), np.full(runs, 1.0 - level)
    found = linprog(
        np.concatenate([np.zeros(count), above, below]),
        A_eq=hstack([known, eye(runs), -eye(runs)], format="csc"),
        b_eq=values,
        bounds=[(None, None)] * count + [(0.0, None)] * (2 * runs),
        method="highs",
    )
    return np.asarray(found.x[:count])
