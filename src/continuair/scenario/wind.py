"""Wind over time for `Scenario(wind=…)`: a gust, and Dryden turbulence."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.signals import Signal, sampled
from continuair.typing import Array, ArrayLike

_FOOT = 0.3048
_LOWEST, _HIGHEST = 3.0, 305.0
"""Altitudes at which the formulas are valid: 10 to 1000 feet [m]."""

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

    def describe(self) -> dict[str, object]:
        """Return the fields for JSON."""
        return {
            "wind": "gust",
            "velocity": self.velocity.tolist(),
            "start": self.start,
            "duration": self.duration,
        }


def gust(velocity: ArrayLike, start: float, duration: float) -> Gust:
    """Return a gust of the shape (1 - cos) / 2.

    Parameters
    ----------
    velocity : array_like, shape (3,)
        Peak velocity in world axes [m/s].
    start : float
        Start [s].
    duration : float
        Duration [s].

    Returns
    -------
    Gust
        Wind for ``Scenario(wind=...)``.

    Raises
    ------
    InputError
        If an argument is not finite, or the duration is not above 0.
    """
    return Gust(
        checks.frozen(checks.vector("velocity", velocity, 3)),
        checks.number("start", start, otherwise=" [s]"),
        checks.positive("duration", duration, " [s]"),
    )


@dataclass(frozen=True)
class Scales:
    """Standard deviations [m/s] and length scales [m] of turbulence along u, v and w."""

    deviations: tuple[float, float, float]
    lengths: tuple[float, float, float]


def low_altitude(w20: float, altitude: float) -> Scales:
    """Return the scales of Dryden's model below 1000 feet, MIL-F-8785C.

    w20: wind at 20 feet [m/s].
    """
    feet = altitude / _FOOT
    share = np.longdouble(0.177 + 0.000823 * feet)
    along, vertical = float(0.1 * w20 / share**0.4), 0.1 * w20
    length = float(feet / share**1.2) * _FOOT
    return Scales((along, along, vertical), (length, length, altitude))


@dataclass(frozen=True, eq=False)
class Dryden(Immutable):
    """Turbulence at breakpoints (runs or 1, n, 3), `step` apart [s], interpolated linearly."""

    knots: Array
    step: float
    settings: dict[str, object] = field(default_factory=dict)

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
        """Return the wind over a duration [s] as a piecewise linear signal."""
        if duration > self.step * (self.knots.shape[1] - 1) * (1.0 + 1e-9):
            self(duration)
        return sampled(self.knots, self.step, duration)

    @property
    def knot_times(self) -> Array:
        """Inner breakpoints [s], at which steps end."""
        return self.step * np.arange(1, self.knots.shape[1] - 1)

    def describe(self) -> dict[str, object]:
        """Return the settings for JSON."""
        return {"wind": "dryden", **self.settings}


def dryden(
    w20: float,
    altitude: float,
    airspeed: float,
    *,
    seed: int | Sequence[int] = 0,
    mean: ArrayLike = (0.0, 0.0, 0.0),
    heading: float = 0.0,
    duration: float = 60.0,
    step: float = 0.01,
) -> Dryden:
    """Return Dryden turbulence at low altitude, MIL-F-8785C.

    Parameters
    ----------
    w20 : float
        Wind at 20 feet, which sets the intensity [m/s].
    altitude : float
        Altitude, 3 to 305 [m].
    airspeed : float
        Airspeed through the frozen field [m/s].
    seed : int or sequence of int, default 0
        Seed of the noise, one for all runs or one per run.
    mean : array_like, shape (3,), optional
        Steady wind that is added, in world axes [m/s].
    heading : float, default 0.0
        Heading of the axis u in the world [rad].
    duration : float, default 60.0
        Duration of the wind [s].
    step : float, default 0.01
        Time between breakpoints [s]; the wind is linear in between.

    Returns
    -------
    Dryden
        Wind for ``Scenario(wind=...)``.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    At the breakpoints the wind has the model's spectrum exactly.
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
            "altitude",
            f"is {shown(altitude)}",
            f"give at most {_HIGHEST:g} m, the model's upper limit",
        )
    steps = math.ceil(settings["duration"] / settings["step"] - 1e-9)
    if steps >= _MOST_KNOTS:
        raise InputError(
            "step", f"is {shown(step)}, too short for {duration:g} s", "give a longer one"
        )
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


def _same(of: Callable[[np.longdouble], np.longdouble], x: float) -> float:
    """Evaluate a function in extended precision: float64's last bit depends on the processor."""
    return float(of(np.longdouble(x)))


def _first_order(rate: float, step: float, noise: Array) -> Array:
    """Return noise of variance 1 with the spectrum of 1 / (1 + s/rate), exact at breakpoints."""
    kept = _same(np.exp, -rate * step)
    added = math.sqrt(-_same(np.expm1, -2.0 * rate * step))
    found = np.empty(len(noise))
    x = noise[0]
    for i in range(len(noise)):
        x = kept * x + added * noise[i] if i else x
        found[i] = x
    return found


def _third_order(y: float, decayed: float) -> float:
    """Return 1 - e^-y (1 + y + y²/2), e^-y being `decayed`; for small y by its series, from y³/6
    on."""
    if y > 1.0:
        return 1.0 - decayed * (1.0 + y + 0.5 * y * y)
    term, total, order = y * y * y / 6.0, 0.0, 3
    while total + term > total:
        total, order = total + term, order + 1
        term *= y / order
    return decayed * total


def _second_order(rate: float, step: float, noise: Array) -> Array:
    """Return noise of variance 1 with the spectrum of (1 + √3 s/rate) / (1 + s/rate)².

    Exact at the breakpoints. noise: (n, 2). States are z and z' of z'' + 2 a z' + a² z = n, from
    their stationary start.
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
