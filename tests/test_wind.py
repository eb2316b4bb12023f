"""Gusts, and turbulence against the theory of Dryden's model."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import periodogram

import continuair as ca
from continuair.scenario.wind import Dryden, low_altitude
from tests.refusals import refused

SEEDS = 64
STEP, DURATION = 0.05, 200.0
W20, ALTITUDE, AIRSPEED = 10.0, 30.0, 8.0


@pytest.fixture(scope="module")
def field() -> Dryden:
    return ca.dryden(W20, ALTITUDE, AIRSPEED, seed=list(range(SEEDS)), duration=DURATION, step=STEP)


def test_scales_are_those_of_the_standard() -> None:
    """MIL-F-8785C at 200 feet: L_w = h, L_u = h/(0.177 + 0.000823 h)^1.2, σ_w = 0.1 W₂₀."""
    found = low_altitude(10.0, 200.0 * 0.3048)
    share = 0.177 + 0.000823 * 200.0
    np.testing.assert_allclose(found.lengths[2], 60.96)
    np.testing.assert_allclose(found.lengths[0], 60.96 / share**1.2)
    np.testing.assert_allclose(found.deviations, [1.0 / share**0.4] * 2 + [1.0])


def test_variance_is_that_of_the_model_from_the_first_knot_on(field: Dryden) -> None:
    """Mean squares over seeds of independent normals: relative deviation √(2/n), five of it."""
    expected = np.square(low_altitude(W20, ALTITUDE).deviations)
    room = 5.0 * np.sqrt(2.0 / SEEDS)
    for at in (0, 1, 7, field.knots.shape[1] - 1):
        found = np.mean(field.knots[:, at] ** 2, axis=0) / expected
        assert np.abs(found - 1.0).max() < room, at


def correlation(component: int, lag: float) -> float:
    """Of u: e^{-a t}; of v and w, from (1 + √3 s/a)/(1 + s/a)²: e^{-a t} (1 - a t/2)."""
    decay = AIRSPEED / low_altitude(W20, ALTITUDE).lengths[component] * lag
    return float(np.exp(-decay) * (1.0 if component == 0 else 1.0 - 0.5 * decay))


@pytest.mark.parametrize("component", [0, 1, 2])
def test_neighbouring_knots_are_correlated_as_the_model_says(field: Dryden, component: int) -> None:
    """Regression of a knot on one k steps before, over all seeds: its deviation is √((1-r²)/n)."""
    for k in (1, 5, 40):
        r = correlation(component, k * STEP)
        x, y = field.knots[:, 0, component], field.knots[:, k, component]
        found = (x * y).sum() / (x * x).sum()
        assert abs(found - r) < 5.0 * np.sqrt((1.0 - r * r) / SEEDS), k


@pytest.mark.parametrize("airspeed, altitude, step", [(0.8, 22.0, 1e-3), (0.05, 200.0, 1e-4)])
def test_knots_close_together_differ_by_as_little_as_the_model_says(
    airspeed: float, altitude: float, step: float
) -> None:
    """Increments far below the length of the field hardly know of one another: their mean square,
    2 σ² (1 - r) ≈ 3 σ² d, scatters by √(2/n)."""
    knots = ca.dryden(
        W20, altitude, airspeed, seed=list(range(20)), duration=2000 * step, step=step
    ).knots
    scales = low_altitude(W20, altitude)
    for component, times in enumerate((2.0, 3.0, 3.0)):
        d = airspeed * step / scales.lengths[component]
        expected = times * d * scales.deviations[component] ** 2
        found = np.diff(knots[..., component], axis=1) ** 2
        assert abs(found.mean() / expected - 1.0) < 5.0 * np.sqrt(2.0 / found.size)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_spectrum_is_that_of_the_model(field: Dryden, component: int) -> None:
    """Periodograms of 64 seeds, means over bands: of K ordinates that are exponential each, the
    relative deviation is 1/√K. Frequencies whose sampled spectrum differs are told of: the model's,
    folded at the knots."""
    frequency, power = periodogram(field.knots[..., component], 1.0 / STEP, detrend=False, axis=1)
    found, sampled = power.mean(axis=0), np.arange(field.knots.shape[1] // 2)
    lags = STEP * np.arange(4000)
    values = np.array([correlation(component, lag) for lag in lags])
    variance = low_altitude(W20, ALTITUDE).deviations[component] ** 2
    # A finite record sees the spectrum through a triangle of its own length.
    triangle = 1.0 - lags / (STEP * field.knots.shape[1])
    cosines = np.cos(2.0 * np.pi * np.outer(frequency[1:400], lags))
    expected = 2.0 * STEP * variance * (2.0 * (cosines @ (values * triangle)) - 1.0)
    ratios = found[1:400] / expected
    for band in np.array_split(ratios, 10):
        assert abs(band.mean() - 1.0) < 5.0 / np.sqrt(SEEDS * len(band))
    assert len(sampled) > 400


def test_the_same_seed_gives_the_same_wind_alone_and_in_a_batch(field: Dryden) -> None:
    alone = ca.dryden(W20, ALTITUDE, AIRSPEED, seed=5, duration=DURATION, step=STEP)
    assert np.array_equal(alone.knots[0], field.knots[5])
    assert not np.array_equal(field.knots[4], field.knots[5])


def test_mean_and_heading_move_and_turn_the_wind() -> None:
    plain = ca.dryden(5.0, 20.0, 4.0, duration=1.0)
    turned = ca.dryden(5.0, 20.0, 4.0, duration=1.0, mean=[1.0, 2.0, 3.0], heading=np.pi / 2)
    x, y, z = plain(0.5)
    np.testing.assert_allclose(turned(0.5), [1.0 - y, 2.0 + x, 3.0 + z], atol=1e-14)


def test_a_gust_rises_to_its_velocity_and_is_gone_after_its_duration() -> None:
    wind = ca.gust([4.0, 0.0, -2.0], 1.0, 2.0)
    for t, share in ((0.5, 0.0), (1.0, 0.0), (1.5, 0.5), (2.0, 1.0), (3.0, 0.0), (9.0, 0.0)):
        np.testing.assert_allclose(wind(t), share * np.array([4.0, 0.0, -2.0]), atol=1e-15)


UNUSABLE: list[tuple[Any, str]] = [
    (lambda: ca.gust([1.0, 2.0], 0.0, 1.0), "velocity"),
    (lambda: ca.gust([1.0, 2.0, 3.0], 0.0, 0.0), "duration"),
    (lambda: ca.dryden(-1.0, 20.0, 5.0), "w20"),
    (lambda: ca.dryden(5.0, 1.0, 5.0), "altitude"),
    (lambda: ca.dryden(5.0, 1000.0, 5.0), "altitude"),
    (lambda: ca.dryden(5.0, 20.0, 0.0), "airspeed"),
    (lambda: ca.dryden(5.0, 20.0, 5.0, seed=-1), "seed"),
    (lambda: ca.dryden(5.0, 20.0, 5.0, seed=[]), "seed"),
    (lambda: ca.dryden(5.0, 20.0, 5.0, step=1e-9), "step"),
    (lambda: ca.dryden(5.0, 20.0, 5.0, mean=3.0), "mean"),
]


@pytest.mark.parametrize(("made", "field"), UNUSABLE)
def test_unusable_wind_is_refused_in_one_sentence(made: Any, field: str) -> None:
    with refused(field):
        made()


def test_steps_end_at_the_knots_of_turbulence() -> None:
    """Between them wind is a straight line, whose kinks would fall within steps else."""
    vehicle = ca.load_vehicle("slender").replace(
        {
            "uav.drag": {"linear": [1.0, 1.0, 1.0]},
            "arm.drag_coefficient": 1.2,
            "arm.radius": 0.012,
            "arm.density": 60.0,
            "arm.youngs_modulus": 2e6,
        }
    )
    wind = ca.dryden(30.0, 6.0, 10.0, duration=1.0)
    start = ca.Scenario("gusts", (0, 0, 2, 0, 0, 0, 0.3, 0), wind=wind, duration=0.95)
    fine, found = (
        ca.simulate(
            vehicle, start, sample=0.016, method="RK4", step=step, variables=["tip_position"]
        )
        for step in (1e-4, "auto")
    )
    assert found.attrs["step"] > 5e-3
    off = np.linalg.norm(found.tip_position - fine.tip_position, axis=1).max()
    assert off < 1e-4 * vehicle.arm.length


def test_knots_move_no_sample() -> None:
    """Those within rounding of one are that one: flights with and without wind can be compared."""
    vehicle = ca.load_vehicle("slender").replace({"uav.drag": {"linear": [1.0, 1.0, 1.0]}})
    start = ca.Scenario("calm", (0, 0, 2, 0, 0, 0, 0.3, 0), duration=0.5)
    wind = ca.dryden(5.0, 6.0, 10.0, duration=1.0, step=0.03)
    calm, blown = (
        ca.simulate(vehicle, each, sample=0.01, variables=["tip_position"])
        for each in (start, start.replace(wind=wind))
    )
    np.testing.assert_array_equal(calm["time"], blown["time"])
