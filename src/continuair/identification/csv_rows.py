"""Rows of a CSV file with one line of headings."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from continuair.errors import InputError, shown
from continuair.files import check_regular, printed, reason
from continuair.typing import Array


def rows_of(name: str, file: Path) -> tuple[list[str], list[list[str]]]:
    """Return the headings of a CSV file, and its other lines, empty ones left out.

    name: of the argument, for messages. Raises InputError, also for a line longer than the
    headings, as decimal commas make it.
    """
    path, line = printed(file), 0
    check_regular(name, file)
    try:
        with open(file, encoding="utf-8-sig", newline="") as text:
            # Without `strict`, an unclosed quotation mark consumes the rest of the file.
            reader, lines = csv.reader(text, strict=True), []
            for cells in reader:
                line = reader.line_num
                if any(cell.strip() for cell in cells):
                    lines.append(cells)
    except csv.Error as error:
        raise InputError(
            name, f"is not valid CSV after line {line} ({error})", "close the quotation marks there"
        ).located(path) from None
    except (OSError, ValueError) as error:
        raise InputError(
            name,
            f"is {path}, which cannot be read ({reason(error)})",
            "give the path of a CSV file",
        ) from None
    headings = [cell.strip() for cell in lines[0]] if lines else []
    for row, cells in enumerate(lines[1:]):
        if any(cell.strip() for cell in cells[len(headings) :]):
            raise InputError(
                name,
                f"has more cells in row {row + 1} than headings",
                "separate columns by commas and decimals by points",
            ).located(path)
    return headings, lines[1:]


def numbers_of(
    path: str, headings: Sequence[str], rows: Sequence[Sequence[str]], wanted: Sequence[str]
) -> Array:
    """Return the wanted columns (rows, columns) as numbers, NaN where a cell is empty or says nan.

    Raises InputError for a column that is missing or there twice, and for a cell that is no number.
    """
    for name in wanted:
        if list(headings).count(name) != 1:
            problem = "is missing" if name not in headings else "is there twice"
            raise InputError(
                name, problem, f"name the columns {', '.join(wanted)}, each once"
            ).located(path)
    found = np.empty((len(rows), len(wanted)))
    for column, name in enumerate(wanted):
        index = list(headings).index(name)
        for row, cells in enumerate(rows):
            text = cells[index].strip() if index < len(cells) else ""
            try:
                found[row, column] = float(text or "nan")
            except ValueError:
                raise InputError(
                    name, f"is {shown(text)} in row {row + 1}", "give a number, or leave it empty"
                ).located(path) from None
    return found
