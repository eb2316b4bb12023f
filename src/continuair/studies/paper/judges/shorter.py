"""Whether what a flight loses is its model's or its step's: losses with ever shorter steps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from continuair.flight.resolution import RESOLVED
from continuair.studies.extremes import largest
from continuair.studies.paper.judges.words import SHORTER

Losses = dict[str, float]
"""What should be kept -> how far it is from that; NaN of a flight that ended early."""

UNRESOLVED = f"steps of {1e6 * SHORTER[-1]:g} µs do not resolve this flight yet"


@dataclass(frozen=True)
class Left:
    """losses: of the last flight; kept: whether all are small; of_the_step: whether they may be the
    step's, as they fall with it, or as none of the steps resolves the flight."""

    losses: Losses
    kept: bool
    of_the_step: bool


def left(flights: Iterable[tuple[Losses, float]], most: float) -> Left:
    """What is left of losses in flights with ever shorter steps, up to the first below `most`.

    flights: losses and step_error of each, flown as they are asked for.
    """
    worst = np.inf
    for losses, step_error in flights:
        before, worst = worst, largest(losses.values())
        if worst < most:
            return Left(losses, kept=True, of_the_step=False)
        of_the_step = worst >= most and (worst < 0.5 * before or not step_error <= RESOLVED)
    return Left(losses, kept=False, of_the_step=of_the_step)
