"""A linear spring from the tip of an arm to a point of the world, which stores energy."""

from dataclasses import dataclass
from typing import Any, ClassVar

import warp as wp

import continuair as ca
from continuair.terms import Acting, Device


@dataclass(frozen=True)
class TipSpring(ca.Term):
    """k (p - r) on the tip r of an arm, with the energy ½ k |r - p|²."""

    has_energy: ClassVar[bool] = True

    stiffness: float
    """stiffness [N/m]"""

    point: tuple[float, float, float]
    """where its other end is, in world axes [m]"""

    arm: int = 0
    """index of the arm"""

    def device(self, code: Device) -> Acting:
        types, own = code.types, self.arm
        stiffness, point = code.reader(self.stiffness), code.reader(self.point)
        Real, State, Flight, vec3 = types.Real, types.State, code.Flight, types.vec3
        world_tip = code.tips.world_tip_of(own)

        def wrench_of(arm: int) -> Any:
            @wp.func
            def wrench(y: State, flight: Flight, row: int):
                plant, force = flight.plant, vec3()
                if wp.static(arm == own):
                    force = stiffness(plant) * (point(plant) - world_tip(y, plant).position)
                return force, vec3()

            return wrench

        @wp.func
        def energy(y: State, flight: Flight, row: int):
            plant = flight.plant
            stretch = world_tip(y, plant).position - point(plant)
            return Real(0.5) * stiffness(plant) * wp.dot(stretch, stretch)

        return Acting(on_arm=code.on_tip(wrench_of), energy=energy)
