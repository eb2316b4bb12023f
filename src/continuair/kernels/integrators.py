"""How steps of a length are taken: RK4, or the linearly implicit step for stiff arms."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from continuair.kernels.implicit import IMPLICIT_MEASURED_EVERY, IMPLICIT_PHASE, implicit_step_code
from continuair.kernels.resolution import STEP_PHASE
from continuair.kernels.step import MEASURED_EVERY, step_code


@dataclass(frozen=True)
class Integrator:
    """step_code makes the function `step` of a model; phase: the largest product of an automatic
    step and the fastest rate that it resolves; one step in measured_every is measured, for all of
    them. stiff: whether modes that steps do not resolve stay stable."""

    step_code: Callable[..., Any]
    order: int
    phase: float
    measured_every: int
    stiff: bool

    @property
    def share(self) -> float:
        """The error of half the step, as a share of what halving changes."""
        return 1.0 / (2.0**self.order - 1.0)


INTEGRATORS = {
    "RK4": Integrator(step_code, 4, STEP_PHASE, MEASURED_EVERY, stiff=False),
    "implicit": Integrator(
        implicit_step_code, 2, IMPLICIT_PHASE, IMPLICIT_MEASURED_EVERY, stiff=True
    ),
}
"""Integrators of kernels by name, the one by default first."""

TSIT5 = "Tsit5"
"""The embedded pair by whose error steps are controlled (kernels/adaptive.py)."""
