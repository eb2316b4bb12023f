"""The frequency of a sampled motion is found where it has one, and not where it has none."""

import numpy as np
import pytest

from amiri2026.spectrum import dominant, spectrum

TIME = np.linspace(0.0, 1.0, 1001)


@pytest.mark.parametrize("hz", [4.3, 9.18, 22.79])
def test_a_sine_has_its_own_frequency_and_amplitude(hz: float) -> None:
    sine = 0.1 * np.sin(2 * np.pi * hz * TIME + 0.4)[:, None] + 3.0
    peak = dominant(TIME, sine)
    # A second holds few periods: the sine's image at -hz shifts the peak by less than 0.1 Hz.
    assert peak is not None and peak.hz == pytest.approx(hz, abs=0.1)
    assert peak.share > 0.99
    assert spectrum(TIME, sine)[1].max() == pytest.approx(0.1, rel=0.02)


def test_components_that_swing_together_count_as_one_motion() -> None:
    phase = 2 * np.pi * 12.0 * TIME
    peak = dominant(TIME, np.column_stack([np.cos(phase), 0.5 * np.sin(phase)]))
    assert peak is not None and peak.hz == pytest.approx(12.0, abs=0.1)


def test_what_does_not_swing_has_no_frequency() -> None:
    still = np.full((1001, 2), 0.1)
    drift = np.column_stack([TIME, TIME**2])
    three = sum(np.sin(2 * np.pi * hz * TIME) for hz in (8.0, 20.0, 40.0))
    broken = np.sin(2 * np.pi * 9.0 * TIME)
    broken[500:] = np.nan
    for values in (still, drift, np.reshape(three, (-1, 1)), broken[:, None]):
        assert dominant(TIME, values) is None
