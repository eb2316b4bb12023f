"""Gains of the flight controller, for given bandwidths or for the fastest stable ones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from continuair.controllers.cascade_gains import (
    attitude_gains,
    bend_gains,
    per_period,
    position_gains,
)
from continuair.controllers.hover import hover, resting
from continuair.controllers.margins import LinearLoop
from continuair.errors import InputError
from continuair.vehicle.vehicle import Vehicle

GRAVITY = 9.81
"""That gains are made for [m/s²]."""

FASTEST = {"attitude": 20.0, "bend": 5.0}
"""Bandwidths [rad/s] that defaults do not exceed; the others follow from the attitude's."""

_SLOWER = 0.8 ** np.arange(14)
"""Shares of those, tried until the loop is stable with half as much delay again."""

_BEND_DAMPING = (0.7, 0.4, 0.2, 0.1)
"""Damping ratios of the bends, in the order tried: delayed damping destabilises a stiff arm."""

_OF_LAG = 0.5
"""Largest bandwidth of the attitude by default, times the rotors' lag."""

_BELOW_ATTITUDE = {"position": 1.0 / 8.0, "yaw": 1.0 / 2.5}


class Design:
    """Gains of given bandwidths, or of the fastest with which the hovering vehicle is stable.

    Arms are straight, or held at bends (postures, 2 per section) [1/m].
    """

    def __init__(
        self,
        vehicle: Vehicle,
        given: dict[str, Any],
        shape: tuple[float, float],
        limits: dict[str, Any],
        feedforward: str,
        timing: tuple[float, float, float],
        bends: np.ndarray,
    ) -> None:
        self.vehicle, self.given, self.shape, self.limits = vehicle, given, shape, limits
        self.feedforward, self.hover = feedforward, hover(vehicle, GRAVITY)
        self.period, self.latency, self.lag = timing
        free = np.zeros(vehicle.sections, bool) if given["bend"] is None else given["bend"] == 0.0
        held = [resting(vehicle, GRAVITY, free), *(tuple(each) for each in bends.tolist())]
        self.postures = [hover(vehicle, GRAVITY, each) for each in held]

    def found(self) -> tuple[dict[str, Any], dict[str, Any], float]:
        """Return bandwidths, gains, and the largest stable latency [s].

        Raise InputError if that is less than the latency.
        """
        # The others follow from these.
        asked = self.given["attitude"] is not None and self.given["bend"] is not None
        tried = [
            (self.bandwidths(float(share)), ratio)
            for share in ((1.0,) if asked else _SLOWER)
            for ratio in _BEND_DAMPING
        ]
        for bandwidths, ratio in tried:
            gains = self.gains(bandwidths, ratio)
            if not (self.stable(gains) and self.bears_more(gains)):
                continue
            longest = self.longest_latency(gains)
            if longest >= self.latency:
                return bandwidths, gains, longest
        borne = [self.longest_latency(self.gains(*each)) for each in tried]
        most = max(borne)
        if most < self.latency:
            at = tried[borne.index(most)][0]
            raise _unstable(at, most, self.latency, self.lag, len(self.postures) > 1)
        # Take the fastest with half of the largest margin, as slower ones gain little.
        first = next(i for i, each in enumerate(borne) if each >= 0.5 * (self.latency + most))
        return tried[first][0], self.gains(*tried[first]), borne[first]

    def loops(self, gains: dict[str, Any], lag: float = 1.0) -> Iterator[LinearLoop]:
        """Yield the loop of every posture with these gains, with the rotors' lag times a factor."""
        for each in self.postures:
            yield LinearLoop(each, gains, self.feedforward, lag * self.lag)

    def stable(self, gains: dict[str, Any]) -> bool:
        """Return whether the loop is stable with its latency."""
        return all(loop.stable(self.latency) for loop in self.loops(gains))

    def bears_more(self, gains: dict[str, Any]) -> bool:
        """Return whether the loop is stable with half as much delay again, including the hold's."""
        late = 1.5 * self.latency + 0.5 * self.period
        return all(loop.stable(late) for loop in self.loops(gains, 1.5))

    def longest_latency(self, gains: dict[str, Any]) -> float:
        """Return the latency up to which the loop is stable in every posture [s]."""
        return min(loop.longest_latency(self.latency) for loop in self.loops(gains))

    def bandwidths(self, share: float) -> dict[str, Any]:
        """Return all bandwidths [rad/s]; those not given are a share of the fastest."""
        found = dict(self.given)
        if found["attitude"] is None:
            slow = _OF_LAG / self.lag if self.lag else np.inf
            found["attitude"] = share * min(FASTEST["attitude"], slow)
        for name, below in _BELOW_ATTITUDE.items():
            if found[name] is None:
                found[name] = below * found["attitude"]
        if found["bend"] is None:
            found["bend"] = np.full(self.vehicle.sections, share * FASTEST["bend"])
        return found

    def gains(self, bandwidths: dict[str, Any], bend_damping: float) -> dict[str, Any]:
        """Return the value of every field of the law's gains except its noise."""
        ratio, share = self.shape
        k_p, k_v, k_i = position_gains(bandwidths["position"], ratio, share)
        servos = self.vehicle.layout.per_coordinate(bandwidths["bend"])
        limits = {name: np.asarray(value) for name, value in self.limits.items()}
        return {
            "period": np.array(self.period),
            "mass": np.array(self.hover.mass),
            "inertia": self.hover.inertia,
            "position": np.full(3, k_p),
            "velocity": np.full(3, k_v),
            "integral": np.full(3, k_i),
            **attitude_gains(bandwidths["attitude"], bandwidths["yaw"], ratio),
            **bend_gains(self.hover, servos, bend_damping, self.period),
            "speed": limits["speed"],
            "tilt": np.tan(limits["tilt"]),
            "least_thrust": limits["thrust"][0],
            "most_thrust": limits["thrust"][1],
            "most_moment": limits["moment"],
            "bend_limit": np.where(servos == 0.0, 0.0, limits["bend_moment"]),
            "bend_speed": np.full(self.vehicle.layout.bends, limits["bend_speed"]),
            "bend_washout": per_period(bandwidths["attitude"], self.period),
        }


def _unstable(
    bandwidths: dict[str, Any], bears: float, latency: float, lag: float, bent: bool
) -> InputError:
    """Return the error for an unstable loop; bent: arms have several postures."""
    with_lag = f" with a rotor lag of {lag:.3g} s" if lag else ""
    vehicle = "the hovering vehicle" + (", its arms held straight and bent," if bent else "")
    margin = (
        f"{vehicle} is stable up to a latency of {bears:.2g} s{with_lag}, which "
        f"{latency:.2g} s exceeds by {latency - bears:.2g} s"
        if bears >= 0.0
        else f"{vehicle} is unstable{with_lag} at any latency"
    )
    return InputError(
        "attitude_bandwidth",
        f"is {bandwidths['attitude']:.3g} rad/s, position_bandwidth {bandwidths['position']:.3g} "
        f"and bend_bandwidth {bandwidths['bend'].max():.3g}, with which {margin}",
        "give lower bandwidths, less latency or a higher rate, or arms that hang free their "
        "damping",
    )
