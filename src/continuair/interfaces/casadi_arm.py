"""Arms in CasADi: positions, velocities and inertias of their sections.

docs/explanation/fast_form.md derives every term. A section's own axes are those in which it points
along -z where it is straight. Columns of a motion are those of z = (v, ω, k̇): velocity of B's
origin and angular velocity of the body, both in body axes, and the rates of all coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, SX
from scipy.spatial.transform import Rotation

from continuair.engine.pack import pack_table
from continuair.errors import InputError, shown
from continuair.sections import kind_of
from continuair.sections.symbolic import Frame
from continuair.vehicle.arms import ArmChain, TipBody
from continuair.vehicle.vehicle import Vehicle

_HALF_TURN = np.diag([1.0, -1.0, -1.0])
"""From the axes of a body on a tip, z out of it, to those in which the arm ends along -z."""


@dataclass(frozen=True)
class Arm:
    """An arm with its sections, from its base out, as `SectionKind.symbolic` gives them, and the
    frame at its tip."""

    chain: ArmChain
    sections: list[Any]
    tip: Frame


def arms_of(vehicle: Vehicle, bends: SX) -> list[Arm]:
    """Return the arms of a vehicle at the coordinates (M,) of all sections, which are symbols."""
    z = DM.eye(vehicle.layout.coordinates)
    layout, table = vehicle.layout, pack_table(vehicle, threads=1)[0]
    arms, index, row = [], 0, 0
    for chain in vehicle.arms:
        T = DM(Rotation.from_quat(chain.attitude).as_matrix())
        moves = z[:3, :] - ca.skew(DM(chain.mount)) @ z[3:6, :]
        frame, sections = Frame(T, T.T @ moves, T.T @ z[3:6, :]), []
        for section in chain.section:
            kind = kind_of(section)
            own, rate = bends[layout.of_section[index]], z[layout.polar_of(index), :]
            rows = table[row : row + kind.rows, : kind.columns]
            found = kind.symbolic(section, frame, own, rate, rows)
            if found is None:
                raise InputError(
                    "vehicle",
                    (
                        f"{shown(vehicle.name)} has a section of kind {shown(kind.name)}, "
                        "which has no form in CasADi"
                    ),
                    "leave it out",
                )
            sections.append(found)
            frame, index, row = found.frame(), index + 1, row + kind.rows
        arms.append(Arm(chain, sections, frame))
    return arms


def body_inertia(body: TipBody) -> np.ndarray:
    """(6, 6) of a body on a tip, of the velocity and turning of that, in axes of the arm's end."""
    x, y, z = _HALF_TURN @ body.centre
    lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    off, own = body.mass * lever, _HALF_TURN @ np.asarray(body.inertia) @ _HALF_TURN
    return np.block([[body.mass * np.eye(3), -off], [off, own - off @ lever]])
