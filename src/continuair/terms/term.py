"""What a term is: one thing that acts on vehicles, of which its own file alone knows.

Whatever has to do with all that acts goes through the terms of a vehicle: device code, packing,
base reactions, CasADi, gradients and Lyapunov functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from continuair.kernels.numbers import Numbers
from continuair.kernels.term_sum import Acting
from continuair.kernels.types import Tree
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class Stream:
    """Air that a term moves, as device functions: its State, begun(y, flight, row, push) -> State,
    and velocity(plant, point, state) at a point in body axes [m/s]."""

    State: Any
    begun: Any
    velocity: Any


@dataclass(frozen=True)
class Term:
    """A term that acts on a vehicle, and nothing but what kernels are made for: equal terms share
    kernels.

    field: of the vehicle that has it, as refusals name it; "" for what acts on every one. in_wind:
    whether it feels the wind; in_stream: whether it feels air that others move; moves_air: whether
    it does so. differentiable: whether `gradient` knows its derivatives. has_power: whether it
    takes or gives power beside a law's push.
    """

    field: ClassVar[str] = ""
    in_wind: ClassVar[bool] = False
    in_stream: ClassVar[bool] = False
    differentiable: ClassVar[bool] = True
    has_power: ClassVar[bool] = False

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """The term as it acts on a vehicle; None if it does not."""
        return cls()

    @property
    def moves_air(self) -> bool:
        return False

    @property
    def states(self) -> int:
        """Numbers that the term adds to a state."""
        return 0

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Fields of the device's Plant, by name, with the shape of each: (), (n,) or (n, m)."""
        return {}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill these fields of structured plants (runs,)."""

    def device(self, numbers: Numbers, tree: Tree, frozen_arm: bool) -> Acting:
        """What it does on the device; frozen_arm: to an arm that stays as it starts."""
        raise NotImplementedError

    def left(self, numbers: Numbers, tree: Tree) -> Any:
        """The device function that gives what of a law's push this term does not take over; None if
        it leaves all, as every term of a vehicle but one does."""
        return None

    def stream(self, numbers: Numbers, tree: Tree) -> Stream | None:
        """The air that it moves, as one term of a vehicle at most does."""
        return None

    def observer(self, numbers: Numbers, tree: Tree) -> Any:
        """The kernel that looks back along a log at what is observed of it; None if nothing is."""
        return None

    def casadi(self, model: Any) -> SX | None:
        """Its generalised force (6 + 2 N,) in a model of interfaces/casadi_dynamics.py; None if it
        has no form in CasADi."""
        return None
