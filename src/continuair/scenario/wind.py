"""Wind over time for `Scenario(wind=…)`: a gust, and turbulence after Dryden."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.signals import Signal, sampled

Array = np.ndarray

_FOOT = 0.3048
_LOWEST, _HIGHEST = 3.0, 305.0
"""Altitudes for which the formulas are made: 10 to 1000 feet [m]."""

_MOST_KNOTS = 10_000_000


@dataclass(frozen=True, eq=False)
class Gust(Immutable):
    """Wind that rises and falls as 1 - cos."""

    velocity: Array
    start: float
    duration: float

    def __call__(self, t: float) -> Array:
        phase = min(max((t - self.start) / self.duration, 0.0), 1.0)
        return np.asarray(0.5 * (1.0 - math.cos(2.0 * math.pi * phase)) * self.velocity)

    def describe(self) -> dict[str, Any]:
        """What it was made of, as JSON can hold it."""
        return {
            "wind": "gust",
            "velocity": self.velocity.tolist(),
            "start": self.start,
            "duration": self.duration,
        }


def gust(velocity: Any, start: float, duration: float) -> Gust:
    """A gust of a velocity (3,) at its height, world axes [m/s], that lasts from `start` [s] on for
    a duration [s]: half of 1 - cos. Raises InputError."""
    return Gust(
        checks.frozen(checks.vector("velocity", velocity, 3)),
        checks.number("start", start, otherwise=" [s]"),
        checks.positive("duration", duration, " [s]"),
    )


@dataclass(frozen=True)
class Scales:
    """Standard deviations [m/s] and lengths [m] of turbulence along u, v and w."""

    deviations: tuple[float, float, float]
    lengths: tuple[float, float, float]


def low_altitude(w20: float, altitude: float) -> Scales:
    """Scales of Dryden's model below 1000 feet, MIL-F-8785C; w20: wind at 20 feet [m/s]."""
    feet = altitude / _FOOT
    share = np.longdouble(0.177 + 0.000823 * feet)
    along, vertical = float(0.1 * w20 / share**0.4), 0.1 * w20
    length = float(feet / share**1.2) * _FOOT
    return Scales((along, along, vertical), (length, length, altitude))


@dataclass(frozen=True, eq=False)
class Dryden(Immutable):
    """Turbulence at knots (runs or 1, n, 3) a step apart [s], and straight between them."""

    knots: Array
    step: float
    settings: dict[str, Any] = field(default_factory=dict)

    def __call__(self, t: float) -> Array:
        at = t / self.step
        first = min(max(int(at), 0), self.knots.shape[1] - 2)
        if at > self.knots.shape[1] - 1 + 1e-6:
            raise ValueError(
                f"this wind lasts {self.step * (self.knots.shape[1] - 1):g} s; make it with a "
                "longer duration"
            )
        before, after = self.knots[:, first], self.knots[:, first + 1]
        found = before + (at - first) * (after - before)
        return np.asarray(found if len(found) > 1 else found[0])

    def signal(self, duration: float) -> Signal:
        """Return the wind over a duration [s] as a signal, straight between its knots."""
        if duration > self.step * (self.knots.shape[1] - 1) * (1.0 + 1e-9):
            self(duration)
        return sampled(self.knots, self.step, duration)

    @property
    def knot_times(self) -> Array:
        """Times of the knots inside [s], at which steps end."""
        return self.step * np.arange(1, self.knots.shape[1] - 1)

    def describe(self) -> dict[str, Any]:
        """What it was made of, as JSON can hold it."""
        return {"wind": "dryden", **self.settings}


def dryden(
    w20: float,
    altitude: float,
    airspeed: float,
    *,
    seed: int | Sequence[int] = 0,
    mean: Any = (0.0, 0.0, 0.0),
    heading: float = 0.0,
    duration: float = 60.0,
    step: float = 0.01,
) -> Dryden:
    """Dryden's turbulence at low altitude, MIL-F-8785C, world axes.

    w20: the wind at 20 feet, which sets how strong it is [m/s]; altitude [m], 3 to 305; airspeed
    through the frozen field [m/s]; seed: of its noise, one, or one per run; mean: a steady wind
    (3,) that is added [m/s]; heading: of its axis u in the world [rad]; duration of what is made,
    and the time between knots [s], between which wind is a straight line. At the knots it has the
    model's spectrum exactly. Raises InputError.
    """
    settings = {
        "w20": checks.number("w20", w20, least=0.0, otherwise=" [m/s]"),
        "altitude": checks.number("altitude", altitude, least=_LOWEST, otherwise=" [m]"),
        "airspeed": checks.positive("airspeed", airspeed, " [m/s]"),
        "heading": checks.number("heading", heading, otherwise=" [rad]"),
        "duration": checks.positive("duration", duration, " [s]"),
        "step": checks.positive("step", step, " [s]"),
    }
    if altitude > _HIGHEST:
        raise InputError(
            f"altitude is {shown(altitude)}, but the formulas hold up to {_HIGHEST:g} m; give less."
        )
    steps = math.ceil(settings["duration"] / settings["step"] - 1e-9)
    if steps >= _MOST_KNOTS:
        raise InputError(f"step is {shown(step)}, too short for {duration:g} s; give a longer one.")
    steady = checks.vector("mean", mean, 3)
    given = checks.seed(seed)
    seeds = list(given) if isinstance(given, tuple) else [given]
    scales = low_altitude(settings["w20"], settings["altitude"])
    rates = [settings["airspeed"] / length for length in scales.lengths]
    knots = np.empty((len(seeds), steps + 1, 3))
    for run, own in enumerate(seeds):
        noise = np.random.default_rng(own).standard_normal((steps + 1, 5))
        knots[run, :, 0] = _first_order(rates[0], settings["step"], noise[:, 0])
        knots[run, :, 1] = _second_order(rates[1], settings["step"], noise[:, 1:3])
        knots[run, :, 2] = _second_order(rates[2], settings["step"], noise[:, 3:])
    u, v, w = np.moveaxis(knots * scales.deviations, -1, 0)
    cosine, sine = (_same(of, settings["heading"]) for of in (np.cos, np.sin))
    turned = np.stack([cosine * u - sine * v, sine * u + cosine * v, w], axis=-1)
    told = {"seed": seeds if isinstance(given, tuple) else given, "mean": steady.tolist()}
    return Dryden(checks.frozen(turned + steady), settings["step"], settings | told)


def _same(of: Any, x: float) -> float:
    """A function in extended precision: its last bit in float64 is another by processor."""
    return float(of(np.longdouble(x)))


def _first_order(rate: float, step: float, noise: Array) -> Array:
    """Of variance 1, with the spectrum of 1 / (1 + s/rate): exact at the knots (n,)."""
    kept = _same(np.exp, -rate * step)
    added = math.sqrt(-_same(np.expm1, -2.0 * rate * step))
    found = np.empty(len(noise))
    x = noise[0]
    for i in range(len(noise)):
        x = kept * x + added * noise[i] if i else x
        found[i] = x
    return found


def _third_order(y: float, decayed: float) -> float:
    """1 - e^-y (1 + y + y²/2), e^-y being decayed; for small y, where y³/6 is left, its series."""
    if y > 1.0:
        return 1.0 - decayed * (1.0 + y + 0.5 * y * y)
    term, total, order = y * y * y / 6.0, 0.0, 3
    while total + term > total:
        total, order = total + term, order + 1
        term *= y / order
    return decayed * total


def _second_order(rate: float, step: float, noise: Array) -> Array:
    """Of variance 1, with the spectrum of (1 + √3 s/rate) / (1 + s/rate)²: exact at the knots.

    noise: (n, 2). States are z and z' of z'' + 2 a z' + a² z = n, from their stationary start.
    """
    a, x = rate, rate * step
    decayed, squared = (_same(np.exp, -times * x) for times in (1.0, 2.0))
    forward = np.array([[1.0 + x, step], [-a * x, 1.0 - x]]) * decayed
    lost = -_same(np.expm1, -2.0 * x)
    variance = _third_order(2.0 * x, squared) / (4.0 * a * a * a)
    of_rate = (lost + 2.0 * squared * x * (1.0 - x)) / (4.0 * a)
    spread = math.sqrt(variance)
    shared = 0.5 * step * step * squared / spread if spread > 0.0 else 0.0
    own = math.sqrt(max(of_rate - shared * shared, 0.0))
    seen = a * math.sqrt(a), math.sqrt(3.0 * a)
    found = np.empty(len(noise))
    z, dz = noise[0, 0] / (2.0 * a * math.sqrt(a)), noise[0, 1] / (2.0 * math.sqrt(a))
    for i in range(len(noise)):
        if i:
            z, dz = (
                forward[0, 0] * z + forward[0, 1] * dz + spread * noise[i, 0],
                forward[1, 0] * z + forward[1, 1] * dz + shared * noise[i, 0] + own * noise[i, 1],
            )
        found[i] = seen[0] * z + seen[1] * dz
    return found
