"""What does not change during a flight: the vehicle, what acts on it, and what a model freezes."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.chain import chain_code
from continuair.kernels.arm.rigid import rigid_code
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.types import Tree, device_types, holding


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
def flight_code(precision: str, tree: Tree) -> FlightCode:
    """The structs for one precision and tree of arms."""
    types, tips = device_types(precision, tree), tip_code(precision, tree)
    Real, Row, State, Plant = types.Real, types.Row, types.State, types.Plant
    vec3, mat33, quat, Vectors = types.vec3, types.mat33, types.quat, types.Vectors
    attitude_of, between = types.attitude_of, rigid_code(precision, tree).between
    total_of = chain_code(precision, tree, "alone").total_of
    points_of_tips = tips.points_of_tips

    @wp.struct
    class Vehicles:
        """Plants (vehicles,), polynomials (vehicles, sections times terms): one, or one per run."""

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
        """What `independent` keeps from the initial state: first moment of the arms and inertia of
        all about B, that about the common centre of mass inverted; the tips, and the attitude."""

        moment: vec3
        inertia: mat33
        inverse: mat33
        tips: Vectors
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
        total = total_of(y, flight.coefficients, plant, flight.vehicle)
        out.moment = total.H
        out.inertia = plant.uav_inertia + total.I
        c = total.H / plant.mass
        out.inverse = wp.inverse(out.inertia - between(c, vec3(), plant.mass, mat33()))
        out.tips = points_of_tips(y, plant)
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
