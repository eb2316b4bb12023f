"""What does not change during a flight: the vehicle, what acts on it, and what a model freezes."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.types import device_types, holding


@dataclass(frozen=True)
class FlightCode:
    """Structs, defined below; flight_of makes a run's, freeze what `independent` keeps."""

    Vehicles: Any
    Drive: Any
    Frozen: Any
    Flight: Any
    freeze: Any
    flight_of: Any


@cache
def flight_code(precision: str, sections: int) -> FlightCode:
    """The structs for one precision and number of sections."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    Real, Row, State, Plant = types.Real, types.Row, types.State, types.Plant
    vec3, mat33, quat = types.vec3, types.mat33, types.quat
    attitude_of, bend_of = types.attitude_of, types.bend_of
    shape, tip_of = section.shape, section.tip_of
    inertia_of, moment_of_arm = section.inertia_of, section.moment_of_arm

    @wp.struct
    class Vehicles:
        """Plants (vehicles,) and moment polynomials (vehicles, terms): one, or one per run."""

        plants: wp.array(dtype=Plant)
        coefficients: wp.array2d(dtype=Row)

    @wp.struct
    class Drive:
        """What acts: inputs (rows, runs or 1, inputs), rows per step (3 or 0), groups in use."""

        inputs: wp.array3d(dtype=Real)
        stride: wp.int32
        groups: wp.int32
        gravity: Real

    @wp.struct
    class Frozen:
        """What `independent` keeps from the initial state: payload, tip and attitude."""

        moment: vec3
        inertia: mat33
        inverse: mat33
        tip: vec3
        attitude: quat

    @wp.struct
    class Flight:
        """One run: its plant, its row of moment polynomials and its column of the inputs."""

        plant: Plant
        coefficients: wp.array2d(dtype=Row)
        vehicle: wp.int32
        inputs: wp.array3d(dtype=Real)
        column: wp.int32
        stride: wp.int32
        groups: wp.int32
        gravity: Real
        frozen: Frozen

    @wp.func
    def freeze(flight: Flight, y: State):
        """What `independent` keeps of the state y."""
        out = Frozen()
        plant = flight.plant
        b = bend_of(y)
        s = shape(flight.coefficients, flight.vehicle, wp.dot(b, b))
        out.moment = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        out.inertia = inertia_of(s, plant, b)
        out.inverse = wp.inverse(out.inertia)
        out.tip = plant.mount + plant.unit * tip_of(b).point
        out.attitude = attitude_of(y)
        return out

    @wp.func
    def flight_of(vehicles: Vehicles, drive: Drive, run: int):
        """The flight of a run, with nothing frozen yet."""
        out = Flight()
        out.vehicle = wp.min(run, vehicles.plants.shape[0] - 1)
        out.plant = vehicles.plants[out.vehicle]
        out.coefficients = vehicles.coefficients
        out.inputs = drive.inputs
        out.column = wp.min(run, drive.inputs.shape[1] - 1)
        out.stride = drive.stride
        out.groups = drive.groups
        out.gravity = drive.gravity
        return out

    return holding(FlightCode, locals())
