"""By how much errors multiply in a flight that nothing holds, where it falls or turns over."""

from __future__ import annotations

import numpy as np

from continuair.flight.cohorts import Flight
from continuair.flight.loaded_rates import pull_rate, strongest_pull
from continuair.vehicle.runs import per_run

Array = np.ndarray

_FALL = 0.25
"""Share of the rate at which an arm falls over, or a vehicle turns, with which errors multiply in a
long flight."""

_SWINGS = 2.0 * np.pi
"""What a UAV that its arm swings turns through, in all [rad]."""

_MOST = 700.0
"""The largest exponent of a finite number."""


def multiplied(flight: Flight) -> Array:
    """By how much (runs,) errors of a flight may multiply until its end, once it has been flown."""
    return np.asarray(np.exp(np.minimum(_FALL * _fallen(flight), _MOST)))


def _fallen(flight: Flight) -> Array:
    """How often (runs,) what is as long as the arms' reach may fall over, or is tipped over by
    forces on the tips, in a flight, in e-folds, and the angle that it turns through [rad]."""
    reach = per_run(flight.vehicle.reach, flight.runs)
    rate = np.sqrt(flight.scenario.gravity / reach) + _pull_rate(flight)
    spin = flight.start.states[:, flight.coupled.layout.angular_velocity]
    # What swings to and fro turns through as much in all, and is no turning over.
    over = np.maximum(flight.turned - _SWINGS, 0.0)
    turned = np.fmax(np.linalg.norm(spin, axis=1) * flight.duration, over)
    return np.asarray(rate * flight.duration + turned)


def _pull_rate(flight: Flight) -> Array:
    """`pull_rate` (runs,) of the strongest forces on the tips."""
    pull = strongest_pull(flight.scenario, flight.coupled.layout, flight.duration)
    pull = np.broadcast_to(pull, (flight.runs, pull.shape[1]))
    return pull_rate(flight.coupled, np.atleast_2d(flight.scenario.q), pull)
