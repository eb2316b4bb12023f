"""The closed-loop study: letters tracked by one law on the coupled and on the simpler plants."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.tracking.largest import (
    ds_extremes,
    largest_coordinate,
    largest_norm,
    largest_off_target,
    largest_servo_error,
    off_target,
)
from continuair import MODELS, Gains, Scenario, Vehicle, checks, load_gains, lyapunov, simulate
from continuair.analysis import (
    NEEDED,
    TRANSIENT,
    Flown,
    Lyapunov,
    compared_models,
    feature_norm,
    feature_rms,
    norm_difference,
    other_powers,
    samples,
    ultimate_bound,
)
from continuair.kernels import REFERENCE, UNSEEN
from continuair.progress import Progress, Steps
from continuair.scenario import LETTERS, SETTINGS, chosen_letters, equipped, task
from continuair.studies import by_model
from continuair.typing import Model
from continuair.vehicle import check_has_arms, check_single_vehicle, is_paper
from continuair.warning import untold

PRINTED = {"ds_max_px": 0.7}
"""What Amiri et al. print of the closed loop: |DS| stays below it "across all four" letters."""

CONVERGED = 5.0
"""A run has converged once the norm of its feature error stays below this [px]."""

_STAYS = 0.02
"""Least share of the flight spent below: an oscillation may end below by chance."""

_TURNING = 0.05
"""Share of its largest acceleration above which the target counts as turning."""

SAMPLE = 1e-2
"""Time between samples [s]."""

_VARIABLES = tuple(
    dict.fromkeys(("target_position", "camera_position", "tip_position", "q", *NEEDED))
)


@dataclass(frozen=True)
class Tracking:
    """Results of the study.

    results: JSON-able; results["letters"][letter][model] holds the metrics of the first setting,
    the nominal one by default, results["settings"][setting] the same of every other one. datasets:
    setting -> trajectories, leading dimensions `model` and `letter`.
    """

    results: dict[str, Any]
    datasets: dict[str, xr.Dataset]


def tracking(
    vehicle: Vehicle,
    letters: str = "".join(LETTERS),
    gains: Gains | None = None,
    models: Iterable[str] = MODELS,
    settings: Iterable[str] = tuple(SETTINGS),
    *,
    progress: Progress | None = None,
) -> Tracking:
    """Track letters in every setting with each model as the plant, under one law.

    Of a vehicle with [[arm]] the camera is at the tip of the arm that `camera.arm` names, whose
    sections all start with the bend of the paper's one (our choice); other arms start straight. The
    paper's proof is of one section: what it says is left out there.

    gains: of `load_gains`, the preset `paper` by default. models: `coupled` is added as the
    reference. progress: called with (done, total, what) before each batch. Raises InputError, also
    for a vehicle without an arm.
    """
    check_has_arms(check_single_vehicle(vehicle))
    written, plants = chosen_letters(letters), compared_models(models)
    names = checks.choices("settings", settings, SETTINGS)
    gains = gains or load_gains("paper")
    steps = Steps(progress, len(names) * len(plants))
    found: dict[str, Any] = {}
    datasets = {}
    for name in names:
        runs, found[name] = _fly(name, vehicle, written, gains, plants, steps)
        datasets[name] = by_model(runs)
    first = names[0]
    results = {
        "study": "tracking",
        "vehicle": vehicle.describe(),
        "gains": {"name": gains.name, **gains.settings},
        "reference": REFERENCE,
        "printed": PRINTED if is_paper(vehicle) and "decoupled" in plants else {},
        "setting": first,
        **found[first],
        "settings": {name: found[name] for name in names[1:]},
    }
    return Tracking(results, datasets)


@untold("error_estimate")
def _fly(
    name: str,
    vehicle: Vehicle,
    letters: list[str],
    gains: Gains,
    plants: Sequence[Model],
    steps: Steps,
) -> tuple[Flown, dict[str, Any]]:
    """Return trajectories of one setting over (letter, time), and their metrics."""
    setting = SETTINGS[name]
    flown = equipped(vehicle, setting)
    controller = gains.controller(flown)
    scenario = task(flown, letters, controller, setting.duration)
    runs = Flown()
    proofs: dict[str, Lyapunov] = {}
    # The statements on stability are of the paper's one section.
    proven = gains.as_printed and not other_powers(flown) and not vehicle.has_arm_list
    for model in plants:
        steps.begin(f"{name}, {model}")
        data = simulate(
            flown,
            scenario,
            model=model,
            sample=SAMPLE,
            variables=_VARIABLES,
            check=True,
        )
        if proven:
            proofs[model] = lyapunov(flown, scenario, data)
            data = data.merge(proofs[model].over_time)
        runs[model] = data.rename(run="letter").assign_coords(letter=letters)
    return runs, {
        "setting_meaning": setting.meaning,
        "settled_s": setting.settled,
        "duration_s": setting.duration,
        "damping_ratio": _damping_ratio(flown),
        "letters": {letter: _entry(letter, runs, setting.settled) for letter in letters},
        **(_stability(scenario, proofs[REFERENCE], runs, setting.settled) if proven else {}),
    }


def _damping_ratio(vehicle: Vehicle) -> Any:
    """The damping ratio that the file gives a section; None where it gives a damping. Of [[arm]]
    one for each section, as lists by arm."""
    if not vehicle.has_arm_list:
        return vehicle.arm.damping_ratio
    return {arm.name: [each.damping_ratio for each in arm.section] for arm in vehicle.arms}


def _stability(scenario: Scenario, proof: Lyapunov, runs: Flown, settled: float) -> dict[str, Any]:
    """Return bound of the paper's proof, which is of constant gains, for all letters and for each,
    and which conditions hold."""
    letters = [str(letter) for letter in runs[REFERENCE]["letter"].to_numpy()]
    each = {
        letter: ultimate_bound(scenario, run)["radius_least"] for run, letter in enumerate(letters)
    }
    reached = {
        letter: largest_servo_error(runs[REFERENCE].sel(letter=letter), settled)
        for letter in letters
    }
    lasting = [value for value in reached.values() if np.isfinite(value)]
    found = {"reached": max(lasting, default=np.nan), "reached_of": reached}
    found |= {"radius_least_of": each}
    return {
        "ultimate_bound": proof.bound | found,
        "conditions": {
            statement: [asdict(each) for each in conditions]
            for statement, conditions in proof.conditions.items()
        },
    }


def _entry(letter: str, runs: Flown, settled: float) -> dict[str, Any]:
    """Return metrics of one letter by model, and the largest |DS| of the decoupled plant."""
    flights = {model: data.sel(letter=letter) for model, data in runs.items()}
    entry: dict[str, Any] = {}
    for model, flight in flights.items():
        entry[model] = metrics(flight, settled)
        if model != REFERENCE:
            entry[model] |= _difference(flights[REFERENCE], flight)
    of_decoupled = entry.get("decoupled", {})
    for key in ("ds_max_px_before_2s", "ds_max_px_after_2s"):
        if key in of_decoupled:
            entry[key] = of_decoupled[key]
    return entry


def _difference(coupled: xr.Dataset, other: xr.Dataset) -> dict[str, float]:
    early, late = ds_extremes(coupled, other)
    corners, straight = ds_by_corner(coupled, other)
    return {
        "ds_max_px_before_2s": early,
        "ds_max_px_after_2s": late,
        "ds_rms_px_corners": corners,
        "ds_rms_px_straight": straight,
    }


def ds_by_corner(coupled: xr.Dataset, other: xr.Dataset) -> tuple[float, float]:
    """Return RMS of DS after the transient where the target turns, and where it does not [px]."""
    return rms_by_corner(coupled, norm_difference(coupled, other))


def rms_by_corner(
    flight: xr.Dataset, values: np.ndarray, since: float = TRANSIENT
) -> tuple[float, float]:
    """RMS of values (time,) from `since` [s] on, where the target turns and where it does not."""
    velocity = samples(flight, "target_velocity", "axis")
    acceleration = np.linalg.norm(np.gradient(velocity, SAMPLE, axis=0), axis=1)
    turning = acceleration > _TURNING * acceleration.max()
    late = flight["time"].to_numpy() >= since
    corners, straight = (np.sqrt(np.mean(values[late & part] ** 2)) for part in (turning, ~turning))
    return float(corners), float(straight)


def metrics(flight: xr.Dataset, settled: float) -> dict[str, Any]:
    """Return feature error, tip error, convergence, effort and field of view of one flight.

    Errors count from `settled` [s] on. They, and values of the whole flight, are NaN for a run that
    ended early.
    """
    late = flight.sel(time=slice(settled, None))
    off = off_target(late)
    push = samples(flight, "command", "actuator")
    bends = samples(flight, "bend", "bend_axis")
    rest = np.zeros(push.shape[1])
    rest[2] = push[:, 2].mean()
    effort = np.sqrt(np.mean((push - rest) ** 2, axis=0))
    return {
        "status": int(flight["status"]),
        "end_time_s": float(flight["end_time"]),
        "error_estimate": float(flight["error_estimate"]),
        **_saturated(flight),
        "rms_px": feature_rms(late),
        "max_px": largest_coordinate(flight, settled),
        "norm_max_px": largest_norm(flight, settled),
        "tip_rms_m": float(np.sqrt(np.mean(off**2))),
        "tip_max_m": largest_off_target(flight, settled),
        "converged_s": _converged(flight["time"].to_numpy(), feature_norm(flight)),
        "force_rms_n": float(np.linalg.norm(effort[:3])),
        "moment_rms_nm": float(np.linalg.norm(effort[3:6])),
        "bend_moment_rms_nm2": float(np.linalg.norm(effort[6:])),
        "out_of_view_samples": _out_of_view(flight),
        "largest_bend_1_m": float(np.max(np.linalg.norm(bends, axis=-1))),
    }


def _saturated(flight: xr.Dataset) -> dict[str, float]:
    """Return the largest command to rotors beyond their limits, for vehicles that have some."""
    name = "largest_saturation"
    return {name: float(flight[name])} if name in flight else {}


def _out_of_view(flight: xr.Dataset) -> float:
    """Return the number of samples with a point out of view.

    After a flight has lost all points, the remaining samples count. NaN if it ended otherwise.
    """
    if int(flight["status"]) not in (0, UNSEEN):
        return float("nan")
    seen = flight["in_view"].transpose("time", "point").to_numpy()
    return int((~(seen > 0.5)).any(axis=1).sum())


def _converged(time: np.ndarray, norm: np.ndarray) -> float:
    """Return first time after which the norm of the feature error stays below CONVERGED, or NaN."""
    above = np.flatnonzero(~(norm < CONVERGED))
    first = above[-1] + 1 if above.size else 0
    lasts = first < len(time) and time[-1] - time[first] >= _STAYS * (time[-1] - time[0])
    return float(time[first]) if lasts else float("nan")
