"""Number types of device code: numbers of one run, packs of several runs, and dual numbers.

A pack holds one number of each of LANES runs, in vector registers of the CPU. Device code is
written once, for `Real`. Where runs may differ it selects by `above` instead of branching: an `if`
on a pack does not compile. Dual numbers hold derivatives (device/duals.py).
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Protocol

from continuair.device.duals import numbers_of_duals
from continuair.device.packs import numbers_of_packs
from continuair.device.single import numbers_of_runs

LANES = {"float64": 8, "float32": 16}
"""Runs of a pack, which fills two registers of AVX2, or one of AVX-512."""

NARROW = {"float64": 4, "float32": 8}
"""Runs of a narrow pack, which needs no more time than a single run."""

DIRECTIONS = 8
"""Number of directional derivatives of a dual number."""


class Struct(Protocol):
    """A Warp struct type; a call returns an instance, whose fields are zero."""

    def __call__(self) -> Any: ...


@dataclass(frozen=True)
class Numbers:
    """Kind of numbers of device code.

    Parameters
    ----------
    precision : {"float64", "float32"}
        Precision of the numbers.
    lanes : int, default 1
        Runs of a pack, or 1. For dual numbers, the number of directions.
    dual : bool, default False
        Whether numbers hold directional derivatives.
    """

    precision: str
    lanes: int = 1
    dual: bool = False


def holding(kind: type, found: dict[str, Any]) -> Any:
    """Return an instance of a dataclass, its fields taken by name from locals of a factory."""
    return kind(**{field.name: found[field.name] for field in fields(kind)})


@dataclass(frozen=True)
class NumberCode:
    """Types and functions of one kind of numbers.

    Cell: a number in memory. Real: the type of computations. Readers take the index of the first
    run of a pack: of_run(cells, run, column), of_row(cells, row, run, column), of_sample(cells,
    run, sample, column). The first two read the same value for all runs if the array has one run.
    at(cells, index) reads an entry per run. keep, keep_of_run and keep_whole write the values of
    all existing runs. keep_where(cells, run, sample, column, x, due) writes at a sample per run,
    where due > 0; mark writes a whole number where x > 0. rows_of(Struct) is the type of an array
    of structs, and reader_of(Struct) its reader; table_of(Row) and row_reader(Row) are those of the
    tables of moments. two_to(k): 2^k for a whole k. randn: noise of camera frames.
    """

    Cell: Any
    Real: Any
    lanes: int
    options: dict[str, Any]
    above: Any
    all_above: Any
    any_above: Any
    finite: Any
    two_to: Any
    of_run: Any
    of_row: Any
    of_sample: Any
    keep: Any
    keep_where: Any
    keep_of_run: Any
    keep_whole: Any
    mark: Any
    at: Any
    randn: Any
    rows_of: Callable[[Any], Any]
    reader_of: Callable[[Any], Any]
    table_of: Callable[[Any], Any]
    row_reader: Callable[[Any], Any]


@cache
def number_code(numbers: Numbers) -> NumberCode:
    """Return the types and functions of one kind of numbers."""
    found = numbers_of_runs if numbers.lanes == 1 else numbers_of_packs
    found = numbers_of_duals if numbers.dual else found
    return holding(NumberCode, found(numbers.precision, numbers.lanes))
