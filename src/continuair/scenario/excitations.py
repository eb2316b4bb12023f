"""Named excitations of a sweep: constant, sine or chirp on one channel, or a test's inputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from continuair.scenario.paper_tests import open_loop_test

Array = np.ndarray

Channel = Literal[
    "force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z", "bend_x", "bend_y",
    "tip_force_x", "tip_force_y", "tip_force_z", "tip_moment_x", "tip_moment_y", "tip_moment_z",
]  # fmt: skip

_INPUTS = {
    "force": ("force", 0, 3),
    "moment": ("moment", 0, 3),
    "bend": ("bend_moment", 0, 2),
    "tip_force": ("tip_wrench", 0, 6),
    "tip_moment": ("tip_wrench", 3, 6),
}
CHANNELS = {
    channel: (_INPUTS[channel[:-2]][0], _INPUTS[channel[:-2]][1] + "xyz".index(channel[-1]))
    for channel in get_args(Channel)
}
"""Channel -> input of a scenario, and which component of it."""

_WIDTH = {name: width for name, _, width in _INPUTS.values()}


@dataclass(frozen=True)
class Wave:
    """amplitude · sin(2π (f₀ t + (f₁ - f₀) t² / 2T) + phase) on one component of an input.

    Parameters are numbers, or arrays over runs; the value at t is then a row per run.
    """

    width: int
    component: int
    amplitude: Any
    frequency: Any
    end_frequency: Any
    phase: Any
    duration: float

    def __call__(self, t: float) -> Array:
        sweep = (self.end_frequency - self.frequency) * t**2 / (2.0 * self.duration)
        value = self.amplitude * np.sin(2.0 * np.pi * (self.frequency * t + sweep) + self.phase)
        rows = np.zeros((*np.shape(value), self.width))
        rows[..., self.component] = value
        return rows


@dataclass(frozen=True)
class Scaled:
    """A function of time times an amplitude, a number or an array over runs."""

    function: Any
    amplitude: Any

    def __call__(self, t: float) -> Array:
        return np.asarray(self.amplitude)[..., None] * np.asarray(self.function(t))


def plus(excitation: Any, constant: Any) -> Any:
    """Return the sum of an input of a scenario and a constant; None is none."""
    if excitation is None or constant is None:
        return constant if excitation is None else excitation
    return (lambda t: excitation(t) + constant) if callable(excitation) else excitation + constant


def inputs(fields: dict[str, Any]) -> dict[str, Any]:
    """Fields of a `Scenario` that excite it, from those of a scenario table over runs."""
    if fields["test"] is not None:
        return _test_inputs(fields)
    if fields["excitation"] == "none":
        return {}
    name, component = CHANNELS[fields["on"]]
    width = _WIDTH[name]
    amplitude = fields["amplitude"]
    if fields["excitation"] == "constant":
        rows = np.zeros((*np.shape(amplitude), width))
        rows[..., component] = amplitude
        return {name: rows}
    frequency = fields["frequency"]
    end = frequency if fields["excitation"] == "sine" else fields["end_frequency"]
    wave = Wave(width, component, amplitude, frequency, end, fields["phase"], fields["duration"])
    return {name: wave}


def _test_inputs(fields: dict[str, Any]) -> dict[str, Any]:
    test, amplitude = open_loop_test(fields["test"], fields["f1"]), fields["amplitude"]
    found: dict[str, Any] = {"tip_wrench_sign": test.tip_wrench_sign}
    for name in ("tau", "tip_wrench"):
        value = getattr(test, name)
        if value is not None:
            scaled = Scaled(value, amplitude) if callable(value) else None
            found[name] = scaled or np.asarray(amplitude)[..., None] * np.asarray(value)
    return found
