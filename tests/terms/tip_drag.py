"""Linear drag of the tips in air at rest, as docs/howto/custom_force.md shows it."""

from dataclasses import dataclass
from typing import Any, ClassVar

import warp as wp

import continuair as ca
from continuair.terms import Acting, Device


@dataclass(frozen=True)
class TipDrag(ca.Term):
    """-c v of every tip."""

    differentiable: ClassVar[bool] = True
    stiff: ClassVar[bool] = False

    per_velocity: float
    """drag of a tip over its velocity [N s/m]"""

    def device(self, code: Device) -> Acting:
        types, drag = code.types, code.reader(self.per_velocity)
        State, Flight, vec3 = types.State, code.Flight, types.vec3

        def wrench_of(arm: int) -> Any:
            world_tip = code.tips.world_tip_of(arm)

            @wp.func
            def wrench(y: State, flight: Flight, row: int):
                plant = flight.plant
                return -drag(plant) * world_tip(y, plant).velocity, vec3()

            return wrench

        return Acting(on_arm=code.on_tip(wrench_of))

    def casadi(self, model: Any) -> Any:
        found = model.none
        for arm in model.arms:
            found -= self.per_velocity * arm.tip.moves.T @ (arm.tip.moves @ model.rates)
        return found
