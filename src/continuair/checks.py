"""Validation of arguments, once where they enter the library."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib.util import find_spec
from itertools import chain
from numbers import Integral, Real
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from continuair.errors import InputError, nearest, shown

Array = NDArray[np.float64]

_Name = TypeVar("_Name", bound=str)

_ASKED_AGAIN, _SAME = 5, 1e-9
"""Number of repeated evaluations of a function, and their largest relative difference."""

_PLAIN_NUMBERS = {float, int, np.float64}


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is one finite number, not an array or a bool."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number beyond the largest float
        return False


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether a value is one whole number, of Python or NumPy, not a bool."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def finite_array(value: object) -> Array | None:
    """Return finite numbers as a new array, or None for anything else.

    Arrays of other libraries are accepted if NumPy can read them: not on a device, not traced by
    JAX, and not recorded by PyTorch for derivatives. Booleans, masked entries, quantities with a
    unit and numbers beyond float64 are rejected, although NumPy would convert the first three. In
    labelled arrays the dimension of runs is moved to the front.
    """
    value = runs_first(value)
    try:
        given = np.asarray(value)
    except (TypeError, ValueError, RuntimeError):
        return None
    if given.dtype.kind not in "iuf" or not means_numbers(value):
        return None
    with np.errstate(over="ignore"):
        found = np.array(given, dtype=np.float64)
    return found if np.isfinite(found).all() else None


def runs_first(value: Any) -> Any:
    """Return an array of xarray with its dimension of runs first, anything else unchanged."""
    return value.transpose("run", ...) if "run" in getattr(value, "dims", ())[1:] else value


def frozen(array: Array) -> Array:
    """Return an array made read-only, since its values have been checked."""
    array.flags.writeable = False
    return array


def asked_again(count: int) -> NDArray[np.intp]:
    """Return indices of some of `count` times, in descending order, for repeated evaluation."""
    return np.unique(np.linspace(0, count - 1, _ASKED_AGAIN).astype(int))[::-1]


def repeats(name: str, first: Array, again: Array) -> None:
    """Raise InputError if a repeated evaluation of a function gives other values."""
    if first.shape != again.shape or np.abs(again - first).max() > _SAME * np.abs(first).max():
        raise InputError(
            name,
            "returns other values for the same times",
            (
                "give a function of time alone, such as np.interp over precomputed "
                "values, or step a Simulation"
            ),
        )


def means_numbers(value: object) -> bool:
    """Return whether no entry is a bool, masked, or a quantity with a unit (astropy, Pint)."""
    if isinstance(value, (list, tuple)):
        kinds = set(map(type, value))
        # Lists of plain numbers are accepted at once; bool is a type of its own.
        if kinds <= _PLAIN_NUMBERS:
            return True
        if kinds <= {list, tuple}:
            return means_numbers(list(chain.from_iterable(value)))
        if kinds == {np.ndarray}:
            return "b" not in {entry.dtype.kind for entry in value}
        return all(means_numbers(entry) for entry in value)
    if has_unit(value):
        return False
    if isinstance(value, np.ndarray):
        return value.dtype.kind != "b" and not np.ma.is_masked(value)
    return not isinstance(value, (bool, np.bool_))


def has_unit(value: object) -> bool:
    """Return whether a value is a quantity, whose unit NumPy would drop; text is only a note."""
    units = (getattr(value, name, None) for name in ("unit", "units"))
    return any(unit is not None and not isinstance(unit, str) for unit in units)


def number(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    otherwise: str = "",
) -> float:
    """Return a finite number above a bound, or of at least another.

    otherwise: end of the message, such as the unit or an alternative.
    """
    if not is_number(value) or not (value > above and value >= least):
        bound = f" above {above:g}" if above > -math.inf else ""
        bound += f" of at least {least:g}" if least > -math.inf else ""
        raise InputError(name, f"is {shown(value)}", f"give a finite number{bound}{otherwise}")
    return float(value)


def positive(name: str, value: Any, otherwise: str = "") -> float:
    """Return a finite number above 0; `otherwise` as in `number`."""
    return number(name, value, above=0.0, otherwise=otherwise)


def whole(name: str, value: Any, least: int, most: int | None = None) -> int:
    """Return a whole number between bounds; the upper one is optional."""
    if not is_whole(value) or value < least or (most is not None and value > most):
        bound = f", {least} or more" if most is None else f" from {least} to {most:,}"
        raise InputError(name, f"is {shown(value)}", f"give a whole number{bound}")
    return int(value)


def seed(value: Any, most: int | None = None) -> int | tuple[int, ...]:
    """Return a seed of random numbers, 0 or more, or one seed per run."""
    row = value.ndim == 1 if isinstance(value, np.ndarray) else isinstance(value, (list, tuple))
    if row and len(value):
        return tuple(whole("seed", each, 0, most) for each in value)
    return whole("seed", value, 0, most)


def flag(name: str, value: Any) -> bool:
    """Return a bool, of Python or NumPy."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(name, f"is {shown(value)}", "give True or False")
    return bool(value)


def gravity(value: Any) -> float:
    """Return the magnitude of gravity [m/s²]."""
    if not is_number(value) or value < 0:
        raise InputError(
            "gravity",
            f"is {shown(value)}, but must be a finite number, 0 or more",
            "give its magnitude [m/s²]",
        )
    return float(value)


def choice(name: str, value: object, valid: Iterable[str]) -> str:
    """Return one of the valid names."""
    valid = list(valid)
    if not isinstance(value, str) or value not in valid:
        raise InputError(name, f"is {shown(value)}", nearest(str(value), valid))
    return value


def choices(name: str, values: Any, valid: Iterable[_Name]) -> list[_Name]:
    """Return one or more of the valid names, once each."""
    valid = list(valid)
    given: list[Any] = [values] if isinstance(values, str) else list(values)
    if not given:
        raise InputError(name, "is empty", f"name one or more of {', '.join(valid)}")
    for value in given:
        if not isinstance(value, str) or value not in valid:
            raise InputError(name, f"holds {shown(value)}", nearest(str(value), valid))
    return list(dict.fromkeys(given))


def renamed(function: str, given: dict[str, Any], **names: str) -> None:
    """Raise InputError for arguments by an old name, and TypeError for unknown arguments.

    names: old name -> new name.
    """
    for name, value in given.items():
        if name in names:
            raise InputError(name, f"is {shown(value)}, but has a new name", f"use {names[name]}")
        raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")


def installed(package: str, extra: str) -> None:
    """Raise InputError, with the extra that installs it, if a package is not installed."""
    if find_spec(package) is None:
        raise InputError(
            package,
            "is not installed, but this needs it",
            f"install it with pip install 'continuair[{extra}]'",
        )


def row(name: str, value: Any, width: int) -> Array:
    """Return an array (width,) from `width` numbers, or from one number for all."""
    found = finite_array(value)
    if found is None or found.shape not in ((), (width,)):
        numbers = "a finite number" if width == 1 else f"{width} finite numbers"
        raise InputError(name, f"is {shown(value)}", f"give {numbers}")
    return np.broadcast_to(found, width).copy()


def vector(name: str, value: Any, width: int, *, or_zero: bool = False) -> Array:
    """Return an array (width,) from `width` numbers.

    or_zero: whether a single 0 is accepted as zeros.
    """
    found = _zeros_of(value, width) if or_zero else finite_array(value)
    if found is None or found.shape != (width,):
        otherwise = ", or 0 for none" if or_zero else ""
        raise InputError(name, f"is {shown(value)}", f"give {width} finite numbers{otherwise}")
    return found


def rows(name: str, value: Any, width: int) -> Array:
    """Return an array (n, width) from n rows, one row, or 0 for a row of zeros."""
    found = _zeros_of(value, width)
    if (
        found is None
        or found.ndim not in (1, 2)
        or found.shape[-1] != width
        or not len(np.atleast_2d(found))
    ):
        raise InputError(
            name, f"is {shown(value)}", f"give {width} finite numbers, rows of them, or 0 for none"
        )
    return np.atleast_2d(found)


def _zeros_of(value: Any, width: int) -> Array | None:
    """Return finite numbers as an array, a single 0 as zeros (width,), else None."""
    found = finite_array(value)
    return np.zeros(width) if found is not None and found.ndim == 0 and found == 0.0 else found
