"""How steps of a length are taken: RK4, or the linearly implicit step for stiff arms."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from continuair.kernels.implicit import implicit_step_code
from continuair.kernels.step import step_code


@dataclass(frozen=True)
class Integrator:
    """step_code makes the function `step` of a model; phase: the largest product of an automatic
    step and the fastest rate that it resolves; stiff: whether modes that steps do not resolve stay
    stable."""

    step_code: Callable[..., Any]
    phase: float
    stiff: bool


INTEGRATORS = {
    "RK4": Integrator(step_code, 0.2, stiff=False),
    "implicit": Integrator(implicit_step_code, 0.05, stiff=True),
}
"""Integrators of kernels by name. At its phase RK4 keeps the amplitude of the stiffest mode, and
follows the fastest decay."""

TSIT5 = "Tsit5"
"""The embedded pair by whose error steps are controlled (kernels/adaptive.py)."""
