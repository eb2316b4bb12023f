"""Tables of results: as CSV and in Markdown, and how the numbers in them are printed."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

_WIDEST = 8


def as_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return a line per row below the names of all that any row holds."""
    rows = list(rows)
    names = dict.fromkeys(name for row in rows for name in row)
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(names), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def as_markdown(
    headings: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[str]
) -> list[str]:
    """Return the lines of a table; words: headings of columns that hold words, not numbers.

    A bar in a cell, such as those of a norm, does not end it.
    """
    rule = "".join("---|" if heading in words else "---:|" for heading in headings)
    whole = ([cell.replace("|", "\\|") for cell in cells] for cells in (headings, *rows))
    lines = [f"| {' | '.join(cells)} |" for cells in whole]
    return [lines[0], f"|{rule}", *lines[1:]]


def number(value: float | None, digits: int = 4) -> str:
    """Return a number as tables print it: nothing if there is none, - if it is not finite.

    One that is not negative takes eight characters at most.
    """
    if value is None:
        return ""
    if isinstance(value, int):
        return str(value)
    if not math.isfinite(value):
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.1e}" if 0 < abs(value) < 1e-3 or len(text) > _WIDEST else text


def number_below(value: float, digits: int = 2) -> str:
    """Return a number above 0 with so many digits, rounded down."""
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    # What has so many digits keeps them, whatever the division's last bit.
    below = float(f"{math.floor(value / unit * (1.0 + 1e-9)) * unit:.{digits}g}")
    return f"{below:g}"
