"""Integrators with a given step: RK4, and the linearly implicit step for stiff arms."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from continuair.kernels.implicit import implicit_step_code
from continuair.kernels.step import step_code


@dataclass(frozen=True)
class Integrator:
    """Integrator with a given step.

    step_code: factory of the function `step` of a model. phase: largest product of an automatic
    step and the fastest resolved rate. stiff: whether unresolved modes stay stable.
    """

    step_code: Callable[..., Any]
    phase: float
    stiff: bool


INTEGRATORS = {
    "RK4": Integrator(step_code, 0.2, stiff=False),
    "implicit": Integrator(implicit_step_code, 0.05, stiff=True),
}
"""Integrators by name. At its phase RK4 preserves the amplitude of the stiffest mode, and resolves
the fastest decay."""

TSIT5 = "Tsit5"
"""Embedded pair with adaptive steps (kernels/adaptive.py)."""
