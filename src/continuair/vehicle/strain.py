"""Coordinates of a section with a strain field: Legendre coefficients of each component.

Strains per length, in the axes of the cross-section, whose normal is its z: turning
κ = (b_y, -b_x, -τ) and advance ε = (γ_x, γ_y, -(1 + e)). Each component that varies is
Σ_p P_p(s/l) q_p with shifted Legendre polynomials P_p.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.polynomial import legendre
from pydantic import model_validator

from continuair.errors import InputError
from continuair.typing import Array
from continuair.vehicle.fields import Part, Whole

COMPONENTS = ("bend_x", "bend_y", "twist", "stretch", "shear_x", "shear_y")
"""Names of the components, in the order of the coordinates."""

TURNING = 3
"""The first components turn the cross-section, the others move it."""


@dataclass(frozen=True)
class Orders:
    """Orders of the polynomials of a section's strain; None for a component that is left out.

    Parameters
    ----------
    bending : int
        Order of both components of the bend.
    twist, stretch, shear : int, optional
        Orders of the twist, of the stretch, and of both components of the shear.
    """

    bending: int
    twist: int | None = None
    stretch: int | None = None
    shear: int | None = None

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """Return the number of coefficients of each of `COMPONENTS`."""
        bending, twist, stretch, shear = (
            0 if order is None else order + 1
            for order in (self.bending, self.twist, self.stretch, self.shear)
        )
        return bending, bending, twist, stretch, shear, shear

    @cached_property
    def coordinates(self) -> tuple[tuple[int, int], ...]:
        """Return the component, by its index, and the order of each coordinate."""
        return tuple((c, p) for c, count in enumerate(self.counts) for p in range(count))

    @property
    def turning(self) -> int:
        """Return the number of coordinates that turn the cross-section: the first ones."""
        return sum(self.counts[:TURNING])

    @property
    def highest(self) -> int:
        """Return the highest order of the components that turn the cross-section."""
        return max(self.counts[:TURNING]) - 1

    @property
    def least_nodes(self) -> int:
        """Return the fewest nodes at which the coordinates of a component are independent."""
        return max(self.counts) + 1

    @property
    def nodes(self) -> int:
        """Return the default number of nodes: 8 for linear bending, 2 more per order, 2 for twist.

        Accelerations of rods without disks then err by less than 1e-6, up to half a circle.
        """
        return 6 + 2 * max(self.highest, 1) + 2 * (self.twist is not None)


CONSTANT = Orders(0)
"""Bending that is constant along the section, as of an arc."""


def mode_shapes(count: int, shares: Array) -> tuple[Array, Array]:
    """Return deflections and slopes of a straight clamped section of length 1 per coordinate.

    Parameters
    ----------
    count : int
        Number of coordinates of the bend in one direction.
    shares : ndarray, shape (n,)
        Arc lengths over the length, from 0 to 1.

    Returns
    -------
    deflections, slopes : ndarray, shape (n, count)
        Integrals, once and twice, of the shifted Legendre polynomials.
    """
    y = 2.0 * shares - 1.0
    slopes, deflections = np.empty((len(y), count)), np.empty((len(y), count))
    for order in range(count):
        bend = legendre.Legendre.basis(order)
        slopes[:, order] = bend.integ(1, lbnd=-1.0)(y) / 2.0
        deflections[:, order] = bend.integ(2, lbnd=-1.0)(y) / 4.0
    return deflections, slopes


_HIGHEST = {"bending": 3, "twist": 2, "stretch": 1, "shear": 1}


class Strain(Part):
    """How the strain of a section varies along it: the order of the polynomial of each component.

    Order 0 is constant along the section, 1 linear. Bending of order 0 alone is the section of
    constant curvature. A component that is left out is rigid.
    """

    bending: Whole = 0
    """the order of the bend, in both directions, 0 to 3"""

    twist: Whole | None = None
    """the order of the twist about the backbone, 0 to 2"""

    stretch: Whole | None = None
    """the order of the stretch, 0 or 1; needs the implicit method"""

    shear: Whole | None = None
    """the order of the shear, in both directions, 0 or 1; needs the implicit method"""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        for name, highest in _HIGHEST.items():
            order = getattr(self, name)
            if order is not None and order > highest:
                raise InputError(
                    name, f"is {order}, above the highest order {highest}", "give a lower order"
                )
        return self

    @property
    def orders(self) -> Orders:
        """Return the orders."""
        return Orders(self.bending, self.twist, self.stretch, self.shear)
