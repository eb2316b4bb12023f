"""Samples of a log between their times: those of a smooth motion, however they are stamped."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from continuair.interfaces.log_signals import Signal, signal
from continuair.interfaces.log_topics import Topic

PERIOD = 0.02
AXIS = np.array([0.6, 0.0, 0.8])
BETWEEN = np.linspace(0.2, 0.8, 301)


def swing(t: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(20.0 * t), np.cos(15.0 * t)], -1)


def turned(t: np.ndarray) -> Rotation:
    return Rotation.from_rotvec(2.5 * np.sin(8.0 * t)[:, None] * AXIS)


def measured(of: Any, period: float) -> Signal:
    times = np.arange(0.0, 1.0, period)
    return signal(Topic("bend", "/arm"), times, of(times))


def test_a_swing_between_samples_is_right_to_fourth_order() -> None:
    off = [np.abs(measured(swing, h).at(BETWEEN) - swing(BETWEEN)).max() for h in (0.02, 0.01)]
    assert off[0] < 2e-3 and off[1] < off[0] / 12.0
    straight = np.interp(BETWEEN, np.arange(0.0, 1.0, 0.02), swing(np.arange(0.0, 1.0, 0.02))[:, 0])
    assert np.abs(straight - swing(BETWEEN)[:, 0]).max() > 1e-2


def test_a_turn_between_samples_is_right_to_fourth_order_whatever_the_signs() -> None:
    def flipped(t: np.ndarray) -> np.ndarray:
        return turned(t).as_quat() * np.where(np.arange(len(t)) % 3, 1.0, -1.0)[:, None]

    off = []
    for period in (0.02, 0.01):
        found = measured(flipped, period).turned_at(BETWEEN)
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, rtol=1e-12)
        off.append((Rotation.from_quat(found) * turned(BETWEEN).inv()).magnitude().max())
    assert off[0] < 2e-3 and off[1] < off[0] / 12.0


def test_what_was_measured_is_kept_and_few_samples_are_enough() -> None:
    whole = measured(swing, PERIOD)
    np.testing.assert_allclose(whole.at(whole.time), whole.values, rtol=0, atol=1e-13)
    two = signal(Topic("bend", "/arm"), np.array([0.0, 1.0]), np.array([[1.0], [3.0]]))
    assert two.at(np.array([0.25])) == pytest.approx(1.5)


def test_noise_of_samples_with_nearly_the_same_time_is_no_slope() -> None:
    times = np.sort(np.append(np.arange(0.0, 1.0, PERIOD), 0.5 + 1e-6))
    noise = np.where(times == 0.5, 1e-3, 0.0)[:, None]
    found = signal(Topic("bend", "/arm"), times, noise).at(BETWEEN)
    assert np.abs(found).max() <= 1e-3
