"""Inputs over time as piecewise polynomials, fitted once and evaluated at any time."""

from continuair.signals.approximation import UnresolvedSignal, fit
from continuair.signals.signal import Signal, constant, from_pieces, sampled

__all__ = ["Signal", "UnresolvedSignal", "constant", "fit", "from_pieces", "sampled"]
