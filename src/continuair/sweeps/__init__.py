"""Sweeps: many paired flights of several models, in memory or in a store that survives a kill."""

from continuair.sweeps.pairs import METRICS, run_pairs

__all__ = ["METRICS", "run_pairs"]
