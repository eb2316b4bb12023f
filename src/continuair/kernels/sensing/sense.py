"""What a controller senses on the device, and the laws' common ground.

A controller gives a law: a function of this code that returns `Gains`, a Warp struct, and
`control(sense: Sense, gains: Gains) -> Push`, a Warp function. A push is what the actuators do:
force on the UAV in world axes [N], moment on it in body axes [N m], bend moments [N m²].
"""

from types import SimpleNamespace

import warp as wp


def control_code(code: SimpleNamespace) -> SimpleNamespace:
    """The struct `Sense` and functions of it, on top of a model's code and its vision code."""
    Real, State, Plant, Push = code.Real, code.State, code.Plant, code.Push
    vec2, vec3, quat, attitude_of = code.vec2, code.vec3, code.quat, code.attitude_of
    Camera, View, Sight, Image, Twist = code.Camera, code.View, code.Sight, code.Image, code.Twist
    push_of_camera = code.camera_push
    zero = Real(0.0)

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
        bend: vec2
        velocity: vec3
        angular_velocity: vec3
        bend_rate: vec2
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
    def proprioception(time: Real, y: State, plant: Plant):
        """The parts of a Sense that need no camera; weight is left to the caller."""
        out = Sense()
        out.time = time
        out.position = vec3(y[0], y[1], y[2])
        out.attitude = attitude_of(y)
        out.bend = vec2(y[7], y[8]) / plant.unit
        out.velocity = vec3(y[9], y[10], y[11])
        out.angular_velocity = vec3(y[12], y[13], y[14])
        out.bend_rate = vec2(y[15], y[16]) / plant.unit
        k = plant.unit * plant.stiffness
        out.spring = Push(zero, zero, zero, zero, zero, zero, k * y[7], k * y[8])
        out.state = y
        out.plant = plant
        return out

    @wp.func
    def camera_push(sense: Sense, wrench: Twist):
        """J_cᵀ wrench: the push that does what a wrench on the camera, in its axes, would do."""
        return push_of_camera(sense.state, sense.view, sense.plant, sense.camera, wrench)

    return SimpleNamespace(
        Sense=Sense,
        proprioception=proprioception,
        push_of_camera=push_of_camera,
        camera_push=camera_push,
    )
