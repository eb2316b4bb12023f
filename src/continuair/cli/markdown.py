"""Markdown, as studies write it to table.md, in a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich import box
from rich.console import Console, ConsoleOptions
from rich.markdown import Markdown, TableElement
from rich.measure import Measurement, measure_renderables
from rich.table import Column, Table

_BETWEEN = 3  # columns, and the table's edges together


class _Table(TableElement):
    """A table with unbroken words.

    If the terminal is too narrow for all columns, some are printed below the others, with the
    columns that identify the rows repeated.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Table]:
        (table,) = super().__rich_console__(console, options)
        assert isinstance(table, Table)
        # Measurements are limited to the terminal's width, which the table may exceed.
        unbounded = options.update(width=10_000)
        sizes = [
            measure_renderables(console, unbounded, [column.header, *column.cells])
            for column in table.columns
        ]
        for places in _parts(sizes, _names(table), options.max_width):
            widths = _widths([sizes[place] for place in places], options.max_width)
            yield _of([table.columns[place] for place in places], widths)


class Page(Markdown):
    """Markdown that rich prints, with such tables."""

    elements = Markdown.elements | {"table_open": _Table}


def _names(table: Table) -> int:
    """Return how many leading columns identify the rows."""
    cells = [[str(cell) for cell in column.cells] for column in table.columns]
    for count in range(1, len(cells)):
        if len(set(zip(*cells[:count], strict=True))) == table.row_count:
            return count
    return 1


def _parts(sizes: Sequence[Measurement], names: int, width: int) -> Iterator[list[int]]:
    """Return groups of columns printed side by side, each with the first `names` columns."""
    shown = list(range(names))
    for place in range(names, len(sizes)):
        least = sum(sizes[each].minimum + _BETWEEN for each in [*shown, place])
        if len(shown) > names and least > width:
            yield shown
            shown = list(range(names))
        shown.append(place)
    yield shown


def _widths(sizes: Sequence[Measurement], width: int) -> list[int]:
    """Return widths of columns: their longest words, and a share of the remaining space."""
    spare = width - sum(size.minimum + _BETWEEN for size in sizes)
    wanted = sum(size.span for size in sizes)
    share = min(1.0, max(0.0, spare / wanted)) if wanted else 0.0
    return [size.minimum + int(share * size.span) for size in sizes]


def _of(columns: Sequence[Column], widths: Sequence[int]) -> Table:
    """Return a table of columns of another one."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column, width in zip(columns, widths, strict=True):
        table.add_column(column.header, width=width)
    for row in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*row)
    return table
