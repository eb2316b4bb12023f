"""Largest and least numbers, of which one may be none."""

import itertools

import numpy as np

from amiri2026.extremes import largest, largest_of, least


def test_one_that_is_none_is_passed_over_at_no_place() -> None:
    for values in itertools.permutations([1.0, 2.0, np.nan]):
        assert np.isnan(largest(values)) and np.isnan(least(iter(values)))
        named = dict(zip("abc", values, strict=True))
        assert np.isnan(named[largest_of(named)])
    assert (largest([1.0, 3.0]), least([1.0, 3.0]), largest_of({"a": 1.0, "b": 3.0})) == (3, 1, "b")
