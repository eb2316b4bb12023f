"""Device code of the inputs: what each group of their columns does, as a Load of its own."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.flight import flight_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.types import device_types, holding
from continuair.vehicle.layout import COMMAND


@dataclass(frozen=True)
class InputCode:
    """Loads of the inputs and a push on the vehicle, of the paper's torques, and on the tip;
    misdirected, what the polar ones of a step may do that passes through straight."""

    push_load: Any
    paper_load: Any
    tip_load: Any
    misdirected: Any


@cache
def input_code(precision: str, sections: int, frozen_arm: bool) -> InputCode:
    """Forces of the inputs; frozen_arm: the tip pushes the base where it was at the start."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    flight, Load = flight_code(precision, sections), load_code(precision, sections).Load
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    vec2, vec3, quat, layout = types.vec2, types.vec3, types.quat, types.layout
    attitude_of, bend_of, three_of = types.attitude_of, types.bend_of, types.three_of
    force_of, moment_of, bend_moment_of = types.force_of, types.moment_of, types.bend_moment_of
    tip_of, wrench_on_bend, Flight = section.tip_of, section.wrench_on_bend, flight.Flight
    pushes = layout.push.stop
    euler, polar = layout.of_input["euler_torque"].start, layout.of_input["polar_torque"].start
    tip_force, tip_moment = layout.tip_wrench.start, layout.tip_wrench.start + 3
    zero, one, full = Real(0.0), Real(1.0), section.full
    # The bend's turn in a step that counts as followed, and the sine of one that is in a plane.
    clear, planar = Real(0.5), Real(1e-6)

    @wp.func
    def euler_torque_to_body(q: quat, torque: vec3):
        """E^{-T} τ: torques conjugate to ZYX Euler rates as a body moment."""
        x = wp.quat_rotate_inv(q, vec3(zero, zero, one))
        cos_pitch = wp.sqrt(x[1] * x[1] + x[2] * x[2])
        sin_roll = x[1] / cos_pitch
        cos_roll = x[2] / cos_pitch
        # The third row of R is (-sin θ, sin φ cos θ, cos φ cos θ).
        shared = (torque[2] - x[0] * torque[0]) / cos_pitch
        return vec3(
            torque[0],
            cos_roll * torque[1] + sin_roll * shared,
            -sin_roll * torque[1] + cos_roll * shared,
        )

    @wp.func
    def polar_to_bend(b: vec2, branch: vec2, threshold: Real, along: Real, around: Real):
        """Q_κ and Q_ψa (per λ) as a force on the bend; only Q_ψa/κ meets the threshold κ_s.

        branch: (cos ψa, sin ψa) of the signed branch followed so far; Q_κ acts along it.
        """
        size = wp.length(b)
        direction = branch
        if size > zero:
            direction = b / size
        pushed = along * direction
        if wp.dot(direction, branch) < zero:
            pushed = -pushed
        scaled = wp.max(size, threshold)
        if around == zero or scaled == zero:
            return pushed
        return pushed + around / scaled * vec2(-direction[1], direction[0])

    @wp.func
    def push_load(y: State, flight: Flight, row: int, command: Push):
        """The inputs force, moment and bend moment, and a controller's push."""
        push = command
        if flight.groups != COMMAND:
            for j in range(pushes):
                push[j] = push[j] + flight.inputs[row, flight.column, j]
        out = Load()
        out.force = wp.quat_rotate_inv(attitude_of(y), force_of(push))
        out.moment = moment_of(push)
        out.bend = bend_moment_of(push) / flight.plant.unit
        return out

    @wp.func
    def paper_load(y: State, branch: vec2, flight: Flight, row: int):
        """Torques conjugate to the paper's angles and bend; Eq. of motion, Amiri et al."""
        out = Load()
        unit = flight.plant.unit
        torque = three_of(flight.inputs, row, flight.column, euler)
        if wp.length_sq(torque) > zero:
            out.moment = euler_torque_to_body(attitude_of(y), torque)
        along = flight.inputs[row, flight.column, polar]
        around = unit * flight.inputs[row, flight.column, polar + 1]
        out.bend = polar_to_bend(bend_of(y), branch, flight.plant.threshold, along, around) / unit
        return out

    @wp.func
    def misdirected(y: State, end: State, branch: vec2, flight: Flight, row: int):
        """How far the polar torques may move the tip the wrong way [arm lengths], from a step.

        From y to the end of the step the bend turns so far, beside straight, that another step
        would take the other side and with it the other sign of κ: the torques would point the
        other way. Twice what they bend the arm by at rest, whose tip moves by half the angle; at
        most an arm length.
        """
        b = bend_of(end)
        size = wp.length(b)
        cosine = wp.dot(b, branch)
        aside = wp.abs(branch[0] * b[1] - branch[1] * b[0])
        if cosine > clear * size or (cosine < zero and aside <= planar * size):
            return zero
        pushed = paper_load(y, branch, flight, row).bend
        return wp.min(one, full * wp.length(pushed) / flight.plant.stiffness)

    @wp.func
    def tip_load(y: State, flight: Flight, row: int):
        """The wrench on the tip."""
        out = Load()
        plant, q, b = flight.plant, attitude_of(y), bend_of(y)
        force = three_of(flight.inputs, row, flight.column, tip_force)
        moment = three_of(flight.inputs, row, flight.column, tip_moment)
        tip = tip_of(b)
        out.force = wp.quat_rotate_inv(q, force)
        on_arm = out.force
        turning = wp.quat_rotate_inv(q, moment)
        bending = turning
        point = plant.mount + plant.unit * tip.point
        if wp.static(frozen_arm):
            point = flight.frozen.tip
            on_arm = wp.quat_rotate_inv(flight.frozen.attitude, force)
            bending = wp.quat_rotate_inv(flight.frozen.attitude, moment)
        out.moment = wp.cross(point, out.force) + turning
        out.bend = wrench_on_bend(tip, plant.unit, b, on_arm, bending)
        return out

    return holding(InputCode, locals())
