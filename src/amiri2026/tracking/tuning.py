"""A search for gains of the paper's law: every candidate flies every letter in every setting.

Candidates are a scrambled Sobol set over `RANGES`, as constant gains and as current gains, refined
by smaller sets about the best of their kind. The objective is the mean over the runs of
log(RMS feature error [px]) + log(RMS tip error [mm]) + log(1 + effort), so that settings whose
errors differ by orders of magnitude have equal weight. The image may be right and the tip not above
the target, so both count. Effort, the RMS of the force beyond the weight as a share of it, prevents
chattering. A run that ends early, or whose end depends on rounding, outweighs everything: every
flight is repeated from a start a nanometre off. Candidates fly the first 20 s of a letter. Failures
of the best one on whole letters are reported, with its errors as `tracking` computes them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from amiri2026.tracking.candidates import HORIZON, Outcomes, fly, fly_whole
from continuair import Vehicle, checks
from continuair.controllers import GAINS
from continuair.errors import InputError
from continuair.kernels import PLANTS
from continuair.progress import Progress, Steps
from continuair.scenario import SETTINGS, damping_notes, noise_notes, without_rotors
from continuair.sweeps import sobol
from continuair.typing import Model
from continuair.vehicle import check_single_vehicle

Array = np.ndarray

RANGES = {
    "bandwidth": (1.0, 16.0),
    "damping_ratio": (0.5, 1.5),
    "conditioning": (3e-4, 2e-2),
    "sliding": (1e-6, 1e-2),
    "sigma": (1e-4, 1e-1),
}
"""Ranges of the search, on a logarithmic scale; `design` and `servoing` define them."""

MARGINS = {"bandwidth": 1.15, "conditioning": 0.75}
"""Factors of the candidates' settings on the returned ones, closer to chattering."""

SHRINK = 0.4
"""Each round's box about the best candidate, as a share of the one before."""

Run = tuple[str, Model]
"""A setting and a plant."""


@dataclass(frozen=True)
class Candidate:
    """Gains, the outcome of each run with them, and the objective."""

    gains: dict[str, Any]
    flown: dict[Run, Outcomes]
    score: float

    @property
    def losses(self) -> int:
        """How many letters are lost."""
        return sum(int((each.why != "").sum()) for each in self.flown.values())


@dataclass
class _Search:
    """The settings of the search, and the best so far."""

    vehicle: Vehicle
    letters: Sequence[str]
    runs: list[Run]
    steps: Steps
    kinds: tuple[str, ...] = GAINS
    best: Candidate | None = None
    held: dict[Run, tuple[int, int]] = field(default_factory=dict)
    """of each run, how many candidates held it, and how many flew it"""

    def fly_round(self, points: Array, note: str) -> int | None:
        """Simulate points (rows, ranges) of RANGES' logarithms; return the new best, if any.

        If interrupted, the first round keeps the best of the runs completed.
        """
        named = [dict(zip(RANGES, map(float, np.exp(p)), strict=True)) for p in points]
        rows = [{"gains": kind} | row for kind in self.kinds for row in named]
        flown: dict[Run, Outcomes] = {}
        try:
            for run in self.runs:
                self.steps.begin(f"{note}, {', '.join(run)}")
                flown[run] = fly(self.vehicle, rows, self.letters, *run)
                before, all_before = self.held.get(run, (0, 0))
                now = int(flown[run].held.sum())
                self.held[run] = (before + now, all_before + len(rows))
        except KeyboardInterrupt:
            if self.best is None and flown:
                self._take(rows, flown)
            raise
        leader = self._take(rows, flown)
        return None if leader is None else leader % len(points)

    def _take(self, rows: list[dict[str, Any]], flown: dict[Run, Outcomes]) -> int | None:
        """Keep the best of these if it is better than the one so far; its row."""
        scores = np.mean([each.cost for each in flown.values()], axis=0)
        leader = int(np.argmin(scores))
        if self.best is not None and scores[leader] >= self.best.score:
            return None
        own = {run: each.row(leader) for run, each in flown.items()}
        self.best = Candidate(rows[leader], own, float(scores[leader]))
        self.kinds = (rows[leader]["gains"],)
        return leader

    def relaxed(self) -> Candidate:
        """Return the best with the margins taken off, unless it loses more without them."""
        assert self.best is not None
        off = {name: self.best.gains[name] / margin for name, margin in MARGINS.items()}
        gains = self.best.gains | off
        flown = {run: fly(self.vehicle, [gains], self.letters, *run) for run in self.runs}
        score = float(np.mean([each.cost for each in flown.values()]))
        found = Candidate(gains, flown, score)
        return found if found.losses <= self.best.losses else self.best


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
    """Search gains; return the best, with the objective, its parts and how to reproduce them.

    candidates: per round, a power of two, of each kind in the first one. letters: M has the
    sharpest corners. Returns "gains", settings of `Gains`; "record", JSON-able; "remarks",
    sentences on their failures; "flies", whether they succeed in a setting; and "interrupted".
    KeyboardInterrupt ends the search, but keeps its result. Raises InputError.
    """
    check_single_vehicle(vehicle)
    _check_size(candidates, rounds, seed)
    flown, remarks = without_rotors(vehicle)
    remarks = [*remarks, *damping_notes(vehicle), *noise_notes(vehicle)]
    # Gains on the brink for one plant are lost on the other.
    runs = list(product(settings, PLANTS))
    search = _Search(flown, letters, runs, Steps(progress, rounds * len(runs)))
    interrupted = False
    try:
        _refine(search, candidates, rounds, seed)
        found = search.relaxed()
    except KeyboardInterrupt:
        if search.best is None:
            raise
        found, interrupted = search.best, True
    record = {"vehicle": vehicle.name, "candidates": candidates, "rounds": rounds, "seed": seed}
    if interrupted:
        record["interrupted"] = True
        remarks = [*remarks, "The search was interrupted: these are the best gains so far."]
    whole = {run: fly_whole(flown, found.gains, letters, *run) for run in runs}
    record |= {"objective": found.score, **_of_runs(search.letters, whole)}
    remarks = [*remarks, *_sentences(search, whole)]
    return {
        "gains": found.gains, "record": record, "remarks": remarks, "interrupted": interrupted,
        "flies": any(each.held.all() for each in whole.values()),
    }  # fmt: skip


def _check_size(candidates: int, rounds: int, seed: int) -> None:
    checks.whole("candidates", candidates, 2)
    checks.whole("rounds", rounds, 1)
    checks.whole("seed", seed, 0)
    if candidates & (candidates - 1):
        raise InputError("candidates", f"is {candidates}", "give a power of two, such as 128")


def _refine(search: _Search, candidates: int, rounds: int, seed: int) -> None:
    """Fly rounds, each in a smaller box about the best so far."""
    lows, highs = np.log([list(each) for each in RANGES.values()]).T
    centre, half = (lows + highs) / 2, (highs - lows) / 2
    for turn in range(rounds):
        cube = sobol(len(RANGES), candidates, [seed, turn])
        points = np.clip(centre + (2.0 * cube - 1.0) * half, lows, highs)
        leader = search.fly_round(points, f"round {turn + 1}")
        if leader is not None:
            centre = points[leader]
        half = half * SHRINK


def _of_runs(letters: Sequence[str], whole: dict[Run, Outcomes]) -> dict[str, Any]:
    """Return RMS feature errors [px], and failures, by setting and plant, and by letter."""
    errors: dict[str, dict[str, float]] = {}
    lost: dict[str, dict[str, str]] = {}
    for run, flown in whole.items():
        for letter, why, pixels in zip(letters, flown.why[0], flown.pixels[0], strict=True):
            if why:
                lost.setdefault(".".join(run), {})[letter] = why
            else:
                errors.setdefault(".".join(run), {})[letter] = float(pixels)
    return {"rms_px": errors, "lost": lost}


def _sentences(search: _Search, whole: dict[Run, Outcomes]) -> list[str]:
    """Return the failures of the gains, why, and how many candidates did not fail."""
    told = []
    for run, flown in whole.items():
        for letter, why in zip(search.letters, flown.why[0], strict=True):
            if why:
                held, tried = search.held.get(run, (0, 0))
                kept = "all letters" if len(search.letters) > 1 else "it"
                told.append(
                    f"{', '.join(run)}, letter {letter} is lost: {why}; {held} of {tried} "
                    f"candidates keep {kept} for {min(HORIZON, SETTINGS[run[0]].duration):g} s."
                )
    if not any(flown.held.all() for flown in whole.values()):
        told.append(
            "No setting is flown with these gains, the best that were tried; look at the camera "
            "first (attitude, latency, frame_rate), then at the arm's damping."
        )
    return told


def as_toml(found: dict[str, Any]) -> str:
    """Return the result of `tune` as a file for `load_gains`."""
    record = dict(found["record"])
    tables = {name: record.pop(name) for name in ("rms_px", "lost")}
    lines = ["# DPD-SM-IBVS gains, in normalised image coordinates; found by continuair tune."]
    lines += [f"# {remark}" for remark in found["remarks"]]
    lines += [f"{name} = {json.dumps(value)}" for name, value in found["gains"].items()]
    lines += ["", "[record]"]
    lines += [f"{name} = {json.dumps(value)}" for name, value in record.items()]
    for title, parts in tables.items():
        for run, by_letter in parts.items():
            lines += ["", f"[record.{title}.{run}]"]
            lines += [f"{letter} = {_cell(value)}" for letter, value in by_letter.items()]
    return "\n".join(lines) + "\n"


def _cell(value: Any) -> str:
    return json.dumps(value) if isinstance(value, str) else f"{value:.6g}"
