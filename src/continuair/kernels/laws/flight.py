"""A flight controller's cascade: position, velocity (PI), thrust, attitude on SO(3), rates, moment.

    v_d = v_ref + k_p (p_ref - p)               a_d = k_v (v_d - v) + ∫ k_i (v_d - v) dt
    F = m (a_d + g), |F| and its tilt limited   R_d: z along F, x towards the yaw
    e_R = ½ (R_dᵀ R - Rᵀ R_d)^∨                 M = -I (ω_n² e_R + 2 ζ ω_n e_ω) + ω×I ω + arms
    f = F · R e_z along the body's z axis

Lee, Leok and McClamroch (2010), with the gains by axis, I about the common centre of mass, and what
is fed forward of the arms (kernels/laws/feeding.py). A servo moves each bend's reference to its
set-point with a lag and a largest speed, and the bend after it by spring and damper.
"""

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.kernels.flight import flight_code
from continuair.kernels.laws.feeding import FEEDFORWARD, feeding_code
from continuair.kernels.sensing.guidance import guidance_code
from continuair.kernels.sensing.sense import LawCode

_SIDEWAYS = 0.3
"""Share of the largest thrust that is kept for pushing sideways when it must climb."""


def _fed_by(feedforward: str) -> Callable[[LawCode], SimpleNamespace]:
    def law(code: LawCode) -> SimpleNamespace:
        """The law on the device."""
        parts = cascade_parts(code)
        steer = steering(code, parts, feedforward)
        return _following(code, parts, steer)

    return law


LAWS = {name: _fed_by(name) for name in FEEDFORWARD}
"""The law by what it feeds forward."""


def cascade_parts(
    code: LawCode, more: Mapping[str, Any] | None = None, remembers: int = 0
) -> SimpleNamespace:
    """Gains, and the functions that the cascade consists of.

    more: types of further gains by name; remembers: how many numbers more are remembered.
    """
    Real, Sense, Bends = code.Real, code.Sense, code.Bends
    vec3, quat, mat33, above = code.vec3, code.quat, code.mat33, code.above
    sine, cosine, bends = code.sine, code.cosine, code.bends
    ground = guidance_code(code.numbers, code.tree)
    SetPoint, Noise = ground.SetPoint, ground.Noise
    Memory = wp.types.vector(4 + 2 * bends + remembers, Real)
    BendInertia = wp.types.matrix((bends, bends), Real)
    zero, half, one, share = Real(0.0), Real(0.5), Real(1.0), Real(_SIDEWAYS)

    # Made of a table, as other laws have further gains.
    fields = {
        "period": Real,
        "mass": Real,
        "inertia": mat33,
        "position": vec3,
        "velocity": vec3,
        "integral": vec3,
        "attitude": vec3,
        "spin": vec3,
        "speed": Real,
        "tilt": Real,
        "least_thrust": Real,
        "most_thrust": Real,
        "most_moment": vec3,
        "noise": Noise,
        "bend_inertia": BendInertia,
        "bend_stiffness": Bends,
        "bend_stiffer": Real,
        "bend_damper": Real,
        "bend_servo": Bends,
        "bend_speed": Bends,
        "bend_limit": Bends,
        "bend_washout": Real,
    }
    Gains = wp.struct(type("Gains", (), {"__annotations__": fields | dict(more or {})}))

    @wp.func
    def asked_velocity(sense: Sense, gains: Gains, wanted: SetPoint):
        back = wp.cw_mul(gains.position, wanted.position - sense.position)
        back = wanted.follows * back
        size = wp.length(back)
        less = above(size, gains.speed, gains.speed / above(size, zero, size, one), one)
        return wanted.velocity + less * back

    @wp.func
    def within_limits(lift: vec3, gains: Gains):
        """A force [N] of which the vehicle is capable, its vertical part kept first."""
        most = gains.most_thrust
        wide = wp.sqrt(lift[0] * lift[0] + lift[1] * lift[1])
        kept = wp.min(wide, share * most)
        up = wp.min(lift[2], wp.sqrt(most * most - kept * kept))
        up = wp.max(gains.least_thrust, up)
        widest = wp.min(up * gains.tilt, wp.sqrt(wp.max(zero, most * most - up * up)))
        less = above(wide, widest, widest / above(wide, zero, wide, one), one)
        return vec3(less * lift[0], less * lift[1], up)

    @wp.func
    def asked_turning(sense: Sense, gains: Gains, lift: vec3, wanted: SetPoint):
        """The angular acceleration [rad/s²] that turns the body to R_d, body axes."""
        q = sense.attitude
        d3 = lift / wp.length(lift)
        d2 = wp.cross(d3, vec3(cosine(wanted.yaw), sine(wanted.yaw), zero))
        d2 = d2 / wp.length(d2)
        d1 = wp.cross(d2, d3)
        r1 = wp.quat_rotate(q, vec3(one, zero, zero))
        r2 = wp.quat_rotate(q, vec3(zero, one, zero))
        r3 = wp.quat_rotate(q, vec3(zero, zero, one))
        x = wp.dot(d3, r2) - wp.dot(d2, r3)
        y = wp.dot(d1, r3) - wp.dot(d3, r1)
        z = wp.dot(d2, r1) - wp.dot(d1, r2)
        rate = wp.quat_rotate_inv(q, vec3(zero, zero, wanted.yaw_rate))
        turned = wp.cw_mul(gains.attitude, half * vec3(x, y, z))
        return -turned - wp.cw_mul(gains.spin, sense.angular_velocity - rate)

    @wp.func
    def reference_of(sense: Sense, memory: Memory):
        """Where the servo is, which starts at the bends as they are."""
        out = Bends()
        for j in range(bends):
            out[j] = above(memory[3], half, memory[4 + j], sense.bend[j])
        return out

    @wp.func
    def washed_rate(sense: Sense, memory: Memory):
        """The bend rates, late: what they have gained on these tells how the bends accelerate."""
        out = Bends()
        for j in range(bends):
            out[j] = above(memory[3], half, memory[4 + bends + j], sense.bend_rate[j])
        return out

    @wp.func
    def servo_rate(reference: Bends, gains: Gains, wanted: SetPoint):
        out = wp.cw_mul(gains.bend_servo, wanted.bend - reference)
        for j in range(bends):
            out[j] = wp.max(-gains.bend_speed[j], wp.min(gains.bend_speed[j], out[j]))
        return out

    @wp.func
    def servo_moment(sense: Sense, gains: Gains, reference: Bends, rate: Bends):
        """Bend moments [N m²] that hold the bends at the reference."""
        x = gains.bend_stiffer * (reference - sense.bend)
        x = x + gains.bend_damper * (rate - sense.bend_rate)
        return wp.cw_mul(gains.bend_stiffness, reference) + gains.bend_inertia * x

    return SimpleNamespace(**locals())


def steering(code: LawCode, parts: SimpleNamespace, feedforward: str) -> Any:
    """The function steer(sense, gains, flight, wanted, reference, rate, memory) -> push, memory.

    reference, rate: of the bends' servos.
    """
    fed = getattr(feeding_code(code.numbers, code.tree), feedforward)
    Real, Sense, vec3, push, bends = code.Real, code.Sense, code.vec3, code.push, code.bends
    Bends = code.Bends
    Flight = flight_code(code.numbers, code.tree).Flight
    Gains, Memory, SetPoint = parts.Gains, parts.Memory, parts.SetPoint
    asked_velocity, within_limits = parts.asked_velocity, parts.within_limits
    asked_turning, servo_moment = parts.asked_turning, parts.servo_moment
    washed_rate = parts.washed_rate
    zero, one, two = Real(0.0), Real(1.0), Real(2.0)

    @wp.func
    def thrust_along(force: vec3, body_z: vec3, gains: Gains):
        return wp.max(gains.least_thrust, wp.min(gains.most_thrust, wp.dot(force, body_z)))

    @wp.func
    def remembered(
        memory: Memory, gains: Gains, miss: vec3, cut: vec3, reference: Bends, washed: Bends
    ):
        """The integral, which what the limits cut off holds back, the servo's reference and the
        late bend rates."""
        for j in range(3):
            held = miss[j] - two * cut[j] / gains.velocity[j]
            memory[j] = memory[j] + gains.period * gains.integral[j] * held
        memory[3] = one
        for j in range(bends):
            memory[4 + j] = reference[j]
            memory[4 + bends + j] = washed[j]
        return memory

    @wp.func
    def steer(
        sense: Sense, gains: Gains, flight: Flight, wanted: SetPoint, reference: Bends, rate: Bends,
        memory: Memory,
    ):  # fmt: skip
        miss = asked_velocity(sense, gains, wanted) - sense.velocity
        asked = wp.cw_mul(gains.velocity, miss) + vec3(memory[0], memory[1], memory[2])
        body_z = wp.quat_rotate(sense.attitude, vec3(zero, zero, one))
        lift = gains.mass * (asked + vec3(zero, zero, flight.gravity))
        felt = vec3(zero, zero, thrust_along(lift, body_z, gains) / gains.mass)
        bend = servo_moment(sense, gains, reference, rate)
        washed = washed_rate(sense, memory)
        ddb = gains.bend_washout * (sense.bend_rate - washed)
        arms = fed(sense.state, flight, gains.inertia, felt, bend, gains.bend_limit, ddb)
        lift = lift + wp.quat_rotate(sense.attitude, arms.force)
        force = within_limits(lift, gains)
        moment = gains.inertia * asked_turning(sense, gains, force, wanted) + arms.moment
        for j in range(3):
            most = gains.most_moment[j]
            moment[j] = wp.max(-most, wp.min(most, moment[j]))
        cut = (lift - force) / gains.mass
        reference = reference + gains.period * rate
        washed = washed + gains.period * ddb
        memory = remembered(memory, gains, miss, cut, reference, washed)
        thrust = thrust_along(force, body_z, gains)
        return push(thrust * body_z, moment, arms.bend), memory

    return steer


def _following(code: LawCode, parts: SimpleNamespace, steer: Any) -> SimpleNamespace:
    """The law that follows set-points."""
    Sense, Flight = code.Sense, flight_code(code.numbers, code.tree).Flight
    Gains, Memory, SetPoint = parts.Gains, parts.Memory, parts.SetPoint
    reference_of, servo_rate = parts.reference_of, parts.servo_rate

    @wp.func
    def control(sense: Sense, gains: Gains, flight: Flight, wanted: SetPoint, memory: Memory):
        reference = reference_of(sense, memory)
        rate = servo_rate(reference, gains, wanted)
        push, memory = steer(sense, gains, flight, wanted, reference, rate, memory)
        return push, memory

    return SimpleNamespace(Gains=Gains, Memory=Memory, control=control, looks=False)
