"""Derivatives of packed parameters with respect to fields of a vehicle, by finite differences.

Packing is a smooth closed form of the fields, so that differences of fourth order are accurate to
about 1e-11 with steps of 2e-4 of a field's scale. The scale is the field's value. For a field that
is 0, or has little effect, steps are shortened until results agree.
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
"""Step of a difference, as a share of the field's scale. Quaternions then keep their norm of 1
within the 1e-3 that is accepted."""

_SHORTER, _MOST = 8.0, 16
"""Factor by which scales are shortened, and the most repetitions."""

_AGREE = 3e-8
"""Relative difference of derivatives with successive steps, beyond rounding."""

_ROUNDING = 16 * np.finfo(float).eps
"""Rounding error of a difference before division by its step, relative to the number: sums of
weights are up to 11, and BLAS rounds differently on different processors."""

_COUNTS = 1e-3
"""Relative change of a number over the scale of a field that counts. Rounding leaves smaller
changes too few digits to agree."""

_STENCILS = (
    (np.array([-2.0, -1.0, 1.0, 2.0]), np.array([1.0, -8.0, 8.0, -1.0]) / 12.0),
    (np.arange(5.0), np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0),
    (-np.arange(5.0), -np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0),
)
"""Positions and weights of differences of fourth order: central, and one-sided if the other side is
invalid, such as a negative mass or a disk beyond the end of its section."""


@dataclass(frozen=True)
class Tangents:
    """Derivatives of a plain vehicle's packed parameters with respect to fields.

    fields: name -> shape; the entries of all fields, in order, are the directions. plants:
    (directions, numbers). table: polynomials (directions, terms, functions).
    """

    fields: dict[str, tuple[int, ...]]
    plants: Array
    table: Array

    @property
    def of_attitudes(self) -> bool:
        """Return whether a field is an attitude, or an entry of one."""
        return any("attitude" in name.split(".") for name in self.fields)

    def named(self, directions: Array) -> dict[str, Array]:
        """Return derivatives (directions,) as arrays with the fields' shapes."""
        found, first = {}, 0
        for name, shape in self.fields.items():
            size = int(np.prod(shape))
            found[name] = directions[first : first + size].reshape(shape)
            first += size
        return found


def tangents_of(vehicle: Vehicle, fields: tuple[str, ...], Plant: Any) -> Tangents:
    """Return the derivatives with respect to fields, by dotted names; Plant: struct of a vehicle.

    Raises InputError for a field that is not numeric.
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
    """Return the numeric value of a field."""
    value = value_of(vehicle, name)
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if not np.isfinite(found).all() or found.ndim > 2 or not found.size:
        raise InputError(
            "fields",
            f"holds {name}, which is {shown(value)} in the vehicle",
            "name numeric fields, such as arm.length or uav.mass",
        )
    return found


def _moves(value: Array) -> Iterator[Array]:
    """Yield the change of a value for each of its entries.

    Matrices stay symmetric: both off-diagonal entries change by a half, so that the sum over all
    entries of derivatives times changes is the total change.
    """
    for index in np.ndindex(value.shape):
        moved = np.zeros(value.shape)
        for entry in (index, index[::-1]):
            moved[entry] += 0.5
        yield moved


def _tangent(
    vehicle: Vehicle, name: str, value: Array, moved: Array, own: tuple[Array, Array], Plant: Any
) -> tuple[Array, Array]:
    """Return derivatives of plant and polynomials along a change; own: both of the vehicle."""

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
    """Return whether a number changes over the scale of a field by more than rounding."""
    return any(
        bool((np.abs(slope) * scale > _COUNTS * np.abs(of)).any())
        for slope, of in zip(found, own, strict=True)
    )


def _apart(found: Array, finer: Array, own: Array, scale: float) -> float:
    """Return the largest relative difference of derivatives beyond rounding.

    Tables are compared by columns. scale: of the first derivative; the second's is shorter.
    """
    size = np.maximum(np.abs(finer), _COUNTS * np.abs(own) / scale)
    off, rounding = np.abs(found - finer), _ROUNDING * _SHORTER / (_STEP * scale) * np.abs(own)
    if found.ndim > 1:
        size, off, rounding = (each.max(axis=0) for each in (size, off, rounding))
    off = np.maximum(off - rounding, 0.0)
    return float(np.divide(off, size, out=np.zeros_like(off), where=size > 0.0).max())


def _difference(
    vehicle: Vehicle, name: str, value: Array, moved: Array, step: float, Plant: Any
) -> tuple[Array, Array]:
    """Return differences of fourth order along a change of a value; moved: change by one step."""
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
    raise InputError(
        "fields", f"holds {name}, which cannot change ({refused[0].problem})", "leave it out"
    )
