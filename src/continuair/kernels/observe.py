"""Kernels that look back along a log: tip, energies, momenta and reaction; what the camera saw."""

from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.bias import bias_code
from continuair.kernels.dynamics import Dynamics
from continuair.kernels.flight import flight_code
from continuair.kernels.options import OPTIONS
from continuair.kernels.sensing.eye import Eye
from continuair.kernels.types import MOMENTS, device_types
from continuair.vehicle.layout import MOTION, OBSERVED, watched_columns


def observe_kernel(precision: str, sections: int, dynamics: Dynamics) -> Any:
    """The kernel `observe` of a model: columns OBSERVED for each run and sample."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    structs, motion_of = flight_code(precision, sections), bias_code(precision, sections).motion_of
    Real, Push, layout = types.Real, types.Push, types.layout
    vec2, vec3 = types.vec2, types.vec3
    position_of, attitude_of, velocity_of = types.position_of, types.attitude_of, types.velocity_of
    bend_of, spin_of = types.bend_of, types.spin_of
    shape, tip_of, tip_attitude = section.shape, section.tip_of, section.tip_attitude
    moment_of_arm, Vehicles, Drive = section.moment_of_arm, structs.Vehicles, structs.Drive
    flight_of, freeze, load_state = structs.flight_of, structs.freeze, types.load_state
    rate_of, load_on_uav = dynamics.rate_of, dynamics.loads.load_on_uav
    half, zero, quarter = Real(0.5), Real(0.0), Real(0.25)
    NP, ND = MOMENTS.index("NP"), MOMENTS.index("ND")
    angle_at, pushes, command_at = layout.branch.start + 1, layout.push.stop, layout.command.start
    at = {name: where.start for name, where in OBSERVED.items()}
    position, attitude = at["tip_position"], at["tip_attitude"]
    kinetic_energy, gravity_energy = at["kinetic_energy"], at["gravity_energy"]
    elastic_energy = at["elastic_energy"]
    linear_momentum, angular_momentum = at["linear_momentum"], at["angular_momentum"]
    base_force, base_moment = at["base_force"], at["base_moment"]
    coupled, independent = dynamics.model == "coupled", dynamics.freezes

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def observe(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Real),
        out: wp.array3d(dtype=Real),
    ):
        """drive: inputs at the samples, with one row per sample or one for all."""
        run, sample = wp.tid()
        flight = flight_of(vehicles, drive, run)
        plant = flight.plant
        y = load_state(log[run], sample, plant.unit)
        if wp.static(dynamics.freezes):
            flight.frozen = freeze(flight, load_state(log[run], 0, plant.unit))
        row = sample * flight.stride
        angle = log[run, sample, angle_at]
        along = vec2(wp.cos(angle), wp.sin(angle))
        push = Push()
        for j in range(pushes):
            push[j] = log[run, sample, command_at + j]
        dy = rate_of(y, along, flight, row, push)

        p, q, v = position_of(y), attitude_of(y), velocity_of(y)
        b, w = bend_of(y), spin_of(y)
        s = shape(flight.coefficients, flight.vehicle, wp.dot(b, b))
        m = motion_of(y, s, plant)
        tip = p + wp.quat_rotate(q, plant.mount + plant.unit * tip_of(b).point)
        turn = q * tip_attitude(b)

        height = plant.mass * p[2]
        if wp.static(independent):
            c = flight.frozen.moment
            inertia = flight.frozen.inertia
            hb = vec3(zero, zero, zero)
            swept = vec3(zero, zero, zero)
            height += wp.quat_rotate(flight.frozen.attitude, moment_of_arm(s, b))[2]
        else:
            c = m.c
            inertia = m.inertia
            hb = m.hb
            swept = m.hd
        height += wp.quat_rotate(q, c)[2]
        moving = v + wp.quat_rotate(q, wp.cross(w, c) + swept) / plant.mass
        spin = inertia * w
        kinetic = half * (s.f[NP] * wp.dot(m.db, m.db) + quarter * s.f[ND] * m.du * m.du)
        kinetic += half * wp.dot(w, spin)
        if wp.static(coupled):
            kinetic += wp.dot(w, hb) + half * plant.mass * wp.dot(moving, moving)
        else:
            frozen_velocity = v + wp.quat_rotate(q, wp.cross(w, c)) / plant.mass
            kinetic += half * plant.mass * wp.dot(frozen_velocity, frozen_velocity)
        centre = p + wp.quat_rotate(q, c) / plant.mass
        linear = plant.mass * moving
        angular = wp.quat_rotate(q, spin + hb) + wp.cross(centre, linear)

        falling = velocity_of(dy) + vec3(zero, zero, flight.gravity)
        a = wp.quat_rotate_inv(q, falling)
        on_uav = load_on_uav(y, along, flight, row, push)
        force = plant.uav_mass * a - on_uav.force
        moment = plant.uav_inertia * spin_of(dy) + wp.cross(w, plant.uav_inertia * w)
        moment -= on_uav.moment
        for j in range(3):
            out[run, sample, position + j] = tip[j]
            out[run, sample, linear_momentum + j] = linear[j]
            out[run, sample, angular_momentum + j] = angular[j]
            out[run, sample, base_force + j] = force[j]
            out[run, sample, base_moment + j] = moment[j]
        for j in range(4):
            out[run, sample, attitude + j] = turn[j]
        out[run, sample, kinetic_energy] = kinetic
        out[run, sample, gravity_energy] = flight.gravity * height
        out[run, sample, elastic_energy] = half * plant.stiffness * m.u

    return observe


def watch_kernel(precision: str, sections: int, eye: Eye) -> Any:
    """The kernel `watch`: the true image and the camera's pose and twist, columns watched_columns.

    motion: of the target's centroid at the samples (samples, runs or 1, MOTION).
    """
    types = device_types(precision, sections)
    Real, Plant, Camera, points = types.Real, types.Plant, eye.Camera, eye.points
    load_state, three_of = types.load_state, types.three_of
    vec2, vec3, angle_at = types.vec2, types.vec3, types.layout.branch.start + 1
    view_of, look, columns = eye.view_of, eye.look, watched_columns(points)
    position, attitude = columns["camera_position"].start, columns["camera_attitude"].start
    centroid = MOTION["position"].start
    twist, image = columns["camera_twist"].start, columns["image"].start
    depth, in_view = columns["depth"].start, columns["in_view"].start

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def watch(
        plants: wp.array(dtype=Plant),
        cameras: wp.array(dtype=Camera),
        corners: wp.array(dtype=vec3),
        motion: wp.array3d(dtype=Real),
        log: wp.array3d(dtype=Real),
        out: wp.array3d(dtype=Real),
    ):
        run, sample = wp.tid()
        plant = plants[wp.min(run, plants.shape[0] - 1)]
        camera = cameras[wp.min(run, cameras.shape[0] - 1)]
        column = wp.min(run, motion.shape[1] - 1)
        y = load_state(log[run], sample, plant.unit)
        angle = log[run, sample, angle_at]
        view = view_of(y, vec2(wp.cos(angle), wp.sin(angle)), plant, camera)
        sight = look(view, camera, three_of(motion, sample, column, centroid), corners)
        for j in range(3):
            out[run, sample, position + j] = view.position[j]
        for j in range(4):
            out[run, sample, attitude + j] = view.attitude[j]
        for j in range(6):
            out[run, sample, twist + j] = view.twist[j]
        for i in range(2 * points):
            out[run, sample, image + i] = sight.image[i]
        for i in range(points):
            out[run, sample, depth + i] = sight.depth[i]
            out[run, sample, in_view + i] = sight.seen[2 * i]

    return watch
