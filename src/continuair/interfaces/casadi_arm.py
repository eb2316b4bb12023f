"""Arms in CasADi: where their sections are, how they move, and what mass they have.

docs/numerics.md derives every term. A section's own axes are those in which it points along -z
where it is straight. Columns of a motion are those of z = (v, ω, k̇): velocity of B's origin and
turning of the body, both in body axes, and the rates of all bends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import casadi as ca
import numpy as np
from casadi import DM, SX
from scipy.spatial.transform import Rotation

from continuair.engine.pack import pack_table
from continuair.kernels.types import FULL_LENGTH
from continuair.sections.arc.moments import MOMENTS, length_unit
from continuair.vehicle.arms import ArmChain, TipBody
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

_HALF_TURN = np.diag([1.0, -1.0, -1.0])
"""From the axes of a body on a tip, z out of it, to those in which the arm ends along -z."""

_UP = DM([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Frame:
    """A frame that moves with an arm: axes (3, 3), its own to the body's, and, in its own axes,
    what z moves its origin (3, n) and turns it (3, n) by."""

    axes: SX
    moves: SX
    turns: SX

    @property
    def motion(self) -> SX:
        """Both (6, n)."""
        return ca.vertcat(self.moves, self.turns)


@dataclass(frozen=True)
class BentSection:
    """A section on its base: its bend k (2,), k̇ of z (2, n), and its moments as polynomials."""

    section: Section
    base: Frame
    bend: SX
    rate: DM
    table: np.ndarray

    def frame(self, share: float = 1.0) -> Frame:
        """The frame at a part of the length; at the end it is the next section's base."""
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
        """Of its base and its bend (8, n)."""
        return ca.vertcat(self.base.motion, self.rate)

    @property
    def inertia(self) -> SX:
        """(8, 8), of the velocity of its base, its turning and k̇."""
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


@dataclass(frozen=True)
class Arm:
    """An arm with its sections, from its base out, and the frame at its tip."""

    chain: ArmChain
    sections: list[BentSection]
    tip: Frame


def arms_of(vehicle: Vehicle, bends: SX) -> list[Arm]:
    """The arms of a vehicle at bends (N, 2) that are symbols."""
    z = DM.eye(vehicle.layout.coordinates)
    tables = np.split(pack_table(vehicle, threads=1)[0], vehicle.sections)
    own = vehicle.layout.polar_of
    each = ((bends[i, :].T, z[own(i), :], table) for i, table in enumerate(tables))
    arms = []
    for chain in vehicle.arms:
        T = DM(Rotation.from_quat(chain.attitude).as_matrix())
        moves = z[:3, :] - ca.skew(DM(chain.mount)) @ z[3:6, :]
        frame, sections = Frame(T, T.T @ moves, T.T @ z[3:6, :]), []
        for section in chain.section:
            sections.append(BentSection(section, frame, *next(each)))
            frame = sections[-1].frame()
        arms.append(Arm(chain, sections, frame))
    return arms


def body_inertia(body: TipBody) -> np.ndarray:
    """(6, 6) of a body on a tip, of the velocity and turning of that, in axes of the arm's end."""
    x, y, z = _HALF_TURN @ body.centre
    lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    off, own = body.mass * lever, _HALF_TURN @ np.asarray(body.inertia) @ _HALF_TURN
    return np.block([[body.mass * np.eye(3), -off], [off, own - off @ lever]])


def _axial_inertia(section: Section) -> float:
    backbone = section.axial_inertia_per_length * section.length
    return backbone + sum(disk.axial_inertia for disk in section.disks)


def _moments(table: np.ndarray, u: SX) -> dict[str, SX]:
    """The functions of a section at u = |b|², by Horner's rule in u - 1."""
    return {
        name: reduce(lambda value, term: value * (u - 1) + term, terms)
        for name, terms in zip(MOMENTS, table.T.tolist(), strict=True)
    }
