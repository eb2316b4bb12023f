"""Derivatives of steps and tips of a simulation, launched over an engine's threads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import DIRECTIONS
from continuair.engine.engine import Drive, Engine
from continuair.engine.factory import step_slopes, tip_slopes
from continuair.engine.lanes import packs_of
from continuair.engine.tangents import Tangents
from continuair.kernels.slopes import Directions, tip_columns
from continuair.vehicle.layout import width_of

Array = np.ndarray


class Slopes:
    """Derivatives with respect to inputs, state, initial state and fields of one vehicle.

    directions: indices of inputs, state and initial state; fields: indices of the tangents.
    """

    def __init__(self, engine: Engine, tangents: Tangents) -> None:
        self.engine = engine
        # Kernels for arms without rotated mounts lack the terms of a rotation.
        self._tree = replace(engine.tree, turned=engine.tree.turned or tangents.of_attitudes)
        self._kernel, Vehicles = step_slopes(self._tree, engine.model)
        self.directions = Directions(engine.layout, engine.model == "independent")
        first = self.directions.start.stop
        self.fields = slice(first, first + len(tangents.plants))
        self._blocks = packs_of(self.fields.stop, DIRECTIONS)
        plants = self._dual(engine.plants.view(float).ravel(), tangents.plants)
        self._vehicles = Vehicles()
        self._vehicles.plants = engine.upload(plants)
        self._vehicles.coefficients = engine.upload(self._dual(engine.table[0], tangents.table))

    def of_steps(self, grid: Any, drive: Drive, log: Array, part: slice) -> Array:
        """Return derivatives (n, directions, state) of the states at the ends of some steps.

        log: states (steps + 1, columns) at the starts of all steps, and at the end.
        """
        engine = self.engine
        acting, steps = engine.drive(drive, slice(None), 3), engine.steps(grid)
        rows = engine.upload(log[None])

        def launch(at: slice, found: Array) -> list[Any]:
            return [self._vehicles, acting, steps, rows, at.start, found]

        return self._launched(self._kernel, part, engine.layout.state, launch)

    def of_tips(self, log: Array) -> Array:
        """Return derivatives (n, directions, tip_columns) at states (n, columns)."""
        engine = self.engine
        width = width_of(tip_columns(engine.layout.arms))

        def launch(at: slice, found: Array) -> list[Any]:
            return [self._vehicles.plants, engine.upload(log[None, at]), found]

        return self._launched(tip_slopes(self._tree), slice(0, len(log)), width, launch)

    def _launched(self, kernel: wp.Kernel, part: slice, width: int, arguments: Any) -> Array:
        """Return the results of a kernel (n, directions, width) for some rows, on all threads."""
        engine, count = self.engine, part.stop - part.start
        out = np.empty((count, self.fields.stop, width))

        def work(at: slice) -> None:
            n = at.stop - at.start
            found = np.empty((self.fields.stop, n, width))
            engine.launch(kernel, (self._blocks, n), arguments(at, engine.upload(found)))
            out[at.start - part.start : at.stop - part.start] = found.transpose(1, 0, 2)

        edges = np.linspace(part.start, part.stop, min(engine.threads, count) + 1).astype(int)
        engine.side_by_side(
            work, [slice(*ends) for ends in zip(edges[:-1], edges[1:], strict=True)]
        )
        return out

    def _dual(self, values: Array, tangents: Array) -> Array:
        """Return dual numbers (blocks, ..., n (1 + DIRECTIONS)): values before their derivatives.

        values: (..., n); tangents: derivatives with respect to the fields, (fields, ..., n). Other
        derivatives are 0.
        """
        rows = np.zeros((self._blocks * DIRECTIONS, *values.shape))
        if len(tangents):
            rows[self.fields] = tangents
        found = np.empty((self._blocks, *values.shape, 1 + DIRECTIONS))
        found[..., 0] = values
        found[..., 1:] = np.moveaxis(rows.reshape(self._blocks, DIRECTIONS, *values.shape), 1, -1)
        return found.reshape(self._blocks, *values.shape[:-1], -1)
