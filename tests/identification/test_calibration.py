"""Intervals of fits to releases contain the truth as often as they say, over many recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, norm, t

from continuair.identification import JointFit, fit_jointly
from tests.identification.benches import FIELDS, TRUE, bench_vehicle, released, start_vehicle

MASS = 0.05


def fitted(number: int, **how: Any) -> JointFit:
    """Return the fit to releases with and without a payload."""
    recordings = [
        released(2 * number, **how),
        released(2 * number + 1, payload=MASS, **how),
    ]
    return fit_jointly(start_vehicle(), recordings, FIELDS)


def departure(ranks: Any, bins: int) -> float:
    """Return the probability that ranks (n, columns), uniform and independent, depart as much."""
    counts = np.array([np.histogram(each, bins, (0.0, 1.0))[0] for each in ranks.T])
    expected = len(ranks) / bins
    found = ((counts - expected) ** 2 / expected).sum()
    return float(chi2.sf(found, (bins - 1) * ranks.shape[1]))


def standardised(fit: JointFit) -> tuple[Any, Any]:
    """Return errors over standard errors: of each field, and of independent combinations."""
    error = np.log(fit.values / TRUE)
    independent = np.linalg.solve(np.linalg.cholesky(fit.covariance), error)
    return error / np.sqrt(np.diag(fit.covariance)), independent


@pytest.mark.slow
def test_nine_tenths_of_the_intervals_hold_the_truth() -> None:
    """Of 24 recordings: 108 of 120 are expected, and 95 to 118 in 999 of 1000 such tests."""
    errors = [standardised(fitted(3000 + number))[1] for number in range(24)]
    assert 95 <= np.sum(np.abs(errors) < norm.ppf(0.95)) <= 118


@pytest.mark.soak
def test_the_truth_has_uniform_ranks_where_noise_is_white() -> None:
    """200 recordings, of which some are taken as correlated by chance."""
    fits = [fitted(number) for number in range(200)]
    ranks = np.array(
        [[t.sf(each, fit.degrees_of_freedom) for each in standardised(fit)] for fit in fits]
    )
    white = np.mean([fit.degrees_of_freedom > 100.0 for fit in fits])
    assert white > 0.9
    assert departure(ranks[:, 1], 10) > 0.01
    for column in ranks[:, 0].T:
        assert departure(column[:, None], 10) > 0.002


@pytest.mark.soak
def test_the_truth_has_uniform_ranks_where_noise_is_correlated_within_a_release() -> None:
    fits = [fitted(1000 + number, releases=5, kept=0.8) for number in range(80)]
    assert all(fit.degrees_of_freedom == 9.0 for fit in fits)
    ranks = np.array([t.sf(standardised(fit)[0], 9.0) for fit in fits])
    for column in ranks.T:
        assert departure(column[:, None], 5) > 0.002


@pytest.mark.slow
def test_bands_of_other_releases_contain_nine_tenths_of_their_samples() -> None:
    """Draws of the fields and of the noise, from starts that fit the releases best."""
    shares = []
    for number in range(5):
        fit = fitted(2000 + number)
        rng = np.random.default_rng(number)
        moved = rng.multivariate_normal(np.zeros(len(FIELDS)), fit.covariance, 200)
        values = fit.values * np.exp(moved)
        drawn = bench_vehicle().replace(dict(zip(FIELDS, values.T, strict=True)))
        other = released(5000 + number, payload=0.1)
        predicted = other.free_predictor(fit.vehicle)(drawn)
        predicted = predicted + rng.normal(0.0, fit.rms[next(iter(fit.rms))], predicted.shape)
        low, high = np.quantile(predicted, [0.05, 0.95], axis=0)
        measured = other.measured(drawn)
        shares.append(((measured > low) & (measured < high)).mean())
    assert 0.85 < np.mean(shares) < 0.95
