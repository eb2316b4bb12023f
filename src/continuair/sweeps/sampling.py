"""Values of variables along one dimension: lists, ranges, and samples of a box of ranges."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, nearest, shown
from continuair.typing import Array

SAMPLINGS = ("sobol", "latin-hypercube")

MOST_VALUES = 10_000_000
"""Most values along one dimension, all of which are in memory."""

_RANGE_KEYS = ("from", "to", "count", "spacing")
_SPACINGS = ("linear", "log")


def values_along(table: Mapping[str, Any], seed: int | Sequence[int]) -> dict[str, Array]:
    """Return the variables of one [[vary]] table, all of one length.

    table: field -> list of values, or range {from, to, count, spacing}; with `sampling` and `count`
    in it, ranges are sampled together. Raises InputError.
    """
    fields = flat({name: v for name, v in table.items() if name not in ("sampling", "count")})
    if not fields:
        raise InputError(
            "vary", "has a table without a field", "name one, as in vehicle.arm.radius"
        )
    if "sampling" in table:
        return _sampled(fields, table["sampling"], table.get("count"), seed)
    if "count" in table:
        raise InputError(
            "count",
            "of a vary table needs a sampling",
            f"give sampling, one of {', '.join(SAMPLINGS)}, or a count in each range",
        )
    found = {name: _listed(name, value) for name, value in fields.items()}
    lengths = {name: len(values) for name, values in found.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise InputError(
            "vary",
            f"has fields of different lengths in one table ({counts})",
            "give equally many values, or a table for each",
        )
    return found


def flat(fields: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return dotted names from nested tables, which TOML makes of names without quotation marks."""
    found: dict[str, Any] = {}
    for name, value in fields.items():
        if isinstance(value, Mapping) and not {"from", "to"} & set(value):
            found |= flat(value, f"{prefix}{name}.")
        else:
            found[f"{prefix}{name}"] = value
    return found


def _listed(field: str, value: Any) -> Array:
    """Return the values of a list or a range."""
    if isinstance(value, Mapping):
        low, high, log = _range(field, value)
        count = checks.whole(f"{field}.count", value.get("count"), 1, MOST_VALUES)
        if not log:
            return np.linspace(low, high, count)
        found = _geometric(low, high, np.linspace(0.0, 1.0, count))
        found[-1] = high if count > 1 else low
        return found
    return values(field, value)


def values(field: str, value: Any) -> Array:
    """Return a list of numbers, texts or booleans as an array; InputError for anything else."""
    array = _array(value) if isinstance(value, (list, tuple)) and value else np.empty(0)
    if array.ndim != 1 or not len(array) or array.dtype.kind not in "biufU":
        raise InputError(
            field, f"is {shown(value)}", "give a list of values, or a range {from, to, count}"
        )
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise InputError(field, f"has {shown(value)}", "give finite numbers")
    return array.astype(float) if array.dtype.kind in "iu" else array


def _array(value: Any) -> Array:
    """Return a list as an array, empty if entries are of several kinds, or nested."""
    kinds = {"b" if isinstance(v, bool) else "U" if isinstance(v, str) else "f" for v in value}
    nested = any(isinstance(v, (list, tuple, Mapping)) for v in value)
    return np.asarray(value) if len(kinds) == 1 and not nested else np.empty(0)


def _sampled(
    fields: dict[str, Any], sampling: object, count: object, seed: int | Sequence[int]
) -> dict[str, Array]:
    """Return samples of ranges, by name."""
    checks.choice("sampling", sampling, SAMPLINGS)
    many = checks.whole("count", count, 1, MOST_VALUES)
    for name, value in fields.items():
        if not isinstance(value, Mapping) or "count" in value:
            raise InputError(
                name,
                f"is {shown(value)} in a sampled table",
                "give a range {from, to}, or move it to its own table",
            )
    ranges = {name: _range(name, value) for name, value in fields.items()}
    if sampling == "sobol":
        points = sobol(len(ranges), many, seed)
    else:
        # SciPy's statistics are slow to import.
        from scipy.stats import qmc

        points = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed)).random(many)
    found = {}
    for (name, (low, high, log)), column in zip(ranges.items(), points.T, strict=True):
        found[name] = _geometric(low, high, column) if log else low + (high - low) * column
    return found


def sobol(dimensions: int, count: int, seed: int | Sequence[int]) -> Array:
    """Return a scrambled Sobol sequence in the unit cube.

    Parameters
    ----------
    dimensions : int
        Number of dimensions.
    count : int
        Number of points.
    seed : int or sequence of int
        Seed of the scrambling.

    Returns
    -------
    ndarray, shape (count, dimensions)
        The points.
    """
    from scipy.stats import qmc

    # Sequences are balanced at powers of two; points beyond the count are dropped.
    sampler = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
    points: Array = sampler.random_base2(int(np.ceil(np.log2(count))))[:count]
    return points


def sobol_box(
    ranges: Mapping[str, tuple[float, float]], count: int, seed: int | Sequence[int]
) -> dict[str, Array]:
    """Return a Sobol sequence in a box, uniform in the logarithms.

    Parameters
    ----------
    ranges : mapping of str to tuple of float
        Name to lower and upper end, both above 0.
    count : int
        Number of points.
    seed : int or sequence of int
        Seed of the scrambling.

    Returns
    -------
    dict of str to ndarray
        Name to values (count,).
    """
    points = sobol(len(ranges), count, seed)
    return {
        name: _geometric(low, high, column)
        for (name, (low, high)), column in zip(ranges.items(), points.T, strict=True)
    }


def _geometric(low: float, high: float, share: Array) -> Array:
    """Return values from low at a share of 0 to high at 1, uniform in the logarithm.

    In extended precision, as the last bit of NumPy's powers depends on the processor.
    """
    grown = np.longdouble(high / low) ** share.astype(np.longdouble)
    return np.asarray(low * grown.astype(float))


def _range(field: str, value: Mapping[str, Any]) -> tuple[float, float, bool]:
    """Return the ends of a range, and whether its spacing is logarithmic."""
    for key in value:
        if key not in _RANGE_KEYS:
            raise InputError(
                f"{field}.{key}", "is not part of a range", f"{nearest(key, _RANGE_KEYS)}"
            )
    low, high = (checks.number(f"{field}.{key}", value.get(key)) for key in ("from", "to"))
    spacing = checks.choice(f"{field}.spacing", value.get("spacing", "linear"), _SPACINGS)
    if spacing == "log" and not (low > 0.0 and high > 0.0):
        raise InputError(field, f"has spacing 'log' from {low} to {high}", "give ends above 0")
    if not math.isfinite(high / low if spacing == "log" else high - low):
        raise InputError(
            field, f"goes from {low} to {high}, beyond floating-point range", "give closer ends"
        )
    return low, high, spacing == "log"
