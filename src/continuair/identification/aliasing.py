"""Whether rows follow how fast an arm swings: another swing may pass through the same rows."""

from __future__ import annotations

import numpy as np

from continuair.analysis.modes import modes
from continuair.vehicle.vehicle import Vehicle

ROWS = 3
"""Rows of a swing from which on its aliases are more than twice as fast, and no start as far off.
"""

_GAP = 1.5
"""Time between rows, over the usual one, from which on it is a gap."""

# No swing is left of a mode that is damped as much.
_SWINGS = 0.7


def of_fast_swings(start: Vehicle, found: Vehicle, time: np.ndarray) -> tuple[str, ...]:
    """A sentence where an arm of the fitted vehicle, or of the one to start from, swings more than
    once in ROWS: a swing within twice its frequency looks the same."""
    gaps = np.diff(time)
    # Of the gaps around an instant: rows in bursts follow no better than bursts.
    rate = float(gaps.sum() / np.square(gaps).sum())
    uneven = ", gaps counted," if gaps.max() > _GAP * np.median(gaps) else ""
    swings = {"fitted vehicle": _fastest(found), "vehicle to start from": _fastest(start)}
    for name, fastest in swings.items():
        if ROWS * fastest > rate:
            other = abs(fastest - rate * max(round(fastest / rate), 1))
            return (
                f"an arm of the {name} swings at {fastest:.3g} Hz, which {rate:.3g} rows a second"
                f"{uneven} cannot tell from {other:.3g} Hz: the fit may have taken the one for the "
                f"other; record more than {ROWS} rows a swing.",
            )
    return ()


def _fastest(vehicle: Vehicle) -> float:
    """The highest frequency at which an arm swings, free in flight [Hz]; 0 where none does."""
    if not vehicle.arms:
        return 0.0
    found = modes(vehicle, base="free")
    return float(found.frequencies[found.damping < _SWINGS].max(initial=0.0)) / (2.0 * np.pi)
