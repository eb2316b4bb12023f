"""Arrays as kernels of single runs and of packs read them."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

Array = np.ndarray


def packs_of(runs: int, lanes: int) -> int:
    """Threads that a number of runs takes; the last pack may have room."""
    return -(-runs // lanes)


def struct_rows(rows: Array, Struct: Any, lanes: int, device: str) -> Any:
    """Structured rows of numbers, one per run or one for all."""
    rows = np.ascontiguousarray(rows)
    if lanes == 1:
        return wp.array(rows, dtype=Struct, device=device)
    number = _first_number(rows.dtype)
    numbers = rows.view(number).reshape(len(rows), -1)
    return wp.array(numbers, dtype=getattr(wp, number.name), device=device)


def table_rows(table: Array, Row: Any, lanes: int, device: str) -> Any:
    """Polynomials (vehicles, terms, functions); of packs (packs, terms, functions times lanes).

    One vehicle is that of all lanes; a pack that is not full repeats its last one.
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
    """Of the numbers of a structure, all of which are of one kind."""
    while kind.names or kind.subdtype:
        kind = kind[kind.names[0]] if kind.names else kind.base
    return kind
