"""Hold a position, an attitude and the bends: PD loops with compensation of weight and spring.

Sections that no loop holds hang free: their weight and spring are not compensated. The spring is
compensated at the desired bends, and adds to the loops elsewhere. Bend moments are the inertia of
the straight arms times the desired accelerations. While the base rests, one section's loop moves no
other section. Limits saturate each component of the actuator wrench separately.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.cascade_design import GRAVITY
from continuair.controllers.controller import REACHED, Controller, Values
from continuair.controllers.inertias import bend_inertia, rigid_inertia
from continuair.device.types import room
from continuair.errors import InputError, shown
from continuair.kernels.sensing.sense import LawCode, gains_of
from continuair.sections import of_coordinates
from continuair.typing import ArrayLike
from continuair.vehicle.bending import check_bend, check_uniform
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_NO_LIMIT = 1e30


def hold(
    vehicle: Vehicle,
    position: ArrayLike,
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    bend: ArrayLike | None = None,
    *,
    rate: float = 3.0,
    attitude_rate: float = 8.0,
    bend_rate: ArrayLike = 5.0,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    bend_moment: float | None = None,
) -> Controller:
    """Make a controller that holds a position, an attitude and the bends.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    position : array_like (3,)
        Position of B's origin, world axes [m].
    attitude : array_like (4,), default (0, 0, 0, 1)
        Quaternion x y z w, body to world.
    bend : array_like (2 sections,), optional
        Bend vectors, arm by arm from the base out, below a full circle [1/m]. Default: 0.
    rate : float, default 3.0
        Bandwidth of the critically damped position loop [rad/s].
    attitude_rate : float, default 8.0
        Bandwidth of the critically damped attitude loop [rad/s].
    bend_rate : float or array_like (sections,), default 5.0
        Bandwidth of the bend loops [rad/s], one for all sections or one each. The arm's spring adds
        to it, so that a stiff arm overshoots. 0 leaves a section free, for open-loop studies of the
        arm's reaction on the base.
    force : float or array_like (3,), optional
        Largest force along each world axis [N]. Default: no limit.
    moment : float or array_like (3,), optional
        Largest moment about each body axis [N m]. Default: no limit.
    bend_moment : float, optional
        Largest bend moment of each component [N m²]. Default: no limit.

    Returns
    -------
    Controller
        The controller of one run. `simulate` warns if it reaches its limits.

    Raises
    ------
    InputError
        If a value is out of range, or the limits cannot carry the weight or the bend.
    """
    check_single_vehicle(vehicle, strain=True)
    sections = [section for arm in vehicle.arms for section in arm.section]
    straight = np.zeros(vehicle.layout.bends)
    turn = checks.vector("attitude", attitude, 4)
    if not np.linalg.norm(turn) > 0.0:
        raise InputError("attitude", f"is {shown(attitude)}", "give a unit quaternion (x, y, z, w)")
    settings = {
        "position": checks.vector("position", position, 3),
        "attitude": turn / np.linalg.norm(turn),
        "bend": checks.vector("bend", straight if bend is None else bend, len(straight)),
        "rate": checks.positive("rate", rate),
        "attitude_rate": checks.positive("attitude_rate", attitude_rate),
        "bend_rate": _bend_rate(bend_rate, len(sections)),
    }
    check_bend("bend", bend, settings["bend"], vehicle)
    per_coordinate = vehicle.layout.per_coordinate
    held = np.broadcast_to(settings["bend_rate"], len(sections)) > 0.0
    if settings["bend"][per_coordinate(held) == 0.0].any():
        raise InputError(
            "bend",
            f"is {shown(bend)}, but bend_rate {shown(bend_rate)} leaves sections of it free",
            "give a rate above 0 [rad/s], or zeros for these",
        )
    check_uniform("bend_rate", held, vehicle)
    plant = {
        "mass": vehicle.mass,
        "inertia": rigid_inertia(vehicle)[3:, 3:],
        # Moments for the other sections do not act on a free one.
        "bend_inertia": np.where(per_coordinate(held)[:, None], bend_inertia(vehicle), 0.0),
        "stiffness": np.where(per_coordinate(held), of_coordinates(vehicle, "stiffness")[0], 0.0),
    }
    gains = {name: np.asarray(value) for name, value in (settings | plant).items()}
    gains["bend_rate"] = per_coordinate(np.broadcast_to(settings["bend_rate"], len(sections)))
    given = {"force": force, "moment": moment, "bend_moment": bend_moment}
    if all(each is None for each in given.values()):
        return Controller("hold", law, gains, False, settings, asks=6)
    limits = _limits(given, vehicle.mass * GRAVITY, np.abs(gains["stiffness"] * gains["bend"]))
    settings |= {name: limits[name] for name, value in given.items() if value is not None}
    most = [limits["force"], limits["moment"], np.full(len(straight), limits["bend_moment"])]
    gains["limit"] = np.concatenate(most)
    return Controller(
        "limited hold", limited_law, gains, False, settings, asks=6, at_limits=_at_limits
    )


def _at_limits(gains: Values, push: np.ndarray) -> dict[str, np.ndarray]:
    """Return which parts of wrenches (runs, samples, numbers) are at their limits."""
    at = np.abs(push) >= REACHED * np.atleast_2d(gains["limit"])[:, None]
    parts = {"force": at[..., :3], "moment": at[..., 3:6], "bend moment": at[..., 6:]}
    return {name: each.any(-1) for name, each in parts.items()}


def _limits(given: dict[str, Any], weight: float, held: np.ndarray) -> dict[str, Any]:
    """Return checked limits by name; held: the moment that the spring needs at each bend [N m²]."""
    found: dict[str, Any] = {}
    for name, unit in (("force", "N"), ("moment", "N m")):
        value = given[name]
        found[name] = checks.row(name, _NO_LIMIT if value is None else value, 3)
        if not (found[name] > 0.0).all():
            raise InputError(
                name, f"is {shown(value)}", f"give the largest along each axis, above 0 [{unit}]"
            )
    if not found["force"][2] > weight:
        raise InputError(
            "force",
            f"is {shown(given['force'])}, which does not carry the weight of {weight:.3g} N",
            "give more along z",
        )
    most = given["bend_moment"]
    found["bend_moment"] = checks.positive(
        "bend_moment", _NO_LIMIT if most is None else most, " [N m²]"
    )
    if held.max(initial=0.0) > found["bend_moment"]:
        raise InputError(
            "bend_moment",
            f"is {shown(most)}, but to hold the bend takes {held.max():.3g} N m²",
            "give more, or less to bend",
        )
    return found


def _bend_rate(given: Any, sections: int) -> Any:
    """Return rates of 0 or more: one for all sections, or one each (sections,)."""
    found = checks.finite_array(given)
    if found is None or found.shape != (sections,):
        each = f", or {sections} of them" if sections > 1 else ""
        return checks.number("bend_rate", given, least=0.0, otherwise=each)
    if not (found >= 0.0).all():
        raise InputError("bend_rate", f"is {shown(given)}", "give rates of 0 or more [rad/s]")
    return found


def law(code: LawCode) -> SimpleNamespace:
    """Return the law on the device."""
    Gains = gains_of(_gains(code))
    return SimpleNamespace(Gains=Gains, control=_holding(code, Gains))


def limited_law(code: LawCode) -> SimpleNamespace:
    """Return the same law within limits of the wrench."""
    Gains = gains_of(_gains(code) | {"limit": code.Push})
    holding, Sense, numbers = _holding(code, Gains), code.Sense, 6 + code.bends

    @wp.func
    def control(sense: Sense, gains: Gains):
        asked = holding(sense, gains)
        for i in range(numbers):
            most = gains.limit[i]
            asked[i] = wp.max(-most, wp.min(most, asked[i]))
        return asked

    return SimpleNamespace(Gains=Gains, control=control)


def _gains(code: LawCode) -> dict[str, Any]:
    """Return the types of the law's gains."""
    return {
        "position": code.vec3,
        "attitude": code.quat,
        "bend": code.Bends,
        "mass": code.Real,
        "inertia": code.mat33,
        "bend_inertia": wp.types.matrix((room(code.bends), room(code.bends)), code.Real),
        "stiffness": code.Bends,
        "rate": code.Real,
        "attitude_rate": code.Real,
        "bend_rate": code.Bends,
    }


def _holding(code: LawCode, Gains: Any) -> Any:
    """Return the function (sense, gains) of the actuator wrench."""
    Real, Sense, push, above = code.Real, code.Sense, code.push, code.above
    vec3, bends = code.vec3, code.bends
    two, zero, one = Real(2.0), Real(0.0), Real(1.0)

    @wp.func
    def control(sense: Sense, gains: Gains):
        w = gains.rate
        f = gains.mass * w * (w * (gains.position - sense.position) - two * sense.velocity)
        turn = wp.quat_inverse(sense.attitude) * gains.attitude
        side = two * above(zero, turn[3], -one, one)
        w = gains.attitude_rate
        error = side * vec3(turn[0], turn[1], turn[2])
        m = gains.inertia * (w * (w * error - two * sense.angular_velocity))
        b = wp.cw_mul(gains.stiffness, gains.bend)
        x = wp.cw_mul(gains.bend_rate, gains.bend - sense.bend) - two * sense.bend_rate
        for i in range(bends):
            b[i] = b[i] + gains.bend_inertia[i, i] * gains.bend_rate[i] * x[i]
            for j in range(bends):
                if i != j:
                    b[i] = b[i] + gains.bend_inertia[i, j] * gains.bend_rate[j] * x[j]
        weight = sense.weight
        for i in range(bends):
            # A free section hangs by its own spring.
            weight[6 + i] = above(gains.bend_rate[i], zero, weight[6 + i], zero)
        return weight + push(f, m, b)

    return control
