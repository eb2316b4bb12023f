"""Inputs of a flight for the kernels: functions of time, sampled over the steps."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from continuair import checks
from continuair.errors import InputError
from continuair.scenario.excitations import is_vectorised
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.layout import BENDING, COMMAND, FIELDS, OF_NAME, Layout
from continuair.vehicle.vehicle import Vehicle

_TIMES_AT_ONCE = 256

BYTES_AT_ONCE = 1e8
"""Memory for values of a function of time, which returns those of all runs [bytes]."""

_COPIES = 4
"""Arrays of their size that a check of these values needs."""


CALLED = ("force", "moment", "tip_wrench")
"""Fields of a scenario to which a force_callback adds."""


def groups_in_use(scenario: Scenario) -> int:
    """Return the bits of the groups of inputs that a scenario uses."""
    return groups_of(field for field in FIELDS if getattr(scenario, field) is not None)


def groups_of_loop(scenario: Scenario, vehicle: Vehicle) -> int:
    """Return the bits of a scenario's controller, none without one."""
    law = scenario.controller
    bends = BENDING if law is not None and law.bends and vehicle.tendons else 0
    return bends | (COMMAND if law is not None else 0)


def groups_of(fields: Iterable[str]) -> int:
    """Return the bits of the groups of inputs of a scenario's fields."""
    bits = 0
    for field in fields:
        for name in FIELDS[field]:
            bits |= OF_NAME[name].bit
    return bits


def field_width(field: str, layout: Layout) -> int:
    """Return how many numbers a field of a scenario has."""
    where = [layout.of_input[name] for name in FIELDS[field]]
    return sum(each.stop - each.start for each in where)


def sample_inputs(
    scenario: Scenario,
    times: Array,
    layout: Layout,
    runs: NDArray[np.intp] | None = None,
    among: int = 1,
) -> tuple[Array, bool]:
    """Return a table (times or 1, runs or 1, inputs), and whether it changes over time.

    runs: indices of the wanted runs, for inputs with a row per run; among: the runs of the whole
    flight. Raises InputError.
    """
    parts: list[tuple[str, Array]] = []
    for field in FIELDS:
        value = getattr(scenario, field)
        if value is not None:
            sign = scenario.tip_wrench_sign if field == "tip_wrench" else 1.0
            width = field_width(field, layout)
            parts.append((field, sign * _at(field, value, times, width, runs, among)))
    rows = max((v.shape[0] for _, v in parts), default=1)
    count = max((v.shape[1] for _, v in parts), default=1)
    if any(v.shape[1] not in (1, count) for _, v in parts):
        held = ", ".join(f"{field} has {v.shape[1]}" for field, v in parts)
        raise InputError(
            "inputs",
            f"have different numbers of runs ({held})",
            "give equally many rows in each, or one row for all runs",
        )
    table = np.zeros((rows, count, layout.inputs))
    for field, value in parts:
        layout.add(table, FIELDS[field], value)
    return table, rows > 1


def _at(
    name: str, value: Any, times: Array, width: int, runs: NDArray[np.intp] | None, among: int
) -> Array:
    """Return an input at every time: (times or 1, runs or 1, width)."""
    if not callable(value):
        constant = np.asarray(value, float)
        return _some(constant.reshape(1, -1, constant.shape[-1]), runs)
    # Steps share their ends: each time is evaluated once.
    distinct, index = np.unique(times, return_inverse=True)
    # In blocks, as a function may return rows of more runs than are wanted.
    most = min(_TIMES_AT_ONCE, times_at_once(among, width))
    blocks = np.array_split(distinct, -(-len(distinct) // most))
    parts = [_some(evaluated(name, value, block, width), runs) for block in blocks]
    if len({part.shape[1] for part in parts}) > 1:
        raise _changing_shape(name, width)
    return np.concatenate(parts)[index]


def times_at_once(runs: int, width: int) -> int:
    """Return at how many times a function that returns rows of all runs is evaluated at once."""
    return max(1, int(BYTES_AT_ONCE / (8 * _COPIES * runs * width)))


def evaluated(name: str, value: Any, times: Array, width: int) -> Array:
    """Return a function of time at some times: (times, runs or 1, width).

    Raises InputError unless it returns that many finite numbers each time, and the same ones when
    called again.
    """
    found = asked(name, value, times, width)
    again = checks.asked_again(len(times))
    checks.repeats(name, found[again], asked(name, value, times[again], width))
    return found


def asked(name: str, value: Any, times: Array, width: int) -> Array:
    """Return values as `evaluated`, without the comparison with a second call."""
    given: list[Any] = []
    returned: list[Any] = []
    try:
        # Copied, as a function may return the same array each time. Overflow is reported below.
        with np.errstate(over="ignore", invalid="ignore"):
            if is_vectorised(value):
                given = value(times[:, None])
            else:
                for t in times.tolist():
                    returned.append(value(t))
                    given.append(np.array(returned[-1]))
    except Exception as error:
        raise InputError(
            name,
            f"raises {type(error).__name__} ({error}) during the flight",
            f"return {width} numbers at every time",
        ) from error
    if not checks.means_numbers(returned):
        meant = [checks.means_numbers(each) for each in returned]
        raise InputError(
            name,
            f"returns a boolean, a masked entry or a unit at t = {times[meant.index(False)]:g} s",
            f"return {width} numbers in SI units",
        )
    try:
        rows = np.array(given, float)
    except (TypeError, ValueError):
        rows = np.empty((0, 0))
    if rows.shape[-1] != width or rows.ndim not in (2, 3) or len(rows) != len(times):
        raise _changing_shape(name, width)
    bad = ~np.isfinite(rows.reshape(len(rows), -1)).all(-1)
    if bad.any():
        raise InputError(
            name, f"is not finite at t = {times[bad][0]:g} s", "return finite numbers at every time"
        )
    return rows.reshape(len(times), -1, width)


def _changing_shape(name: str, width: int) -> InputError:
    """Return an InputError for values of wrong shape."""
    return InputError(
        name,
        "returns values of changing or wrong shape over time",
        f"return {width} numbers, or a row of them per run, at every time",
    )


def _some(rows: Array, runs: NDArray[np.intp] | None) -> Array:
    """Return the rows (times, runs or 1, width) of some runs."""
    return rows if runs is None or rows.shape[1] == 1 else rows[:, runs]
