"""Device code of the inputs: from their columns to forces on the base and on the bend."""

from types import SimpleNamespace

import warp as wp

GENERAL, PAPER, TIP, COMMAND = 1, 2, 4, 8
"""What acts, as bits: the columns of inputs (layout.py) push, Euler and polar, and tip wrench,
and a controller's push."""


def load_code(section: SimpleNamespace, independent: bool) -> SimpleNamespace:
    """Warp functions on top of a section's, for the `independent` model or the others."""
    Real, Row, State, Plant = section.Real, section.Row, section.State, section.Plant
    Push = section.Push
    vec2, vec3, mat33, quat = section.vec2, section.vec3, section.mat33, section.quat
    shape, tip_of, bend_force = section.shape, section.tip_of, section.bend_force
    attitude_of, inertia_of = section.attitude_of, section.inertia_of
    moment_of_arm, full = section.moment_of_arm, section.full
    zero, one = Real(0.0), Real(1.0)

    @wp.struct
    class Frozen:
        """What `independent` keeps from the initial state: payload, tip and attitude."""

        moment: vec3
        inertia: mat33
        inverse: mat33
        tip: vec3
        attitude: quat

    @wp.struct
    class Load:
        """External force and moment on the vehicle in body axes, and on the bend."""

        force: vec3
        moment: vec3
        bend: vec2

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
    def load_of(
        y: State,
        b: vec2,
        branch: vec2,
        plant: Plant,
        frozen: Frozen,
        inputs: wp.array3d(dtype=Real),
        row: int,
        run: int,
        groups: int,
        command: Push,
    ):
        """Sum the inputs in use, and a controller's push, into body axes and bend axes."""
        out = Load()
        if groups == 0:
            return out
        q = attitude_of(y)
        push = command
        if groups != COMMAND:
            for j in range(8):
                push[j] = push[j] + inputs[row, run, j]
        out.force = wp.quat_rotate_inv(q, vec3(push[0], push[1], push[2]))
        out.moment = vec3(push[3], push[4], push[5])
        bend = vec2(push[6], push[7]) / plant.unit
        if (groups & PAPER) != 0:
            torque = vec3(inputs[row, run, 8], inputs[row, run, 9], inputs[row, run, 10])
            if wp.length_sq(torque) > zero:
                out.moment += euler_torque_to_body(q, torque)
            bend += (
                polar_to_bend(
                    b,
                    branch,
                    plant.threshold,
                    inputs[row, run, 11],
                    plant.unit * inputs[row, run, 12],
                )
                / plant.unit
            )
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

    return SimpleNamespace(Frozen=Frozen, Load=Load, freeze=freeze, load_of=load_of)
