"""Judges of the conclusions on visual tracking, V.13 to V.15."""

from __future__ import annotations

import math

from amiri2026.extremes import largest, least
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.loops import (
    ALIGNED,
    GRAVITY,
    OFF,
    OURS,
    PRINTED_G,
    Loop,
    over_loops,
    rms,
)
from amiri2026.paper.judges.words import PRONOUNCED, SAME
from amiri2026.sensitivity.findings import listed
from amiri2026.verdicts import Judgement, judged
from continuair.analysis import feature_rms, norm_difference, percent
from continuair.kernels import PLANTS

SUBPIXEL = 1.0
"""An error below this is one of less than a pixel [px]."""


def tasks_done(evidence: Evidence) -> Judgement:
    """Judge V.13: does the law complete the task with either plant?"""
    note = f"1 px as success is our reading. {OURS}"
    return over_loops(evidence, completed, (OFF, PRINTED_G), note=note)


def completed(loop: Loop) -> Judgement:
    """Return whether all letters are tracked to less than a pixel with every point in view."""
    flights = [entry[plant] for entry in loop.entries.values() for plant in PLANTS]
    if loop.ended:
        first = least(flight["end_time_s"] for flight in loop.ended)
        return judged(
            False,
            f"{len(loop.ended)} of {len(flights)} flights, of the four letters with both plants, "
            f"stop early, the first after {first:.3g} s",
            flights_that_end_early=float(len(loop.ended)),
        )
    worst = {plant: _worst(loop, plant) for plant in PLANTS}
    lost = sum(flight["out_of_view_samples"] for flight in flights)
    return judged(
        lost == 0 and largest(worst.values()) < SUBPIXEL,
        f"the RMS feature error after 5 s is at most {worst['coupled']:.2g} px with the coupled "
        f"plant and {worst['decoupled']:.2g} px with the decoupled one on the four letters. "
        f"Points are out of view in {lost} samples",
        **{f"largest RMS feature error, {plant} [px]": value for plant, value in worst.items()},
        samples_out_of_view=float(lost),
    )


def start_and_end(evidence: Evidence) -> Judgement:
    """Judge V.14: do the plants differ at the start, and track alike at the end?"""
    return over_loops(evidence, alike_at_the_end, (ALIGNED, GRAVITY), (OFF, PRINTED_G))


def alike_at_the_end(loop: Loop) -> Judgement:
    """Return whether DS is larger in the first tenth, and the errors of the last tenth alike."""
    tenth = loop.flights["time"].to_numpy()[-1] / 10.0
    parts = slice(0.0, tenth), slice(9.0 * tenth, None)
    ds, off = {}, {}
    for name in loop.entries:
        pair = [loop.flights.sel(letter=name, model=plant) for plant in PLANTS]
        ds[name] = [rms(norm_difference(*(each.sel(time=part) for each in pair))) for part in parts]
        errors = [float(feature_rms(each.sel(time=parts[1]))) for each in pair]
        off[name] = abs(errors[1] / errors[0] - 1.0)
    return judged(
        all(start >= PRONOUNCED * end for start, end in ds.values())
        and largest(off.values()) <= SAME,
        f"DS is {listed([start for start, _ in ds.values()])} px RMS in the first tenth of "
        f"{', '.join(ds)} and {listed([end for _, end in ds.values()])} px in the last. The "
        f"feature errors of the last tenth differ by up to {percent(largest(off.values()))}",
        **{f"RMS of DS in the first tenth, {name} [px]": each for name, (each, _) in ds.items()},
        **{f"RMS of DS in the last tenth, {name} [px]": each for name, (_, each) in ds.items()},
        **{f"share by which the last errors differ, {name}": each for name, each in off.items()},
    )


def robust_law(evidence: Evidence) -> Judgement:
    """Judge V.15: does the law make up for a simplified model?"""
    letters = evidence.tracking.results["letters"]
    frozen = largest(entry["independent"]["rms_px"] for entry in letters.values())
    kept = "does not come to the end" if math.isnan(frozen) else f"keeps {frozen:.2g} px"
    note = (
        "The law needs weight and kinematics alone, which decoupling does not change, so the law "
        "with the decoupled model is the same law. On a plant with a frozen payload, which is not "
        f"in the paper, it {kept} without an integral term. {OURS}"
    )
    return over_loops(evidence, small_errors, (OFF, PRINTED_G), note=note)


def small_errors(loop: Loop) -> Judgement:
    """Return whether the feature error is below a pixel with both plants."""
    worst = {plant: _worst(loop, plant) for plant in PLANTS}
    return judged(
        largest(worst.values()) < SUBPIXEL,
        "the RMS feature error after 5 s on the four letters is at most "
        f"{worst['decoupled']:.2g} px on the decoupled plant and {worst['coupled']:.2g} px on the "
        "coupled one",
        **{f"largest RMS feature error, {plant} [px]": value for plant, value in worst.items()},
    )


def _worst(loop: Loop, plant: str) -> float:
    return largest(entry[plant]["rms_px"] for entry in loop.entries.values())
