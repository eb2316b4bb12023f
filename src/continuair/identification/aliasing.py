"""Aliasing: whether the rows of a recording resolve the oscillation of an arm."""

from __future__ import annotations

import numpy as np

from continuair.analysis.modes import modes
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

ROWS = 3
"""Rows per period above which aliases are more than twice as fast, beyond any reasonable start."""

_GAP = 1.5
"""Time between rows, over the median, that counts as a gap."""

# Modes with a larger damping ratio hardly oscillate.
_SWINGS = 0.7


def of_fast_swings(start: Vehicle, found: Vehicle, time: Array) -> tuple[str, ...]:
    """Return a sentence if an arm of the fitted or starting vehicle has less than ROWS rows per
    period.

    Another oscillation within twice its frequency then has the same samples.
    """
    gaps = np.diff(time)
    # Weighted by gaps: rows in bursts resolve no more than the bursts.
    rate = float(gaps.sum() / np.square(gaps).sum())
    uneven = ", gaps counted," if gaps.max() > _GAP * np.median(gaps) else ""
    swings = {"fitted vehicle": _fastest(found), "vehicle to start from": _fastest(start)}
    for name, fastest in swings.items():
        if ROWS * fastest > rate:
            other = abs(fastest - rate * max(round(fastest / rate), 1))
            return (
                f"an arm of the {name} swings at {fastest:.3g} Hz, which {rate:.3g} rows a second"
                f"{uneven} cannot tell from {other:.3g} Hz; record more than {ROWS} rows per "
                "period.",
            )
    return ()


def _fastest(vehicle: Vehicle) -> float:
    """Return the highest frequency of an arm, free in flight [Hz]; 0 if none oscillates."""
    if not vehicle.arms:
        return 0.0
    found = modes(vehicle, base="free")
    return float(found.frequencies[found.damping < _SWINGS].max(initial=0.0)) / (2.0 * np.pi)
