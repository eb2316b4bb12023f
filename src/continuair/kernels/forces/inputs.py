"""Device code of the inputs: forces that follow from their columns, each a Load of its own."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.flight import flight_code
from continuair.kernels.types import device_types, holding
from continuair.vehicle.layout import COMMAND, PAPER, TIP


@dataclass(frozen=True)
class InputCode:
    """Load, a struct, and the loads by which inputs and a push act: on the UAV, and in all."""

    Load: Any
    load_on_uav: Any
    load_of: Any


@cache
def input_code(precision: str, sections: int, frozen_arm: bool) -> InputCode:
    """Forces of the inputs; frozen_arm: the tip pushes the base where it was at the start."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    flight = flight_code(precision, sections)
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    vec2, vec3, quat, layout = types.vec2, types.vec3, types.quat, types.layout
    attitude_of, bend_of = types.attitude_of, types.bend_of
    force_of, moment_of, bend_moment_of = types.force_of, types.moment_of, types.bend_moment_of
    tip_of, wrench_on_bend, Flight = section.tip_of, section.wrench_on_bend, flight.Flight
    pushes = layout.push.stop
    euler, polar = layout.of_input["euler_torque"].start, layout.of_input["polar_torque"].start
    tip_force, tip_moment = layout.tip_wrench.start, layout.tip_wrench.start + 3
    zero, one = Real(0.0), Real(1.0)

    @wp.struct
    class Load:
        """External force and moment on the vehicle in body axes, and on the bend."""

        force: vec3
        moment: vec3
        bend: vec2

    @wp.func
    def plus(a: Load, b: Load):
        out = Load()
        out.force = a.force + b.force
        out.moment = a.moment + b.moment
        out.bend = a.bend + b.bend
        return out

    @wp.func
    def three(flight: Flight, row: int, first: int):
        """Three adjacent columns of the inputs."""
        at = flight.column
        return vec3(
            flight.inputs[row, at, first],
            flight.inputs[row, at, first + 1],
            flight.inputs[row, at, first + 2],
        )

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
        torque = three(flight, row, euler)
        if wp.length_sq(torque) > zero:
            out.moment = euler_torque_to_body(attitude_of(y), torque)
        along = flight.inputs[row, flight.column, polar]
        around = unit * flight.inputs[row, flight.column, polar + 1]
        out.bend = polar_to_bend(bend_of(y), branch, flight.plant.threshold, along, around) / unit
        return out

    @wp.func
    def tip_load(y: State, flight: Flight, row: int):
        """The wrench on the tip."""
        out = Load()
        plant, q, b = flight.plant, attitude_of(y), bend_of(y)
        force = three(flight, row, tip_force)
        moment = three(flight, row, tip_moment)
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

    @wp.func
    def load_on_uav(y: State, branch: vec2, flight: Flight, row: int, command: Push):
        """What acts otherwise than at the tip."""
        out = Load()
        if flight.groups == 0:
            return out
        out = push_load(y, flight, row, command)
        if (flight.groups & PAPER) != 0:
            out = plus(out, paper_load(y, branch, flight, row))
        return out

    @wp.func
    def load_of(y: State, branch: vec2, flight: Flight, row: int, command: Push):
        """All that acts."""
        out = load_on_uav(y, branch, flight, row, command)
        if (flight.groups & TIP) != 0:
            out = plus(out, tip_load(y, flight, row))
        return out

    return holding(InputCode, locals())
