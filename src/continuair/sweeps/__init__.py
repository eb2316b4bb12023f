"""Sweeps: many paired flights of several models, in memory or in a store that can be resumed."""

from continuair.sweeps.design import Design, load_design
from continuair.sweeps.execution import sweep
from continuair.sweeps.hardware import machine
from continuair.sweeps.pairs import METRICS, run_pairs
from continuair.sweeps.results import open_sweep
from continuair.sweeps.sampling import sobol, sobol_box

__all__ = [
    "METRICS",
    "Design",
    "load_design",
    "machine",
    "open_sweep",
    "run_pairs",
    "sobol",
    "sobol_box",
    "sweep",
]
