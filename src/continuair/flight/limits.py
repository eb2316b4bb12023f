"""Warnings that a controller's command reached its limits."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.flight.resolution import in_runs
from continuair.flight.trajectory import Recorder
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.warning import untold, warn


def with_limited_command(names: tuple[str, ...], scenario: Scenario) -> tuple[str, ...]:
    """Return the variables to record, with the command if it has limits."""
    controller = scenario.controller
    limited = controller is not None and controller.at_limits and "command" not in names
    return (*names, "command") if limited else names


def warn_of_limits(recorder: Recorder, stacklevel: int) -> None:
    """Warn, `stacklevel` frames up, if the controller's command is at its limits at samples."""
    controller = recorder.flight.scenario.controller
    if controller is None or controller.at_limits is None:
        return
    parts = controller.at_limits(controller.gains, recorder.values("command"))
    at = np.any(list(parts.values()), axis=0)
    if not at.any():
        return
    runs = at.any(axis=1)
    of = in_runs(runs.sum(), len(runs))
    first = recorder.flight.marks.samples[np.flatnonzero(at.any(axis=0))[0]]
    names = ", ".join(name for name, each in parts.items() if each.any())
    warn(
        f"controller {controller.name} reaches its limits{of}: {names} from t = {first:.3g} s, "
        f"at {100.0 * at[runs].mean():.3g} % of the samples; see command, or raise the limits.",
        stacklevel=stacklevel,
    )


def share_at_limits(scenario: Scenario, flown: xr.Dataset, chosen: NDArray[np.intp]) -> Array:
    """Return the share (runs,) of samples at which commands are at the controller's limits.

    flown: with the command (run, time, number), of the runs with the indices `chosen`.
    """
    controller = scenario.controller
    if controller is None or controller.at_limits is None:
        return np.zeros(len(chosen))
    gains = controller.gains
    if controller.runs is not None and controller.runs > 1:
        gains = {name: values[chosen] for name, values in gains.items()}
    parts = controller.at_limits(gains, flown["command"].to_numpy())
    found: Array = np.any(list(parts.values()), axis=0).mean(axis=1)
    return found


def warn_of_runs_at_limits(shares: Array, scenario: Scenario, stacklevel: int) -> None:
    """Warn of runs whose commands are at limits, by the share of samples (runs, models)."""
    runs = np.asarray(shares.any(axis=1))
    if scenario.controller is not None and runs.any():
        warn(
            f"controller {scenario.controller.name} reaches its limits"
            f"{in_runs(runs.sum(), len(runs))}, at up to {100.0 * shares.max():.3g} % of the "
            "samples; see command of simulate, or raise the limits.",
            stacklevel=stacklevel,
        )


def limits_untold() -> AbstractContextManager[None]:
    """Suppress warnings of limits, for studies of many vehicles that report them otherwise."""
    return untold("controller .* reaches its limits")
