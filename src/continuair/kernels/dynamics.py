"""Device code of the three models: accelerations of an aerial continuum manipulator.

The state y of one run: position of B in the world, attitude (x y z w), bend b, velocity of B's
origin in world axes, angular velocity in body axes, rate of b. Lengths along the arc are in units
of λ (arc.py). The derivation of every term is in docs/numerics.md; letters are those used there:
c first moment, I inertia and J the coupling of bending and rotation about the common centre of
mass, N the inertia of bending, hb the angular momentum of bending.
"""

from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp

from continuair.kernels.arc import MAX_BEND_ANGLE, NAMES

STATE = 17
INPUTS = 19
"""Input columns: world force 3, body moment 3, bend moment 2 | Euler torques 3, Q_κ, Q_ψa | tip 6."""

GENERAL, PAPER, TIP = 1, 2, 4
"""Groups of input columns that are in use, as bits."""


@cache
def device_code(precision: str, model: str) -> SimpleNamespace:
    """Warp functions and types for one precision ("float64", "float32") and one model."""
    Real = getattr(wp, precision)
    vec2, vec3 = wp.types.vector(2, Real), wp.types.vector(3, Real)
    vec4, mat33 = wp.types.vector(4, Real), wp.types.matrix((3, 3), Real)
    quat = wp.types.quaternion(Real)
    Row, State = wp.types.vector(len(NAMES), Real), wp.types.vector(STATE, Real)
    zero, half, one, two = Real(0.0), Real(0.5), Real(1.0), Real(2.0)
    quarter, full = Real(0.25), Real(MAX_BEND_ANGLE / np.sqrt(2.0))
    coupled, independent = model == "coupled", model == "independent"

    @wp.struct
    class Plant:
        mass: Real
        arm_mass: Real
        uav_mass: Real
        unit: Real
        stiffness: Real
        damping: Real
        threshold: Real
        mount: vec3
        lever: vec3
        inertia: mat33
        uav_inertia: mat33

    @wp.struct
    class Frozen:
        """What `independent` keeps from the initial state: payload, tip and attitude."""

        moment: vec3
        inertia: mat33
        inverse: mat33
        tip: vec3
        attitude: quat

    @wp.struct
    class Shape:
        """Moments and their derivatives in u = |b|² at the current bend."""

        f: Row
        d: Row
        dd_alpha: Real
        dd_beta: Real

    @wp.struct
    class Load:
        """External force and moment on the vehicle in body axes, and on the bend."""

        force: vec3
        moment: vec3
        bend: vec2

    @wp.struct
    class Tip:
        """Tip relative to the arm's base: point [λ], and the functions A, A', B', Γ there."""

        point: vec3
        A: Real
        dA: Real
        dB: Real
        Gamma: Real

    @wp.func
    def position_of(y: State):
        return vec3(y[0], y[1], y[2])

    @wp.func
    def attitude_of(y: State):
        return quat(y[3], y[4], y[5], y[6])

    @wp.func
    def flat(x: Real, y: Real):
        return vec3(x, y, Real(0.0))

    @wp.func
    def shape(coefficients: wp.array2d(dtype=Row), i: int, u: Real):
        w = u - Real(1.0)
        out = Shape()
        f = Row()
        d = Row()
        sa = Real(0.0)
        sb = Real(0.0)
        for j in range(coefficients.shape[1]):
            sa = sa * w + d[0]
            sb = sb * w + d[1]
            d = d * w + f
            f = f * w + coefficients[i, j]
        out.f = f
        out.d = d
        out.dd_alpha = Real(2.0) * sa
        out.dd_beta = Real(2.0) * sb
        return out

    @wp.func
    def stumpff(z: Real):
        """c_1 … c_4 of z; c_0 is 1 - z c_2."""
        if z < Real(0.25):
            c3 = Real(0.0)
            c4 = Real(0.0)
            for i in range(7):
                n = Real(2.0) * Real(6 - i)
                c3 = (Real(1.0) - z * c3) / ((n + Real(3.0)) * (n + Real(2.0)))
                c4 = (Real(1.0) - z * c4) / ((n + Real(4.0)) * (n + Real(3.0)))
            c4 = c4 * Real(0.5)
            return vec4(Real(1.0) - z * c3, Real(0.5) - z * c4, c3, c4)
        x = wp.sqrt(z)
        sine = wp.sin(Real(0.5) * x)
        c1 = wp.sin(x) / x
        c2 = Real(2.0) * sine * sine / z
        return vec4(c1, c2, (Real(1.0) - c1) / z, (Real(0.5) - c2) / z)

    @wp.func
    def tip_of(b: vec2):
        out = Tip()
        c = stumpff(full * full * wp.dot(b, b))
        A = full * full * c[1]
        out.A = A
        out.dA = full * full * full * full * (c[3] - half * c[2])
        out.dB = half * full * full * full * (c[2] - c[1])
        out.Gamma = full * full * full * c[2]
        out.point = vec3(A * b[0], A * b[1], -full * c[0])
        return out

    @wp.func
    def moment_of_arm(s: Shape, b: vec2):
        return vec3(s.f[0] * b[0], s.f[0] * b[1], -s.f[1])

    @wp.func
    def bend_force(alpha: Real, d_alpha: Real, d_beta: Real, b: vec2, force: vec3):
        """J_cᵀ force: a force on every mass of the arm, as a force on the bend."""
        h = vec2(force[0], force[1])
        return alpha * h + two * (d_alpha * wp.dot(b, h) - d_beta * force[2]) * b

    @wp.func
    def inertia_of(s: Shape, plant: Plant, b: vec2):
        """Inertia about the common centre of mass with the arm frozen; d = u P + S + axial."""
        P = s.f[2]
        Q = s.f[3]
        S = s.f[4]
        h = moment_of_arm(s, b)
        e = plant.lever
        eh = e[0] * h[0] + e[1] * h[1]
        d = wp.dot(b, b) * P + S + two * eh
        xy = -P * b[0] * b[1] - e[0] * h[1] - e[1] * h[0]
        xz = Q * b[0] - e[0] * h[2]
        yz = Q * b[1] - e[1] * h[2]
        return plant.inertia + mat33(
            d - P * b[0] * b[0] - two * e[0] * h[0], xy, xz,
            xy, d - P * b[1] * b[1] - two * e[1] * h[1], yz,
            xz, yz, d - S,
        )

    @wp.func
    def load_of(y: State, b: vec2, branch: vec2, plant: Plant, frozen: Frozen,
                inputs: wp.array3d(dtype=Real), row: int, run: int, groups: int):
        """Sum the inputs in use into body axes and bend axes."""
        out = Load()
        if groups == 0:
            return out
        q = attitude_of(y)
        force = vec3(inputs[row, run, 0], inputs[row, run, 1], inputs[row, run, 2])
        out.force = wp.quat_rotate_inv(q, force)
        out.moment = vec3(inputs[row, run, 3], inputs[row, run, 4], inputs[row, run, 5])
        bend = vec2(inputs[row, run, 6], inputs[row, run, 7]) / plant.unit
        if (groups & PAPER) != 0:
            torque = vec3(inputs[row, run, 8], inputs[row, run, 9], inputs[row, run, 10])
            if wp.length_sq(torque) > zero:
                out.moment += euler_torque_to_body(q, torque)
            bend += polar_to_bend(b, branch, plant.threshold, inputs[row, run, 11],
                                  plant.unit * inputs[row, run, 12]) / plant.unit
        if (groups & TIP) != 0:
            f = vec3(inputs[row, run, 13], inputs[row, run, 14], inputs[row, run, 15])
            t = vec3(inputs[row, run, 16], inputs[row, run, 17], inputs[row, run, 18])
            tip = tip_of(b)
            fb = wp.quat_rotate_inv(q, f)
            tb = wp.quat_rotate_inv(q, t)
            fa = fb
            ta = tb
            point = plant.mount + plant.unit * tip.point
            if wp.static(independent):
                point = frozen.tip
                fa = wp.quat_rotate_inv(frozen.attitude, f)
                ta = wp.quat_rotate_inv(frozen.attitude, t)
            out.force += fb
            out.moment += wp.cross(point, fb) + tb
            twist = tip.A * ta[2] - tip.Gamma * (b[0] * ta[0] + b[1] * ta[1])
            bend += plant.unit * bend_force(tip.A, tip.dA, tip.dB, b, fa)
            bend += full * vec2(-ta[1], ta[0]) + twist * vec2(-b[1], b[0])
        out.bend = bend
        return out

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
    def freeze(y: State, plant: Plant, coefficients: wp.array2d(dtype=Row), vehicle: int):
        out = Frozen()
        b = vec2(y[7], y[8])
        s = shape(coefficients, vehicle, wp.dot(b, b))
        tip = tip_of(b)
        out.moment = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        out.inertia = inertia_of(s, plant, b)
        out.inverse = wp.inverse(out.inertia)
        out.tip = plant.mount + plant.unit * tip.point
        out.attitude = attitude_of(y)
        return out

    @wp.func
    def own_bending(s: Shape, b: vec2, db: vec2, du: Real, ddu: Real):
        """Ṅ ḃ - ½ ∂(ḃᵀ N ḃ)/∂b."""
        along = quarter * s.d[9] * du * du + half * (s.f[9] - s.d[8]) * ddu
        return s.d[8] * du * db + along * b

    @wp.func
    def solve_bending(s: Shape, b: vec2, u: Real, rhs: vec2):
        """N⁻¹ rhs with N = NP 1 + ND b bᵀ."""
        NP = s.f[8]
        ND = s.f[9]
        return (rhs - (ND * wp.dot(b, rhs) / (NP + u * ND)) * b) / NP

    @wp.func
    def solve_symmetric(m: mat33, r: vec3):
        """m⁻¹ r for a symmetric m."""
        a = m[1, 1] * m[2, 2] - m[1, 2] * m[1, 2]
        d = m[0, 2] * m[1, 2] - m[0, 1] * m[2, 2]
        e = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
        scale = one / (m[0, 0] * a + m[0, 1] * d + m[0, 2] * e)
        b = m[0, 0] * m[2, 2] - m[0, 2] * m[0, 2]
        c = m[0, 0] * m[1, 1] - m[0, 1] * m[0, 1]
        f = m[0, 1] * m[0, 2] - m[0, 0] * m[1, 2]
        return scale * vec3(
            a * r[0] + d * r[1] + e * r[2],
            d * r[0] + b * r[1] + f * r[2],
            e * r[0] + f * r[1] + c * r[2],
        )

    @wp.func
    def exchange_on_rotation(s: Shape, e: vec3, b: vec2, db: vec2, w: vec3, hd: vec3, du: Real):
        """İ ω, the change of inertia as the arm bends."""
        P = s.f[2]
        Q = s.f[3]
        u = wp.dot(b, b)
        bw = b[0] * w[0] + b[1] * w[1]
        dbw = db[0] * w[0] + db[1] * w[1]
        on_w = du * (P + u * s.d[2] + s.d[4]) + two * wp.dot(e, hd)
        on_b = du * (s.d[3] * w[2] - s.d[2] * bw) - P * dbw
        on_db = Q * w[2] - P * bw
        on_z = du * (s.d[3] * bw - s.d[4] * w[2]) + Q * dbw
        return (
            on_w * w
            + vec3(on_b * b[0] + on_db * db[0], on_b * b[1] + on_db * db[1], on_z)
            - wp.dot(hd, w) * e
            - wp.dot(e, w) * hd
        )

    @wp.func
    def momentum_of_bending(s: Shape, e: vec3, b: vec2, db: vec2, hd: vec3, du: Real):
        """hb: angular momentum of bending about the common centre of mass."""
        x = s.f[6] * db[0] + s.f[7] * du * b[0]
        y = s.f[6] * db[1] + s.f[7] * du * b[1]
        return vec3(y, -x, s.f[5] * (b[0] * db[1] - b[1] * db[0])) + wp.cross(e, hd)

    @wp.func
    def centrifugal(s: Shape, e: vec3, b: vec2, u: Real, w: vec3):
        """-½ ∂(ωᵀ I ω)/∂b."""
        bw = b[0] * w[0] + b[1] * w[1]
        wz = w[2]
        d_slope = s.f[2] + u * s.d[2] + s.d[4]
        along = d_slope * wp.dot(w, w) - s.d[2] * bw * bw + two * s.d[3] * bw * wz - s.d[4] * wz * wz
        across = s.f[2] * bw - s.f[3] * wz
        spin = wp.cross(w, wp.cross(w, e))
        return (
            across * vec2(w[0], w[1]) - along * b + bend_force(s.f[0], s.d[0], s.d[1], b, spin)
        )

    @wp.func
    def coupled_accelerations(y: State, plant: Plant, s: Shape, load: Load, b: vec2, db: vec2,
                              w: vec3, hd: vec3, du: Real, ddu: Real):
        """(a_o - g in body axes, ω̇, b̈) of the full 8×8 system; gravity cancels from the last two."""
        e = plant.lever
        u = wp.dot(b, b)
        inertia = inertia_of(s, plant, b)
        c = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        hb = momentum_of_bending(s, e, b, db, hd, du)
        up = s.d[1] * ddu + s.dd_beta * du * du
        out = s.d[0] * ddu + s.dd_alpha * du * du
        hdd = vec3(two * s.d[0] * du * db[0] + out * b[0],
                   two * s.d[0] * du * db[1] + out * b[1], -up)
        turn = (s.d[6] + s.f[7]) * du
        twist = s.d[7] * du * du + s.f[7] * ddu
        own = vec3(turn * db[1] + twist * b[1], -turn * db[0] - twist * b[0],
                   s.d[5] * du * (b[0] * db[1] - b[1] * db[0])) + wp.cross(e, hdd)
        bias = wp.cross(w, inertia * w + hb) + own
        bias += exchange_on_rotation(s, e, b, db, w, hd, du)
        rhs_w = load.moment - wp.cross(c, load.force) / plant.mass - bias
        rate = two * ((s.d[6] - s.f[7]) * (b[0] * w[0] + b[1] * w[1])
                      + (s.f[5] + u * s.d[5]) * w[2])
        rhs_b = (
            load.bend - plant.stiffness * b - plant.damping * db
            - bend_force(s.f[0], s.d[0], s.d[1], b, load.force) / plant.mass
            - own_bending(s, b, db, du, ddu) - rate * vec2(-db[1], db[0])
            - centrifugal(s, e, b, u, w)
        )
        # Columns of J, the coupling of rotation and bending.
        g00 = s.f[6] + two * s.f[7] * b[0] * b[0]
        g01 = two * s.f[7] * b[0] * b[1]
        g11 = s.f[6] + two * s.f[7] * b[1] * b[1]
        ca = two * s.d[0]
        cb = -two * s.d[1]
        jc0 = vec3(s.f[0] + ca * b[0] * b[0], ca * b[0] * b[1], cb * b[0])
        jc1 = vec3(ca * b[0] * b[1], s.f[0] + ca * b[1] * b[1], cb * b[1])
        j0 = vec3(g01, -g00, -s.f[5] * b[1]) + wp.cross(e, jc0)
        j1 = vec3(g11, -g01, s.f[5] * b[0]) + wp.cross(e, jc1)
        # Schur complement on the rotation.
        n = one / s.f[8]
        k = n * s.f[9] / (s.f[8] + u * s.f[9])
        jb = b[0] * j0 + b[1] * j1
        y0 = n * j0 - (k * b[0]) * jb
        y1 = n * j1 - (k * b[1]) * jb
        schur = inertia - wp.outer(y0, j0) - wp.outer(y1, j1)
        dw = solve_symmetric(schur, rhs_w - rhs_b[0] * y0 - rhs_b[1] * y1)
        ddb = solve_bending(s, b, u, rhs_b - vec2(wp.dot(j0, dw), wp.dot(j1, dw)))
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c) + two * hd) + hdd
        moved += ddb[0] * jc0 + ddb[1] * jc1
        return (load.force - moved) / plant.mass, dw, ddb

    @wp.func
    def decoupled_accelerations(y: State, plant: Plant, s: Shape, load: Load, b: vec2, db: vec2,
                                w: vec3, hd: vec3, du: Real, ddu: Real, gravity: Real):
        """The same with the UAV-arm blocks of M and C zeroed: own terms and half the exchange."""
        e = plant.lever
        u = wp.dot(b, b)
        alpha = s.f[0]
        inertia = inertia_of(s, plant, b)
        c = plant.arm_mass * plant.mount + moment_of_arm(s, b)
        hb = momentum_of_bending(s, e, b, db, hd, du)
        exchange = exchange_on_rotation(s, e, b, db, w, hd, du) + wp.cross(w, hb)
        bias = wp.cross(w, inertia * w) + half * exchange
        dw = solve_symmetric(inertia, load.moment - wp.cross(c, load.force) / plant.mass - bias)
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c) + hd)
        # About the arm's own base, K differ from those about the common centre of mass.
        across = s.d[6] - s.f[7] + two * alpha * s.d[1] / plant.mass
        about = s.f[5] + u * s.d[5] + alpha * (alpha + two * u * s.d[0]) / plant.mass
        rate = across * (b[0] * w[0] + b[1] * w[1]) + about * w[2]
        weight = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -gravity))
        rhs_b = (
            load.bend - plant.stiffness * b - plant.damping * db
            + bend_force(alpha, s.d[0], s.d[1], b, weight)
            - own_bending(s, b, db, du, ddu) - rate * vec2(-db[1], db[0])
        )
        return (load.force - moved) / plant.mass, dw, solve_bending(s, b, u, rhs_b)

    @wp.func
    def independent_accelerations(y: State, plant: Plant, frozen: Frozen, s: Shape, load: Load,
                                  b: vec2, db: vec2, w: vec3, du: Real, ddu: Real, gravity: Real):
        """A rigid vehicle with frozen payload, and the arm on a base fixed at the initial attitude."""
        c = frozen.moment
        bias = wp.cross(w, frozen.inertia * w)
        dw = frozen.inverse * (load.moment - wp.cross(c, load.force) / plant.mass - bias)
        moved = wp.cross(dw, c) + wp.cross(w, wp.cross(w, c))
        weight = wp.quat_rotate_inv(frozen.attitude, vec3(zero, zero, -gravity))
        rhs_b = (
            load.bend - plant.stiffness * b - plant.damping * db
            + bend_force(s.f[0], s.d[0], s.d[1], b, weight)
            - own_bending(s, b, db, du, ddu)
        )
        return (
            (load.force - moved) / plant.mass, dw, solve_bending(s, b, wp.dot(b, b), rhs_b)
        )

    @wp.func
    def rate_of(y: State, branch: vec2, plant: Plant, frozen: Frozen, coefficients: wp.array2d(dtype=Row),
                vehicle: int, inputs: wp.array3d(dtype=Real), row: int, run: int, groups: int,
                gravity: Real):
        """dy/dt."""
        b = vec2(y[7], y[8])
        db = vec2(y[15], y[16])
        w = vec3(y[12], y[13], y[14])
        du = two * wp.dot(b, db)
        ddu = two * wp.dot(db, db)
        s = shape(coefficients, vehicle, wp.dot(b, b))
        load = load_of(y, b, branch, plant, frozen, inputs, row, run, groups)
        lift = s.d[0] * du
        hd = vec3(s.f[0] * db[0] + lift * b[0], s.f[0] * db[1] + lift * b[1], -s.d[1] * du)
        if wp.static(coupled):
            a, dw, ddb = coupled_accelerations(y, plant, s, load, b, db, w, hd, du, ddu)
        elif wp.static(independent):
            a, dw, ddb = independent_accelerations(
                y, plant, frozen, s, load, b, db, w, du, ddu, gravity)
        else:
            a, dw, ddb = decoupled_accelerations(
                y, plant, s, load, b, db, w, hd, du, ddu, gravity)
        v = wp.quat_rotate(attitude_of(y), a)
        return State(
            y[9], y[10], y[11],
            half * (y[6] * w[0] + y[4] * w[2] - y[5] * w[1]),
            half * (y[6] * w[1] + y[5] * w[0] - y[3] * w[2]),
            half * (y[6] * w[2] + y[3] * w[1] - y[4] * w[0]),
            -half * (y[3] * w[0] + y[4] * w[1] + y[5] * w[2]),
            db[0], db[1],
            v[0], v[1], v[2] - gravity,
            dw[0], dw[1], dw[2],
            ddb[0], ddb[1],
        )

    return SimpleNamespace(
        model=model, Real=Real, vec2=vec2, vec3=vec3, quat=quat, mat33=mat33, Row=Row, State=State,
        Plant=Plant, Frozen=Frozen, shape=shape, tip_of=tip_of, inertia_of=inertia_of,
        moment_of_arm=moment_of_arm, momentum_of_bending=momentum_of_bending, freeze=freeze,
        load_of=load_of, rate_of=rate_of, position_of=position_of, attitude_of=attitude_of,
    )
