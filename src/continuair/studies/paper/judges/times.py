"""What the plants cost to compute, and verdicts that turn on it: never within timing's noise."""

from __future__ import annotations

from continuair.analysis.shares import percent
from continuair.kernels.dynamics import PLANTS
from continuair.studies.paper.evidence import Evidence
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, UNDECIDED, Judgement

NOISE = 0.05
"""Shares of a time that differ by less may be noise of the machine."""


def by_margin(evidence: Evidence, excess: float) -> str:
    """Return the verdict that a measured share of a time exceeds its limit, by which it does."""
    if abs(excess) < max(NOISE, abs(unexplained(evidence))):
        return UNDECIDED
    return REPRODUCED if excess > 0 else NOT_REPRODUCED


def unexplained(evidence: Evidence) -> float:
    """The share of the coupled plant's time that the dynamics leave of what decoupling saves.

    It is noise where it is not 0: camera and law run the same code with both plants.
    """
    dynamics, total = seconds(evidence, "dynamics"), seconds(evidence, "total")
    put_back = dynamics["coupled"] - dynamics["decoupled"]
    return 1.0 - (total["decoupled"] + put_back) / total["coupled"]


def seconds(evidence: Evidence, part: str) -> dict[str, float]:
    """Time per sampling instant [s] of both plants; part: dynamics, camera, control or total."""
    models = evidence.cost["models"]
    return {model: float(models[model][f"{part}_s"]) for model in PLANTS}


def saving(evidence: Evidence) -> float:
    """The share of the coupled plant's time per sampling instant that decoupling saves."""
    taken = seconds(evidence, "total")
    return 1.0 - taken["decoupled"] / taken["coupled"]


def measured(evidence: Evidence) -> dict[str, float]:
    """Times of both plants by name, as a judgement holds them."""
    parts = {"dynamics": "dynamics", "sampling instant": "total"}
    return {
        f"{name}, {model} [s]": value
        for name, part in parts.items()
        for model, value in seconds(evidence, part).items()
    }


def cheaper(evidence: Evidence) -> Judgement:
    """Return the judgement that the decoupled plant takes less time per sampling instant."""
    taken = {model: 1e6 * value for model, value in seconds(evidence, "total").items()}
    return Judgement(
        by_margin(evidence, saving(evidence)),
        f"in compiled form a sampling instant takes {taken['coupled']:.3g} µs with the coupled "
        f"plant and {taken['decoupled']:.3g} µs with the decoupled one, {told(saving(evidence))}",
        times=measured(evidence),
    )


def told(share: float) -> str:
    """Say how much less, or more, that is."""
    return f"{percent(abs(share))} {'less' if share > 0 else 'more'}"
