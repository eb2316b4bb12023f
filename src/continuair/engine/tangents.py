"""How what kernels read of a vehicle changes with a field of it: differences of the host's packing.

Packing a vehicle is a smooth closed form of its fields, so that differences of fourth order, of
steps of 2e-4 of the value, are right to about 1e-11.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.engine.pack import pack_plants, pack_table
from continuair.errors import ContinuairWarning, InputError, shown
from continuair.vehicle.replacing import value_of
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_STEP = 2e-4
"""Of a difference, as a share of the value, or of the largest of a field's; of 1 where that is 0.
Quaternions keep their norm of 1 to the 1e-3 that they are read with."""

_STENCILS = (
    (np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0),
    (np.arange(5.0), np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0),
    (-np.arange(5.0), -np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0),
)
"""Places and weights of differences of fourth order: central, and to one side where the other is
refused, such as a mass below 0 or a disk beyond the end of its section."""


@dataclass(frozen=True)
class Tangents:
    """Derivatives of a plain vehicle's plant (directions, numbers) and polynomials (directions,
    terms, functions) along fields: names -> their shapes, whose entries are directions in turn."""

    fields: dict[str, tuple[int, ...]]
    plants: Array
    table: Array

    def named(self, directions: Array) -> dict[str, Array]:
        """Derivatives along the directions (directions,) as arrays of the fields' shapes."""
        found, first = {}, 0
        for name, shape in self.fields.items():
            size = int(np.prod(shape))
            found[name] = directions[first : first + size].reshape(shape)
            first += size
        return found


def tangents_of(vehicle: Vehicle, fields: tuple[str, ...], Plant: Any) -> Tangents:
    """Tangents along fields, by their dotted names; Plant: the struct that holds a vehicle.

    Raises InputError for what is no number or array of numbers.
    """
    shapes, plants, tables = {}, [], []
    for name in fields:
        value = _numbers(vehicle, name)
        shapes[name] = value.shape
        for moved in _moves(value):
            plant, table = _tangent(vehicle, name, value, moved, Plant)
            plants.append(plant)
            tables.append(table)
    none = np.zeros((0, 0)), np.zeros((0, 0, 0))
    return Tangents(shapes, *(np.array(each) for each in (plants, tables)) if plants else none)


def _numbers(vehicle: Vehicle, name: str) -> Array:
    """The value of a field."""
    value = value_of(vehicle, name)
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if not np.isfinite(found).all() or found.ndim > 2 or not found.size:
        raise InputError(
            f"fields holds {name}, which is {shown(value)} in the vehicle; name fields that hold "
            "numbers, such as arm.length or uav.mass."
        )
    return found


def _moves(value: Array) -> Iterator[Array]:
    """For each entry of a value what moves. Matrices stay symmetric: beside the diagonal both
    entries move by a half, so that derivatives times changes add up over all entries."""
    for index in np.ndindex(value.shape):
        moved = np.zeros(value.shape)
        for entry in (index, index[::-1]):
            moved[entry] += 0.5
        yield moved


def _tangent(
    vehicle: Vehicle, name: str, value: Array, moved: Array, Plant: Any
) -> tuple[Array, Array]:
    """Derivatives of plant and polynomials as a value moves."""
    size = float(np.abs(value).max())
    step = _STEP * (size if size > 0.0 else 1.0)
    refused: list[InputError] = []
    for places, weights in _STENCILS:
        values = value + step * np.multiply.outer(places, moved)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ContinuairWarning)
                batch = vehicle.replace({name: values})
        except InputError as error:
            refused.append(error)
            continue
        plants = pack_plants(batch, Plant).view(float).reshape(len(places), -1)
        of = weights / step
        return of @ plants, np.tensordot(of, pack_table(batch, 1), 1)
    raise InputError(f"fields holds {name}, which cannot change: {refused[0]}")
