"""The multirotor that carries the arm."""

from __future__ import annotations

import numpy as np
from pydantic import field_validator

from continuair.vehicle.fields import (
    Matrix,
    Part,
    Positive,
    Vector,
    check_moments,
    symmetric_matrix,
)


class Uav(Part):
    """The multirotor, a rigid body."""

    mass: Positive
    """the mass of the UAV without the arm [kg]"""

    inertia: Matrix
    """the inertia of the UAV about its centre of mass in body axes, diagonal or 3x3 [kg m²]"""

    mount: Vector = (0.0, 0.0, 0.0)
    """the position of the arm's base in body axes, as 3 numbers [m]"""

    @field_validator("inertia", mode="before")
    @classmethod
    def _physical_inertia(cls, value: object) -> Matrix:
        matrix = symmetric_matrix(value)
        if not (matrix[0][1] or matrix[0][2] or matrix[1][2]):
            moments = sorted((matrix[0][0], matrix[1][1], matrix[2][2]))
        else:
            moments = np.linalg.eigvalsh(matrix).tolist()
        if not moments[0] > 0:
            raise ValueError(
                f"must be positive definite, and its eigenvalue {moments[0]:.6g} kg m² is not"
            )
        check_moments("uav.inertia", *moments)
        return matrix
