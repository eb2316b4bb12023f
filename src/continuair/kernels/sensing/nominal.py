"""Device code of a control law's nominal model, if it differs from the simulated vehicle.

Such a law computes weights, Jacobians and camera poses with its nominal plant and camera.
Measurements are true: state, curvatures, depths, and the image in pixels. Measured and desired
images are converted from pixels with the nominal intrinsics.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.camera import camera_code


@dataclass(frozen=True)
class NominalCode:
    """Structs and functions of nominal models."""

    Cameras: Any
    Believed: Any
    believed_of: Any
    flight_with: Any
    state_with: Any
    read_with: Any


@cache
def nominal_code(numbers: Numbers, tree: Tree, points: int) -> NominalCode:
    """Return the code for numbers, a tree of arms and a number of feature points."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    code, of_camera, layout = number_code(numbers), camera_code(numbers, tree, points), tree.layout
    State, Plant, Table = types.State, types.Plant, types.Table
    Vehicles, Flight, Camera, Image = (
        structs.Vehicles,
        structs.Flight,
        of_camera.Camera,
        of_camera.Image,
    )
    Cameras, lanes = code.rows_of(Camera), code.lanes
    plant_of, camera_of = code.reader_of(Plant), code.reader_of(Camera)
    width, bends, count = layout.state, layout.bends, max(points, 1)
    B, DB = layout.bend.start, layout.bend_rate.start

    @wp.struct
    class Believed:
        """Nominal model of the law of one run."""

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
        """Return the Flight of the nominal model."""
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
        """Return a state with the same curvatures, in the units of the nominal model."""
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
        """Return an image, converted from its pixels with the nominal intrinsics."""
        known = believed.camera
        out = Image()
        for i in range(count):
            for j in range(2):
                pixel = true.focal[j] * image[2 * i + j] + true.principal[j]
                out[2 * i + j] = (pixel - known.principal[j]) / known.focal[j]
        return out

    return holding(NominalCode, locals())
