"""What is left over of a fit tells how sure it is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from continuair.identification.confidence import spread
from continuair.identification.leftover import of_what_is_left
from continuair.identification.recording import Recording

ROWS, SLOPES = 400, np.cos(2.0 * np.pi * 3.0 * np.arange(400) / 400.0)
"""A field that moves two columns of measurements slowly."""


def noise(seed: int, memory: float, second: float = 1.0) -> np.ndarray:
    """Noise (rows, 2) that goes on from row to row, in one column more than in the other."""
    drawn = np.random.default_rng(seed).normal(size=(ROWS + 200, 2))
    gone_on = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], drawn, axis=0)
    return gone_on[200:] * [1.0, second]


def told(left: np.ndarray) -> float:
    """The standard error of the field whose fit leaves noise over."""
    scale = np.sqrt(np.mean(left**2))
    inverse = np.stack([SLOPES, SLOPES], axis=1) * scale / (2.0 * SLOPES @ SLOPES)
    return float(spread(inverse[None], left / scale, 1.0)[0])


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9])
def test_standard_errors_are_those_of_noise_that_goes_on(memory: float) -> None:
    """As its own covariance gives them; of independent rows they would be a fourth at 0.9."""
    shared = toeplitz(memory ** np.arange(ROWS)) if memory else np.eye(ROWS)
    true = np.sqrt(SLOPES @ shared @ SLOPES / 2.0) / (SLOPES @ SLOPES)
    found = [told(noise(seed, memory)) for seed in range(40)]
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(found))), true, rtol=0.2)


def test_a_column_that_is_noisier_than_others_counts_as_such() -> None:
    """A field that moves one column alone has its errors; of the mean they would be 0.7 of that."""
    left = noise(0, 0.0, 1e-3)
    scale = np.sqrt(np.mean(left**2))
    inverse = np.stack([SLOPES, 0.0 * SLOPES], axis=1) * scale / (SLOPES @ SLOPES)
    true = 1.0 / np.sqrt(SLOPES @ SLOPES)
    assert spread(inverse[None], left / scale, 1.0)[0] == pytest.approx(true, rel=0.2)


def test_what_comes_again_is_found_beneath_noise() -> None:
    """A quarter of the row rate: from row to row it changes as noise does. Noise alone is not told
    of, nor are a file's digits."""
    time = np.asarray(0.01 * np.arange(ROWS), float)
    moved = np.stack([np.sin(time), np.cos(time), time], axis=1)
    turned = Rotation.from_rotvec(0.1 * moved).as_quat()
    recording = Recording("flight", time, moved, turned, moved[:, :2], None)
    wave = 0.01 * np.sin(2.0 * np.pi * 0.25 * np.arange(ROWS))[:, None]
    for seed in range(20):
        left = 0.01 * np.random.default_rng(seed).normal(size=(ROWS, 8))
        assert not of_what_is_left(left, recording)
        (doubt,) = of_what_is_left(left + wave * (np.arange(8) == 1), recording)
        assert "of the position, beyond noise" in doubt
    assert not of_what_is_left(1e-4 * wave * np.ones(8), recording)
