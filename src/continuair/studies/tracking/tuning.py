"""A search for gains of the paper's law: every candidate flies every letter in every setting.

Candidates are a scrambled Sobol set over `RANGES`, refined by smaller sets about the best so far.
The objective is the mean over the runs of log(RMS feature error [px]) + log(RMS tip error [mm]) +
log(1 + effort): settings whose errors differ by orders of magnitude weigh alike. The image may be
right and the tip not above the target, so both count. Effort, the RMS of the force beyond the
weight as a share of it, keeps the law from chattering. No run may end early, nor end where
rounding sends it: every flight is flown again from a start a nanometre off.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from continuair import checks
from continuair.analysis.determinacy import fly_twice
from continuair.analysis.metrics import TRANSIENT, feature_rms
from continuair.controllers.controller import stack
from continuair.controllers.gain_files import Gains
from continuair.errors import InputError
from continuair.kernels.dynamics import PLANTS
from continuair.progress import Progress, Steps
from continuair.scenario.tracking_task import SETTINGS, equipped, task
from continuair.sweeps.sampling import sobol
from continuair.vehicle.vehicle import Vehicle, check_one_section

RANGES = {
    "bandwidth": (4.0, 16.0),
    "damping_ratio": (0.5, 1.2),
    "conditioning": (3e-4, 6e-3),
    "sliding": (1e-6, 1e-2),
    "sigma": (1e-4, 1e-1),
}
"""What is searched, on a logarithmic scale; `design` and `servoing` say what each one is."""

HORIZON = 20.0
"""How much of a letter is flown at most [s]; the first corner of a 50 s M comes after 15 s."""

_VARIABLES = ("camera_position", "target_position", "command")

LOST = 1e6
"""RMS errors that a run which ends early, or where rounding sends it, counts as [px, mm]: losing
one outweighs everything."""

MARGINS = {"bandwidth": 1.15, "conditioning": 0.75}
"""The candidates fly with these times what is returned, nearer to where a law chatters."""

SHRINK = 0.4
"""Each round's box about the best candidate, as a share of the one before."""


def tune(
    vehicle: Vehicle,
    letters: Sequence[str] = ("M",),
    settings: Sequence[str] = tuple(SETTINGS),
    *,
    candidates: int = 128,
    rounds: int = 4,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """The best gains found, with the objective, its parts and what it takes to find them again.

    candidates: per round, a power of two. letters: M has the sharpest corners. Raises
    InputError.
    """
    check_one_section(vehicle)
    _check_size(candidates, rounds, seed)
    # Gains on the brink for one plant are lost on the other.
    runs = list(product(settings, PLANTS))
    steps = Steps(progress, rounds * len(runs))
    lows, highs = np.log([list(r) for r in RANGES.values()]).T
    best: dict[str, float] = {}
    score, centre, half = np.inf, (lows + highs) / 2, (highs - lows) / 2
    for turn in range(rounds):
        cube = sobol(len(RANGES), candidates, [seed, turn])
        points = np.clip(centre + (2.0 * cube - 1.0) * half, lows, highs)
        rows = [dict(zip(RANGES, map(float, np.exp(p)), strict=True)) for p in points]
        scores = _scores(vehicle, rows, letters, runs, steps, f"round {turn + 1}")
        leader = int(np.argmin(scores))
        if scores[leader] < score:
            best, score, centre = rows[leader], float(scores[leader]), points[leader]
        half = half * SHRINK
    if score >= np.log(LOST) / len(runs):
        raise InputError(
            f"candidates is {candidates}, of which none keeps its target in every setting (rounds "
            f"{rounds}, vehicle {vehicle.name}); try more, or check where the camera looks."
        )
    best = best | {name: best[name] / margin for name, margin in MARGINS.items()}
    search = {"vehicle": vehicle.name, "candidates": candidates, "rounds": rounds, "seed": seed}
    errors = _errors(vehicle, best, letters, runs)
    return {"gains": best, "record": {**search, "objective": score, "rms_px": errors}}


def _check_size(candidates: int, rounds: int, seed: int) -> None:
    checks.whole("candidates", candidates, 2)
    checks.whole("rounds", rounds, 1)
    checks.whole("seed", seed, 0)
    if candidates & (candidates - 1):
        raise InputError(f"candidates is {candidates}; give a power of two, such as 128.")


def _scores(
    vehicle: Vehicle,
    rows: Sequence[dict[str, float]],
    letters: Sequence[str],
    runs: Sequence[tuple[str, str]],
    steps: Steps,
    note: str,
) -> np.ndarray:
    """The objective (rows,) of every candidate, over all settings, plants and letters."""
    costs = []
    for name, plant in runs:
        steps.begin(f"{note}, {name}, {plant}")
        error, tip, effort = fly(vehicle, rows, letters, name, plant)
        costs.append(np.log(error) + np.log(tip) + np.log1p(effort))
    return np.mean(costs, axis=(0, 2))


def _errors(
    vehicle: Vehicle,
    gains: dict[str, float],
    letters: Sequence[str],
    runs: Sequence[tuple[str, str]],
) -> dict[str, dict[str, float]]:
    """RMS feature error [px] by setting and plant, and by letter."""
    flown = {run: fly(vehicle, [gains], letters, *run)[0][0] for run in runs}
    return {
        f"{name}.{plant}": dict(zip(letters, row.tolist(), strict=True))
        for (name, plant), row in flown.items()
    }


def as_toml(found: dict[str, Any]) -> str:
    """What `tune` found as a file for `load_gains`."""
    record = found["record"]
    lines = ["# DPD-SM-IBVS gains, in normalised image coordinates; found by continuair tune."]
    lines += [f"{name} = {value!r}" for name, value in found["gains"].items()]
    lines += ["", "[record]"]
    lines += [f"{name} = {json.dumps(value)}" for name, value in record.items() if name != "rms_px"]
    for setting, parts in record["rms_px"].items():
        lines += ["", f"[record.rms_px.{setting}]"]
        lines += [f"{letter} = {value:.6g}" for letter, value in parts.items()]
    return "\n".join(lines) + "\n"


def fly(
    vehicle: Vehicle,
    rows: Sequence[dict[str, float]],
    letters: Sequence[str],
    setting: str,
    plant: str,
) -> list[np.ndarray]:
    """RMS feature error [px] and tip error [mm], and effort, by candidate (rows) and letter."""
    flown = equipped(vehicle, SETTINGS[setting])
    weight = 9.81 * float(flown.mass)
    gains = stack([Gains("candidate", row).controller(flown) for row in rows])
    found: list[list[np.ndarray]] = []
    for letter in letters:
        scenario = task(flown, [letter], gains, SETTINGS[setting].duration)
        lasts = min(scenario.duration, HORIZON)
        data, held = fly_twice(
            flown, scenario, _VARIABLES, model=plant, duration=lasts, sample=2e-2
        )
        force = data["command"].isel(actuator=slice(3)) - [0.0, 0.0, weight]
        effort = _root((force**2).sum("actuator").mean("time")) / weight
        # Errors count from when DS is judged.
        data = data.sel(time=slice(TRANSIENT, None))
        off = (data["camera_position"] - data["target_position"]).isel(axis=slice(2))
        metres = _root((off**2).sum("axis", skipna=False).mean("time", skipna=False))
        errors = (feature_rms(data), 1e3 * metres.to_numpy())
        counted = [np.where(held, np.minimum(error, LOST), LOST) for error in errors]
        found.append([*counted, np.where(held, effort, 0.0)])
    return [np.stack(columns, axis=1) for columns in zip(*found, strict=True)]


def _root(squares: xr.DataArray) -> xr.DataArray:
    return squares**0.5
