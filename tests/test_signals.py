"""Functions of time as piecewise polynomials: what is lost, and what of them is found."""

from collections.abc import Callable

import numpy as np
import pytest

from continuair.scenario.wind import dryden, gust
from continuair.signals import UnresolvedSignal, fit, sampled

Array = np.ndarray

EDGE, UNTIL = 0.3141592, 0.3151592


def column(values: Array) -> Array:
    return np.asarray(values)[:, None, None]


SMOOTH: dict[str, Callable[[Array], Array]] = {
    "a sine of 50 Hz": lambda t: np.sin(2.0 * np.pi * 50.0 * t),
    "a sine of 1 kHz": lambda t: np.sin(2.0 * np.pi * 1000.0 * t),
    "a ripple of 2 kHz": lambda t: 1.0 + 9e-3 * np.cos(2.0 * np.pi * 2000.0 * t),
    "a chirp": lambda t: np.sin(2.0 * np.pi * (0.5 * t + 4.0 * t * t)),
    "a pulse of 1 ms": lambda t: np.exp(-(((t - 0.4) / 1e-3) ** 2)),
    "a kink in the curvature": lambda t: np.maximum(t - EDGE, 0.0) ** 2,
}
BROKEN: dict[str, tuple[Callable[[Array], Array], list[float]]] = {
    "a jump": (lambda t: np.where(t > EDGE, 1.0, 0.2), [EDGE]),
    "a tap of 1 ms": (lambda t: np.where((t > EDGE) & (t < UNTIL), 1.0, 0.0), [EDGE, UNTIL]),
    "a kink": (lambda t: np.abs(t - EDGE), [EDGE]),
}
TIMES = np.sort(np.random.default_rng(7).random(5000))


@pytest.mark.parametrize("name", SMOOTH)
def test_smooth_functions_are_followed(name: str) -> None:
    signal = fit(lambda t: column(SMOOTH[name](t)), 1.0)
    expected = SMOOTH[name](TIMES)
    assert np.abs(signal(TIMES)[:, 0, 0] - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("name", BROKEN)
def test_what_breaks_is_located(name: str) -> None:
    function, breaks = BROKEN[name]
    signal = fit(lambda t: column(function(t)), 1.0)
    assert signal.breaks[0] == pytest.approx(breaks, abs=3e-7)
    if name != "a kink":
        assert signal.breaks[0] == pytest.approx(breaks, abs=1e-15)
    away = np.abs(TIMES[:, None] - breaks).min(axis=1) > 3e-7
    assert np.abs(signal(TIMES)[:, 0, 0] - function(TIMES))[away].max() < 1e-9
    # Few pieces: nothing is refined around a break once it is known.
    assert len(signal.edges) <= 3


def test_a_known_jump_shows_each_side_to_its_own() -> None:
    """Also where the function's own rounding puts it a digit late."""
    signal = fit(lambda t: column(np.where(t > 0.3 + 1e-16, 2.0, 1.0)), 1.0, jumps=(0.3,))
    assert signal.breaks[0].tolist() == [0.3]
    assert signal([0.3], "left") == pytest.approx(1.0, abs=1e-12)
    assert signal([0.3], "right") == pytest.approx(2.0, abs=1e-12)


def test_a_run_has_the_same_signal_alone_and_in_a_batch() -> None:
    rates, edges = np.linspace(1.0, 60.0, 9), np.linspace(0.1, 0.9, 9)

    def of(chosen: Array) -> Callable[[Array], Array]:
        def function(t: Array) -> Array:
            t = t[:, None]
            wave = np.sin(2.0 * np.pi * rates[chosen] * t) * np.where(t > edges[chosen], 1.0, 0.5)
            return np.asarray(wave[:, :, None])

        return function

    batch = fit(of(np.arange(9)), 1.0)
    for run in (0, 4, 8):
        alone, same = fit(of(np.array([run])), 1.0), batch.of_runs(np.array([run]))
        assert np.array_equal(alone.edges, same.edges)
        assert np.array_equal(alone.coefficients, same.coefficients)
        assert np.array_equal(alone.breaks[0], same.breaks[0])


@pytest.mark.long
def test_noise_is_refused() -> None:
    with pytest.raises(UnresolvedSignal):
        fit(lambda t: column(np.modf(np.sin(12345.678 * t) * 43758.5453)[0]), 1.0)


def test_turbulence_keeps_its_knots() -> None:
    wind = dryden(15.0, 30.0, 10.0, seed=[1, 2], duration=2.0)
    signal = wind.signal(2.0)
    times = np.linspace(0.0, 2.0, 997)
    expected = np.stack([wind(t) for t in times.tolist()])
    assert np.abs(signal(times) - expected).max() < 1e-12
    assert all(len(own) == 0 for own in signal.breaks)


def test_a_gust_takes_few_pieces() -> None:
    """Its curvature jumps twice, between long smooth stretches."""
    given = gust([1.0, 0.0, 0.0], 0.2137, 0.33)
    signal = fit(lambda t: np.stack([given(s) for s in t.tolist()])[:, None], 1.0)
    assert len(signal.edges) < 15


def test_knots_are_joined_by_lines() -> None:
    signal = sampled(np.array([[[0.0], [1.0], [-1.0]]]), 0.1, 0.2)
    assert signal([0.05, 0.15, 0.2])[:, 0, 0] == pytest.approx([0.5, 0.0, -1.0])
