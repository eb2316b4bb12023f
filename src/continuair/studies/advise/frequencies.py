"""The frequencies that advice is tried at, from the slowest motion of a loop to resonances."""

from __future__ import annotations

import numpy as np

from continuair.analysis.excited import excited_arm
from continuair.analysis.modes import Base, Modes, modes
from continuair.analysis.trim import trim
from continuair.errors import InputError
from continuair.studies.excited_flights import Loop, least_periods
from continuair.studies.standard_loops import OWN, hover_loop
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

SCAN = np.geomspace(0.05, 3.0, 20)
"""Frequencies over the clamped one that are tried for every vehicle."""

LONGEST = float(least_periods(SCAN[0]))
"""Clamped periods that a flight at the lowest of them lasts in a loop."""

_WIDER = 1.5
"""Ratio of the frequencies below, over which a loop's response changes little."""

_BESIDE = 0.02
"""Relative distance of a resonance from all frequencies tried, below which it is left out."""

_SWOLLEN = 5.0
"""Times a resonance decays by e while it swells, and while it counts."""


def tried(vehicle: Vehicle, loop: Loop) -> tuple[Array, Array]:
    """Return frequencies (n,) over the clamped one, and the clamped periods that each needs (n,).

    They are SCAN, lower ones at which a loop still moves, and the resonances of further arms and
    sections, which may be narrower than the spacing. The periods let a resonance reach its
    amplitude; they are 0 where `least_periods` are enough.
    """
    found = {place: 0.0 for place in SCAN.tolist()}
    clamped = float(excited_arm(vehicle).frequency)
    if loop.settles and (rate := slowest(vehicle, loop)) is not None:
        steps = np.log(SCAN[0] * clamped / rate) / np.log(_WIDER)
        lower = SCAN[0] * _WIDER ** -np.arange(1.0, np.ceil(steps) + 1.0)
        found |= {place: float(least_periods(place)) for place in lower.tolist()}
    if sum(vehicle.shape) > 1:
        longest = float(least_periods(min(found)))
        for swings in (_swings(vehicle, "hovering"), _swings(vehicle, "clamped")):
            for frequency, ratio in zip(swings.frequencies, swings.damping, strict=True):
                place = float(frequency) / clamped
                beside = min(abs(each / place - 1.0) for each in found)
                if min(found) < place < max(found) and beside > _BESIDE:
                    decay = 2.0 * np.pi * place * max(float(ratio), 1e-9)
                    found[place] = min(max(_SWOLLEN / decay, least_periods(place)), longest)
    places = np.array(sorted(found))
    return places, np.array([found[place] for place in places])


def slowest(vehicle: Vehicle, loop: Loop) -> float | None:
    """Return the rate [rad/s] of the slowest motion of a loop that holds the position.

    None for a controller whose settings do not say it.
    """
    held = loop.held if loop.name == OWN else hover_loop(vehicle, loop.name, loop.bandwidth)
    assert held is not None
    if not {"position_bandwidth", "integral_share"} <= held.settings.keys():
        return None
    return float(held.settings["position_bandwidth"]) * float(held.settings["integral_share"])


def hovering(vehicle: Vehicle) -> list[float]:
    """Return frequencies of the hovering vehicle's modes with gravity, arms at rest [Hz].

    There are none without a stable equilibrium.
    """
    return [float(each) for each in _swings(vehicle, "hovering").frequencies / (2.0 * np.pi)]


def _swings(vehicle: Vehicle, base: Base) -> Modes:
    try:
        return modes(vehicle, trim(vehicle).q, base=base)
    except InputError:
        return Modes(np.empty(0), np.empty(0), np.empty((0, 0)))
