"""Conclusions of the atlas of controlled vehicles: claims with verdicts, and their numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from continuair.analysis.shares import percent
from continuair.studies.atlas.explaining import DECIDES
from continuair.studies.tables import number_below

YES, NO, UNKNOWN = "yes", "no", "unknown"
"""Unknown: where limits beyond the frequencies that were flown would decide."""

HELD = ("moment", "bend", "tip")
"""Loads against which a loop holds the UAV."""

TRUE, USELESS = 0.1, 0.1
"""Share of a rule's answers that flights may refute, and share of the flights that could be
decoupled below which a rule is of no use."""

NAMES = {
    "gravity_number": "gravity number",
    "bandwidth": "bandwidth",
    "mass_ratio": "mass ratio",
    "inertia_ratio": "inertia ratio",
    "damping_ratio": "damping ratio",
    "slenderness": "slenderness",
}


@dataclass(frozen=True)
class Answer:
    """A claim, whether it holds, and its evidence."""

    claim: str
    verdict: str
    evidence: str


def answers(summary: xr.Dataset) -> list[Answer]:
    """Return the claims that were tried, with verdicts."""
    return [_fast(summary), _slow(summary), _pushed(summary), _two(summary), _third(summary),
            _both(summary), _useful(summary), _true(summary)]  # fmt: skip


def _fast(summary: xr.Dataset) -> Answer:
    none, loop = medians(summary, "soft, fast")
    return Answer(
        "A fast loop on a soft arm at least doubles the frequency up to which decoupling is fine, "
        f"of {_loads(HELD)}",
        _together(_at_least(summary, loop[name], none[name], 2.0) for name in HELD),
        _compared(summary, "soft, fast", HELD),
    )


def _slow(summary: xr.Dataset) -> Answer:
    none, loop = medians(summary, "soft, slow")
    return Answer(
        f"A slow loop on a soft arm is worse than none, for {_loads(HELD)}",
        _together(_not(_at_least(summary, loop[name], none[name])) for name in HELD),
        _compared(summary, "soft, slow", HELD),
    )


def _pushed(summary: xr.Dataset) -> Answer:
    both = {kind: medians(summary, kind) for kind in summary["kind"].to_numpy()}
    held = [_at_least(summary, none["force"], loop["force"]) for none, loop in both.values()]
    return Answer(
        "Where a force pushes the UAV sideways, a loop does not help",
        # Kinds whose limits are both below all frequencies do not decide; others do.
        _together([each for each in held if each is not None] or held),
        "; ".join(_compared(summary, str(kind), ("force",)) for kind in both),
    )


def medians(summary: xr.Dataset, kind: str) -> tuple[dict[str, float], dict[str, float]]:
    """Return the median limit of each load without a loop, and in one."""
    names = [str(name) for name in summary["excitation"].to_numpy()]
    of = summary["kind_limit"].sel(kind=kind)
    none, loop = (of.sel(loop=name).to_numpy() for name in ("none", "position"))
    return dict(zip(names, none, strict=True)), dict(zip(names, loop, strict=True))


def _compared(summary: xr.Dataset, kind: str, loads: Sequence[str]) -> str:
    none, loop = medians(summary, kind)
    both = {name: [printed_limit(summary, of[name]) for of in (none, loop)] for name in loads}
    told = [f"{name} {before} without, {after} with it" for name, (before, after) in both.items()]
    return f"{kind}: {', '.join(told)}"


def printed_limit(summary: xr.Dataset, limit: float) -> str:
    """Return a limit over the clamped frequency as texts print it; 0 is none, infinity all."""
    first, last = (float(summary["frequency"][place]) for place in (0, -1))
    if not limit >= first:
        return f"below {first:g}"
    return number_below(limit) if limit <= last else f"above {last:g}"


def _loads(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _at_least(summary: xr.Dataset, limit: float, other: float, times: float = 1.0) -> bool | None:
    """Return whether a limit is at least so many times another; None if undetermined."""
    (least, most), (fewest, largest) = _within(summary, limit), _within(summary, other)
    if least >= times * largest:
        return True
    return False if most < times * fewest else None


def _within(summary: xr.Dataset, limit: float) -> tuple[float, float]:
    """Return the interval of a limit: 0 is below all frequencies, infinity above."""
    first, last = (float(summary["frequency"][place]) for place in (0, -1))
    if limit < first:
        return 0.0, first
    return (last, np.inf) if limit > last else (limit, limit)


def _not(held: bool | None) -> bool | None:
    return None if held is None else not held


def _together(held: Iterable[bool | None]) -> str:
    """Return the verdict on a claim with several parts."""
    found = list(held)
    if False in found:
        return NO
    return UNKNOWN if None in found else YES


def _two(summary: xr.Dataset) -> Answer:
    shares = _explained(summary, "position", "")
    return Answer(
        "Frequency and coupling decide in a position loop, too",
        _verdict(bool((shares >= DECIDES).all())),
        f"of the variance of the error's logarithm they explain {_each(summary, shares)}; without "
        f"a loop {_each(summary, _explained(summary, 'none', ''))}",
    )


def _third(summary: xr.Dataset) -> Answer:
    best = {loop: _best(summary, loop) for loop in ("position", "none")}
    shares = {loop: _explained(summary, loop, name) for loop, name in best.items()}
    return Answer(
        "A third number makes up for it",
        _verdict(bool((shares["position"] >= DECIDES).all())),
        f"the {NAMES[best['position']]} is the best one, with {_each(summary, shares['position'])}"
        f"; without a loop it is the {NAMES[best['none']]}, with {_each(summary, shares['none'])}",
    )


def _both(summary: xr.Dataset) -> Answer:
    one, more = (
        _explained(summary, "position", name)
        for name in ("gravity_number bandwidth", "gravity_number bandwidth mass_ratio")
    )
    return Answer(
        "Gravity number and the loop's bandwidth together do",
        _verdict(bool((one >= DECIDES).all())),
        f"with both {_each(summary, one)}; with the mass ratio {_each(summary, more)}",
    )


def _useful(summary: xr.Dataset) -> Answer:
    tolerance = float(summary["accepted"][0])
    kept = summary["kept"].sel(loop="position").isel(accepted=0)
    two, every = (kept.sel(numbers=name).to_numpy() for name in ("two", "all"))
    return Answer(
        "A rule of two numbers that is as careful is of no use in a loop",
        _verdict(bool((two <= USELESS).all())),
        f"at a tolerance of {percent(tolerance)} it allows {_each(summary, two)} of the flights "
        f"that can be decoupled, the rule of all five {_each(summary, every)}",
    )


def _true(summary: xr.Dataset) -> Answer:
    shares = summary["refuted"] / np.maximum(summary["answers"], 1)
    told = []
    for tolerance in summary["accepted"].to_numpy():
        wrong, of = (summary[name].sel(accepted=tolerance) for name in ("refuted", "answers"))
        counts = [
            f"{load} {int(wrong.sel(excitation=load))} of {int(of.sel(excitation=load))}"
            for load in summary["excitation"].to_numpy()
        ]
        told.append(f"at {percent(float(tolerance))} {', '.join(counts)}")
    return Answer(
        "Limits of that rule stay true for nine of ten vehicles that it has not seen",
        _verdict(bool((shares <= TRUE).all())),
        "flown at the rule's own limit and below, these go beyond the tolerance: "
        + "; ".join(told),
    )


def _verdict(holds: bool) -> str:
    return YES if holds else NO


def _best(summary: xr.Dataset, loop: str) -> str:
    """Return the number that explains most besides frequency and coupling, for the worst load."""
    single = {name: _explained(summary, loop, name).min() for name in NAMES}
    return max(single, key=lambda name: float(single[name]))


def _explained(summary: xr.Dataset, loop: str, besides: str) -> np.ndarray:
    return np.asarray(summary["explained"].sel(loop=loop, besides=besides).to_numpy())


def _each(summary: xr.Dataset, shares: np.ndarray) -> str:
    """Return shares of all excitations, with their names."""
    names = summary["excitation"].to_numpy()
    told = [
        f"{round(100 * max(share, 0.0))} % ({name})"
        for name, share in zip(names, shares, strict=True)
    ]
    return f"{', '.join(told[:-1])} and {told[-1]}"
