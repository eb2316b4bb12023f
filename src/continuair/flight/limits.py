"""Warnings that a controller's command reached its limits."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.engine.engine import Logs
from continuair.flight.resolution import in_runs
from continuair.flight.trajectory import Recorder, Rows, values_of
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.warning import untold, warn


def with_limited_command(names: tuple[str, ...], scenario: Scenario) -> tuple[str, ...]:
    """Return the variables to record, with the command if it has limits."""
    controller = scenario.controller
    limited = controller is not None and controller.at_limits and "command" not in names
    return (*names, "command") if limited else names


_ASIDE, _ANY_FORCE = 0.01, 6
"""Share of a force across the thrust that is told, and the rank of rotors that produce any."""


class LimitWatch:
    """Reduction of a recorder: where commands of its runs are at the controller's limits.

    counts, first (runs,): number of such samples, and index of the first one; names: of limits.
    """

    def __init__(self, recorder: Recorder) -> None:
        self.flight = recorder.flight
        self.counts = np.zeros(len(recorder.runs), int)
        self.first = np.zeros(len(recorder.runs), int)
        self.names: dict[str, bool] = {}

    def __call__(self, rows: Rows, runs: NDArray[np.intp], logs: Logs) -> None:
        """Count the samples of some runs at limits."""
        (command,) = values_of("command", logs, self.flight, runs)
        parts = _at_limits(self.flight.scenario, command, runs)
        for name, each in parts.items():
            self.names[name] = bool(each.any()) or self.names.get(name, False)
        at = np.any(list(parts.values()), axis=0)
        self.counts[rows], self.first[rows] = at.sum(axis=1), at.argmax(axis=1)


def watch_limits(recorder: Recorder) -> LimitWatch | None:
    """Return what watches a recorder's commands, None for a controller without limits."""
    controller = recorder.flight.scenario.controller
    if controller is None or controller.at_limits is None:
        return None
    watched = LimitWatch(recorder)
    recorder.reductions.append(watched)
    return watched


def warn_of_limits(watched: LimitWatch | None, stacklevel: int) -> None:
    """Warn, `stacklevel` frames up, if commands were at the controller's limits at samples."""
    if watched is None or not watched.counts.any():
        return
    controller = watched.flight.scenario.controller
    assert controller is not None
    runs = watched.counts > 0
    of, samples = in_runs(runs.sum(), len(runs)), watched.flight.marks.samples
    first, share = samples[watched.first[runs].min()], watched.counts[runs].mean() / len(samples)
    names = ", ".join(name for name, reached in watched.names.items() if reached)
    warn(
        f"controller {controller.name} reaches its limits{of}: {names} from t = {first:.3g} s, "
        f"at {100.0 * share:.3g} % of the samples; see command, or raise the limits.",
        stacklevel=stacklevel,
    )


class SideForceWatch:
    """Reduction of a recorder: the largest force that a controller asks for across the thrust."""

    def __init__(self, recorder: Recorder) -> None:
        self.flight = recorder.flight
        self._of_parts = [0.0]

    def __call__(self, rows: Rows, runs: NDArray[np.intp], logs: Logs) -> None:
        """Look at the commands of some runs."""
        (command,) = values_of("command", logs, self.flight, runs)
        (attitude,) = values_of("attitude", logs, self.flight, runs)
        x, y, z, w = np.moveaxis(attitude, -1, 0)
        up = np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
        across = np.linalg.norm(np.cross(command[..., :3], np.moveaxis(up, 0, -1)), axis=-1)
        least = _ASIDE * np.linalg.norm(command[..., :3], axis=-1)
        # Several threads may get here at once.
        self._of_parts.append(float(np.where(across > least, across, 0.0).max(initial=0.0)))

    @property
    def largest(self) -> float:
        """The largest one of any run and sample [N]."""
        return max(self._of_parts)


def watch_side_forces(recorder: Recorder) -> SideForceWatch | None:
    """Return what watches commands that rotors without side force follow, None for others."""
    scenario, rotors = recorder.flight.scenario, recorder.flight.vehicle.uav.rotors
    law = scenario.controller
    if law is None or law.asks is not None or rotors is None or rotors.rank == _ANY_FORCE:
        return None
    watched = SideForceWatch(recorder)
    recorder.reductions.append(watched)
    return watched


def warn_of_side_forces(watched: SideForceWatch | None, stacklevel: int) -> None:
    """Warn, `stacklevel` frames up, of a force that the rotors did not produce."""
    if watched is None or watched.largest == 0.0:
        return
    law = watched.flight.scenario.controller
    assert law is not None
    warn(
        f"controller {law.name} asks for up to {watched.largest:.3g} N across the thrust, which "
        "these rotors cannot produce; tilt the vehicle instead, or declare asks=6.",
        stacklevel=stacklevel,
    )


def _at_limits(scenario: Scenario, command: Array, runs: NDArray[np.intp]) -> dict[str, Array]:
    """Return at which samples commands (runs, time, number) of some runs are at each limit."""
    controller = scenario.controller
    assert controller is not None and controller.at_limits is not None
    gains = controller.gains
    if controller.runs is not None and controller.runs > 1:
        gains = {name: values[runs] for name, values in gains.items()}
    return controller.at_limits(gains, command)


def share_at_limits(scenario: Scenario, flown: xr.Dataset, chosen: NDArray[np.intp]) -> Array:
    """Return the share (runs,) of samples at which commands are at the controller's limits.

    flown: with the command (run, time, number), of the runs with the indices `chosen`.
    """
    controller = scenario.controller
    if controller is None or controller.at_limits is None:
        return np.zeros(len(chosen))
    parts = _at_limits(scenario, flown["command"].to_numpy(), chosen)
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
