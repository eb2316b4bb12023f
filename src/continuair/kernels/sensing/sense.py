"""What a controller senses on the device, and the laws' common ground.

A controller gives a law: a function of a `LawCode` that returns `Gains`, a Warp struct, and
`control(sense: Sense, gains: Gains) -> Push`, a Warp function. A push is what the actuators do:
push(force, moment, bend), force on the UAV in world axes [N], moment on it in body axes [N m],
bend moments [N m²].
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import chain_code
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.eye import eye_code


@dataclass(frozen=True)
class LawCode:
    """What a law is written with: types, and functions of what it senses.

    push(force: vec3, moment: vec3, bend: Bends) -> Push, which adds up, with two numbers per
    section in Bends, arm by arm from the base out, which for one section is vec2; force_of and
    moment_of give these of a push;
    camera_push(sense, wrench: Twist) -> Push, J_cᵀ wrench; interaction(sight) -> L, Eq. (14), Amiri
    et al.; points, bends: number of feature points, and of numbers in Bends; Image, ImageGain,
    Twist: vectors and matrices for them; numbers, tree: what all of it is for; Sense: below. On the
    CPU several runs fly at once: a law does so that chooses by above(a, b, x, y), x where a > b and
    else y, and takes sine, cosine, tanh and angle_of(y, x) from here; one that branches on numbers
    flies run by run.
    """

    numbers: Numbers
    tree: Tree
    points: int
    bends: int
    Real: Any
    vec2: Any
    Bends: Any
    vec3: Any
    quat: Any
    mat33: Any
    Push: Any
    Image: Any
    ImageGain: Any
    Twist: Any
    Sense: Any
    push: Any
    force_of: Any
    moment_of: Any
    camera_push: Any
    interaction: Any
    proprioception: Any
    above: Any
    sine: Any
    cosine: Any
    angle_of: Any
    tanh: Any


@cache
def law_code(numbers: Numbers, tree: Tree, points: int) -> LawCode:
    """The common ground for numbers and tree of arms, and a number of feature points."""
    types, total_of = device_types(numbers, tree), chain_code(numbers, tree, "alone").total_of
    eye, Flight = eye_code(numbers, tree, points), flight_code(numbers, tree).Flight
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    vec2, vec3, quat, mat33 = types.vec2, types.vec3, types.quat, types.mat33
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    bends_of, bend_rates_of, spin_of = types.bends_of, types.bend_rates_of, types.spin_of
    Bends, bends = types.Bends, types.layout.bends
    Camera, View, Sight, Image, Twist = eye.Camera, eye.View, eye.Sight, eye.Image, eye.Twist
    ImageGain, interaction, push_of_camera = eye.ImageGain, eye.interaction, eye.camera_push
    push, zero = types.push_of, Real(0.0)
    force_of, moment_of = types.force_of, types.moment_of
    above, known = number_code(numbers).above, elementary_code(numbers)
    sine, cosine, angle_of, tanh = known.sine, known.cosine, known.angle_of, known.tanh

    @wp.struct
    class Sense:
        """What a law may use, at time [s].

        position, velocity: of B's origin, world axes; attitude: body to world; bend [1/m];
        angular_velocity: body axes; sight: what the camera reports; desired: the image to reach;
        camera_twist, target_twist: (v, ω) in camera axes; weight, spring: the pushes that carry
        the weight and that hold the arm against its own stiffness.
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
        state: State
        plant: Plant
        camera: Camera
        view: View

    @wp.func
    def weight_push(y: State, flight: Flight):
        """The push that carries the weight of UAV and arm."""
        plant = flight.plant
        total = total_of(y, flight.coefficients, plant, flight.vehicle)
        down = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -flight.gravity))
        lift = vec3(zero, zero, plant.mass * flight.gravity)
        bend = Bends()
        for j in range(bends):
            pull = total.F[0, j] * down[0] + total.F[1, j] * down[1] + total.F[2, j] * down[2]
            bend[j] = -plant.unit[j] * pull
        return push(lift, wp.cross(down, total.H), bend)

    @wp.func
    def proprioception(time: Real, y: State, flight: Flight):
        """The parts of a Sense that need no camera."""
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
        out.velocity = velocity_of(y)
        out.angular_velocity = spin_of(y)
        out.weight = weight_push(y, flight)
        out.spring = push(nothing, nothing, spring)
        out.state = y
        out.plant = plant
        return out

    @wp.func
    def camera_push(sense: Sense, wrench: Twist):
        """J_cᵀ wrench: the push that does what a wrench on the camera, in its axes, would do."""
        return push_of_camera(sense.state, sense.view, sense.plant, sense.camera, wrench)

    return holding(LawCode, locals())


def gains_of(fields: dict[str, Any]) -> Any:
    """Gains, a struct of fields by name."""
    return wp.struct(type("Gains", (), {"__annotations__": fields}))
