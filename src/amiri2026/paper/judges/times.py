"""Computing times of the plants, and verdicts on them: never within the noise of timing."""

from __future__ import annotations

from amiri2026.cost import ratio, ratio_printed
from amiri2026.paper.evidence import CannotBeFlown, Evidence
from amiri2026.verdicts import (
    FAILS,
    HOLDS,
    UNDECIDED,
    Case,
    Judgement,
    untestable,
)
from continuair.analysis import percent
from continuair.kernels import PLANTS

NOISE = 0.05
"""Shares of a time that differ by less may be noise of the machine."""


def by_margin(evidence: Evidence, excess: float) -> str:
    """Return the verdict that a measured share of a time exceeds its limit, by which it does."""
    if abs(excess) < max(NOISE, abs(unexplained(evidence))):
        return UNDECIDED
    return HOLDS if excess > 0 else FAILS


def unexplained(evidence: Evidence) -> float:
    """Return the part of the saved time that the dynamics do not explain, over the coupled time.

    It is noise if not 0, as camera and law run the same code with both plants.
    """
    dynamics, total = seconds(evidence, "dynamics"), seconds(evidence, "total")
    put_back = dynamics["coupled"] - dynamics["decoupled"]
    return 1.0 - (total["decoupled"] + put_back) / total["coupled"]


def seconds(evidence: Evidence, part: str) -> dict[str, float]:
    """Time per sampling instant [s] of both plants; part: dynamics, camera, control or total."""
    models = evidence.cost["models"]
    return {model: float(models[model][f"{part}_s"]) for model in PLANTS}


def saving(evidence: Evidence) -> float:
    """Return the share of the coupled plant's time per sampling instant that decoupling saves."""
    taken = seconds(evidence, "total")
    return 1.0 - taken["decoupled"] / taken["coupled"]


def measured(evidence: Evidence) -> dict[str, float]:
    """Return times of both plants by name, as stored in a judgement."""
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


def cost_case(evidence: Evidence) -> Case:
    """Return the view of `cheaper` with its vehicle and reading."""
    return Case(evidence.vehicle.name, "cost in compiled form on this machine", cheaper(evidence))


def simulink_times(evidence: Evidence) -> Judgement:
    """Judge IV-C.16: no verdict, but the ratio of both times in this program's compiled form."""
    why = "32 and 22 ms are times of the Simulink Profiler, which cannot be taken here"
    try:
        ours = ratio(evidence.cost["models"])
    except CannotBeFlown as reason:
        return untestable(f"{why}; {reason}")
    assert ours is not None, "both plants are timed"
    return untestable(
        f"{why}. The printed ratio of decoupled to coupled is {ratio_printed():.2f}. In compiled "
        f"form ours is {ours:.2f}: decoupling changes the dynamics alone, while camera and law "
        "run the same code with both plants",
        **measured(evidence),
    )


def told(share: float) -> str:
    """Return how much less, or more, that is, in words."""
    return f"{percent(abs(share))} {'less' if share > 0 else 'more'}"
