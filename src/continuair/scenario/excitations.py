"""Excitations by name: constant, sine or chirp on one channel, or the inputs of a test.

Functions that are `vectorised` also accept a column of times (times, 1) and return
(times, runs or 1, width), as a sweep needs millions of values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from continuair import extensions
from continuair.errors import InputError, shown
from continuair.typing import Array
from continuair.vehicle.layout import CHANNELS, OF_NAME, ONE_SECTION, Layout


def is_vectorised(function: object) -> bool:
    """Return whether a function of time accepts a column of times."""
    return bool(getattr(function, "vectorised", False))


@dataclass(frozen=True)
class Wave:
    """Return amplitude · sin(2π (f₀ t + (f₁ - f₀) t² / 2T) + phase) on one component of an input.

    Fields are numbers, or arrays over runs; the value at t then has a row per run.
    """

    width: int
    component: int
    amplitude: Any
    frequency: Any
    end_frequency: Any
    phase: Any
    duration: float

    vectorised: ClassVar[bool] = True

    def __call__(self, t: Any) -> Array:
        sweep = (self.end_frequency - self.frequency) * t**2 / (2.0 * self.duration)
        value = self.amplitude * np.sin(2.0 * np.pi * (self.frequency * t + sweep) + self.phase)
        rows = np.zeros((*np.shape(value), self.width))
        rows[..., self.component] = value
        return rows


@dataclass(frozen=True)
class Scaled:
    """Multiply a function of time by an amplitude: a number, or an array over runs."""

    function: Any
    amplitude: Any

    def __call__(self, t: Any) -> Array:
        return np.asarray(self.amplitude)[..., None] * np.asarray(self.function(t))

    @property
    def vectorised(self) -> bool:
        """Whether the function is vectorised."""
        return is_vectorised(self.function)


@dataclass(frozen=True)
class Shared:
    """Distribute a wave over several components by factors (width,) or (runs, width)."""

    wave: Wave
    shares: Array

    vectorised: ClassVar[bool] = True

    def __call__(self, t: Any) -> Array:
        return self.wave(t) * self.shares


@dataclass(frozen=True)
class Swelling:
    """Ramp a function of time smoothly from 0 to its full value at `until` [s]."""

    function: Any
    until: float

    def __call__(self, t: Any) -> Array:
        share = np.sin(0.5 * np.pi * np.minimum(t / self.until, 1.0)) ** 2
        return np.asarray(share[..., None] * np.asarray(self.function(t)))

    @property
    def vectorised(self) -> bool:
        """Whether the function is vectorised."""
        return is_vectorised(self.function)


@dataclass(frozen=True)
class Offset:
    """Add a constant to a function of time."""

    function: Any
    constant: Any

    def __call__(self, t: Any) -> Array:
        return np.asarray(self.function(t)) + self.constant

    @property
    def vectorised(self) -> bool:
        """Whether the function is vectorised."""
        return is_vectorised(self.function)


def plus(excitation: Any, constant: Any) -> Any:
    """Return the sum of a scenario's input and a constant; None counts as zero."""
    if excitation is None or constant is None:
        return constant if excitation is None else excitation
    return Offset(excitation, constant) if callable(excitation) else excitation + constant


def inputs(fields: dict[str, Any], layout: Layout) -> dict[str, Any]:
    """Return the inputs of a `Scenario` from the fields of a scenario table over runs.

    layout: of the vehicle. The channels are those of the first section and the first arm. Raises
    InputError for a test of the paper if the vehicle does not have one arm of one section.
    """
    if fields["test"] is not None:
        if layout.widths != ONE_SECTION.widths:
            raise InputError(
                "scenario.test",
                f"is {shown(fields['test'])}, which is for one arm of one section",
                "give an excitation",
            )
        return _test_inputs(fields)
    if fields["excitation"] == "none":
        return {}
    name, component = CHANNELS[fields["on"]]
    width = OF_NAME[name].width(layout)
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
    """Return the inputs of a named open-loop test, scaled by the amplitude."""
    test = extensions.scenario("open_loop_test")(fields["test"], fields["f1"])
    amplitude = fields["amplitude"]
    found: dict[str, Any] = {"tip_wrench_sign": test.tip_wrench_sign}
    for name in ("tau", "tip_wrench"):
        value = getattr(test, name)
        if value is not None:
            scaled = Scaled(value, amplitude) if callable(value) else None
            found[name] = scaled or np.asarray(amplitude)[..., None] * np.asarray(value)
    return found
