"""Inertia matrices and attitudes of rigid bodies, as fields of parameter models."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from continuair.vehicle.fields import ROUNDING, Quaternion, finite
from continuair.warning import warn

Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]

# No rigid body exceeds the triangle inequality of its moments; rounded or measured data may.
_TRIANGLE_EXCESS = 0.05
_UNIT_NORM_TOLERANCE = 1e-3


def _unit_norm(value: tuple[float, float, float, float]) -> tuple[float, ...]:
    norm = math.hypot(*value)
    if abs(norm - 1) > _UNIT_NORM_TOLERANCE:
        raise ValueError(f"must have norm 1 (it has {norm:.6g})")
    if abs(norm - 1) <= ROUNDING:
        return value
    return tuple(component / norm for component in value)


UnitQuaternion = Annotated[Quaternion, AfterValidator(_unit_norm)]


def symmetric_matrix(value: object) -> Matrix:
    """Return a matrix from its diagonal or 3x3 numbers; raise ValueError if not symmetric."""
    demand = "must hold 3 numbers (the diagonal) or 3 rows of 3 numbers"
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(rows, (list, tuple)) or len(rows) != 3:
        raise ValueError(demand)
    rows = [row.tolist() if isinstance(row, np.ndarray) else row for row in rows]
    try:
        if all(isinstance(row, (list, tuple)) and len(row) == 3 for row in rows):
            entries = [finite(entry) for row in rows for entry in row]
        else:
            entries = [finite(entry) for entry in rows]
    except ValueError as error:
        raise ValueError(f"{demand}, and each {error}") from None
    if len(entries) == 3:
        xx, yy, zz = entries
        return (xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = entries
    tolerance = ROUNDING * max(map(abs, entries))
    if max(abs(xy - yx), abs(xz - zx), abs(yz - zy)) > tolerance:
        raise ValueError("must be symmetric")
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def principal_moments(matrix: Matrix) -> list[float]:
    """Return the principal moments of a symmetric matrix in ascending order."""
    if not (matrix[0][1] or matrix[0][2] or matrix[1][2]):
        return sorted((matrix[0][0], matrix[1][1], matrix[2][2]))
    moments: list[float] = np.linalg.eigvalsh(matrix).tolist()
    return moments


def check_moments(field: str, smallest: float, middle: float, largest: float) -> None:
    """Raise ValueError, or warn, if no distribution of mass has these principal moments."""
    if largest <= (smallest + middle) * (1 + ROUNDING):
        return
    text = (
        f"largest principal moment {largest:.6g} kg m² exceeds the sum "
        f"{smallest + middle:.6g} kg m² of the others"
    )
    if largest > (smallest + middle) * (1 + _TRIANGLE_EXCESS):
        raise ValueError(f"belongs to no rigid body: {text} by more than 5 %")
    text = f"{field} belongs to no rigid body, but is used as given: {text} by less than 5 %."
    warn(text, stacklevel=2)
