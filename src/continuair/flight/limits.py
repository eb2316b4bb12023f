"""What a controller's limits cut off, told after a flight."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from continuair.errors import ContinuairWarning
from continuair.flight.resolution import in_runs
from continuair.flight.trajectory import Recorder
from continuair.scenario.scenarios import Scenario

# The device's arithmetic keeps a limit to the last bit; float32 rounds it.
_REACHED = 1.0 - 1e-6


def with_limited_command(names: tuple[str, ...], scenario: Scenario) -> tuple[str, ...]:
    """The variables to record: the command too if it has limits, which are looked for there."""
    limited = _limits_of(scenario) is not None and "command" not in names
    return (*names, "command") if limited else names


def warn_of_limits(recorder: Recorder, stacklevel: int) -> None:
    """Warn, a number of frames up, if the controller's command is at its limits at samples."""
    controller = recorder.flight.scenario.controller
    limits = _limits_of(recorder.flight.scenario)
    if controller is None or limits is None:
        return
    command = recorder.values("command")
    most = np.atleast_2d(limits)[:, None]
    at = np.abs(command) >= _REACHED * most
    if not at.any():
        return
    runs = at.any(axis=(1, 2))
    of = in_runs(runs.sum(), len(runs))
    samples = np.flatnonzero(at.any(axis=(0, 2)))
    share = at.any(axis=2)[runs].mean()
    warnings.warn(
        f"controller {controller.name} reaches its limits{of}: {', '.join(_parts(at))} from t = "
        f"{recorder.flight.marks.samples[samples[0]]:.3g} s on, at {100.0 * share:.3g} % of the "
        "samples; see the result's command, or give limits that leave room.",
        ContinuairWarning,
        stacklevel=stacklevel,
    )


def _parts(at: Any) -> list[str]:
    """Which parts of the push are cut off, of (runs, samples, numbers)."""
    cut = at.any(axis=(0, 1))
    parts = {"force": cut[:3], "moment": cut[3:6], "bend moment": cut[6:]}
    return [name for name, each in parts.items() if each.any()]


def _limits_of(scenario: Scenario) -> Any:
    """The limits (numbers,) or (runs, numbers) of a controller's push, None if it has none."""
    controller = scenario.controller
    return controller.gains["limit"] if controller is not None and controller.limited else None
