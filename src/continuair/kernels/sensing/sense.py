"""Measurements of a controller in device code, and functions for control laws.

A control law is a function of a `LawCode` that returns `Gains`, a Warp struct, and
`control(sense: Sense, gains: Gains) -> Push`, a Warp function. A Push is an actuator wrench,
push(force, moment, bend): force on the UAV in world axes [N], moment in body axes [N m], bend
moments [N m²].
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, Struct, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import chain_code, total_types
from continuair.kernels.elastic import elastic_code
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.camera import camera_code


@dataclass(frozen=True)
class LawCode:
    """Types and functions for the device code of a control law.

    Parameters
    ----------
    numbers : Numbers
        Precision and lanes.
    tree : Tree
        The arms.
    points : int
        Number of feature points.
    bends : int
        Number of entries of `Bends`.
    Real : type
        Scalar.
    vec2 : type
        Vector of two.
    Bends : type
        Vector of the sections' coordinates, two per arc, arm by arm from the base; `vec2` for one
        section.
    vec3 : type
        Vector of three.
    quat : type
        Quaternion x, y, z, w.
    mat33 : type
        Matrix (3, 3).
    Push : type
        Actuator wrench; a vector, so that wrenches can be added.
    Image : type
        Vector of image coordinates (2 points,).
    ImageGain : type
        Matrix (2 points, 2 points).
    Twist : type
        Linear and angular velocity (6,), or force and moment.
    Sense : Struct
        Measurements of the law.
    push : wp.Function
        ``push(force: vec3, moment: vec3, bend: Bends) -> Push``.
    force_of : wp.Function
        ``force_of(push) -> vec3``.
    moment_of : wp.Function
        ``moment_of(push) -> vec3``.
    camera_push : wp.Function
        ``camera_push(sense, wrench: Twist) -> Push``, J_cᵀ wrench.
    interaction : wp.Function
        ``interaction(sight) -> L``, Eq. (14), Amiri et al. (2026).
    proprioception : wp.Function
        ``proprioception(time, y, flight) -> Sense``, without the camera.
    above : wp.Function
        ``above(a, b, x, y)``: x where a > b, else y.
    sine : wp.Function
        Sine.
    cosine : wp.Function
        Cosine.
    angle_of : wp.Function
        ``angle_of(y, x)``, the arctangent of y / x in (-π, π].
    tanh : wp.Function
        Hyperbolic tangent.

    Notes
    -----
    On the CPU several runs are simulated at once if the law selects by `above` and uses `sine`,
    `cosine`, `tanh` and `angle_of` of this object. A law that branches on numbers is simulated run
    by run.
    """

    numbers: Numbers
    tree: Tree
    points: int
    bends: int
    Real: type
    vec2: type
    Bends: type
    vec3: type
    quat: type
    mat33: type
    Push: type
    Image: type
    ImageGain: type
    Twist: type
    Sense: Struct
    push: wp.Function
    force_of: wp.Function
    moment_of: wp.Function
    camera_push: wp.Function
    interaction: wp.Function
    proprioception: wp.Function
    above: wp.Function
    sine: wp.Function
    cosine: wp.Function
    angle_of: wp.Function
    tanh: wp.Function


@cache
def law_code(numbers: Numbers, tree: Tree, points: int) -> LawCode:
    """Return the types and functions for numbers, a tree of arms and a number of feature points."""
    types, total_of = device_types(numbers, tree), chain_code(numbers, tree, "alone").total_of
    Total, elastic = total_types(numbers, tree).Total, elastic_code(numbers, tree)
    springs, coupled_springs = elastic.springs, elastic.pairs > 0
    of_camera, Flight = camera_code(numbers, tree, points), flight_code(numbers, tree).Flight
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    vec2, vec3, quat, mat33 = types.vec2, types.vec3, types.quat, types.mat33
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    bends_of, bend_rates_of, spin_of = types.bends_of, types.bend_rates_of, types.spin_of
    Bends, bends = types.Bends, types.layout.bends
    Camera, View, Sight, Image, Twist = (
        of_camera.Camera,
        of_camera.View,
        of_camera.Sight,
        of_camera.Image,
        of_camera.Twist,
    )
    ImageGain, interaction, push_of_camera = (
        of_camera.ImageGain,
        of_camera.interaction,
        of_camera.camera_push,
    )
    push, zero = types.push_of, Real(0.0)
    force_of, moment_of = types.force_of, types.moment_of
    above, known = number_code(numbers).above, elementary_code(numbers)
    sine, cosine, angle_of, tanh = known.sine, known.cosine, known.angle_of, known.tanh

    @wp.struct
    class Sense:
        """Measurements of a law at a time [s].

        position, velocity: of B's origin, world axes; attitude: body to world; bend [1/m];
        angular_velocity: body axes; sight: measured image features; desired: desired image;
        camera_twist, target_twist: (v, ω) in camera axes; weight, spring: actuator wrenches that
        compensate gravity and the arm's elasticity; arms: their inertias.
        """

        time: Real
        position: vec3
        attitude: quat
        bend: Bends
        velocity: vec3
        angular_velocity: vec3
        bend_rate: Bends
        sight: Sight
        desired: Image
        camera_twist: Twist
        target_twist: Twist
        weight: Push
        spring: Push
        arms: Total
        state: State
        plant: Plant
        camera: Camera
        view: View

    @wp.func
    def weight_push(y: State, flight: Flight, total: Total):
        """Return the actuator wrench that compensates the weight of UAV and arms."""
        plant = flight.plant
        down = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -flight.gravity))
        lift = vec3(zero, zero, plant.mass * flight.gravity)
        bend = Bends()
        for j in range(bends):
            pull = total.F[0, j] * down[0] + total.F[1, j] * down[1] + total.F[2, j] * down[2]
            bend[j] = -plant.unit[j] * pull
        return push(lift, wp.cross(down, total.H), bend)

    @wp.func
    def proprioception(time: Real, y: State, flight: Flight):
        """Return a Sense without the measurements of the camera."""
        plant = flight.plant
        nothing = vec3(zero, zero, zero)
        out = Sense()
        out.time = time
        out.position = position_of(y)
        out.attitude = attitude_of(y)
        b = bends_of(y)
        db = bend_rates_of(y)
        spring = Bends()
        for j in range(bends):
            out.bend[j] = b[j] / plant.unit[j]
            out.bend_rate[j] = db[j] / plant.unit[j]
            spring[j] = plant.unit[j] * plant.stiffness[j] * b[j]
        if wp.static(coupled_springs):
            aside = springs(plant, b)
            for j in range(bends):
                spring[j] = spring[j] + plant.unit[j] * aside[j]
        out.velocity = velocity_of(y)
        out.angular_velocity = spin_of(y)
        out.arms = total_of(y, flight.coefficients, plant, flight.vehicle)
        out.weight = weight_push(y, flight, out.arms)
        out.spring = push(nothing, nothing, spring)
        out.state = y
        out.plant = plant
        return out

    @wp.func
    def camera_push(sense: Sense, wrench: Twist):
        """Return J_cᵀ wrench: the actuator wrench of a wrench on the camera, in camera axes."""
        return push_of_camera(sense.state, sense.view, sense.plant, sense.camera, wrench)

    return holding(LawCode, locals())


def gains_of(fields: dict[str, Any]) -> Any:
    """Return Gains, a struct with given fields."""
    return wp.struct(type("Gains", (), {"__annotations__": fields}))
