"""Judges of the section on visual tracking, IV-C, and of what the conclusions say of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.metrics import (
    TRANSIENT,
    feature_norm,
    feature_rms,
    norm_difference,
    samples,
)
from continuair.analysis.shares import percent
from continuair.kernels.dynamics import PLANTS
from continuair.kernels.step import OK
from continuair.scenario.letters import LETTERS
from continuair.studies.cost import ratio, ratio_printed
from continuair.studies.extremes import largest, least
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import letter
from continuair.studies.paper.judges.settled import if_settled
from continuair.studies.paper.judges.strokes import kinds_of_stroke
from continuair.studies.paper.judges.times import by_margin, cheaper, measured
from continuair.studies.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from continuair.studies.sensitivity.findings import STRONG, listed, rank_correlation
from continuair.studies.tracking.study import CONVERGED, PRINTED, rms_by_corner
from continuair.studies.verdicts import Judgement, all_of, judged

Array = np.ndarray

SUBPIXEL = 1.0
"""An error below this is one of less than a pixel [px]."""

OURS = "camera, start and gains are ours, as the paper prints none"


def one_law(evidence: Evidence) -> Judgement:
    """IV-C.2: is the law the same in both cases, and DS no matter of the step?"""
    pushes = [samples(letter.flown(evidence, plant), "command", "actuator")[0] for plant in PLANTS]
    apart = np.abs(pushes[0] - pushes[1]).max() / np.abs(pushes[0]).max()
    ds = norm_difference(*_both(evidence))
    by_step, by_period = (
        rms(norm_difference(*flights) - ds) / rms(ds)
        for flights in (
            [letter.halved(evidence, plant, "feature_error") for plant in PLANTS],
            [letter.fly(evidence, plant, 5e-4, variables=["feature_error"]) for plant in PLANTS],
        )
    )
    return judged(
        bool(apart < 1e-9 and by_step < NEGLIGIBLE),
        f"from one state the law's pushes on both plants "
        f"{'are the same' if apart < 1e-9 else f'differ by {percent(apart)}'}. Along letter M "
        f"DS is {rms(ds):.3g} px RMS, of which half the step changes "
        f"{'less than 0.1 %' if by_step < 1e-3 else percent(by_step)} and half the control "
        f"period of 1 ms {percent(by_period)}",
        **{
            "RMS of DS, M [px]": rms(ds),
            "change of DS at half the control period": by_period,
        },
    )


def states_and_jacobians(evidence: Evidence) -> Judgement:
    """IV-C.3: do accelerations at one state, and states and J_L along the flights, differ?"""
    start = letter.flown(evidence, "coupled").isel(time=0)
    a, b = (letter.first_acceleration(evidence.vehicle, start, plant) for plant in PLANTS)
    names = ("q", "features", "depth", "camera_attitude")
    finer = [letter.halved(evidence, plant, *names) for plant in PLANTS]
    found = {}
    for name, of in {"position": _position, "J_L": letter.image_slopes}.items():
        whole = [of(flight, evidence.vehicle) for flight in _both(evidence)]
        halves = [of(flight, evidence.vehicle) for flight in finer]
        steps = [rms(one - half) for one, half in zip(whole, halves, strict=True)]
        found[name] = rms(whole[0] - whole[1]), largest(steps), rms(whole[0])
    (moved, of_step, _), (turned, of_slope, size) = found.values()
    times = least([moved / of_step, turned / of_slope])
    return judged(
        bool(
            np.linalg.norm(a - b) > 1e-9 * np.linalg.norm(a)
            and moved > of_step
            and turned > of_slope
        ),
        f"at the start of letter M one push accelerates the UAV by {np.linalg.norm(a):.3g} m/s² "
        f"if coupled and {np.linalg.norm(b):.3g} m/s² if decoupled. Along the flights its "
        f"positions are {1e3 * moved:.2g} mm apart and J_L by {percent(turned / size)} (RMS), "
        f"{'over 1000' if times > 1000 else f'{times:.2g}'} times what half the step changes",
        **{
            "first acceleration, coupled [m/s²]": float(np.linalg.norm(a)),
            "first acceleration, decoupled [m/s²]": float(np.linalg.norm(b)),
            "distance of the UAVs, RMS [m]": moved,
            "difference of J_L, share": turned / size,
        },
    )


def kinds_of_segments(_: Evidence) -> Judgement:
    """IV-C.6: are there straight, inclined and curved parts in the letters?"""
    share = kinds_of_stroke(LETTERS)
    told = ", ".join(f"{percent(value)} {name}" for name, value in share.items())
    return judged(
        min(share.values()) > 0.0,
        f"of the length of our four letters {told}; the paper prints no path",
        **{f"share of the length, {name}": value for name, value in share.items()},
    )


def norm_of_rates(evidence: Evidence) -> Judgement:
    """IV-C.10: does the norm of q̇ stand for the speed of the platform?"""
    parts = _rates(letter.flown(evidence, "coupled"))
    norm, speed = np.sqrt(sum(part**2 for part in parts)), parts[0]
    rho = rank_correlation(norm, speed)
    share = float(np.sum(speed**2) / np.sum(norm**2))
    return judged(
        rho >= STRONG,
        "along letter M the norm, which adds m/s, rad/s and 1/(m s), has a rank correlation of "
        f"{rho:.2f} with the UAV's speed; the UAV's translation makes up {percent(share)} of the "
        "squared norm (the bend's rate as a vector, as ψ̇a of a straight arm has no value)",
        rank_correlation=rho,
        share_of_translation=share,
    )


def turns_and_lines(evidence: Evidence) -> Judgement:
    """IV-C.13: do the plants differ at turns, and hardly along straight parts?"""
    flights, ds, tips, later, share = evidence.tracking.datasets["nominal"], {}, {}, {}, {}
    late = slice(TRANSIENT, None)
    for name in _letters(evidence):
        pair = [flights.sel(letter=name, model=plant) for plant in PLANTS]
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
    return all_of(
        [
            judged(
                least(image.values()) >= PRONOUNCED and largest(share.values()) < NEGLIGIBLE,
                f"without the first 2 s, of which V.14 speaks, DS is {_each(image)} times as large "
                f"in turns as on straight parts of {', '.join(image)}, where it is at most "
                f"{percent(largest(share.values()))} of the norm of the feature error (RMS)",
                **{f"RMS of DS in turns, {name} [px]": each for name, (each, _) in ds.items()},
                **{f"RMS of DS on straight parts, {name} [px]": x for name, (_, x) in ds.items()},
            ),
            judged(
                least(space.values()) >= PRONOUNCED,
                f"the distance of the tips is {_each(space)} times as large there (without the "
                f"first 5 s, {_each(settled)} times)",
                **{f"tips apart in turns, {name} [m]": each for name, (each, _) in tips.items()},
                **{f"tips apart on straight parts, {name} [m]": x for name, (_, x) in tips.items()},
            ),
        ]
    )


def _each(ratios: dict[str, float]) -> str:
    return ", ".join(f"{ratio:.2g}" for ratio in ratios.values())


def largest_ds(evidence: Evidence) -> Judgement:
    """IV-C.14: does DS stay below 0.7 px on all four letters?"""
    limit = PRINTED["ds_max_px"]
    early, late = (
        {name: entry["decoupled"][f"ds_max_px_{part}_2s"] for name, entry in found.items()}
        for found in [_letters(evidence)]
        for part in ("before", "after")
    )
    return judged(
        largest([*early.values(), *late.values()]) < limit,
        f"|DS| is at most {listed(early.values())} px in the first {TRANSIENT:g} s of "
        f"{', '.join(early)}, and {listed(late.values())} px after; {OURS}",
        **{f"|DS| before 2 s, {name} [px]": value for name, value in early.items()},
        **{f"|DS| after 2 s, {name} [px]": value for name, value in late.items()},
    )


def negligible_impact(evidence: Evidence) -> Judgement:
    """IV-C.15: are both plants tracked alike, and is the decoupled one cheaper?"""
    perfect = _off(_letters(evidence))
    real = _off(evidence.tracking.results["settings"]["camera"]["letters"])
    alike = judged(
        largest(perfect.values()) <= SAME,
        "with a perfect camera feature error and tip error of the plants differ by up to "
        f"{percent(largest(perfect.values()))} on the four letters (with 0.5 px noise, 30 Hz and "
        f"latency, of which the paper says nothing, by up to {percent(largest(real.values()))})",
        **{f"{name}, perfect camera": value for name, value in perfect.items()},
    )
    return all_of([alike, cheaper(evidence)])


def _off(letters: dict[str, Any]) -> dict[str, float]:
    """By how much the errors of the decoupled plant differ from those of the coupled one."""
    keys = {"rms_px": "feature error", "tip_rms_m": "tip error"}
    return {
        f"share by which the {keys[key]} differs, {name}": abs(
            entry["decoupled"][key] / entry["coupled"][key] - 1.0
        )
        for name, entry in letters.items()
        for key in keys
    }


def sampling_instants(evidence: Evidence) -> Judgement:
    """IV-C.16: is the ratio of the two times 22/32?"""
    ours, printed = ratio(evidence.cost["models"]), ratio_printed()
    assert ours is not None, "both plants are timed"
    return Judgement(
        by_margin(evidence, SAME - abs(ours / printed - 1.0)),
        f"in compiled form the decoupled plant takes {ours:.2f} of the coupled one's time per "
        f"sampling instant, the paper's 22/32 being {printed:.2f}: decoupling can save "
        "dynamics alone, as camera and law are the same code with both. 32 and 22 ms are "
        "Simulink's, which cannot be taken here",
        times=measured(evidence),
    )


def speed(evidence: Evidence) -> Judgement:
    """IV-C.17: does DS go with the speed of the platform?"""
    coupled, other = _both(evidence)
    ds, moving = np.abs(norm_difference(coupled, other)), _rates(coupled)[0]
    late = coupled["time"].to_numpy() >= TRANSIENT
    rho, settled = rank_correlation(ds, moving), rank_correlation(ds[late], moving[late])
    told, numbers = "", {}
    if not evidence.quick:
        fast = evidence.tracking.results["settings"]["fast"]["letters"]
        key = "ds_max_px_after_2s"
        growth = [fast[name][key] / entry[key] for name, entry in _letters(evidence).items()]
        told = (
            f". Letters in 10 s instead of 50 s, which are ours, raise the largest |DS| after 2 s "
            f"{least(growth):.2g} to {largest(growth):.2g} times"
        )
        numbers = {"growth of |DS| in 10 s, least": least(growth)}
    return judged(
        rho >= STRONG,
        f"over letter M the rank correlation of |DS| with the UAV's speed is {rho:.2f} (without "
        f"the first 2 s {settled:.2f}){told}",
        rank_correlation=rho,
        rank_correlation_after_2_s=settled,
        **numbers,
    )


def before_convergence(evidence: Evidence) -> Judgement:
    """IV-C.18: is DS larger at speed before convergence, and the coupling too?"""
    coupled, other = _both(evidence)
    moving, time = _rates(coupled)[0], coupled["time"].to_numpy()
    entry = evidence.letter.results["letters"]["M"]
    end = float(np.max([entry[plant]["converged_s"] for plant in PLANTS]))
    chosen = (moving > np.median(moving)) & ~(time >= end)
    ds = norm_difference(coupled, other)
    coupling, own = letter.forces_on_uav(evidence)
    larger, rest = (rms(ds[part]) for part in (chosen, ~chosen))
    share, usual = (rms(coupling[part]) / rms(own[part]) for part in (chosen, ~chosen))
    return judged(
        bool(larger >= PRONOUNCED * rest and share > usual),
        f"on letter M DS is {larger:.3g} px RMS where the UAV's speed is above its median "
        f"{_until(end)}, and {rest:.3g} px elsewhere; the coupling's force on the UAV is "
        f"{share:.2g} of its own there, and {usual:.2g} elsewhere",
        **{
            "RMS of DS, fast before convergence [px]": larger,
            "RMS of DS, elsewhere [px]": rest,
            "coupling force over own, fast before convergence": share,
            "coupling force over own, elsewhere": usual,
        },
    )


def _until(end: float) -> str:
    """Say when the error stays small from on [s]; NaN where it never does."""
    if np.isnan(end):
        return f"(the error never stays below {CONVERGED:g} px)"
    return f"before {end:.2g} s, when the error stays below {CONVERGED:g} px"


def tasks_done(evidence: Evidence) -> Judgement:
    """V.13: does the law complete the task with either plant?"""
    flights = [entry[plant] for entry in _letters(evidence).values() for plant in PLANTS]
    ended = [flight for flight in flights if flight["status"] != OK]
    if ended:
        return judged(
            False,
            f"{len(ended)} of {len(flights)} flights, of the four letters with both plants, end "
            f"early, the first after {least(flight['end_time_s'] for flight in ended):.3g} s; "
            f"{OURS}",
            flights_that_end_early=float(len(ended)),
        )
    worst = {plant: _worst(evidence, plant) for plant in PLANTS}
    lost = sum(flight["out_of_view_samples"] for flight in flights)
    return judged(
        lost == 0 and largest(worst.values()) < SUBPIXEL,
        f"on the four letters the RMS feature error after 5 s is at most {worst['coupled']:.2g} px "
        f"with the coupled plant and {worst['decoupled']:.2g} px with the decoupled one, and "
        f"points are out of view in {lost} samples; that 1 px is success is our reading, and "
        f"{OURS}",
        **{f"largest RMS feature error, {plant} [px]": value for plant, value in worst.items()},
        samples_out_of_view=float(lost),
    )


def start_and_end(evidence: Evidence) -> Judgement:
    """V.14: do the plants differ at the start, and track alike at the end?"""
    flights = evidence.tracking.datasets["nominal"]
    tenth = flights["time"].to_numpy()[-1] / 10.0
    parts = slice(0.0, tenth), slice(9.0 * tenth, None)
    ds, off = {}, {}
    for name in map(str, flights["letter"].to_numpy()):
        pair = [flights.sel(letter=name, model=plant) for plant in PLANTS]
        ds[name] = [rms(norm_difference(*(each.sel(time=part) for each in pair))) for part in parts]
        errors = [float(feature_rms(each.sel(time=parts[1]))) for each in pair]
        off[name] = abs(errors[1] / errors[0] - 1.0)
    return judged(
        all(start >= PRONOUNCED * end for start, end in ds.values())
        and largest(off.values()) <= SAME,
        f"DS is {listed([start for start, _ in ds.values()])} px RMS in the first tenth of "
        f"{', '.join(ds)} and {listed([end for _, end in ds.values()])} px in the last, where the "
        f"feature errors differ by up to {percent(largest(off.values()))}; {OURS}",
        **{f"RMS of DS in the first tenth, {name} [px]": each for name, (each, _) in ds.items()},
        **{f"RMS of DS in the last tenth, {name} [px]": each for name, (_, each) in ds.items()},
        **{f"share by which the last errors differ, {name}": each for name, each in off.items()},
    )


def robust_law(evidence: Evidence) -> Judgement:
    """V.15: does the law make up for a simplified model?"""
    worst = {model: _worst(evidence, model) for model in (*PLANTS, "independent")}
    frozen = f"keeps {worst['independent']:.2g} px"
    if math.isnan(worst["independent"]):
        frozen = "does not come to the end of all letters"
        del worst["independent"]
    return judged(
        largest(worst[plant] for plant in PLANTS) < SUBPIXEL,
        "the RMS feature error after 5 s on the four letters is at most "
        f"{worst['decoupled']:.2g} px on the decoupled plant. The law holds weight and kinematics, "
        "which decoupling leaves as they are, so with the decoupled model it is the same: "
        f"{worst['coupled']:.2g} px on the coupled plant. A plant with a frozen payload, which "
        f"the paper does not have, {frozen}, as the law does not integrate",
        **{f"largest RMS feature error, {model} [px]": value for model, value in worst.items()},
    )


def rms(values: Array) -> float:
    """Root mean square over samples of the length of what there is at each."""
    squares = np.asarray(values, float) ** 2
    return float(np.sqrt(squares.sum() / len(squares)))


def _both(evidence: Evidence) -> list[xr.Dataset]:
    """Letter M with both plants."""
    return [letter.flown(evidence, plant) for plant in PLANTS]


def _letters(evidence: Evidence) -> dict[str, Any]:
    """What the study found of each letter in the nominal setting."""
    found: dict[str, Any] = evidence.tracking.results["letters"]
    return found


def _worst(evidence: Evidence, model: str) -> float:
    return largest(entry[model]["rms_px"] for entry in _letters(evidence).values())


def _position(flight: xr.Dataset, _: Any) -> Array:
    return samples(flight, "q", "coordinate")[:, :3]


def _rates(flight: xr.Dataset) -> list[Array]:
    """Norms over time of velocity [m/s], angular velocity [rad/s] and bend rate [1/(m s)]."""
    axes = {"velocity": "axis", "angular_velocity": "axis", "bend_rate": "bend_axis"}
    return [np.linalg.norm(samples(flight, name, axis), axis=1) for name, axis in axes.items()]


JUDGES = {
    "IV-C.6": kinds_of_segments,
    "IV-C.16": sampling_instants,
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
        "V.13": tasks_done,
        "V.14": start_and_end,
        "V.15": robust_law,
    }.items()
}
"""Judge of every sentence of this section, and of those of V on the closed loop, by its id."""
