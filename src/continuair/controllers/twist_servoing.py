"""Visual servoing of a vehicle that must tilt to move: a cascade on twists over the flight law.

The desired twist of the camera is v = λ (LᵀL + c² tr(LᵀL) 1)⁻¹ Lᵀ e, plus the target's own twist.
It approximates L⁺, with slower motion along directions that the image determines poorly. A vehicle
with parallel rotors controls position, yaw and bends, ζ = (velocity, yaw rate, bend rates), while
roll and pitch serve the thrust: ζ = W Jᵀ (J W Jᵀ + μ² 1)⁻¹ v with J its columns of the camera's
Jacobian. The velocity and the integrated yaw are set-points of the flight law
(controllers/flight.py); the bend rates move the servos' references. A velocity above its limit
scales all of ζ by one factor.
"""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, Unpack

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.controllers.definite import definite_code
from continuair.controllers.feeding import FEEDFORWARD
from continuair.controllers.flight import FlightChoices, cascade_parts, flight_controller, steering
from continuair.device.types import device_types
from continuair.kernels.flight import flight_code
from continuair.kernels.sensing.sense import LawCode
from continuair.sections import of_coordinates
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle


def twist_servoing(
    vehicle: Vehicle,
    servo: float = 0.5,
    *,
    speed: float = 0.3,
    conditioning: float = 0.03,
    feed_forward: bool = True,
    **choices: Unpack[FlightChoices],
) -> Controller:
    """Make an image-based servoing law for a vehicle that must tilt to move, such as a quadrotor.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch), with a camera.
    servo : float, default 0.5
        Gain λ of v = λ L⁺ e [1/s]; choose it well below the bandwidths of the flight controller.
    speed : float, default 0.3
        Largest commanded velocity [m/s]. Larger values tilt the camera more.
    conditioning : float, default 0.03
        Directions whose singular value is below this share converge more slowly, as noise moves
        them most.
    feed_forward : bool, default True
        Whether to add the target's twist to v.
    **choices
        Other keyword arguments of `flight_controller`.

    Returns
    -------
    Controller
        A guided controller that turns the twist into set-points of velocity, yaw and bends.

    Raises
    ------
    InputError
        If a value is out of range, or `flight_controller` raises it.

    Notes
    -----
    Sections whose bend_bandwidth is 0 do not move. The others move as fast as the twist needs,
    whatever their bandwidth. The law uses no position measurement, so its noise has no effect.
    `simulate` raises InputError for a scenario with set-points.
    """
    check_single_vehicle(vehicle, strain=True)
    rate, ahead, share = (
        checks.positive("servo", servo, " [1/s]"),
        checks.flag("feed_forward", feed_forward),
        checks.number("conditioning", conditioning, least=0.0),
    )
    flight = flight_controller(vehicle, speed=speed, **choices)
    natural = of_coordinates(vehicle, "natural")[0]
    moved = flight.settings["bend_bandwidth"] > 0.0
    gains = {
        "servo": np.array(rate),
        "feed_forward": np.array(float(ahead)),
        "conditioning": np.array(share),
        # A bend counts by the angle at its section's end.
        "bend_weight": np.where(vehicle.layout.per_coordinate(moved), natural**2, 0.0),
    }
    return replace(
        flight,
        name="IBVS by twists",
        law=LAWS[flight.settings["feedforward"]],
        gains={**flight.gains, **gains},
        looks=True,
        settings={
            "servo": rate,
            "feed_forward": ahead,
            "conditioning": share,
            **flight.settings,
        },
    )


_SINGULAR = 1e-6
"""μ², below which directions that ζ does not move are given up."""


def _by_twists(feedforward: str) -> Callable[[LawCode], SimpleNamespace]:
    def law(code: LawCode) -> SimpleNamespace:
        """The law on the device."""
        real = dict.fromkeys(("servo", "feed_forward", "conditioning"), code.Real)
        more = {**real, "bend_weight": code.Bends}
        parts = cascade_parts(code, more, remembers=1)
        return _servoed(code, parts, _wanted(code, parts), steering(code, parts, feedforward))

    return law


LAWS = {name: _by_twists(name) for name in FEEDFORWARD}
"""The law by the feedforward of its flight law."""


def _wanted(code: LawCode, parts: SimpleNamespace) -> Any:
    """Return the function that gives ζ, of (sense, gains)."""
    Real, Twist, Sense, vec3, bends = code.Real, code.Twist, code.Sense, code.vec3, code.bends
    Gains, interaction, camera_push, above = (
        parts.Gains, code.interaction, code.camera_push, code.above,
    )  # fmt: skip
    force_of, moment_of = code.force_of, code.moment_of
    bend_moment_of = device_types(code.numbers, code.tree).bend_moment_of
    definite = definite_code(code)
    determined, factored, solved = definite.determined, definite.factored, definite.solved
    Held = wp.types.vector(4 + bends, Real)
    Columns = wp.types.matrix((6, 4 + bends), Real)
    zero, one = Real(0.0), Real(1.0)
    singular = Real(_SINGULAR)

    @wp.func
    def camera_twist(sense: Sense, gains: Gains):
        """v."""
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        normal = wp.transpose(L) * L
        slower = gains.conditioning * gains.conditioning * wp.trace(normal)
        for i in range(6):
            normal[i, i] += slower
        v = gains.servo * solved(factored(determined(normal)), wp.transpose(L) * e)
        return v + gains.feed_forward * sense.target_twist

    @wp.func
    def columns(sense: Sense):
        """J: its rows are the actuator wrenches of unit wrenches on the camera."""
        out = Columns()
        up = wp.quat_rotate_inv(sense.attitude, vec3(zero, zero, one))
        for i in range(6):
            wrench = Twist()
            wrench[i] = one
            push = camera_push(sense, wrench)
            force = force_of(push)
            bend = bend_moment_of(push)
            for j in range(3):
                out[i, j] = force[j]
            out[i, 3] = wp.dot(moment_of(push), up)
            for j in range(bends):
                out[i, 4 + j] = bend[j]
        return out

    @wp.func
    def wanted(sense: Sense, gains: Gains):
        J = columns(sense)
        weighted = J
        for i in range(6):
            for j in range(bends):
                weighted[i, 4 + j] = gains.bend_weight[j] * J[i, 4 + j]
        square = weighted * wp.transpose(J)
        for i in range(6):
            square[i, i] += singular
        out = Held()
        out = wp.transpose(weighted) * solved(factored(square), camera_twist(sense, gains))
        size = wp.length(vec3(out[0], out[1], out[2]))
        return above(size, gains.speed, gains.speed / above(size, zero, size, one), one) * out

    return wanted


def _servoed(code: LawCode, parts: SimpleNamespace, wanted_of: Any, steer: Any) -> SimpleNamespace:
    """Return the law that makes the camera follow the wanted twist."""
    Real, Sense, Bends, vec3, bends = code.Real, code.Sense, code.Bends, code.vec3, code.bends
    Flight, above, angle_of = flight_code(code.numbers, code.tree).Flight, code.above, code.angle_of
    Gains, Memory, SetPoint = parts.Gains, parts.Memory, parts.SetPoint
    reference_of, turned = parts.reference_of, 4 + 2 * bends
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)

    @wp.func
    def yaw_of(sense: Sense, memory: Memory):
        """The yaw that is held, which starts as it is."""
        along = wp.quat_rotate(sense.attitude, vec3(one, zero, zero))
        return above(memory[3], half, memory[turned], angle_of(along[1], along[0]))

    @wp.func
    def control(sense: Sense, gains: Gains, flight: Flight, wanted: SetPoint, memory: Memory):
        moved = wanted_of(sense, gains)
        yaw = yaw_of(sense, memory)
        reference = reference_of(sense, memory)
        goal = SetPoint()
        goal.velocity = vec3(moved[0], moved[1], moved[2])
        goal.yaw = yaw
        goal.yaw_rate = moved[3]
        rate = Bends()
        for j in range(bends):
            rate[j] = wp.max(-gains.bend_speed[j], wp.min(gains.bend_speed[j], moved[4 + j]))
        push, memory = steer(sense, gains, flight, goal, reference, rate, memory)
        memory[turned] = yaw + gains.period * moved[3]
        return push, memory

    return SimpleNamespace(Gains=Gains, Memory=Memory, control=control, looks=True)
