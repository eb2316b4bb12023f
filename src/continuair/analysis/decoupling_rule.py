"""Up to which frequency a vehicle may be decoupled, by a rule that was made of other vehicles.

The rule is a Dataset, of which `continuair.studies.atlas` makes one. For every load and frequency
it has the logarithm of an error, which few vehicles exceed, as a polynomial of a vehicle's numbers;
between frequencies that goes evenly in the logarithms. Decoupling is allowed up to where the error
first leaves the tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import xarray as xr

Array = np.ndarray

DEGREE = 3
"""Total degree of the polynomials."""


def scaled(name: str, values: Any, ends: Any) -> Array:
    """A number of a vehicle on its range, from -1 to 1: even in its logarithm, or logit."""
    a, b, x = (_even(name, np.asarray(each, float)) for each in (*ends, values))
    return 2.0 * (x - a) / (b - a) - 1.0


def _even(name: str, values: Array) -> Array:
    return np.log(values / (1.0 - values)) if name == "coupling" else np.log(values)


def terms(numbers: Sequence[Array]) -> Array:
    """Products (runs, terms) of numbers, each (runs,), up to DEGREE; the constant comes first."""
    columns = np.stack(list(numbers), axis=-1)
    chosen = (
        each
        for degree in range(DEGREE + 1)
        for each in combinations_with_replacement(range(columns.shape[1]), degree)
    )
    return np.stack([columns[:, list(each)].prod(axis=1) for each in chosen], axis=-1)


def crossing(frequencies: Array, errors: Array, tolerance: float) -> Array:
    """Frequencies (runs,) at which errors (frequency, runs) first leave a tolerance.

    They go evenly in the logarithms from one frequency to the next. NaN where the first is beyond
    the tolerance already, inf where none is.
    """
    logs = np.log(np.clip(errors, 1e-12, 1e12)) - np.log(tolerance)
    x = np.log(np.asarray(frequencies))
    beyond = ~(errors <= tolerance)
    first, run = np.argmax(beyond, axis=0), np.arange(errors.shape[1])
    before = np.maximum(first - 1, 0)
    low, high = logs[before, run], logs[first, run]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(first > 0, -low / (high - low), 0.0)
    found = np.exp(x[before] + share * (x[first] - x[before]))
    found = np.where(first > 0, found, np.nan)
    return np.where(beyond.any(axis=0), found, np.inf)


def beyond(
    rule: xr.Dataset, groups: Mapping[str, float]
) -> list[tuple[str, float, tuple[float, float]]]:
    """Numbers of a vehicle that a rule was not made of: name, value, and the rule's ends."""
    ends = {str(each): rule["ends"].sel(number=each).to_numpy() for each in rule["number"].values}
    return [
        (name, groups[name], (float(low), float(high)))
        for name, (low, high) in ends.items()
        if name in groups and not low <= groups[name] <= high
    ]


def allowed(rule: xr.Dataset, loop: str, groups: Mapping[str, Any], tolerance: float) -> Array:
    """Frequencies (excitation, runs) over the clamped one up to which a rule allows decoupling.

    rule: coefficients (loop, excitation, frequency, term), ends (number, end) of each number's
    range, and known (loop, number), which of them it goes by; groups: numbers by name, (runs,)
    each. NaN where it allows none that was flown, inf where it allows all, as `crossing` has them.
    """
    one = rule.sel(loop=loop)
    names = [str(name) for name in one["number"].to_numpy()[one["known"].to_numpy()]]
    ends = rule["ends"]
    of = [scaled(name, groups[name], ends.sel(number=name).to_numpy()) for name in names]
    products = terms([np.atleast_1d(each) for each in of])
    coefficients = one["coefficients"].to_numpy()[..., : products.shape[1]]
    errors = np.exp(coefficients @ products.T)
    frequencies = rule["frequency"].to_numpy()
    return np.stack([crossing(frequencies, each, tolerance) for each in errors])
