"""Constants of a run in device code: vehicle, inputs, and values that a model freezes."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import chain_code
from continuair.kernels.arm.rigid import rigid_code
from continuair.kernels.arm.tip import tip_code


@dataclass(frozen=True)
class FlightCode:
    """Structs, defined below; flight_of(vehicles, drive, run) and freeze(flight, y)."""

    Vehicles: Any
    Frozen: Any
    Flight: Any
    freeze: Any
    flight_of: Any


@cache
def flight_code(numbers: Numbers, tree: Tree) -> FlightCode:
    """Return the structs for one kind of numbers and tree of arms."""
    types, tips = device_types(numbers, tree), tip_code(numbers, tree)
    code, rigid = number_code(numbers), rigid_code(numbers, tree)
    Cell, Real, Table = types.Cell, types.Real, types.Table
    State, Plant, Plants = types.State, types.Plant, code.rows_of(types.Plant)
    vec3, mat33, quat, Vectors = types.vec3, types.mat33, types.quat, types.Vectors
    attitude_of, between, inverse_of = types.attitude_of, rigid.between, rigid.inverse_of
    plant_of, lanes = code.reader_of(Plant), code.lanes
    Drive = arguments(numbers.precision).Drive
    total_of = chain_code(numbers, tree, "alone").total_of
    points_of_tips = tips.points_of_tips

    @wp.struct
    class Vehicles:
        """Plants and polynomials of their sections (vehicles, terms), per run or one for all."""

        plants: Plants
        coefficients: Table

    @wp.struct
    class Frozen:
        """Values of the initial state that the model "independent" uses.

        moment: first moment of the arms; inertia: of all about B; inverse: of the inertia about the
        common centre of mass; tips; attitude.
        """

        moment: vec3
        inertia: mat33
        inverse: mat33
        tips: Vectors
        attitude: quat

    @wp.struct
    class Flight:
        """One run, or a pack: plant, row of its moment polynomials, and inputs."""

        run: wp.int32
        plant: Plant
        coefficients: Table
        vehicle: wp.int32
        inputs: wp.array3d(dtype=Cell)
        stride: wp.int32
        groups: wp.int32
        gravity: Real
        frozen: Frozen

    @wp.func
    def freeze(flight: Flight, y: State):
        """Return the values of a state that the model "independent" uses."""
        out = Frozen()
        plant = flight.plant
        total = total_of(y, flight.coefficients, plant, flight.vehicle)
        out.moment = total.H
        out.inertia = plant.uav_inertia + total.I
        c = total.H / plant.mass
        out.inverse = inverse_of(out.inertia - between(c, vec3(), plant.mass, mat33()))
        out.tips = points_of_tips(y, plant)
        out.attitude = attitude_of(y)
        return out

    @wp.func
    def flight_of(vehicles: Vehicles, drive: Drive, run: int):
        """Return the Flight of a run, or of a pack by its first run, without frozen values."""
        out = Flight()
        out.run = run
        out.plant = plant_of(vehicles.plants, run)
        out.coefficients = vehicles.coefficients
        out.vehicle = wp.min(run // lanes, vehicles.coefficients.shape[0] - 1)
        out.inputs = drive.inputs
        out.stride = drive.stride
        out.groups = drive.groups
        out.gravity = Real(drive.gravity)
        return out

    return holding(FlightCode, locals())
