"""A payload on a tip: a body that is picked up and released in flight, with a momentum-true jump.

It is inertia and weight, not a force: while it is carried, the body of the tip has its mass. At the
pick-up it comes to move with the tip, by a plastic impact; at the release it keeps its velocity,
and so does the vehicle.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import warp as wp

from continuair.device.numbers import number_code
from continuair.kernels.device import Device
from continuair.kernels.load import load_code
from continuair.kernels.term_sum import Acting
from continuair.terms.term import Term


@dataclass(frozen=True)
class CarriedBody(Term):
    """A payload.

    Parameters
    ----------
    mass : float
        Its mass [kg].
    centre : tuple of float
        Its centre of mass in the axes of the tip [m].
    inertia : tuple of float
        Its inertia about its own centre, nine numbers in the axes of the tip [kg m²].
    velocity : tuple of float
        Velocity at which it waits, world axes [m/s].
    place : tuple of float
        Where it waits to be touched, world axes [m].
    times : tuple of float
        Times of pick-up and release, and the distance at which it is touched [s, s, m].
    touched : bool
        Whether the tip picks it up where it touches it.
    arm : int
        Index of the arm.
    sections : tuple of int
        Sections of that arm, among those of all arms.
    """

    field: ClassVar[str] = "scenario.payload"
    carries: ClassVar[bool] = True
    has_power: ClassVar[bool] = False

    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, ...]
    velocity: tuple[float, float, float]
    place: tuple[float, float, float]
    times: tuple[float, float, float]
    touched: bool
    arm: int
    sections: tuple[int, ...]

    @property
    def states(self) -> dict[str, int]:
        """Return whether it is carried, 0 or 1, and the impulse on the tip at the pick-up [N s]."""
        return {"payload": 1, "payload_impulse": 3}

    def device(self, code: Device) -> Acting:
        """Return the device functions of the payload.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            The body on the tip, and the switch at pick-up and release.
        """
        return Acting(laden=_laden(self, code), switch=_switch(self, code))


def _laden(term: CarriedBody, code: Device) -> Any:
    types, numbers = code.types, code.numbers
    State, Plant, mat33, vec3 = types.State, types.Plant, types.mat33, types.vec3
    mass_of, centre_of, inertia_of = (
        code.reader(each) for each in (term.mass, term.centre, term.inertia)
    )
    arm, carried = term.arm, types.layout.of_state["payload"].start
    above, Real = number_code(numbers).above, types.Real
    first, last = term.sections[0], term.sections[-1] + 1
    half, zero, one = Real(0.5), Real(0.0), Real(1.0)

    @wp.func
    def laden(plant: Plant, y: State):
        """Return the parameters with the payload on the tip, in axes in which the arm ends at -z,
        as Plant has those of a body there."""
        share = above(y[carried], half, one, zero)
        m = share * mass_of(plant)
        own = inertia_of(plant)
        c = centre_of(plant)
        c = vec3(c[0], -c[1], -c[2])
        plant.mass = plant.mass + m
        plant.arm_mass[arm] = plant.arm_mass[arm] + m
        plant.body_mass[arm] = plant.body_mass[arm] + m
        for section in range(first, last):
            plant.beyond[section] = plant.beyond[section] + m
        turned = mat33(
            own[0], -own[1], -own[2], -own[3], own[4], own[5], -own[6], own[7], own[8]
        )  # fmt: skip
        x, y_, z = c[0], c[1], c[2]
        spread = mat33(
            y_ * y_ + z * z, -x * y_, -x * z, -x * y_, x * x + z * z, -y_ * z, -x * z, -y_ * z,
            x * x + y_ * y_,
        )  # fmt: skip
        for i in range(3):
            plant.body_moment[arm, i] = plant.body_moment[arm, i] + m * c[i]
            for j in range(3):
                at = 3 * i + j
                plant.body_inertia[arm, at] = (
                    plant.body_inertia[arm, at] + share * turned[i, j] + m * spread[i, j]
                )
        return plant

    return laden


def _switch(term: CarriedBody, code: Device) -> Any:
    types, number = code.types, number_code(code.numbers)
    State, Flight, Along, Push = types.State, code.Flight, types.Along, types.Push
    Real, mat33, Load = types.Real, types.mat33, code.Load
    above, arm, touched = number.above, term.arm, term.touched
    mass_of, centre_of, inertia_of, velocity_of, place_of, times_of = (
        code.reader(each)
        for each in (
            term.mass, term.centre, term.inertia, term.velocity, term.place, term.times,
        )
    )  # fmt: skip
    states = types.layout.of_state
    carried, impulse = states["payload"].start, states["payload_impulse"].start
    world_tip, zero, half, one = code.tips.world_tip_of(arm), Real(0.0), Real(0.5), Real(1.0)
    plus = load_code(code.numbers, code.tree).plus

    @wp.func
    def caught(y: State, flight: Flight, row: int):
        """Return the impulse, and its moment, on the tip of the payload that comes to move."""
        plant = flight.plant
        tip = world_tip(y, plant)
        arm_to = wp.quat_rotate(tip.attitude, centre_of(plant))
        moved = tip.velocity + wp.cross(tip.turning, arm_to)
        force = -mass_of(plant) * (moved - velocity_of(plant))
        own = inertia_of(plant)
        turned = mat33(own[0], own[1], own[2], own[3], own[4], own[5], own[6], own[7], own[8])
        spun = wp.quat_rotate(tip.attitude, turned * wp.quat_rotate_inv(tip.attitude, tip.turning))
        return force, wp.cross(arm_to, force) - spun

    on_tip = code.on_tip(lambda _: caught)(arm)

    @wp.func
    def switch(y: State, flight: Flight, time: Real):
        plant = flight.plant
        times = times_of(plant)
        held = above(y[carried], half, one, zero)
        wanted = above(times[0], time, zero, one)
        if wp.static(touched):
            near = wp.length(world_tip(y, plant).position - place_of(plant))
            wanted = wp.max(held, wanted * above(near, times[2], zero, one))
        wanted = wanted * above(times[1], time, one, zero)
        taken = wanted * (one - held)
        now = taken + held * (one - wanted)
        load = Load()
        load = plus(load, on_tip(y, Along(), flight, 0, Push()))
        load.force = taken * load.force
        load.moment = taken * load.moment
        load.bend = taken * load.bend
        force, _ = caught(y, flight, 0)
        y[carried] = wanted
        for j in range(3):
            y[impulse + j] = y[impulse + j] + taken * force[j]
        return y, load, now

    return switch
