"""Frames that move with an arm, in CasADi."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
from casadi import SX


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
