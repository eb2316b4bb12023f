"""What a controller's limits cut off, told after a flight."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import xarray as xr

from continuair.flight.resolution import in_runs
from continuair.flight.trajectory import Recorder
from continuair.scenario.scenarios import Scenario
from continuair.warning import untold, warn

Array = np.ndarray


def with_limited_command(names: tuple[str, ...], scenario: Scenario) -> tuple[str, ...]:
    """The variables to record: the command too if it has limits, which are looked for there."""
    controller = scenario.controller
    limited = controller is not None and controller.at_limits and "command" not in names
    return (*names, "command") if limited else names


def warn_of_limits(recorder: Recorder, stacklevel: int) -> None:
    """Warn, a number of frames up, if the controller's command is at its limits at samples."""
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
        f"controller {controller.name} reaches its limits{of}: {names} from t = {first:.3g} s on, "
        f"at {100.0 * at[runs].mean():.3g} % of the samples; see the result's command, or give "
        "limits that leave room.",
        stacklevel=stacklevel,
    )


def share_at_limits(scenario: Scenario, flown: xr.Dataset, chosen: Array) -> Array:
    """The share (runs,) of samples at which commands are at the controller's limits.

    flown: with the command (run, time, number), of the runs that are chosen by their indices.
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
            "samples; see the command that simulate returns, or give limits that leave room.",
            stacklevel=stacklevel,
        )


def limits_untold() -> AbstractContextManager[None]:
    """For studies of many vehicles that say elsewhere how often: no warnings of limits."""
    return untold("controller .* reaches its limits")
