"""Whether a loss along a flight is due to its model or to an error of the integration."""

from __future__ import annotations

FINE = 1e-9
"""Tolerance of flights in which something should be kept."""

UNRESOLVED = f"a tolerance of {FINE:g} does not resolve this flight yet"

_SMALL = 0.01
"""Largest error estimate of a flight that decides on a loss, over the least loss."""


def is_unresolved(loss: float, most: float, error_estimate: float) -> bool:
    """Whether a loss of at least `most` may be an error; both as shares, or in arm lengths."""
    return not loss < most and not error_estimate <= _SMALL * most
