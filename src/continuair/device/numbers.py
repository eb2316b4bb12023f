"""The numbers that device code computes with: those of one run, or packs of several runs.

A pack holds the same number of LANES runs, side by side in vector registers of the CPU. The source
is one: `Real` is a number or a pack, and where runs may differ device code chooses (`above`)
instead of branching; an `if` on a pack does not compile. A third kind are numbers with their
derivatives (device/duals.py).
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

from continuair.device.duals import numbers_of_duals
from continuair.device.packs import numbers_of_packs
from continuair.device.single import numbers_of_runs

LANES = {"float64": 8, "float32": 16}
"""Runs of a pack: they fill two registers of AVX2, or one of AVX-512."""

NARROW = {"float64": 4, "float32": 8}
"""Runs of a narrow pack, which takes no longer than a run alone."""

DIRECTIONS = 8
"""Directions along which dual numbers have derivatives at once."""


@dataclass(frozen=True)
class Numbers:
    """Of "float64" or "float32", and of so many runs at once: 1, or those of a pack.

    dual: of one run, with derivatives along so many directions at once.
    """

    precision: str
    lanes: int = 1
    dual: bool = False


def holding(kind: type, found: dict[str, Any]) -> Any:
    """A namespace of that kind, its fields taken from what a factory has made, by name."""
    return kind(**{field.name: found[field.name] for field in fields(kind)})


@dataclass(frozen=True)
class NumberCode:
    """Cell, a number in memory; Real, what is computed with; functions defined below.

    Readers take the first run of a pack: of_run(cells, run, column), of_row(cells, row, run,
    column) and of_sample(cells, run, sample, column); the first two read one run for all, where
    there is one; at(cells, index) reads an entry of each run's own. keep, keep_of_run and
    keep_whole write what the runs hold that there are; keep_where(cells, run, sample, column, x,
    due), at a sample of each run's own, where due > 0; mark a whole number where x > 0.
    rows_of(Struct) is the type of an array of structs of numbers, and reader_of(Struct) its reader;
    table_of(Row) and row_reader(Row) are those of the tables of moments. two_to(k): 2^k for a whole
    k. randn: the noise of frames.
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
    """The numbers of one precision, of a run, of packs or with derivatives."""
    found = numbers_of_runs if numbers.lanes == 1 else numbers_of_packs
    found = numbers_of_duals if numbers.dual else found
    return holding(NumberCode, found(numbers.precision, numbers.lanes))
