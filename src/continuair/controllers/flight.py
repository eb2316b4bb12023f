"""A flight controller's cascade: position, velocity (PI), thrust, attitude on SO(3), rates, moment.

    v_d = v_ref + k_p (p_ref - p)               a_d = k_v (v_d - v) + ∫ k_i (v_d - v) dt
    F = m (a_d + g), |F| and its tilt limited   R_d: z along F, x towards the yaw
    e_R = ½ (R_dᵀ R - Rᵀ R_d)^∨                 M = -I (ω_n² e_R + 2 ζ ω_n e_ω) + ω×I ω + arms
    f = F · R e_z along the body's z axis

Lee, Leok and McClamroch (2010), with gains per axis, I about the common centre of mass, and
feedforward of the arms (controllers/feeding.py). A servo moves each bend's reference to its
set-point with a lag and a largest speed; a spring and a damper make the bend follow.
"""

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any, Literal, TypedDict

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.cascade_design import GRAVITY, Design
from continuair.controllers.cascade_gains import real_gains
from continuair.controllers.controller import REACHED, Controller, Values
from continuair.controllers.feeding import FEEDFORWARD, feeding_code
from continuair.controllers.hover import hover
from continuair.device.types import room
from continuair.errors import CannotHover, InputError, nearest, shown
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.guidance import guidance_code
from continuair.kernels.sensing.sense import LawCode
from continuair.typing import ArrayLike
from continuair.vehicle.bending import check_bend, check_uniform
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_NOISE = ("position", "velocity", "attitude", "gyro")
_NO_LIMIT = 1e30
_FASTEST = 1e4
"""The largest rate [Hz]."""


class FlightChoices(TypedDict, total=False):
    """Keyword arguments of `flight_controller` but `speed`."""

    position_bandwidth: float | None
    attitude_bandwidth: float | None
    yaw_bandwidth: float | None
    bend_bandwidth: ArrayLike | None
    damping_ratio: float
    integral_share: float
    feedforward: Literal["none", "weight", "reaction"]
    rate: float
    latency: float
    rotor_lag: float | None
    bend: ArrayLike | None
    tilt: float
    thrust: ArrayLike | None
    moment: ArrayLike | None
    bend_moment: float | None
    bend_speed: float | None
    noise: Mapping[str, float] | None


def flight_controller(
    vehicle: Vehicle,
    *,
    position_bandwidth: float | None = None,
    attitude_bandwidth: float | None = None,
    yaw_bandwidth: float | None = None,
    bend_bandwidth: ArrayLike | None = None,
    damping_ratio: float = 1.0,
    integral_share: float = 0.2,
    feedforward: Literal["none", "weight", "reaction"] = "weight",
    rate: float = 250.0,
    latency: float = 0.0,
    rotor_lag: float | None = None,
    bend: ArrayLike | None = None,
    tilt: float = 0.7,
    thrust: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    speed: float = 5.0,
    bend_moment: float | None = None,
    bend_speed: float | None = None,
    noise: Mapping[str, float] | None = None,
) -> Controller:
    """Make a cascaded flight controller that follows set-points.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    position_bandwidth : float, optional
        Bandwidth of position [rad/s]. Default: an eighth of `attitude_bandwidth`.
    attitude_bandwidth : float, optional
        Bandwidth of roll and pitch [rad/s]. Default: 20, at most 0.5 / `rotor_lag`, lowered as
        Notes say.
    yaw_bandwidth : float, optional
        Bandwidth of yaw [rad/s]. Default: two fifths of `attitude_bandwidth`.
    bend_bandwidth : float or array_like (sections,), optional
        Bandwidth of the bend servos [rad/s], one for all sections or one each; 0 leaves a section
        free. Default: 5, lowered as Notes say.
    damping_ratio : float, default 1.0
        Damping ratio of the position and attitude loops.
    integral_share : float, default 0.2
        Pole of the integral over that of position; 0 for no integral.
    feedforward : {"none", "weight", "reaction"}, default "weight"
        Feedforward of the arms.
    rate : float, default 250.0
        Sampling rate [Hz].
    latency : float, default 0.0
        Delay from sensing to actuation [s].
    rotor_lag : float, optional
        Time constant of first order that the gains are designed for [s]. Default: the rotors'.
    bend : array_like (2 sections,) or (postures, 2 sections), optional
        Bend vectors [1/m] for which the gains must be stable too, besides straight arms.
    tilt : float, default 0.7
        Largest tilt [rad].
    thrust : array_like (2,), optional
        Least and most thrust [N]. Default: 0.1 times the weight, or the rotors' least if that is
        more, and the most that the rotors lift level, or 2 times the weight without rotors.
    moment : float or array_like (3,), optional
        Largest moment about each body axis [N m]. Default: no limit.
    speed : float, default 5.0
        Largest speed of approach [m/s].
    bend_moment : float, optional
        Largest bend moment of each component [N m²]. Default: no limit.
    bend_speed : float, optional
        Largest rate of each component of a bend [1/(m s)]. Default: no limit.
    noise : mapping of str to float, optional
        Standard deviations per axis of "position" [m], "velocity" [m/s], "attitude" [rad] and
        "gyro" [rad/s]. Default: 0.

    Returns
    -------
    Controller
        A guided controller; its set-points are the scenario's `Setpoints`. Its settings record the
        bandwidths, gains, limits and the latency margin [s].

    Raises
    ------
    InputError
        If a value is out of range, or the delays make the hovering vehicle unstable.

    Notes
    -----
    Thrust acts along the body's z axis, with moments and bend servos. Gains are designed at 9.81
    m/s². Bandwidths of attitude and bends that are not given are lowered until the hovering vehicle
    is stable with half as much delay again. Without `bend`, gains and margin are those of straight
    arms, with free sections at rest under their weight; at other bends the margin may be smaller.
    The delay margin is searched up to ``max(0.25 s, 1.5 * latency)``; larger margins are reported
    as that limit.
    """
    check_single_vehicle(vehicle, strain=True)
    checks.choice("feedforward", feedforward, FEEDFORWARD)
    period = 1.0 / checks.positive("rate", rate, " [Hz]")
    if rate > _FASTEST:
        raise InputError(
            "rate",
            f"is {shown(rate)}",
            f"give at most {_FASTEST:g} [Hz], beyond which its margin takes minutes to find",
        )
    late = checks.number("latency", latency, least=0.0, otherwise=" [s]")
    lag = _lag(vehicle, rotor_lag)
    ratio = checks.positive("damping_ratio", damping_ratio)
    share = checks.number("integral_share", integral_share, least=0.0)
    bends = np.empty((0, vehicle.layout.bends)) if bend is None else _bends(vehicle, bend)
    if not real_gains(ratio, share):
        raise InputError(
            "integral_share",
            f"is {shown(integral_share)}, with which damping_ratio {ratio:g} has no real gains",
            "give a smaller share, such as 0.2",
        )
    given = {
        "position": _bandwidth("position_bandwidth", position_bandwidth),
        "attitude": _bandwidth("attitude_bandwidth", attitude_bandwidth),
        "yaw": _bandwidth("yaw_bandwidth", yaw_bandwidth),
        "bend": _bend_bandwidth(bend_bandwidth, vehicle.sections),
    }
    servos = np.ones(vehicle.sections) if given["bend"] is None else given["bend"]
    check_uniform("bend_bandwidth", servos > 0.0, vehicle)
    limits = _limits(vehicle, tilt, thrust, moment, speed, bend_moment, bend_speed)
    design = Design(vehicle, given, (ratio, share), limits, feedforward, (period, late, lag), bends)
    bandwidths, gains, margin = design.found()
    settings = {
        **{f"{name}_bandwidth": value for name, value in bandwidths.items()},
        "damping_ratio": ratio,
        "integral_share": share,
        "feedforward": feedforward,
        "rate": 1.0 / period,
        "latency": late,
        "rotor_lag": lag,
        "bend": bends,
        "latency_margin": margin - late,
        **{name: gains[name] for name in ("position", "velocity", "integral", "attitude", "spin")},
        **limits,
        "noise": _noise(noise),
    }
    gains = gains | {"noise": np.array(list(settings["noise"].values()))}
    law = LAWS[feedforward]
    return Controller(
        "flight controller",
        law,
        gains,
        False,
        settings,
        period=period,
        latency=late,
        guided=True,
        at_limits=_at_limits,
        known=_known,
        bandwidths=_bandwidths,
        asks=4,
        bends=bool(np.any(gains["bend_limit"])),
    )


def _known(vehicle: Vehicle) -> dict[str, np.ndarray]:
    """Return the mass [kg] and inertia (3, 3) [kg m²] that are among the gains for a vehicle."""
    found = hover(vehicle, GRAVITY)
    return {"mass": np.array(found.mass), "inertia": found.inertia}


def _bandwidths(gains: Values) -> np.ndarray:
    """Return the slowest of position, and of roll and pitch (..., 2) [rad/s], without integrals."""
    position = np.sqrt(np.asarray(gains["position"]) * np.asarray(gains["velocity"]))
    attitude = np.sqrt(np.asarray(gains["attitude"])[..., :2])
    return np.stack([position.min(axis=-1), attitude.min(axis=-1)], axis=-1)


def _at_limits(gains: Values, push: np.ndarray) -> dict[str, np.ndarray]:
    """Return which parts of wrenches (runs, samples, numbers) are at limits, if they have any."""
    least, most = (np.atleast_1d(gains[f"{each}_thrust"])[:, None] for each in ("least", "most"))
    moment, bend = (np.atleast_2d(gains[each])[:, None] for each in ("most_moment", "bend_limit"))
    thrust, parts = np.linalg.norm(push[..., :3], axis=-1), np.abs(push)
    return {
        "thrust": (thrust >= REACHED * most) | (thrust * REACHED <= least),
        "moment": (parts[..., 3:6] >= REACHED * moment).any(-1),
        "bend moment": ((parts[..., 6:] >= REACHED * bend) & (bend > 0.0)).any(-1),
    }


def _limits(
    vehicle: Vehicle, tilt: Any, thrust: Any, moment: Any, speed: Any, bend: Any, bend_speed: Any
) -> dict[str, Any]:
    """Return checked limits by name; None means no limit."""
    weight = vehicle.mass * GRAVITY
    able = _thrust_of(vehicle, weight) if thrust is None else thrust
    least_most = checks.vector("thrust", able, 2)
    if not 0.0 < least_most[0] < weight < least_most[1]:
        raise InputError(
            "thrust",
            f"is {shown(least_most.tolist())}",
            (
                "give the least and the most [N], above 0, with the weight of "
                f"{weight:.3g} N in between"
            ),
        )
    if not 0.0 < checks.positive("tilt", tilt, " [rad]") <= 1.4:
        raise InputError("tilt", f"is {shown(tilt)}", "give an angle of at most 1.4 [rad]")
    most = checks.row("moment", _NO_LIMIT if moment is None else moment, 3)
    if not (most > 0.0).all():
        raise InputError(
            "moment", f"is {shown(moment)}", "give three largest moments above 0 [N m]"
        )
    return {
        "tilt": float(tilt),
        "thrust": least_most,
        "moment": most,
        "speed": checks.positive("speed", speed, " [m/s]"),
        "bend_moment": checks.positive(
            "bend_moment", _NO_LIMIT if bend is None else bend, " [N m²]"
        ),
        "bend_speed": checks.positive(
            "bend_speed", _NO_LIMIT if bend_speed is None else bend_speed, " [1/(m s)]"
        ),
    }


def _thrust_of(vehicle: Vehicle, weight: float) -> tuple[float, float]:
    """Return the least and the most thrust [N], from the rotors or from the weight.

    The first rotor that reaches its limit ends what the rotors lift without turning the vehicle.
    """
    least, rotors = 0.1 * weight, vehicle.uav.rotors
    if rotors is None:
        return least, 2.0 * weight
    found = hover(vehicle, GRAVITY)
    ahead, left, _ = found.moment / found.mass
    shares = rotors.thrusts_for(np.array([0.0, 0.0, 1.0, left, -ahead, 0.0]))
    lifting = shares > 0.0
    lowest, highest = (limits[lifting] / shares[lifting] for limits in rotors.limits.T)
    if not highest.min() > weight:
        rotor = int(np.flatnonzero(lifting)[np.argmin(highest)])
        raise CannotHover(
            rotors.limits_field(rotor),
            f"lets the rotors lift {highest.min():.4g} N level, but the vehicle weighs "
            f"{weight:.4g} N",
            "increase the thrust",
        )
    return max(least, float(lowest.max())), float(highest.min())


def _lag(vehicle: Vehicle, given: Any) -> float:
    """Return the rotors' lag [s], as given or the vehicle's slower one; 0 without rotors."""
    if given is None:
        rotors = vehicle.uav.rotors
        return 0.0 if rotors is None else float(np.maximum(*rotors.lags))
    return checks.number("rotor_lag", given, least=0.0, otherwise=" [s]")


def _bandwidth(name: str, value: Any) -> float | None:
    return None if value is None else checks.positive(name, value, " [rad/s]")


def _bend_bandwidth(value: Any, sections: int) -> np.ndarray | None:
    """Return one bandwidth of 0 or more for each section (sections,)."""
    if value is None:
        return None
    found = checks.row("bend_bandwidth", value, sections)
    if not (found >= 0.0).all():
        raise InputError("bend_bandwidth", f"is {shown(value)}", "give 0 or more [rad/s]")
    return found


def _bends(vehicle: Vehicle, value: Any) -> np.ndarray:
    """Return bends as rows (postures, 2 per section) [1/m], checked to be possible."""
    found = checks.rows("bend", value, vehicle.layout.bends)
    for each in found:
        check_bend("bend", value, each, vehicle)
    return found


def _noise(given: Any) -> dict[str, float]:
    """Return standard deviations of all measurements, in order."""
    given = {} if given is None else given
    if not isinstance(given, Mapping):
        raise InputError(
            "noise", f"is {shown(given)}", f"give numbers by name: {', '.join(_NOISE)}"
        )
    for name in given:
        if name not in _NOISE:
            raise InputError("noise", f"holds {shown(name)}", nearest(str(name), _NOISE))
    return {
        name: checks.number(f"noise.{name}", given.get(name, 0.0), least=0.0) for name in _NOISE
    }


_SIDEWAYS = 0.3
"""Share of the largest thrust reserved for horizontal force during a climb."""


def _fed_by(feedforward: str) -> Callable[[LawCode], SimpleNamespace]:
    def law(code: LawCode) -> SimpleNamespace:
        """The law on the device."""
        parts = cascade_parts(code)
        steer = steering(code, parts, feedforward)
        return _following(code, parts, steer)

    return law


LAWS = {name: _fed_by(name) for name in FEEDFORWARD}
"""The law by its feedforward."""


def cascade_parts(
    code: LawCode, more: Mapping[str, Any] | None = None, remembers: int = 0
) -> SimpleNamespace:
    """Return the gains and the functions of the cascade.

    more: types of further gains by name; remembers: the number of further values in memory.
    """
    Real, Sense, Bends = code.Real, code.Sense, code.Bends
    vec3, quat, mat33, above = code.vec3, code.quat, code.mat33, code.above
    sine, cosine, bends = code.sine, code.cosine, code.bends
    ground = guidance_code(code.numbers, code.tree)
    SetPoint, Noise = ground.SetPoint, ground.Noise
    Memory = wp.types.vector(4 + 2 * bends + remembers, Real)
    BendInertia = wp.types.matrix((room(bends), room(bends)), Real)
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
        d2 = wp.cross(d3, vec3(cosine(wanted.yaw), sine(wanted.yaw), zero))  # type: ignore[arg-type]
        d2 = d2 / wp.length(d2)
        d1 = wp.cross(d2, d3)  # type: ignore[arg-type]
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
        """Low-pass filtered bend rates; the difference to them estimates the bend accelerations."""
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
    """Return function steer(sense, gains, flight, wanted, reference, rate, memory) -> push, memory.

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
        arms = fed(
            sense.state, sense.arms, flight, gains.inertia, felt, bend, gains.bend_limit, ddb
        )
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
    """Return the law that follows set-points."""
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
