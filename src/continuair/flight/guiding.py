"""Timing and set-points of a flight controller's loop."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from continuair.engine.loop import Guidance, OverTime, columns_of_runs, over_time
from continuair.errors import InputError
from continuair.flight.time_grid import Grid, instants_at
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.coordinates import bends_of
from continuair.vehicle.layout import Layout, setpoint_columns, width_of

_AT_ONCE = 1024
"""Runs whose set-points are checked at once, which limits the memory of large batches."""


def guidance_over(scenario: Scenario, grid: Grid, layout: Layout) -> Guidance:
    """Return the update times of a flight controller over a grid, and its set-points."""
    controller = scenario.controller
    assert controller is not None and controller.period is not None
    period, latency = controller.period, controller.latency
    issued, taken = instants_at(grid, period), instants_at(grid, period, latency)
    # Before the first command arrives after its latency, it acts already.
    taken[0] = 0
    instants = period * np.arange(issued.max() + 1)
    evaluate = partial(wanted_at, scenario, layout, instants)
    runs = _runs_of(scenario)
    wanted = over_time(evaluate, runs * len(instants) * width_of(setpoint_columns(layout.bends)))
    _check_held(scenario, layout, wanted, runs)
    return Guidance(issued, taken, int(latency / period) + 2, wanted, _upright(scenario))


def _runs_of(scenario: Scenario) -> int:
    """Return how many runs have set-points of their own, or a start that they keep."""
    given = scenario.setpoints
    return max(len(np.atleast_2d(scenario.q)), (given.runs if given is not None else None) or 1)


def _check_held(scenario: Scenario, layout: Layout, wanted: OverTime, runs: int) -> None:
    """Raise InputError if set-points bend a section that the controller does not control."""
    law, given = scenario.controller, scenario.setpoints
    if law is None or given is None or given.bend is None or "bend_limit" not in law.gains:
        return
    free = np.atleast_2d(law.gains["bend_limit"]) == 0.0
    if free.shape[1] != layout.bends:
        raise InputError(
            "controller",
            f"{law.name} moves {free.shape[1]} coordinates, but the sections have {layout.bends}",
            "make it for this vehicle",
        )
    bends = _is_bent(layout, wanted, runs)
    ignored = np.argwhere(free & bends)
    if len(ignored):
        run, bend = ignored[0]
        where = f" in run {run}" if len(free) > 1 or len(bends) > 1 else ""
        raise InputError(
            "setpoints",
            (
                f"bend section {layout.owner[bend]}{where}, which the controller {law.name} "
                "does not control"
            ),
            "give it a bend_bandwidth above 0, or a bend of 0",
        )


def _is_bent(layout: Layout, wanted: OverTime, runs: int) -> NDArray[np.bool_]:
    """Return whether set-points bend a section at any time (runs or 1, bends)."""
    columns, every = setpoint_columns(layout.bends)["bend"], np.arange(runs)
    parts = np.array_split(every, -(-runs // _AT_ONCE)) if callable(wanted) else [every]
    tables = (columns_of_runs(wanted, part)[..., columns] for part in parts)
    return np.concatenate([(table != 0.0).any(axis=0) for table in tables])


def _upright(scenario: Scenario) -> Array:
    """Return 1 for starts (runs or 1, 1) whose thrust points up, and 0 for the others."""
    roll, pitch = np.atleast_2d(scenario.q)[:, 3:5].T
    return (np.cos(roll) * np.cos(pitch) > 0.0).astype(float)[:, None]


def wanted_at(
    scenario: Scenario, layout: Layout, instants: Array, runs: NDArray[np.intp] | None = None
) -> Array:
    """Return the set-points (instants, runs or 1, columns) of a scenario, or of some runs."""
    given, found = scenario.setpoints, _at_start(scenario, runs, layout)
    columns = setpoint_columns(layout.bends)
    for name in columns if given is not None else ():
        rows = None
        if given is not None and name != "follows":
            rows = given.at(name, instants, runs)
        if rows is not None:
            found[name] = rows
    alone = given is not None and given.velocity is not None and given.position is None
    found["follows"] = np.full((1, 1, 1), float(not alone))
    if found["bend"].shape[-1] != layout.bends:
        raise InputError(
            "bend",
            (
                f"of the setpoints has {found['bend'].shape[-1]} numbers, but the vehicle "
                f"has {layout.sections} sections"
            ),
            f"give {layout.bends}",
        )
    count = max(len(rows) for rows in found.values())
    table = np.zeros((len(instants), count, width_of(columns)))
    for name, rows in found.items():
        table[..., columns[name]] = rows.swapaxes(0, 1)
    return table


def _at_start(
    scenario: Scenario, runs: NDArray[np.intp] | None, layout: Layout
) -> dict[str, Array]:
    """Return position, yaw and bends (runs or 1, 1, width) at the start of a flight."""
    q = np.atleast_2d(scenario.q)[:, None]
    q = q if runs is None or len(q) == 1 else q[runs]
    # Of the two Euler triples of an attitude, one has the opposite heading.
    yaw = q[..., 5:6] + np.where(np.cos(q[..., 4:5]) < 0.0, np.pi, 0.0)
    return {"position": q[..., :3], "yaw": yaw, "bend": bends_of(q, layout)}
