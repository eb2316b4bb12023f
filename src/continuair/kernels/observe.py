"""The kernel that finds tip, energies, momenta and base reaction along logged runs."""

from types import SimpleNamespace

import warp as wp

from continuair.kernels.forces.inputs import TIP
from continuair.kernels.step import OPTIONS

OBSERVED = 22
"""Observed columns: tip position 3, tip attitude 4, energies 3, momenta 6, base reaction 6."""


def observer(code: SimpleNamespace):
    """The kernel `observe`: what follows from logged rows, for each run and sample."""
    Real, State, Row, Plant, vec2, vec3 = (
        code.Real,
        code.State,
        code.Row,
        code.Plant,
        code.vec2,
        code.vec3,
    )
    quat, shape, tip_of, freeze = code.quat, code.shape, code.tip_of, code.freeze
    tip_attitude, Push = code.tip_attitude, code.Push
    inertia_of, moment_of_arm, momentum_of_bending, load_of, rate_of = (
        code.inertia_of,
        code.moment_of_arm,
        code.momentum_of_bending,
        code.load_of,
        code.rate_of,
    )
    half, zero, one, two = Real(0.5), Real(0.0), Real(1.0), Real(2.0)
    tip_group, width, first = TIP, code.layout.state, code.layout.command.start
    coupled, independent = code.model == "coupled", code.model == "independent"

    @wp.kernel(enable_backward=False, module="unique", module_options=OPTIONS)
    def observe(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        log: wp.array3d(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        stride: int,
        groups: int,
        gravity: Real,
        out: wp.array3d(dtype=Real),
    ):
        run, sample = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        column = wp.min(run, inputs.shape[1] - 1)
        plant = plants[vehicle]
        y = State()
        y0 = State()
        for j in range(width):
            scale = wp.where(j == 7 or j == 8 or j >= 15, plant.unit, one)
            y[j] = log[run, sample, j] * scale
            y0[j] = log[run, 0, j] * scale
        frozen = freeze(y0, plant, coefficients, vehicle)
        row = sample * stride
        direction = vec2(wp.cos(log[run, sample, width + 1]), wp.sin(log[run, sample, width + 1]))
        command = Push()
        for j in range(8):
            command[j] = log[run, sample, first + j]
        dy = rate_of(
            y,
            direction,
            plant,
            frozen,
            coefficients,
            vehicle,
            inputs,
            row,
            column,
            groups,
            command,
            gravity,
        )

        q = quat(y[3], y[4], y[5], y[6])
        p = vec3(y[0], y[1], y[2])
        v = vec3(y[9], y[10], y[11])
        w = vec3(y[12], y[13], y[14])
        b = vec2(y[7], y[8])
        db = vec2(y[15], y[16])
        u = wp.dot(b, b)
        du = two * wp.dot(b, db)
        s = shape(coefficients, vehicle, u)
        tip = tip_of(b)
        at = p + wp.quat_rotate(q, plant.mount + plant.unit * tip.point)
        turn = q * tip_attitude(b)

        h = moment_of_arm(s, b)
        lift = s.d[0] * du
        hd = vec3(s.f[0] * db[0] + lift * b[0], s.f[0] * db[1] + lift * b[1], -s.d[1] * du)
        c = plant.arm_mass * plant.mount + h
        inertia = inertia_of(s, plant, b)
        hb = momentum_of_bending(s, plant.lever, b, db, hd, du)
        bending = half * (s.f[8] * wp.dot(db, db) + Real(0.25) * s.f[9] * du * du)
        swept = hd
        height = plant.mass * p[2]
        if wp.static(independent):
            c = frozen.moment
            inertia = frozen.inertia
            hb = vec3(zero, zero, zero)
            swept = hb
            height += wp.quat_rotate(frozen.attitude, h)[2]
        height += wp.quat_rotate(q, c)[2]
        moving = v + wp.quat_rotate(q, wp.cross(w, c) + swept) / plant.mass
        spin = inertia * w
        kinetic = bending + half * wp.dot(w, spin)
        if wp.static(coupled):
            kinetic += wp.dot(w, hb) + half * plant.mass * wp.dot(moving, moving)
        else:
            frozen_velocity = v + wp.quat_rotate(q, wp.cross(w, c)) / plant.mass
            kinetic += half * plant.mass * wp.dot(frozen_velocity, frozen_velocity)
        centre = p + wp.quat_rotate(q, c) / plant.mass
        linear = plant.mass * moving
        angular = wp.quat_rotate(q, spin + hb) + wp.cross(centre, linear)

        a = wp.quat_rotate_inv(q, vec3(dy[9], dy[10], dy[11] + gravity))
        dw = vec3(dy[12], dy[13], dy[14])
        on_uav = load_of(
            y,
            b,
            direction,
            plant,
            frozen,
            inputs,
            row,
            column,
            groups - (groups & tip_group),
            command,
        )
        force = plant.uav_mass * a - on_uav.force
        moment = plant.uav_inertia * dw + wp.cross(w, plant.uav_inertia * w) - on_uav.moment
        for j in range(3):
            out[run, sample, j] = at[j]
            out[run, sample, 10 + j] = linear[j]
            out[run, sample, 13 + j] = angular[j]
            out[run, sample, 16 + j] = force[j]
            out[run, sample, 19 + j] = moment[j]
        for j in range(4):
            out[run, sample, 3 + j] = turn[j]
        out[run, sample, 7] = kinetic
        out[run, sample, 8] = gravity * height
        out[run, sample, 9] = half * plant.stiffness * u

    return observe
