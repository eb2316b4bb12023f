"""Whether steps follow the inputs over time that do not tell how fast they are."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.errors import ContinuairWarning, InputError
from continuair.flight.inputs import evaluated, field_width
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.layout import FIELDS, Layout

Array = np.ndarray

BLUR = 0.01
"""Share of an input's largest value that it may be off the parabola through a step's stages: a sine
reaches it at six steps per period, which RK4 follows to 4e-4."""

_WINDOWS = 100
"""Steps that are looked into."""

_HALVINGS = 8
"""An automatic step is halved as often, at most, to follow inputs."""

_STAGES = np.array([0.0, 0.5, 1.0])
# Between the stages, and not placed evenly, so that no sine is zero at both of them and at stages.
_PROBES = np.array([0.211, 0.727])
# Of the golden section: starts that no period of an input falls in step with.
_SPREAD = 0.6180339887498949


@dataclass(frozen=True)
class Blur:
    """How far an input is off what the stages of a step show of it: a share, at a time [s]."""

    field: str
    share: float
    time: float


def following_step(scenario: Scenario, layout: Layout, duration: float, step: float) -> float:
    """The step, halved until it follows the inputs; as it was if no half does [s]."""
    for halvings in range(_HALVINGS + 1):
        if worst_blur(scenario, layout, duration, step / 2**halvings) is None:
            return step / 2**halvings
    return step


def warn_of_blur(
    scenario: Scenario, layout: Layout, duration: float, step: float, stacklevel: int
) -> None:
    """Warn if steps of a length [s] do not follow the inputs."""
    blur = worst_blur(scenario, layout, duration, step)
    if blur is not None:
        warnings.warn(
            f"{blur.field} changes within steps of {step:.3g} s: near t = {blur.time:.4g} s it is "
            f"{100.0 * blur.share:.2g} % of its largest value off what the steps see of it; give a "
            "shorter step, or name the times at which it jumps in jumps.",
            ContinuairWarning,
            stacklevel=stacklevel,
        )


def worst_blur(scenario: Scenario, layout: Layout, duration: float, step: float) -> Blur | None:
    """The worst blur of more than BLUR in steps spread over the flight; of declared inputs none."""
    width = min(step, duration)
    starts = (duration - width) * (_SPREAD * np.arange(1, _WINDOWS + 1) % 1.0)
    for jump in scenario.jumps:
        starts = starts[(jump < starts) | (starts + width < jump)]
    worst: Blur | None = None
    for field in FIELDS:
        value = getattr(scenario, field)
        # An input that tells its fastest rate is resolved by the automatic step.
        if not callable(value) or hasattr(value, "fastest") or not len(starts):
            continue
        try:
            share = _blur_of(field, value, field_width(field, layout), starts, width)
        except InputError:
            # The flight samples it in order, and tells where it fails first.
            return None
        at = int(np.argmax(share))
        if share[at] > max(BLUR, worst.share if worst else 0.0):
            worst = Blur(field, float(share[at]), float(starts[at] + width / 2.0))
    return worst


def _blur_of(field: str, value: Any, size: int, starts: Array, width: float) -> Array:
    """Largest share (starts,) that an input is off the parabola through the stages of a step."""
    stages, probes = (
        evaluated(field, value, (starts[:, None] + width * at).ravel(), size)
        for at in (_STAGES, _PROBES)
    )
    stages, probes = (x.reshape(len(starts), -1, *x.shape[1:]) for x in (stages, probes))
    s = _PROBES
    weights = np.stack([(2 * s - 1) * (s - 1), 4 * s * (1 - s), s * (2 * s - 1)], axis=-1)
    off = np.abs(probes - np.einsum("ps,nsrk->nprk", weights, stages)).max(axis=(1, 3))
    largest = np.maximum(*(np.abs(x).max(axis=(0, 1, 3)) for x in (stages, probes)))
    share = np.divide(off, largest, out=np.zeros_like(off), where=largest > 0.0)
    return np.asarray(share.max(axis=1))
