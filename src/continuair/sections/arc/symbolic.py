"""An arc in CasADi: docs/explanation/fast_form.md derives every term."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import casadi as ca
import numpy as np
from casadi import DM, SX

from continuair.device.types import FULL_LENGTH, MAX_BEND_ANGLE
from continuair.sections.arc.moments import MOMENTS, length_unit
from continuair.sections.symbolic import Frame
from continuair.vehicle.section import Section

_UP = DM([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class BentArc:
    """An arc on its base.

    bend: k (2,). rate (2, n): k̇ as a matrix times the rates z. table: its moments as polynomials.
    """

    section: Section
    base: Frame
    bend: SX
    rate: DM
    table: np.ndarray

    def frame(self, share: float = 1.0) -> Frame:
        """Return the frame at a share of the length; at 1 it is the base of the next section."""
        unit = share * length_unit(self.section.length)
        b = unit * self.bend
        x, y, u = b[0], b[1], ca.sumsqr(b)
        f = _moments(self.table, u)
        A, Γ = f["A"], f["Gamma"]
        B = FULL_LENGTH - u * Γ
        p = unit * ca.vertcat(A * b, -B)
        R = ca.blockcat(
            [[1 - A * x * x, -A * x * y, -B * x], [-A * x * y, 1 - A * y * y, -B * y],
             [B * x, B * y, 1 - u * A]]
        )  # fmt: skip
        J_w = unit * ca.blockcat(
            [[Γ * x * y, FULL_LENGTH - Γ * x * x], [Γ * y * y - FULL_LENGTH, -Γ * x * y],
             [-A * y, A * x]]
        )  # fmt: skip
        turns = self.base.turns + J_w @ self.rate
        moves = self.base.moves - ca.skew(p) @ self.base.turns
        moves += ca.jacobian(p, self.bend) @ self.rate
        return Frame(self.base.axes @ R, R.T @ moves, R.T @ turns)

    @property
    def motion(self) -> SX:
        """Return the Jacobian (8, n) of the motion of its base and its bend."""
        return ca.vertcat(self.base.motion, self.rate)

    @property
    def inertia(self) -> SX:
        """Return the inertia (8, 8) for velocity and angular velocity of its base, and k̇."""
        unit = length_unit(self.section.length)
        b = unit * self.bend
        f = _moments(self.table, ca.sumsqr(b))
        flat, aside = ca.vertcat(b, 0), ca.vertcat(b[1], -b[0], 0)
        H = ca.vertcat(f["alpha"] * b, -f["beta"])
        I = (_axial_inertia(self.section) + ca.sumsqr(b) * f["P"] + f["S"]) * DM.eye(3)
        I -= f["P"] * flat @ flat.T - f["Q"] * (flat @ _UP.T + _UP @ flat.T) + f["S"] * _UP @ _UP.T
        J = f["KQ"] * DM([[0, 1], [-1, 0], [0, 0]]) + 2 * f["KW"] * aside @ b.T
        J = unit * (J - f["KP"] * _UP @ aside[:2].T)
        N = unit**2 * (f["NP"] * DM.eye(2) + f["ND"] * b @ b.T)
        J_c = ca.jacobian(H, self.bend)
        return ca.blockcat(
            [[self.section.mass * DM.eye(3), -ca.skew(H), J_c], [ca.skew(H), I, J], [J_c.T, J.T, N]]
        )

    @property
    def bent(self) -> SX:
        """Return the squared share of a full circle by which it is bent."""
        return ca.sumsqr(self.bend * self.section.length) / MAX_BEND_ANGLE**2


def _axial_inertia(section: Section) -> float:
    backbone = section.axial_inertia_per_length * section.length
    return backbone + sum(disk.axial_inertia for disk in section.disks)


def _moments(table: np.ndarray, u: SX) -> dict[str, SX]:
    """Return the moments of a section at u = |b|², by Horner's rule in u - 1."""
    return {
        name: reduce(lambda value, term: value * (u - 1) + term, terms)
        for name, terms in zip(MOMENTS, table.T.tolist(), strict=True)
    }
