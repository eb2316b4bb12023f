"""One unit of work: some runs of a design, simulated and reduced to numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair.engine.compiling import kind_of
from continuair.errors import InputError
from continuair.flight.trajectory import COUNTED, ERROR_ESTIMATE, LARGEST_SATURATION
from continuair.kernels.integrators import TSIT5
from continuair.kernels.step import STATUS
from continuair.scenario.scenarios import Scenario
from continuair.sweeps.assembly import batches
from continuair.sweeps.design import Design
from continuair.sweeps.pairs import METRICS, check_pairs, run_pairs
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

REFUSED = -1
"""Status of a run with invalid parameters."""

STATUSES = {REFUSED: "parameters refused", **STATUS}
"""Status -> meaning."""

MEANINGS: dict[str, tuple[str, str]] = {
    **METRICS,
    "tip_x_m": ("m", "tip of the arm at the end, world x"),
    "tip_y_m": ("m", "tip of the arm at the end, world y"),
    "tip_z_m": ("m", "tip of the arm at the end, world z"),
    "status": ("1", "how the run ended: " + ", ".join(f"{k} {v}" for k, v in STATUSES.items())),
    "end_time": ("s", "time up to which the run is valid"),
    "error_estimate": (ERROR_ESTIMATE["units"], ERROR_ESTIMATE["long_name"]),
    "steps": ("1", COUNTED["steps"][1]),
    "step_error": ("1", "estimated largest error of the tip, in arm lengths, of older stores"),
    "step": ("s", "integration step"),
    "largest_saturation": (LARGEST_SATURATION["units"], LARGEST_SATURATION["long_name"]),
}
"""Units and meaning of the quantities of a run, also of older stores."""

_ENDS = ("tip_x_m", "tip_y_m", "tip_z_m", "status", "end_time")

# Simulated seconds of each model in a unit: one or two seconds of work of a core, or of a GPU.
_SECONDS_PER_UNIT = {"cpu": 1000.0, "cuda": 20000.0}


def quantities(design: Design) -> tuple[str, ...]:
    """Return the names of the quantities per run and model, in order."""
    steps = ("steps",) if design.base.method == TSIT5 else ("step",)
    checked = ("error_estimate",) * design.base.check
    saturation = ("largest_saturation",) * bool(design.vehicle.limited)
    return (*design.metrics, *_ENDS, *steps, *checked, *saturation)


def unit_size(design: Design, device: str) -> int:
    """Return the runs per unit: the design's, or those of a few seconds of work."""
    if design.base.chunk is not None:
        return min(design.base.chunk, design.runs)
    seconds = _SECONDS_PER_UNIT[kind_of(device)]
    # The quotient is infinite for a tiny duration.
    return max(1, int(min(seconds / design.base.scenario.duration, design.runs)))


def compute(design: Design, runs: NDArray[np.intp], device: str, threads: int | None) -> Array:
    """Return quantities (runs, models, quantities) of some runs of a design, by their indices.

    A run with invalid parameters is a row with the status REFUSED.
    """
    try:
        return _computed(design, runs, device, threads)
    except InputError:
        if len(runs) == 1:
            return _refused(design)
        halves = np.array_split(runs, 2)
        return np.concatenate([compute(design, half, device, threads) for half in halves])


def check(design: Design, device: str) -> None:
    """Simulate the start of some runs: compiles all kernels, and raises InputError if all fail.

    One run that works is enough, as others may be rows with a status.
    """
    refusals = []
    probes = design.probes()
    for run in probes:
        try:
            for _, vehicle, scenario in batches(design, np.array([run])):
                _check_whole(design, vehicle, scenario, device)
                _fly(design, vehicle, scenario, device, 1, duration=design.base.sample)
        except InputError as error:
            refusals.append(error)
    if len(refusals) == len(probes):
        raise refusals[0]


def _check_whole(design: Design, vehicle: Vehicle, scenario: Scenario, device: str) -> None:
    """Raise InputError for arguments that only the whole flight shows to be invalid."""
    base = design.base
    # The step of every run is kept, and a coarse one was asked for.
    with untold():
        check_pairs(
            vehicle,
            scenario,
            method=base.method,
            rtol=base.rtol,
            step=base.step,
            sample=base.sample,
            settle=base.settle,
            device=device,
        )


def _computed(design: Design, runs: NDArray[np.intp], device: str, threads: int | None) -> Array:
    """Return quantities of some runs, or raise InputError if any is invalid."""
    block = np.full((len(runs), len(design.models), len(quantities(design))), np.nan)
    for at, vehicle, scenario in batches(design, runs):
        scenario = scenario.replace(seed=_seeds(design.base.seed, runs[at]))
        block[at] = _fly(design, vehicle, scenario, device, threads)
    return block


def _seeds(seed: int, runs: NDArray[np.intp]) -> list[int]:
    """Return the seeds of camera noise of every run, independent of units."""
    each = [np.random.SeedSequence([seed, int(run)]).generate_state(1)[0] for run in runs]
    return [int(one) for one in each]


def _fly(
    design: Design, vehicle: Vehicle, scenario: Scenario, device: str, threads: int | None,
    **options: Any,
) -> Array:  # fmt: skip
    """Return the quantities of a batch."""
    base = design.base
    # The step of every run is kept, and a coarse one was asked for.
    with untold():
        found = run_pairs(
            vehicle,
            scenario,
            design.models[1:],
            method=base.method,
            rtol=base.rtol,
            step=base.step,
            check=base.check,
            sample=base.sample,
            settle=min(base.settle, 0.5 * options.get("duration", np.inf)),
            device=device,
            threads=threads,
            **options,
        )
    columns = [found[name].to_numpy() for name in design.metrics]
    columns += [found["tip_position"].to_numpy()[..., axis] for axis in range(3)]
    each = {name: found[name].to_numpy() for name in quantities(design)[len(columns) :]}
    if "step" in each:
        each["step"] = np.broadcast_to(each["step"][:, None], found["status"].shape)
    columns += each.values()
    return np.stack(columns, axis=-1)


def _refused(design: Design) -> Array:
    """Return the row of a run with invalid parameters."""
    names = quantities(design)
    block = np.full((1, len(design.models), len(names)), np.nan)
    block[..., names.index("status")] = REFUSED
    block[..., names.index("end_time")] = 0.0
    return block
