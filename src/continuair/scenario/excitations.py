"""Named excitations of a sweep: constant, sine or chirp on one channel, or a test's inputs.

Those that are `vectorised` take a column of times (times, 1) as well as a number, and return
(times, runs or 1, width): thousands of flights ask for millions of values.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from continuair import extensions
from continuair.errors import InputError, shown
from continuair.vehicle.layout import CHANNELS, OF_NAME, ONE_SECTION, Layout

Array = np.ndarray


def is_vectorised(function: Any) -> bool:
    """Whether a function of time takes a column of times."""
    return bool(getattr(function, "vectorised", False))


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

    vectorised: ClassVar[bool] = True

    def __call__(self, t: Any) -> Array:
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

    def __call__(self, t: Any) -> Array:
        return np.asarray(self.amplitude)[..., None] * np.asarray(self.function(t))

    @property
    def vectorised(self) -> bool:
        """As the function."""
        return is_vectorised(self.function)


@dataclass(frozen=True)
class Shared:
    """A wave of one component on several, each by its share (width,), or (runs, width)."""

    wave: Wave
    shares: Array

    vectorised: ClassVar[bool] = True

    def __call__(self, t: Any) -> Array:
        return self.wave(t) * self.shares


@dataclass(frozen=True)
class Swelling:
    """A function of time that swells from nothing, smoothly, until a time [s]."""

    function: Any
    until: float

    def __call__(self, t: Any) -> Array:
        share = np.sin(0.5 * np.pi * np.minimum(t / self.until, 1.0)) ** 2
        return np.asarray(share[..., None] * np.asarray(self.function(t)))

    @property
    def vectorised(self) -> bool:
        """As the function."""
        return is_vectorised(self.function)


@dataclass(frozen=True)
class Offset:
    """A function of time plus a constant."""

    function: Any
    constant: Any

    def __call__(self, t: Any) -> Array:
        return np.asarray(self.function(t)) + self.constant

    @property
    def vectorised(self) -> bool:
        """As the function."""
        return is_vectorised(self.function)


def plus(excitation: Any, constant: Any) -> Any:
    """Return the sum of an input of a scenario and a constant; None is none."""
    if excitation is None or constant is None:
        return constant if excitation is None else excitation
    return Offset(excitation, constant) if callable(excitation) else excitation + constant


def inputs(fields: dict[str, Any], layout: Layout) -> dict[str, Any]:
    """Fields of a `Scenario` that excite it, from those of a scenario table over runs.

    layout: of the vehicle; on its bends and tips, the first section and the first arm are excited.
    Raises InputError for a test of the paper on a vehicle that is not the paper's.
    """
    if fields["test"] is not None:
        if layout.widths != ONE_SECTION.widths:
            raise InputError(
                f"scenario.test is {shown(fields['test'])}, which is for one arm of one section; "
                "give an excitation."
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
    test = extensions.scenario("open_loop_test")(fields["test"], fields["f1"])
    amplitude = fields["amplitude"]
    found: dict[str, Any] = {"tip_wrench_sign": test.tip_wrench_sign}
    for name in ("tau", "tip_wrench"):
        value = getattr(test, name)
        if value is not None:
            scaled = Scaled(value, amplitude) if callable(value) else None
            found[name] = scaled or np.asarray(amplitude)[..., None] * np.asarray(value)
    return found
