"""Device code of a strain field and of the axes of its cross-sections.

In kernels turning strains are in units of 1/l, and arc lengths in units of l. With y = 2 s/l - 1 and
κ = Σ_p κ_p y^p, the quaternion of the axes relative to the middle of the section is the power series

    (k + 1) a_{k+1} = 1/4 Σ_p a_{k-p} ⊗ κ_p,    a_0 = 1,

which is entire in the coordinates: no root, no division, no singularity at any shape.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.device.types import Tree, device_types
from continuair.vehicle.strain import Orders


@dataclass(frozen=True)
class FieldCode:
    """Functions of a strain field, defined below.

    Turns, Moves: vectors of the columns per coordinate that turn, or move, the cross-section.
    """

    Series: Any
    Coordinates: Any
    Turns: Any
    Moves: Any
    series_of: Any
    axes_at: Any
    turning_columns: Any
    moving_columns: Any
    advance_of: Any


@cache
def field_code(numbers: Numbers, tree: Tree, orders: Orders, nodes: int) -> FieldCode:
    """Return the functions for one kind of numbers, orders and number of nodes.

    The series has twice as many terms as there are nodes, and two: sums over the nodes are exact to
    about that degree.
    """
    types, Cell = device_types(numbers, tree), number_code(numbers).Cell
    Real, vec3, vec4, quat = types.Real, types.vec3, types.vec4, types.quat
    bending, _, twist, stretch, shear, _ = orders.counts
    counted, turning = len(orders.coordinates), orders.turning
    moving, highest, terms = counted - turning, orders.highest, 2 * nodes + 2
    Coordinates = wp.types.vector(counted, Real)
    Turns = wp.types.vector(3 * turning, Real)
    Moves = wp.types.vector(3 * max(moving, 1), Real)
    Series = wp.types.matrix((terms + highest, 4), Real)
    Powers = wp.types.matrix((highest + 1, 3), Real)
    # Of a component's monomials from its Legendre coefficients.
    Monomials = wp.types.matrix((highest + 1, highest + 1), Cell)
    monomials = Monomials(*_monomials(highest + 1).ravel())
    Reciprocals = wp.types.vector(terms, Cell)
    reciprocals = Reciprocals(*(1.0 / (k + 1) for k in range(terms)))
    zero, quarter, one, two = (Real(x) for x in (0.0, 0.25, 1.0, 2.0))
    last, middle, of_twist = terms + highest - 1, highest, 2 * bending
    of_stretch, of_shear = of_twist + twist, of_twist + twist + stretch
    Legendre = wp.types.vector(4, Real)

    @wp.func
    def legendre(y: Real):
        """Return the first four Legendre polynomials at y from -1 to 1."""
        square = y * y
        return Legendre(
            one, y, Real(1.5) * square - Real(0.5), y * (Real(2.5) * square - Real(1.5))
        )

    @wp.func
    def powers_of(q: Coordinates):
        """Return κ/4 as a polynomial in y, the lowest power first."""
        out = Powers()
        for k in range(bending):
            for p in range(bending):
                factor = quarter * Real(monomials[k, p])
                out[k, 0] = out[k, 0] + factor * q[bending + p]
                out[k, 1] = out[k, 1] - factor * q[p]
        for k in range(twist):
            for p in range(twist):
                out[k, 2] = out[k, 2] - quarter * Real(monomials[k, p]) * q[of_twist + p]
        return out

    @wp.func
    def series_of(q: Coordinates):
        """Return the quaternion's power series, after `highest` rows of zeros."""
        powers = powers_of(q)
        out = Series()
        out[middle, 3] = one
        count = wp.int32(terms - 1)
        for k in range(count):
            sum = vec4()
            for p in range(highest + 1):
                a = out[middle + k - p]
                u = powers[p, 0]
                v = powers[p, 1]
                sum += vec4(a[3] * u - a[2] * v, a[3] * v + a[2] * u, a[0] * v - a[1] * u,
                            -a[0] * u - a[1] * v)  # fmt: skip
                if wp.static(twist > 0):
                    w = powers[p, 2]
                    sum += vec4(a[1] * w, -a[0] * w, a[3] * w, -a[2] * w)
            out[middle + k + 1] = Real(reciprocals[k]) * sum
        return out

    @wp.func
    def axes_at(series: Series, y: Real):
        """Return the quaternion at y, from the axes there to those of the middle."""
        out = series[last]
        count = wp.int32(terms - 1)
        for k in range(count):
            out = y * out + series[last - 1 - k]
        return quat(out[0], out[1], out[2], out[3])

    @wp.func
    def turning_columns(y: Real, x_axis: vec3, y_axis: vec3, z_axis: vec3):
        """Return R ∂κ/∂q at y, for the coordinates that turn the cross-section."""
        of = legendre(y)
        out = Turns()
        for p in range(bending):
            for j in range(3):
                out[3 * p + j] = -of[p] * y_axis[j]
                out[3 * (bending + p) + j] = of[p] * x_axis[j]
        for p in range(twist):
            for j in range(3):
                out[3 * (of_twist + p) + j] = -of[p] * z_axis[j]
        return out

    @wp.func
    def moving_columns(y: Real, x_axis: vec3, y_axis: vec3, z_axis: vec3):
        """Return R ∂ε/∂q at y, for the other coordinates."""
        of = legendre(y)
        out = Moves()
        for p in range(stretch):
            for j in range(3):
                out[3 * p + j] = -of[p] * z_axis[j]
        for p in range(shear):
            for j in range(3):
                out[3 * (stretch + p) + j] = of[p] * x_axis[j]
                out[3 * (stretch + shear + p) + j] = of[p] * y_axis[j]
        return out

    @wp.func
    def advance_of(q: Coordinates, y: Real, x_axis: vec3, y_axis: vec3, z_axis: vec3):
        """Return R ε at y."""
        out = -z_axis
        if wp.static(moving > 0):
            of = legendre(y)
            for p in range(stretch):
                out -= of[p] * q[of_stretch + p] * z_axis
            for p in range(shear):
                out += of[p] * q[of_shear + p] * x_axis
                out += of[p] * q[of_shear + shear + p] * y_axis
        return out

    return holding(FieldCode, locals())


def _monomials(count: int) -> np.ndarray:
    """Return the coefficients of y^k (row) in the Legendre polynomials (column)."""
    out = np.zeros((count, count))
    for p in range(count):
        out[: p + 1, p] = np.polynomial.legendre.leg2poly(np.eye(count)[p])
    return out
