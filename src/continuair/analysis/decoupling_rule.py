"""Frequency up to which a vehicle may be decoupled, by a rule fitted to other vehicles.

The rule is a Dataset made by `continuair.studies.atlas`. For every excitation and frequency it has
the logarithm of an error that few vehicles exceed, as a polynomial of a vehicle's dimensionless
groups. Between frequencies it is interpolated linearly in logarithms. Decoupling is allowed up to
the first frequency at which the error exceeds the tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement

import numpy as np
import xarray as xr

from continuair.typing import Array, ArrayLike

DEGREE = 3
"""Total degree of the polynomials."""


def scaled(name: str, values: ArrayLike, ends: ArrayLike) -> Array:
    """Return a group scaled from its range to -1 … 1, linearly in its logarithm, or logit."""
    a, b, x = (_even(name, np.asarray(each, float)) for each in (*np.asarray(ends), values))
    return 2.0 * (x - a) / (b - a) - 1.0


def _even(name: str, values: Array) -> Array:
    """Return the logarithm of a group; of the coupling, the logit."""
    return np.log(values / (1.0 - values)) if name == "coupling" else np.log(values)


def terms(numbers: Sequence[Array]) -> Array:
    """Return products (runs, terms) of numbers, each (runs,), up to DEGREE, the constant first."""
    columns = np.stack(list(numbers), axis=-1)
    chosen = (
        each
        for degree in range(DEGREE + 1)
        for each in combinations_with_replacement(range(columns.shape[1]), degree)
    )
    return np.stack([columns[:, list(each)].prod(axis=1) for each in chosen], axis=-1)


def crossing(frequencies: Array, errors: Array, tolerance: float) -> Array:
    """Return the frequencies (runs,) at which errors (frequency, runs) first exceed a tolerance.

    Linear interpolation in logarithms. NaN if the first error exceeds the tolerance, inf if none
    does.
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
    """Return the groups of a vehicle outside a rule's ranges: name, value, and range."""
    ends = {str(each): rule["ends"].sel(number=each).to_numpy() for each in rule["number"].values}
    return [
        (name, groups[name], (float(low), float(high)))
        for name, (low, high) in ends.items()
        if name in groups and not low <= groups[name] <= high
    ]


def allowed(
    rule: xr.Dataset, loop: str, groups: Mapping[str, ArrayLike], tolerance: float
) -> Array:
    """Return the frequencies (excitation, runs), over the clamped one, up to which decoupling is
    allowed.

    rule: coefficients (loop, excitation, frequency, term), ends (number, end) of each group's
    range, and known (loop, number), the groups that a loop's rule uses; groups: by name, (runs,)
    each. NaN if no frequency of the rule is allowed, inf if all are, as in `crossing`.
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
