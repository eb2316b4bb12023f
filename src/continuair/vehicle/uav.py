"""The multirotor that carries the arms."""

from __future__ import annotations

from pydantic import field_validator

from continuair.vehicle.fields import Part, Positive, Vector
from continuair.vehicle.inertia import (
    Matrix,
    check_moments,
    principal_moments,
    symmetric_matrix,
)
from continuair.vehicle.rotors import Drag, Rotors


class Uav(Part):
    """Multirotor without its arms, a rigid body."""

    mass: Positive
    """the mass of the UAV without its arms [kg]"""

    inertia: Matrix
    """the inertia of the UAV about its centre of mass in body axes, diagonal or 3x3 [kg m²]"""

    mount: Vector = (0.0, 0.0, 0.0)
    """the position of the single arm's base ([arm]) in body axes, as 3 numbers [m]"""

    rotors: Rotors | None = None
    """the rotors, a table ([uav.rotors]); without it forces and moments act directly"""

    drag: Drag | None = None
    """the drag of UAV and rotors, a table ([uav.drag])"""

    @field_validator("inertia", mode="before")
    @classmethod
    def _physical_inertia(cls, value: object) -> Matrix:
        matrix = symmetric_matrix(value)
        moments = principal_moments(matrix)
        if not moments[0] > 0:
            raise ValueError(
                f"must be positive definite (it has eigenvalue {moments[0]:.6g} kg m²)"
            )
        check_moments("uav.inertia", *moments)
        return matrix
