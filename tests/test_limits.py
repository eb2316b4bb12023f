"""A limit is where a scan leaves the tolerance, found again with finer steps."""

import numpy as np
import pytest

from continuair.analysis.limits import find_limits

PLACES = np.geomspace(0.1, 10.0, 9)


def square(at: np.ndarray, name: str) -> np.ndarray:
    return (at / {"low": 0.7, "high": 3.0}[name]) ** 2


def test_a_limit_is_found_to_the_finer_step_and_never_beyond() -> None:
    errors = {name: square(PLACES, name) for name in ("low", "high")}
    limits = find_limits(PLACES, errors, 1.0, square, 7)
    # The error is 1 at 0.7 and at 3; seven more places cut the scan's step of 10^(1/4) into eight.
    for name, true in (("low", 0.7), ("high", 3.0)):
        found = limits[name]
        assert true / 10 ** (1 / 32) < found.last <= true
        assert (np.diff(found.places) > 0.0).all()
        np.testing.assert_array_equal(found.errors, square(found.places, name))


def test_a_scan_that_falls_is_searched_in_its_own_order() -> None:
    durations = PLACES[::-1]
    found = find_limits(durations, {"a": 1.0 / durations}, 1.0, lambda at, _: 1.0 / at, 7)["a"]
    assert 1.0 <= found.last < 10 ** (1 / 32)
    assert (np.diff(found.places) < 0.0).all()


@pytest.mark.parametrize(
    ("errors", "last"),
    [([0.1, 0.2, 0.3], np.inf), ([2.0, 0.2, 0.3], np.nan), ([np.nan] * 3, np.nan)],
)
def test_nothing_is_searched_where_all_or_none_of_the_first_is_tolerable(
    errors: list[float], last: float
) -> None:
    def finer(_at: np.ndarray, _name: str) -> np.ndarray:
        raise AssertionError

    found = find_limits(PLACES[:3], {"a": np.array(errors)}, 1.0, finer, 7)["a"]
    assert found.last == last or np.isnan(found.last) and np.isnan(last)


def test_a_flight_that_is_lost_is_beyond() -> None:
    errors = np.array([0.1, np.nan, 0.1])
    found = find_limits(PLACES[:3], {"a": errors}, 1.0, lambda at, _: 0.0 * at, 1)["a"]
    # The one place between the two is tolerable, and the next is not.
    assert found.last == pytest.approx(np.sqrt(PLACES[0] * PLACES[1]))
