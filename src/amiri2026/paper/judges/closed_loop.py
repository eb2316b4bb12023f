"""Judges of the section on visual tracking, IV-C, and of the conclusions about it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from amiri2026.extremes import largest, least
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import goals, letter
from amiri2026.paper.judges.loops import (
    ALIGNED,
    GRAVITY,
    OFF,
    OURS,
    PRINTED_G,
    Loop,
    fly,
    over_loops,
    reading,
    rms,
)
from amiri2026.paper.judges.settled import if_settled
from amiri2026.paper.judges.strokes import kinds_of_stroke
from amiri2026.paper.judges.times import cost_case, simulink_times
from amiri2026.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from amiri2026.sensitivity.findings import STRONG, listed, rank_correlation
from amiri2026.tracking.study import CONVERGED, PRINTED, ds_extremes, rms_by_corner
from amiri2026.verdicts import Case, Judgement, judged, over_cases
from continuair.analysis import TRANSIENT, feature_norm, norm_difference, percent, samples
from continuair.kernels import PLANTS
from continuair.scenario import LETTERS, SETTINGS

Array = np.ndarray


def one_law(evidence: Evidence) -> Judgement:
    """Judge IV-C.2: is the law the same in both cases, and DS no error of the integration?"""
    pushes = [samples(letter.flown(evidence, plant), "command", "actuator")[0] for plant in PLANTS]
    apart = np.abs(pushes[0] - pushes[1]).max() / np.abs(pushes[0]).max()
    ds = norm_difference(*_both(evidence))
    by_tolerance, by_period = (
        rms(norm_difference(*flights) - ds) / rms(ds)
        for flights in (
            [letter.finer(evidence, plant, "feature_error") for plant in PLANTS],
            [letter.fly(evidence, plant, 5e-4, variables=["feature_error"]) for plant in PLANTS],
        )
    )
    view = judged(
        bool(apart < 1e-9 and by_tolerance < NEGLIGIBLE),
        f"from one state the law gives both plants "
        f"{'the same wrench' if apart < 1e-9 else f'wrenches that differ by {percent(apart)}'}. "
        f"Along letter M, DS is {rms(ds):.3g} px RMS. A tenth of the tolerance changes DS by "
        f"{'less than 0.1 %' if by_tolerance < 1e-3 else percent(by_tolerance)}, half the control "
        f"period of 1 ms by {percent(by_period)}",
        **{
            "RMS of DS, M [px]": rms(ds),
            "change of DS at half the control period": by_period,
        },
    )
    return _of_letter(evidence, view)


def states_and_jacobians(evidence: Evidence) -> Judgement:
    """Judge IV-C.3: do accelerations at one state, and states and J_L along the flights, differ?"""
    start = letter.flown(evidence, "coupled").isel(time=0)
    a, b = (letter.first_acceleration(evidence.vehicle, start, plant) for plant in PLANTS)
    names = ("q", "features", "depth", "camera_attitude")
    finer = [letter.finer(evidence, plant, *names) for plant in PLANTS]
    found = {}
    for name, of in {"position": _position, "J_L": letter.image_slopes}.items():
        whole = [of(flight, evidence.vehicle) for flight in _both(evidence)]
        better = [of(flight, evidence.vehicle) for flight in finer]
        errors = [rms(one - other) for one, other in zip(whole, better, strict=True)]
        found[name] = rms(whole[0] - whole[1]), largest(errors), rms(whole[0])
    (moved, off, _), (turned, off_slope, size) = found.values()
    times = least([moved / off, turned / off_slope])
    view = judged(
        bool(
            np.linalg.norm(a - b) > 1e-9 * np.linalg.norm(a) and moved > off and turned > off_slope
        ),
        f"at the start of letter M, one wrench accelerates the UAV by {np.linalg.norm(a):.3g} m/s² "
        f"in the coupled model and {np.linalg.norm(b):.3g} m/s² in the decoupled one. Along the "
        f"flights its positions differ by {1e3 * moved:.2g} mm and J_L by {percent(turned / size)} "
        f"(RMS), {'over 1000' if times > 1000 else f'{times:.2g}'} times the change at a tenth of "
        "the tolerance",
        **{
            "first acceleration, coupled [m/s²]": float(np.linalg.norm(a)),
            "first acceleration, decoupled [m/s²]": float(np.linalg.norm(b)),
            "distance of the UAVs, RMS [m]": moved,
            "difference of J_L, share": turned / size,
        },
    )
    return _of_letter(evidence, view)


def kinds_of_segments(_: Evidence) -> Judgement:
    """Judge IV-C.6: are there straight, inclined and curved parts in the letters?"""
    share = kinds_of_stroke(LETTERS)
    told = ", ".join(f"{percent(value)} {name}" for name, value in share.items())
    view = judged(
        min(share.values()) > 0.0,
        f"our letters consist of {told} parts, as shares of their length; the paper prints no path",
        **{f"share of the length, {name}": value for name, value in share.items()},
    )
    return over_cases([Case("any vehicle", "our letters", view)])


def norm_of_rates(evidence: Evidence) -> Judgement:
    """Judge IV-C.10: does the norm of q̇ stand for the speed of the platform?"""
    parts = _rates(letter.flown(evidence, "coupled"))
    norm, speed = np.sqrt(sum(part**2 for part in parts)), parts[0]
    rho = rank_correlation(norm, speed)
    share = float(np.sum(speed**2) / np.sum(norm**2))
    view = judged(
        rho >= STRONG,
        f"along letter M the norm of q̇ has a rank correlation of {rho:.2f} with the UAV's speed. "
        f"Translation of the UAV makes up {percent(share)} of the squared norm, which adds m/s, "
        "rad/s and 1/(m s); bend rates are those of the bend vector, as ψ̇a is undefined for a "
        "straight arm",
        rank_correlation=rho,
        share_of_translation=share,
    )
    return _of_letter(evidence, view)


def _of_letter(evidence: Evidence, view: Judgement) -> Judgement:
    """Return the judgement of a sentence from a view of letter M in the nominal setting."""
    return over_cases([Case(evidence.vehicle.name, reading(evidence, OFF, GRAVITY), view)], OURS)


def turns_and_lines(evidence: Evidence) -> Judgement:
    """Judge IV-C.13: do the plants differ at turns, and hardly along straight parts?"""
    return over_loops(evidence, in_turns, (ALIGNED, GRAVITY), (OFF, PRINTED_G))


def in_turns(loop: Loop) -> Judgement:
    """Return whether DS and the distance of the tips are larger in turns than on lines."""
    ds, tips, later, share = {}, {}, {}, {}
    late = slice(TRANSIENT, None)
    for name in loop.entries:
        pair = [loop.flights.sel(letter=name, model=plant) for plant in PLANTS]
        places = [samples(flight, "tip_position", "axis") for flight in pair]
        distance = np.linalg.norm(places[0] - places[1], axis=1)
        ds[name] = rms_by_corner(pair[0], norm_difference(*pair))
        tips[name] = rms_by_corner(pair[0], distance)
        later[name] = rms_by_corner(pair[0], distance, since=5.0)
        share[name] = ds[name][1] / rms(feature_norm(pair[0].sel(time=late)))
    image, space, settled = (
        {name: bent / straight for name, (bent, straight) in found.items()}
        for found in (ds, tips, later)
    )
    return judged(
        least([*image.values(), *space.values()]) >= PRONOUNCED
        and largest(share.values()) < NEGLIGIBLE,
        f"after the first {TRANSIENT:g} s, DS is {listed(image.values())} times as large in turns "
        f"as on straight parts of {', '.join(image)}. On straight parts it is at most "
        f"{percent(largest(share.values()))} of the norm of the feature error (RMS). The distance "
        f"of the tips is {listed(space.values())} times as large in turns (after the first 5 s "
        f"{listed(settled.values())} times)",
        **{f"DS in turns over straight parts, {name}": each for name, each in image.items()},
        **{f"DS on straight parts, share of the error, {name}": x for name, x in share.items()},
        **{f"tips apart in turns over straight parts, {name}": x for name, x in space.items()},
    )


def largest_ds(evidence: Evidence) -> Judgement:
    """Judge IV-C.14: does DS stay below 0.7 px on all four letters?"""
    undamped = [
        row["ds_max_px_after_2s"]
        for row in evidence.tracking.results["variants"]
        if row["damping_ratio"] == 0.0 and row["variant"].startswith("literal G")
    ]
    without = f"{listed(undamped)} px" if undamped else "not flown"
    note = f"With G as printed and no damping, |DS| after {TRANSIENT:g} s of M is {without}. {OURS}"
    return over_loops(evidence, below_limit, (ALIGNED, GRAVITY), (OFF, PRINTED_G), note=note)


def below_limit(loop: Loop) -> Judgement:
    """Return whether |DS| stays below the printed limit over whole letters."""
    early, late = (
        {name: entry["decoupled"][f"ds_max_px_{part}_2s"] for name, entry in loop.entries.items()}
        for part in ("before", "after")
    )
    return judged(
        largest([*early.values(), *late.values()]) < PRINTED["ds_max_px"],
        f"|DS| is at most {largest(early.values()):.3g} px in the first {TRANSIENT:g} s, and "
        f"{listed(late.values())} px after them on {', '.join(late)}",
        **{f"|DS| before 2 s, {name} [px]": value for name, value in early.items()},
        **{f"|DS| after 2 s, {name} [px]": value for name, value in late.items()},
    )


def negligible_impact(evidence: Evidence) -> Judgement:
    """Judge IV-C.15: are both plants tracked alike, and is the decoupled one cheaper?"""
    real = _off(evidence.tracking.results["settings"]["camera"]["letters"])
    note = (
        "The camera is perfect; with 0.5 px noise, 30 Hz and latency, which the paper does not "
        f"mention, the errors of the plants differ by up to {percent(largest(real.values()))}. "
        f"{OURS}"
    )
    cost = (cost_case(evidence),)
    return over_loops(evidence, tracked_alike, (OFF, PRINTED_G), cases=cost, note=note)


def tracked_alike(loop: Loop) -> Judgement:
    """Return whether feature error and tip error of both plants are the same to a tenth."""
    found = _off(loop.entries)
    return judged(
        largest(found.values()) <= SAME,
        "feature error and tip error of the two plants differ by up to "
        f"{percent(largest(found.values()))} on the four letters",
        **found,
    )


def _off(letters: dict[str, Any]) -> dict[str, float]:
    """Return by how much the errors of the decoupled plant differ from those of the coupled one."""
    keys = {"rms_px": "feature error", "tip_rms_m": "tip error"}
    return {
        f"share by which the {keys[key]} differs, {name}": abs(
            entry["decoupled"][key] / entry["coupled"][key] - 1.0
        )
        for name, entry in letters.items()
        for key in keys
    }


def speed(evidence: Evidence) -> Judgement:
    """Judge IV-C.17: does DS go with the speed of the platform?"""
    coupled, other = _both(evidence)
    ds, moving = np.abs(norm_difference(coupled, other)), _rates(coupled)[0]
    late = coupled["time"].to_numpy() >= TRANSIENT
    rho, settled = rank_correlation(ds, moving), rank_correlation(ds[late], moving[late])
    within = judged(
        rho >= STRONG,
        f"over letter M the rank correlation of |DS| with the UAV's speed is {rho:.2f} (after the "
        f"first {TRANSIENT:g} s {settled:.2f})",
        rank_correlation=rho,
        rank_correlation_after_2_s=settled,
    )
    name, flown = evidence.vehicle.name, reading(evidence, OFF, GRAVITY)
    cases = [Case(name, f"speed within one flight, {flown}", within)]
    if np.isfinite(ds[-1]):
        cases.append(Case(name, f"speed of whole flights, {flown}", faster_letters(evidence)))
    return over_cases(cases, OURS)


def faster_letters(evidence: Evidence) -> Judgement:
    """Return whether DS grows as letters are traced faster; M alone in a quick run."""
    slow = evidence.letter.results["letters"]
    quick = fly(evidence, list(slow), SETTINGS["fast"].duration)
    growth = {}
    for name, entry in slow.items():
        pair = (quick.sel(letter=name, model=plant) for plant in PLANTS)
        growth[name] = ds_extremes(*pair)[1] / entry["decoupled"]["ds_max_px_after_2s"]
    return judged(
        least(growth.values()) >= PRONOUNCED,
        f"letters in {SETTINGS['fast'].duration:g} s instead of {SETTINGS['nominal'].duration:g} s "
        f"raise the largest |DS| after {TRANSIENT:g} s {listed(growth.values())} times on "
        f"{', '.join(growth)}",
        **{f"growth of |DS|, {name}": value for name, value in growth.items()},
    )


def before_convergence(evidence: Evidence) -> Judgement:
    """Judge IV-C.18: is DS larger at speed before convergence, and the coupling too?"""
    coupled, other = _both(evidence)
    moving, time = _rates(coupled)[0], coupled["time"].to_numpy()
    entry = evidence.letter.results["letters"]["M"]
    end = float(np.max([entry[plant]["converged_s"] for plant in PLANTS]))
    chosen = (moving > np.median(moving)) & ~(time >= end)
    ds = norm_difference(coupled, other)
    coupling, own = letter.forces_on_uav(evidence)
    larger, rest = (rms(ds[part]) for part in (chosen, ~chosen))
    share, usual = (rms(coupling[part]) / rms(own[part]) for part in (chosen, ~chosen))
    view = judged(
        bool(larger >= PRONOUNCED * rest and share > usual),
        f"on letter M, DS is {larger:.3g} px RMS where the UAV's speed is above its median "
        f"{_until(end)}, and {rest:.3g} px elsewhere. The coupling force on the UAV is "
        f"{share:.2g} of its own force there, and {usual:.2g} elsewhere",
        **{
            "RMS of DS, fast before convergence [px]": larger,
            "RMS of DS, elsewhere [px]": rest,
            "coupling force over own, fast before convergence": share,
            "coupling force over own, elsewhere": usual,
        },
    )
    return _of_letter(evidence, view)


def _until(end: float) -> str:
    """Return the time of convergence in words [s]; NaN for an error that never stays small."""
    if np.isnan(end):
        return f"(the error never stays below {CONVERGED:g} px)"
    return f"before {end:.2g} s, when the error stays below {CONVERGED:g} px"


def _both(evidence: Evidence) -> list[xr.Dataset]:
    """Return letter M with both plants."""
    return [letter.flown(evidence, plant) for plant in PLANTS]


def _position(flight: xr.Dataset, _: Any) -> Array:
    return samples(flight, "q", "coordinate")[:, :3]


def _rates(flight: xr.Dataset) -> list[Array]:
    """Return norms over time: velocity [m/s], angular velocity [rad/s], bend rate [1/(m s)]."""
    axes = {"velocity": "axis", "angular_velocity": "axis", "bend_rate": "bend_axis"}
    return [np.linalg.norm(samples(flight, name, axis), axis=1) for name, axis in axes.items()]


JUDGES = {
    "IV-C.6": kinds_of_segments,
    "IV-C.16": simulink_times,
} | {
    name: if_settled(judge)
    for name, judge in {
        "IV-C.2": one_law,
        "IV-C.3": states_and_jacobians,
        "IV-C.10": norm_of_rates,
        "IV-C.13": turns_and_lines,
        "IV-C.14": largest_ds,
        "IV-C.15": negligible_impact,
        "IV-C.17": speed,
        "IV-C.18": before_convergence,
        "V.13": goals.tasks_done,
        "V.14": goals.start_and_end,
        "V.15": goals.robust_law,
    }.items()
}
"""Judge of every sentence of this section, and of those of V on the closed loop, by its id."""
