"""Types of structs for NumPy."""

from __future__ import annotations

import re
from typing import Any, cast

import numpy as np

_FORMAT = re.compile(r"\(?([\d, ]*)\)?([^\d, ()].*)")
"""Shape and number of an array of Warp's structs, as in (3, 3)<f8 and 3<f8."""


def numpy_type(Struct: object) -> np.dtype[np.void]:
    """Return the type of a struct for NumPy.

    Parameters
    ----------
    Struct : warp struct
        The struct; its parts may be structs.

    Returns
    -------
    numpy.dtype
        Its type, padded as the struct is.

    Notes
    -----
    Warp describes arrays by texts such as "(3, 3)<f8", which NumPy reads as Python. Python's parser
    fails now and then where several threads use it at once (CPython 106905), so shapes are read
    here.
    """
    return _from_texts(cast("Any", Struct).numpy_dtype())


def _from_texts(fields: dict[str, Any]) -> np.dtype[np.void]:
    """Return the type of fields whose formats are texts or fields of their own."""
    formats: list[Any] = []
    for given in fields["formats"]:
        if isinstance(given, dict):
            formats.append(_from_texts(given))
            continue
        shape, number = _FORMAT.fullmatch(given).groups()  # type: ignore[union-attr]
        sizes = tuple(int(size) for size in shape.replace(",", " ").split())
        formats.append((number, sizes) if sizes else number)
    return np.dtype(fields | {"formats": formats})  # type: ignore[call-overload]
