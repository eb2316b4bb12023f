"""How what kernels read of a vehicle changes with a field of it: differences of the host's packing.

Packing a vehicle is a smooth closed form of its fields, so that differences of fourth order are
right to about 1e-11 where steps are 2e-4 of the scale on which a field counts. That is its value;
or, of a field that is 0 or hardly counts, found by steps that get shorter until they agree.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair.engine.pack import pack_plants, pack_table
from continuair.errors import InputError, shown
from continuair.vehicle.replacing import value_of
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

Array = np.ndarray

_STEP = 2e-4
"""Of a difference, as a share of the field's scale. Quaternions keep their norm of 1 to the 1e-3
that they are read with."""

_SHORTER, _MOST = 8.0, 16
"""The factor by which scales get shorter, and how often they do at the most."""

_AGREE = 3e-8
"""Share of a derivative by which two steps in a row may differ, beside what rounding explains."""

_ROUNDING = 16 * np.finfo(float).eps
"""Of a difference before its step divides it, as a share of the number: sums of weights are up to
11, and BLAS of different processors round differently."""

_COUNTS = 1e-3
"""Change of a number along the scale of a field, as a share of that number, which counts: of
smaller ones rounding leaves too few digits to agree."""

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

    @property
    def of_attitudes(self) -> bool:
        """Whether a field is an attitude, or a number of one."""
        return any("attitude" in name.split(".") for name in self.fields)

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
    own = pack_plants(vehicle, Plant).view(float).ravel(), pack_table(vehicle, 1)[0]
    for name in fields:
        value = _numbers(vehicle, name)
        shapes[name] = value.shape
        for moved in _moves(value):
            plant, table = _tangent(vehicle, name, value, moved, own, Plant)
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
    vehicle: Vehicle, name: str, value: Array, moved: Array, own: tuple[Array, Array], Plant: Any
) -> tuple[Array, Array]:
    """Derivatives of plant and polynomials as a value moves; own: both of the vehicle itself."""

    def along(scale: float) -> tuple[Array, Array]:
        return _difference(vehicle, name, value, _STEP * scale * moved, _STEP * scale, Plant)

    def apart(found: tuple[Array, Array], finer: tuple[Array, Array], scale: float) -> float:
        return max(_apart(*each, scale) for each in zip(found, finer, own, strict=True))

    scale = float(np.abs(value).max())
    found = along(scale) if scale > 0.0 else None
    if found is None or not _counts(found, own, scale):
        scale = max(scale, 1.0)
        found = along(scale)
    best, least = found, np.inf
    for _ in range(_MOST):
        finer = along(scale / _SHORTER)
        off = apart(found, finer, scale)
        if off < least:
            best, least = found, off
        if off < _AGREE:
            break
        found, scale = finer, scale / _SHORTER
    return best


def _counts(found: tuple[Array, Array], own: tuple[Array, Array], scale: float) -> bool:
    """Whether some number changes along the scale of a field by more than rounding tells of."""
    return any(
        bool((np.abs(slope) * scale > _COUNTS * np.abs(of)).any())
        for slope, of in zip(found, own, strict=True)
    )


def _apart(found: Array, finer: Array, own: Array, scale: float) -> float:
    """The largest share by which derivatives of numbers, or of columns of them, differ by more
    than rounding; scale: of the first, the second's is shorter."""
    size = np.maximum(np.abs(finer), _COUNTS * np.abs(own) / scale)
    off, rounding = np.abs(found - finer), _ROUNDING * _SHORTER / (_STEP * scale) * np.abs(own)
    if found.ndim > 1:
        size, off, rounding = (each.max(axis=0) for each in (size, off, rounding))
    off = np.maximum(off - rounding, 0.0)
    return float(np.divide(off, size, out=np.zeros_like(off), where=size > 0.0).max())


def _difference(
    vehicle: Vehicle, name: str, value: Array, moved: Array, step: float, Plant: Any
) -> tuple[Array, Array]:
    """Differences of fourth order as a value moves; moved: by a step."""
    refused: list[InputError] = []
    for places, weights in _STENCILS:
        values = value + np.multiply.outer(places, moved)
        try:
            with untold():
                batch = vehicle.replace({name: values})
        except InputError as error:
            refused.append(error)
            continue
        plants = pack_plants(batch, Plant).view(float).reshape(len(places), -1)
        of = weights / step
        return of @ plants, np.tensordot(of, pack_table(batch, 1), 1)
    raise InputError(f"fields holds {name}, which cannot change: {refused[0]}")
