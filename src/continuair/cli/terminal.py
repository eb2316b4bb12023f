"""Output of commands: tables, and the progress of long work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from textwrap import wrap
from typing import TYPE_CHECKING, Literal

from continuair.progress import Progress

if TYPE_CHECKING:
    from rich.table import Table

_COMPILING = "compiling kernels (first run only, up to minutes)"


def print_table(columns: list[str], rows: list[list[str]], err: bool = False) -> None:
    """Print a table with right-aligned numbers.

    Parameters
    ----------
    columns : list of str
        Headings.
    rows : list of list of str
        Cells, as many per row as headings.
    err : bool, default False
        Whether to print on standard error instead of standard output.
    """
    from rich.console import Console

    console = Console(stderr=err)
    unbounded = console.options.update(width=10_000)
    for folded in (False, True):
        table = _table(columns, rows, folded)
        narrowest = console.measure(table, options=unbounded).minimum
        if narrowest <= console.width:
            break
    # Lines longer than the terminal are better than numbers cut short.
    Console(stderr=err, width=max(console.width, narrowest)).print(table)


def _table(columns: list[str], rows: list[list[str]], folded: bool) -> Table:
    """Return a table whose words fold where needed, headings if asked, and numbers never."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    short = {"task", "test", "setting", "letter", "model"}
    words = {*short, "verdict", "name", columns[0]}
    lists = {"", "rad/s", "EI [N m²]"}  # they fold between their numbers
    for index, column in enumerate(columns):
        is_word = column in words
        justify: Literal["left", "right"] = "left" if is_word else "right"
        if (is_word or column in lists) and column not in short:
            table.add_column(Text(column), justify=justify, overflow="fold")
            continue
        heading = column.split() if folded else [column]
        width = max(map(len, [*heading, *(row[index] for row in rows)]), default=1)
        text = Text("\n".join(wrap(column, width)))
        table.add_column(text, justify=justify, no_wrap=True, min_width=width)
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table


def print_markdown(text: str) -> None:
    """Print Markdown on standard error, formatted for the terminal.

    Parameters
    ----------
    text : str
        The Markdown; its lines are wrapped and its tables aligned.
    """
    from rich.console import Console

    from continuair.cli.markdown import Page

    Console(stderr=True).print(Page(text))


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Show a progress bar on standard error inside the block.

    Yields
    ------
    callable
        Function of (done, total, what) that updates the bar.

    Notes
    -----
    The remaining time is that of the current study; each study starts with `done` = 0.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        SpinnerColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    columns = (
        SpinnerColumn(),
        BarColumn(20),
        MofNCompleteColumn(),
        TimeRemainingColumn(compact=True, elapsed_when_finished=True),
        TextColumn("{task.description}"),
    )
    # In a file or pipe a bar that has gone would leave an empty line.
    hidden = not console.is_terminal
    with Bar(*columns, console=console, transient=True, disable=hidden) as bar:
        task = bar.add_task("loading", total=None)

        def show(done: int, total: int, what: str) -> None:
            note = f": {_COMPILING}" if done == 0 else ""
            if done == 0:
                bar.reset(task)
            bar.update(task, completed=done, total=total, description=what + note)

        yield show
