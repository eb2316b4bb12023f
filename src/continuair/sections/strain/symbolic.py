"""A section with a strain field in CasADi: the integrals at its nodes of element.py and native.py.

With A the integration matrix of nodes, R their axes and columns of the coordinates,

    p = l A R ε,    W = A R ∂κ/∂q,    P = l A (W × R ε + R ∂ε/∂q).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, SX
from numpy.polynomial.legendre import Legendre, leg2poly

from continuair.device.types import MAX_BEND_ANGLE
from continuair.sections.strain.element import BODIES
from continuair.sections.strain.nodes import gauss, integration
from continuair.sections.symbolic import Frame
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS, TURNING

_X, _Y, _Z = DM.eye(3)[:, 0], DM.eye(3)[:, 1], DM.eye(3)[:, 2]

_DIRECTIONS = (-_Y, _X, -_Z, -_Z, _X, _Y)
"""Direction of κ or ε per unit of each component, in axes of the cross-section."""


@dataclass(frozen=True)
class BentRod:
    """A rod on its base.

    strain: its coordinates (n,). rate (n, N): their rates as a matrix times the rates z. table: its
    integration matrix and bodies.
    """

    section: Section
    base: Frame
    strain: SX
    rate: DM
    table: np.ndarray

    @property
    def _nodes(self) -> int:
        return self.section.node_count

    def frame(self, share: float = 1.0) -> Frame:
        """Return the frame at a share of the length; at 1 it is the base of the next section."""
        if share == 1.0:
            nodes, matrix = self.table[self._nodes + 1], self.table[: self._nodes + 1]
        else:
            points, _ = gauss(self._nodes)
            nodes, matrix = share * points, share * integration(points)
        p, P, W = self._moved(nodes, matrix)[-1]
        R = self._axes(share)
        turns = self.base.turns + W @ self.rate
        moves = self.base.moves - ca.skew(p) @ self.base.turns + P @ self.rate
        return Frame(self.base.axes @ R, R.T @ moves, R.T @ turns)

    @property
    def motion(self) -> SX:
        """Return the Jacobian (6 + n, N) of the motion of its base and its coordinates."""
        return ca.vertcat(self.base.motion, self.rate)

    @property
    def inertia(self) -> SX:
        """Return the inertia (6 + n, 6 + n) for velocity and turning of its base, and rates."""
        first = self._nodes + 1
        nodes, masses, across, axial = self.table[first : first + len(BODIES) - 1]
        found = SX(6 + self.strain.numel(), 6 + self.strain.numel())
        moved = self._moved(nodes, self.table[:first])[:-1]
        for node, mass, aside, along, at in zip(nodes, masses, across, axial, moved, strict=True):
            p, P, W = at
            z = self._axes(node)[:, 2]
            moves = ca.horzcat(DM.eye(3), -ca.skew(p), P)
            turns = ca.horzcat(DM(3, 3), DM.eye(3), W)
            own = aside * DM.eye(3) + (along - aside) * z @ z.T
            found += mass * moves.T @ moves + turns.T @ own @ turns
        return found

    @property
    def bent(self) -> SX:
        """Return the squared share of a full circle by which it turns, or its stretch if larger."""
        sums = [SX(0)] * len(COMPONENTS)
        for index, (component, _) in enumerate(self.section.orders.coordinates):
            sums[component] += ca.fabs(self.strain[index])
        turning = ca.sumsqr(ca.vertcat(*sums[:TURNING]) * self.section.length) / MAX_BEND_ANGLE**2
        return ca.fmax(turning, sums[COMPONENTS.index("stretch")])

    def _moved(self, nodes: np.ndarray, matrix: np.ndarray) -> list[tuple[SX, SX, SX]]:
        """Return point, and columns of its velocity and turning, at each node and at the end.

        matrix (nodes + 1, nodes): integrals to each node and to the end, over the length.
        """
        turned, moves, steps = zip(*map(self._columns, nodes), strict=True)
        p, W = _integrals(matrix, steps), _integrals(matrix, turned)
        swept = [
            moved - ca.skew(step) @ turn
            for moved, step, turn in zip(moves, steps, W[:-1], strict=True)
        ]
        return list(zip(p, _integrals(matrix, swept), W, strict=True))

    def _columns(self, share: float) -> tuple[SX, SX, SX]:
        """Return l R ∂κ/∂q and l R ∂ε/∂q (3, n), and l R ε (3,), at a share of the length."""
        coordinates, length = self.section.orders.coordinates, self.section.length
        turned, moves = DM(3, len(coordinates)), DM(3, len(coordinates))
        for index, (component, order) in enumerate(coordinates):
            value = float(Legendre.basis(order, domain=[0.0, 1.0])(share))
            columns = turned if component < TURNING else moves
            columns[:, index] = length * value * _DIRECTIONS[component]
        R = self._axes(share)
        return R @ turned, R @ moves, R @ (moves @ self.strain - length * _Z)

    def _axes(self, share: float) -> SX:
        """Return the axes (3, 3) of the cross-section at a share of the length."""
        x, y, z, w = ca.vertsplit(
            _product(_inverse(self._quaternion(0.0)), self._quaternion(share))
        )
        return ca.blockcat(
            [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        )  # fmt: skip

    def _quaternion(self, share: float) -> SX:
        """Return the quaternion of the axes relative to those at the middle."""
        y = 2.0 * share - 1.0
        return sum(y**k * term for k, term in enumerate(self._series))

    @cached_property
    def _series(self) -> list[SX]:
        """Return the power series of that in y, as long as the one of the kernels."""
        powers = self._powers
        found = [SX(DM([0.0, 0.0, 0.0, 1.0]))]
        for k in range(2 * self._nodes + 1):
            terms = (_product(found[k - p], powers[p]) for p in range(min(k + 1, len(powers))))
            found.append(sum(terms) / (k + 1))
        return found

    @property
    def _powers(self) -> list[SX]:
        """Return the coefficients of l κ/4 as a polynomial in y, quaternions without real part."""
        orders = self.section.orders
        found = [SX(4, 1) for _ in range(orders.highest + 1)]
        for index, (component, order) in enumerate(orders.coordinates[: orders.turning]):
            for k, factor in enumerate(leg2poly([0.0] * order + [1.0])):
                unit = ca.vertcat(_DIRECTIONS[component], 0)
                found[k] += 0.25 * self.section.length * factor * self.strain[index] * unit
        return found


def _integrals(matrix: np.ndarray, values: list[SX] | tuple[SX, ...]) -> list[SX]:
    """Return the sums of values at nodes by each row of a matrix (rows, nodes)."""
    return [sum(float(a) * value for a, value in zip(row, values, strict=True)) for row in matrix]


def _product(a: SX, b: SX) -> SX:
    """Return the product of quaternions x y z w."""
    u, v = a[:3], b[:3]
    return ca.vertcat(a[3] * v + b[3] * u + ca.cross(u, v), a[3] * b[3] - ca.dot(u, v))


def _inverse(a: SX) -> SX:
    """Return the conjugate of a quaternion x y z w."""
    return ca.vertcat(-a[:3], a[3])
