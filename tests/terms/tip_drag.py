"""A term that only the tests define: linear drag of the tips in air at rest."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import warp as wp

from continuair.kernels.arm.tip import tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.term_sum import Acting
from continuair.kernels.types import Tree, device_types
from continuair.terms.term import Term
from continuair.vehicle.vehicle import Vehicle

PER_VELOCITY = 0.4
"""Drag of a tip [N s/m]."""


@dataclass(frozen=True)
class TipDrag(Term):
    """-c v of every tip, of a vehicle that says so by its name."""

    name: ClassVar[str] = "tip drag"

    field: ClassVar[str] = "tip_drag"
    differentiable: ClassVar[bool] = False
    has_power: ClassVar[bool] = True

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        return cls() if vehicle.name == cls.name else None

    def device(self, numbers: Numbers, tree: Tree, frozen_arm: bool) -> Acting:
        return Acting(on_arm=lambda arm: _load(numbers, tree, frozen_arm, arm))

    def casadi(self, model: Any) -> Any:
        found = model.none
        for arm in model.arms:
            found -= PER_VELOCITY * arm.tip.moves.T @ (arm.tip.moves @ model.rates)
        return found


class WithoutForm(TipDrag):
    """The same without a form in CasADi."""

    name: ClassVar[str] = "without form"

    def casadi(self, model: Any) -> Any:
        return None


def _load(numbers: Numbers, tree: Tree, frozen_arm: bool, arm: int) -> Any:
    types, tips = device_types(numbers, tree), tip_code(numbers, tree)
    Load, Flight = load_code(numbers, tree).Load, flight_code(numbers, tree).Flight
    State, Push, Along, vec3 = types.State, types.Push, types.Along, types.vec3
    attitude_of, world_tip, tip_of = types.attitude_of, tips.world_tip_of(arm), tips.tip_of(arm)
    wrench_on, drag = tips.wrench_on(arm), types.Real(-PER_VELOCITY)

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        plant, q = flight.plant, attitude_of(y)
        force = drag * world_tip(y, plant).velocity
        tip = tip_of(y, plant)
        out = Load()
        out.force = wp.quat_rotate_inv(q, force)
        point = tip.point
        on_arm = out.force
        if wp.static(frozen_arm):
            frozen = flight.frozen
            point = vec3(frozen.tips[arm, 0], frozen.tips[arm, 1], frozen.tips[arm, 2])
            on_arm = wp.quat_rotate_inv(frozen.attitude, force)
        out.moment = wp.cross(point, out.force)
        out.bend = wrench_on(y, plant, tip, on_arm, vec3())
        return out

    return load
