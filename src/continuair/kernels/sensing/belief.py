"""Device code of what a law holds to be true where that is not the vehicle that it flies.

Such a law computes with the plant and the camera that it believes in: weights, Jacobians, camera
poses. What it measures is true: the state, curvatures among it, depths, and the image in pixels,
which it reads with the intrinsics that it believes in; so it does the image that it is to reach.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.eye import eye_code


@dataclass(frozen=True)
class BeliefCode:
    """Structs, and functions of what is true and what is believed."""

    Cameras: Any
    Believed: Any
    believed_of: Any
    flight_with: Any
    state_with: Any
    read_with: Any


@cache
def belief_code(numbers: Numbers, tree: Tree, points: int) -> BeliefCode:
    """Beliefs for one kind of numbers and tree of arms, and a number of feature points."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    code, eye, layout = number_code(numbers), eye_code(numbers, tree, points), tree.layout
    State, Plant, Table = types.State, types.Plant, types.Table
    Vehicles, Flight, Camera, Image = structs.Vehicles, structs.Flight, eye.Camera, eye.Image
    Cameras, lanes = code.rows_of(Camera), code.lanes
    plant_of, camera_of = code.reader_of(Plant), code.reader_of(Camera)
    width, bends, count = layout.state, layout.bends, max(points, 1)
    B, DB = layout.bend.start, layout.bend_rate.start

    @wp.struct
    class Believed:
        """What the law of one run believes in."""

        plant: Plant
        coefficients: Table
        vehicle: wp.int32
        camera: Camera

    @wp.func
    def believed_of(vehicles: Vehicles, cameras: Cameras, run: int, true: Camera):
        out = Believed()
        out.plant = plant_of(vehicles.plants, run)
        out.coefficients = vehicles.coefficients
        out.vehicle = wp.min(run // lanes, vehicles.coefficients.shape[0] - 1)
        out.camera = camera_of(cameras, run)
        out.camera.noise = true.noise
        return out

    @wp.func
    def flight_with(flight: Flight, believed: Believed):
        """The flight of the vehicle that is believed in."""
        out = Flight()
        out.run = flight.run
        out.plant = believed.plant
        out.coefficients = believed.coefficients
        out.vehicle = believed.vehicle
        out.inputs = flight.inputs
        out.stride = flight.stride
        out.groups = flight.groups
        out.gravity = flight.gravity
        out.frozen = flight.frozen
        return out

    @wp.func
    def state_with(y: State, flight: Flight, believed: Believed):
        """A state of the same curvatures, in the units of the vehicle that is believed in."""
        out = State()
        for j in range(width):
            out[j] = y[j]
        for j in range(bends):
            unit = believed.plant.unit[j] / flight.plant.unit[j]
            out[B + j] = unit * y[B + j]
            out[DB + j] = unit * y[DB + j]
        return out

    @wp.func
    def read_with(image: Image, true: Camera, believed: Believed):
        """An image as its pixels are read."""
        known = believed.camera
        out = Image()
        for i in range(count):
            for j in range(2):
                pixel = true.focal[j] * image[2 * i + j] + true.principal[j]
                out[2 * i + j] = (pixel - known.principal[j]) / known.focal[j]
        return out

    return holding(BeliefCode, locals())
