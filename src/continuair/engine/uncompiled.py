"""A few states, or samples of a log, without a compiler: kernels run by Python."""

from __future__ import annotations

from collections.abc import Callable, Collection
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from continuair.device.interpreted import Rows, Struct, interpreted, struct_from, vector_rows

if TYPE_CHECKING:
    from continuair.engine.engine import Drive, Engine, Start

Array = np.ndarray

MOST_STATES = 4096
"""States whose rates Python computes: in 0.1 s for an arm of three sections, whose kernel takes 6 s
to compile."""

MOST_SAMPLES = 5 * MOST_STATES
"""Samples that Python looks back at, as many at once as states: in 0.6 s for the same arm, against
10 s."""


def few_rates(engine: Engine, start: Start, drive: Drive, runs: Array | None) -> Array | None:
    """Return the rates (runs, state) of `Engine.derivative`, or None for compiled code to do so.

    Rates of a state are the same to the last bit alone and beside others, and differ from those of
    the kernel by rounding.
    """
    if len(start.states) > MOST_STATES or engine.dtype != np.float64:
        return None
    states = engine.with_rotors(start.states)[:, None]
    frozen = states if start.frozen is None else engine.with_rotors(start.frozen)[:, None]
    begin = SimpleNamespace(states=states, frozen=frozen, angle=np.asarray(start.angle))
    rates = np.empty((len(states), engine.layout.state))

    def each(vehicles: Any) -> None:
        function = interpreted(engine.kernels_of(1).derivative)
        _run(function, np.arange(len(states)), (vehicles, begin, _acting(drive, 0), rates))

    return rates if _works(engine, runs, each) else None


def few_columns(
    engine: Engine, log: Array, drive: Drive, names: Collection[str], runs: Array | None
) -> Array | None:
    """Return the columns of `Engine.observe`, or None for compiled code to do so; see above."""
    count, samples = log.shape[:2]
    if engine.dtype != np.float64:
        return None
    out = np.full((count, samples, engine.observed_columns), np.nan)
    rows = np.arange(count * samples)

    def each(vehicles: Any) -> None:
        for kernel in engine.kernels_of(1).observers(names):
            for some in np.array_split(rows, -(-len(rows) // MOST_STATES)):
                threads = some // samples, some % samples
                _run(interpreted(kernel), threads, (vehicles, _acting(drive, 1), log, out))

    return out if _works(engine, runs, each) else None


def _works(engine: Engine, runs: Array | None, each: Callable[[Any], None]) -> bool:
    """Whether Python can do it."""
    try:
        with np.errstate(all="ignore"):
            each(_vehicles(engine, engine.kernels_of(1).types.Plant, runs))
    except Exception:
        # Whatever comes of code in words that have no translation: a compiler says what is wrong.
        return False
    return True


def _run(function: Callable[..., Any], threads: Any, arguments: tuple[Any, ...]) -> None:
    """Run a kernel on some threads, at once unless it branches on their numbers."""
    count = np.shape(threads)[-1]
    if count > 1:
        try:
            function(threads, *arguments)
            return
        except ValueError:
            # Arrays have no truth value.
            pass
    for index in range(count):
        alone = tuple(int(each[index]) for each in np.atleast_2d(threads))
        function(alone if isinstance(threads, tuple) else alone[0], *arguments)


def _acting(drive: Drive, rows: int) -> SimpleNamespace:
    """Return what stands for the struct of inputs; see `Engine.drive`."""
    return SimpleNamespace(
        inputs=drive.table,
        stride=rows * drive.timed,
        groups=drive.groups,
        gravity=np.float64(drive.gravity),
    )


def _vehicles(engine: Engine, Plant: Any, runs: Array | None) -> SimpleNamespace:
    """Return what stands for the struct of vehicles: rows of structs and of vectors."""
    own: Array | slice = slice(None) if runs is None or len(engine.plants) == 1 else runs
    plants, table = engine.plants[own], engine.table_of(own)

    def plant(index: Any) -> Struct:
        return struct_from(Plant, plants[index])

    return SimpleNamespace(plants=Rows((len(plants),), plant), coefficients=vector_rows(table))
