"""Tables of results: as CSV and in Markdown, and how the numbers in them are printed."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Iterable, Mapping, Sequence

_WIDEST = 8


def as_csv(rows: Iterable[Mapping[str, object]]) -> str:
    """Return rows as CSV.

    Parameters
    ----------
    rows : iterable of mappings
        Values by column.

    Returns
    -------
    str
        A heading with the columns of all rows, and a line per row.
    """
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
    """Return the lines of a Markdown table.

    Parameters
    ----------
    headings : sequence of str
        Headings of the columns.
    rows : iterable of sequences of str
        Cells; bars in them are escaped.
    words : collection of str
        Headings of columns of text, which are aligned left; numbers are aligned right.

    Returns
    -------
    list of str
        The lines.
    """
    rule = "".join("---|" if heading in words else "---:|" for heading in headings)
    whole = ([cell.replace("|", "\\|") for cell in cells] for cells in (headings, *rows))
    lines = [f"| {' | '.join(cells)} |" for cells in whole]
    return [lines[0], f"|{rule}", *lines[1:]]


def number(value: float | None, digits: int = 4) -> str:
    """Format a number for tables.

    Parameters
    ----------
    value : float or None
        The number.
    digits : int, default 4
        Significant digits.

    Returns
    -------
    str
        Empty for None, "-" if not finite. A number that is not negative takes at most 8 characters.
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
    # A value of so many digits keeps them, whatever the division's last bit.
    below = float(f"{math.floor(value / unit * (1.0 + 1e-9)) * unit:.{digits}g}")
    return f"{below:g}"
