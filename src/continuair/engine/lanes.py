"""Arrays in the memory layout of kernels of single runs and of packs."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import warp as wp

Array = np.ndarray


def packs_of(runs: int, lanes: int) -> int:
    """Return the number of packs for a number of runs; the last may be incomplete."""
    return -(-runs // lanes)


def struct_rows(rows: Array, Struct: Any, lanes: int, device: str) -> Any:
    """Return structured rows of numbers, one per run or one for all, on a device."""
    rows = np.ascontiguousarray(rows)
    if lanes == 1:
        return structs(rows, Struct, device)
    number = _first_number(rows.dtype)
    numbers = rows.view(number).reshape(len(rows), -1)
    return wp.array(numbers, dtype=getattr(wp, number.name), device=device)


def structs(rows: Array, Struct: object, device: str) -> object:
    """Copy contiguous structured rows to a device.

    Parameters
    ----------
    rows : ndarray
        Rows of the type that `Struct` has for NumPy.
    Struct : warp struct
        Their type.
    device : str
        Warp's name of the device.

    Returns
    -------
    warp.array
        The copy.

    Notes
    -----
    The rows' address is given and not the rows, whose type Warp would compare with a text, as
    `numpy_type` of struct_types.py does not.
    """
    source: Any = wp.array(
        ptr=rows.ctypes.data, dtype=cast("Any", Struct), shape=rows.shape, device="cpu"
    )
    copy: object = wp.clone(source, device=device)
    return copy


def table_rows(table: Array, Row: Any, lanes: int, device: str) -> Any:
    """Return polynomials (vehicles, terms, functions) on a device.

    Those of packs have shape (packs, terms, functions times lanes). A single vehicle is used for
    all lanes; an incomplete pack repeats its last vehicle.
    """
    if lanes == 1:
        return wp.array(np.ascontiguousarray(table), dtype=Row, device=device)
    vehicles, terms, functions = table.shape
    packs = packs_of(vehicles, lanes)
    which = np.minimum(np.arange(packs * lanes), vehicles - 1).reshape(packs, lanes)
    packed = table[which].transpose(0, 2, 3, 1).reshape(packs, terms, functions * lanes)
    return wp.array(
        np.ascontiguousarray(packed), dtype=getattr(wp, table.dtype.name), device=device
    )


def _first_number(kind: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type of the numbers of a structure, all of which are equal."""
    while kind.names or kind.subdtype:
        kind = kind[kind.names[0]] if kind.names else kind.base
    return kind
