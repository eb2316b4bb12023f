"""Tables hold what the results do, and a number in them fits its column."""

import csv
import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from continuair.analysis.shares import percent
from continuair.studies.tables import as_csv, as_markdown, number


@given(st.floats(0.0, 1e300))
def test_a_number_fits_its_column_and_is_right_to_what_is_printed(value: float) -> None:
    text = number(value)
    assert len(text) <= 8
    # Two digits, in the worst case, are right to a twentieth.
    assert math.isclose(float(text), value, rel_tol=0.05, abs_tol=1e-320)


def test_numbers_that_are_none_whole_or_not_finite_are_told_apart() -> None:
    assert [number(value) for value in (None, 3, 0.0, math.nan, math.inf)] == [
        "",
        "3",
        "0",
        "-",
        "-",
    ]
    assert number(1.04041) == "1.04" and number(0.012345) == "0.01235" and number(12, 2) == "12"


def test_shares_are_percents() -> None:
    assert [percent(share) for share in (0.5, 0.1, 0.0123)] == ["50 %", "10 %", "1.2 %"]


def test_a_part_is_not_printed_as_all() -> None:
    told = [percent(share) for share in (0.994, 0.996, 1.0 - 1e-12, 1.0, 1.5, 9.9, 12.0)]
    assert told == ["99 %", "above 99 %", "above 99 %", "100 %", "150 %", "990 %", "over 1000 %"]


def test_rows_of_a_csv_may_hold_different_columns() -> None:
    rows: list[dict[str, Any]] = [{"model": "coupled", "a": 1.5}, {"model": "other", "b": "x, y"}]
    found = list(csv.DictReader(as_csv(rows).splitlines()))
    assert found == [
        {"model": "coupled", "a": "1.5", "b": ""},
        {"model": "other", "a": "", "b": "x, y"},
    ]


def test_columns_of_words_stand_left_and_of_numbers_right() -> None:
    table = as_markdown(["model", "error"], [["coupled", "0"]], ("model",))
    assert table == ["| model | error |", "|---|---:|", "| coupled | 0 |"]
