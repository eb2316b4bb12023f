"""Kernels: a whole roll-out per thread, single derivatives, and what is observed along a run."""

from functools import cache
from types import SimpleNamespace

import warp as wp

from continuair.kernels.dynamics import device_code
from continuair.kernels.loads import TIP

OBSERVED = 22
"""Observed columns: tip position 3, tip attitude 4, energies 3, momenta 6, base reaction 6."""

# Measured: inlining everything and fusing products and sums takes a fifth off Warp's own flags.
_OPTIONS = {
    "cpu_compiler_flags": "-march=native -ffp-contract=fast -mllvm=-inline-threshold=9000 "
    "-mllvm=-inline-cold-callsite-threshold=3000"
}

OK, NOT_FINITE, OVERBENT = 0, 1, 2
STATUS = {OK: "ok", NOT_FINITE: "not finite", OVERBENT: "bent beyond a full circle"}


@cache
def kernels(precision: str, sections: int, model: str) -> SimpleNamespace:
    """The kernels `rollout`, `derivative` and `observe`: the factory of all device code."""
    code = device_code(precision, sections, model)
    rollout, derivative = _integrate(code)
    return SimpleNamespace(
        code=code, rollout=rollout, derivative=derivative, observe=_observe(code)
    )


def _integrate(code: SimpleNamespace):
    Real, State, Row, Plant = code.Real, code.State, code.Row, code.Plant
    vec2, rate_of, freeze, width = code.vec2, code.rate_of, code.freeze, code.layout.state
    half, sixth, two, pi = Real(0.5), Real(1.0 / 6.0), Real(2.0), Real(3.141592653589793)

    @wp.func
    def unit_attitude(y: State):
        n = Real(1.0) / wp.sqrt(y[3] * y[3] + y[4] * y[4] + y[5] * y[5] + y[6] * y[6])
        for j in range(3, 7):
            y[j] = y[j] * n
        return y

    @wp.func
    def log_state(
        log: wp.array3d(dtype=Real),
        run: int,
        sample: int,
        y: State,
        unit: Real,
        direction: vec2,
        turns: Real,
    ):
        for j in range(width):
            log[run, sample, j] = y[j]
        for j in range(2):
            log[run, sample, 7 + j] = y[7 + j] / unit
            log[run, sample, 15 + j] = y[15 + j] / unit
        log[run, sample, width] = (y[7] * direction[0] + y[8] * direction[1]) / unit
        log[run, sample, width + 1] = wp.atan2(direction[1], direction[0]) + two * pi * turns

    @wp.kernel(enable_backward=False, module="unique", module_options=_OPTIONS)
    def rollout(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        start: wp.array2d(dtype=Real),
        angle: wp.array(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        stride: int,
        groups: int,
        gravity: Real,
        steps: wp.array(dtype=Real),
        sample_after: wp.array(dtype=wp.int32),
        log: wp.array3d(dtype=Real),
        status: wp.array(dtype=wp.int32),
        last_step: wp.array(dtype=wp.int32),
    ):
        run = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        column = wp.min(run, inputs.shape[1] - 1)
        plant = plants[vehicle]
        y = State()
        for j in range(width):
            y[j] = start[run, j]
        for j in range(2):
            y[7 + j] = y[7 + j] * plant.unit
            y[15 + j] = y[15 + j] * plant.unit
        frozen = freeze(y, plant, coefficients, vehicle)
        direction = vec2(wp.cos(angle[run]), wp.sin(angle[run]))
        turns = wp.round((angle[run] - wp.atan2(direction[1], direction[0])) / (two * pi))
        log_state(log, run, 0, y, plant.unit, direction, turns)
        code_of_end = wp.int32(0)
        done = steps.shape[0]
        for i in range(steps.shape[0]):
            h = steps[i]
            row = i * stride
            mid = row + wp.min(stride, 1)
            end = row + wp.min(stride, 2)
            k1 = rate_of(
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
                gravity,
            )
            k2 = rate_of(
                y + half * h * k1,
                direction,
                plant,
                frozen,
                coefficients,
                vehicle,
                inputs,
                mid,
                column,
                groups,
                gravity,
            )
            k3 = rate_of(
                y + half * h * k2,
                direction,
                plant,
                frozen,
                coefficients,
                vehicle,
                inputs,
                mid,
                column,
                groups,
                gravity,
            )
            k4 = rate_of(
                y + h * k3,
                direction,
                plant,
                frozen,
                coefficients,
                vehicle,
                inputs,
                end,
                column,
                groups,
                gravity,
            )
            y = unit_attitude(y + (h * sixth) * (k1 + two * (k2 + k3) + k4))
            b = vec2(y[7], y[8])
            u = wp.dot(b, b)
            if not wp.isfinite(wp.length_sq(y)):
                code_of_end = 1
            elif u > two:
                code_of_end = 2
            if code_of_end != 0:
                done = i
                break
            if u > Real(0.0):
                side = wp.dot(b, direction)
                # κ changes sign when the bend passes through straight; ψa stays continuous.
                turned = b * (wp.where(side < Real(0.0), Real(-1.0), Real(1.0)) / wp.sqrt(u))
                if direction[0] + turned[0] < Real(0.0):
                    if direction[1] >= Real(0.0) and turned[1] < Real(0.0):
                        turns += Real(1.0)
                    if direction[1] < Real(0.0) and turned[1] >= Real(0.0):
                        turns -= Real(1.0)
                direction = turned
            sample = sample_after[i]
            if sample >= 0:
                log_state(log, run, sample, y, plant.unit, direction, turns)
        status[run] = code_of_end
        last_step[run] = done

    @wp.kernel(enable_backward=False, module="unique", module_options=_OPTIONS)
    def derivative(
        plants: wp.array(dtype=Plant),
        coefficients: wp.array2d(dtype=Row),
        initial: wp.array2d(dtype=Real),
        states: wp.array2d(dtype=Real),
        angle: wp.array(dtype=Real),
        inputs: wp.array3d(dtype=Real),
        groups: int,
        gravity: Real,
        rates: wp.array2d(dtype=Real),
    ):
        run = wp.tid()
        vehicle = wp.min(run, plants.shape[0] - 1)
        plant = plants[vehicle]
        y = State()
        y0 = State()
        for j in range(width):
            scale = wp.where(j == 7 or j == 8 or j >= 15, plant.unit, Real(1.0))
            y[j] = states[run, j] * scale
            y0[j] = initial[run, j] * scale
        frozen = freeze(y0, plant, coefficients, vehicle)
        column = wp.min(run, inputs.shape[1] - 1)
        direction = vec2(wp.cos(angle[run]), wp.sin(angle[run]))
        dy = rate_of(
            y, direction, plant, frozen, coefficients, vehicle, inputs, 0, column, groups, gravity
        )
        for j in range(width):
            rates[run, j] = dy[j] / wp.where(j == 7 or j == 8 or j >= 15, plant.unit, Real(1.0))
        if wp.dot(vec2(y[7], y[8]), vec2(y[7], y[8])) > two:
            for j in range(width):
                rates[run, j] = Real(wp.nan)

    return rollout, derivative


def _observe(code: SimpleNamespace):
    Real, State, Row, Plant, vec2, vec3 = (
        code.Real,
        code.State,
        code.Row,
        code.Plant,
        code.vec2,
        code.vec3,
    )
    quat, shape, tip_of, freeze = (
        code.quat,
        code.shape,
        code.tip_of,
        code.freeze,
    )
    inertia_of, moment_of_arm, momentum_of_bending, load_of, rate_of = (
        code.inertia_of,
        code.moment_of_arm,
        code.momentum_of_bending,
        code.load_of,
        code.rate_of,
    )
    half, zero, one, two = Real(0.5), Real(0.0), Real(1.0), Real(2.0)
    full, tip_group, width = Real(4.442882938158366), TIP, code.layout.state
    coupled, independent = code.model == "coupled", code.model == "independent"

    @wp.func
    def tip_attitude(b: vec2):
        """Quaternion of Rz(ψa) Ry(-κ s) Rz(-ψa) diag(1, -1, -1)."""
        u = wp.dot(b, b)
        x = half * full * wp.sqrt(u)
        c = wp.cos(x)
        s = half * full
        if x > Real(1e-4):
            s = half * full * wp.sin(x) / x
        # The bending turns by -|b| s about (-b_y, b_x); diag(1, -1, -1) is half a turn about x.
        return quat(s * b[1], -s * b[0], zero, c) * quat(one, zero, zero, zero)

    @wp.kernel(enable_backward=False, module="unique", module_options=_OPTIONS)
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
        dy = rate_of(
            y, direction, plant, frozen, coefficients, vehicle, inputs, row, column, groups, gravity
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
            y, b, direction, plant, frozen, inputs, row, column, groups - (groups & tip_group)
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
