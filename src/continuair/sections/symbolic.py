"""Moving frames on an arm, in CasADi."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX


@dataclass(frozen=True)
class Frame:
    """A moving frame on an arm.

    axes (3, 3): rotation from its own axes to the body's. moves (3, n) and turns (3, n): velocity
    of its origin and angular velocity, in its own axes, as matrices times the rates z.
    """

    axes: SX
    moves: SX
    turns: SX

    @property
    def motion(self) -> SX:
        """Return both Jacobians (6, n)."""
        return ca.vertcat(self.moves, self.turns)
