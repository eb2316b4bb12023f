"""What formulas are held against each other with: states, slopes and series."""

import numpy as np
import pytest

from amiri2026.paper.judges import agreement


def test_states_have_bends_of_both_signs_and_no_pitch_near_upright() -> None:
    length = 0.05
    q = np.array([at for at, _ in agreement.random_states(length)])
    assert len(q) == 100
    angle = np.abs(q[:, 6]) * length
    assert angle.min() >= 0.1 and angle.max() <= 3.0
    assert 30 < (q[:, 6] < 0).sum() < 70
    assert np.abs(q[:, 4]).max() <= 1.2


def test_fewer_states_are_others_but_as_random() -> None:
    assert len(agreement.random_states(1.0, 6)) == 6


@pytest.mark.parametrize(
    ("function", "lowest"),
    [
        (lambda z: z**2 + z**5, 2),
        (lambda z: (np.cos(z) - 1) / z, 1),
        (lambda z: np.sin(z) / z, 0),
        (lambda z: np.sin(z) / z**3, -2),
        (lambda z: 1e-7 + z, 0),
    ],
)
def test_lowest_power_is_that_of_the_series(function: agreement.Series, lowest: int) -> None:
    assert agreement.lowest_powers(function, 0.5) == lowest


def test_what_is_zero_has_no_lowest_power() -> None:
    found = agreement.lowest_powers(lambda z: np.array([0.0 * z, z]), 0.5)
    np.testing.assert_array_equal(found, [np.nan, 1.0])


def test_terms_are_the_coefficients_of_the_series() -> None:
    terms = agreement.powers(lambda z: 3 / z + 5 * z**4, 0.5)
    assert terms[-1] / 0.5**-1 == pytest.approx(3.0)
    assert terms[4] / 0.5**4 == pytest.approx(5.0)
    assert abs(terms[0]) < 1e-14


def test_slopes_are_those_of_calculus() -> None:
    q, qd = np.arange(8.0), np.ones(8)
    product = agreement.partial(lambda x: x[1] * x[2] ** 2, q, 2)
    assert product == pytest.approx(4.0, abs=1e-15)
    # Central differences at 1e-5: rounding of 1e-16/1e-5.
    found = agreement.rate(lambda x: np.array([np.sin(x[1])]), q, qd)
    assert found[0] == pytest.approx(np.cos(1.0), abs=1e-9)
