"""What a controller's limits cut off, told after a flight."""

from __future__ import annotations

import warnings

import numpy as np

from continuair.errors import ContinuairWarning
from continuair.flight.resolution import in_runs
from continuair.flight.trajectory import Recorder
from continuair.scenario.scenarios import Scenario


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
    warnings.warn(
        f"controller {controller.name} reaches its limits{of}: {names} from t = {first:.3g} s on, "
        f"at {100.0 * at[runs].mean():.3g} % of the samples; see the result's command, or give "
        "limits that leave room.",
        ContinuairWarning,
        stacklevel=stacklevel,
    )
