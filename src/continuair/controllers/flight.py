"""A flight controller, a cascade from position to moment; kernels/laws/flight.py writes the law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from continuair import checks
from continuair.controllers.cascade_design import GRAVITY, Design
from continuair.controllers.cascade_gains import real_gains
from continuair.controllers.controller import REACHED, Controller
from continuair.controllers.hover import hover
from continuair.errors import InputError, nearest, shown
from continuair.kernels.laws.feeding import FEEDFORWARD
from continuair.kernels.laws.flight import LAWS
from continuair.vehicle.arc import bend_vectors
from continuair.vehicle.bending import check_bend
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_NOISE = ("position", "velocity", "attitude", "gyro")
_NO_LIMIT = 1e30
_FASTEST = 1e4
"""The largest rate [Hz]."""


def flight_controller(
    vehicle: Any,
    *,
    position_bandwidth: float | None = None,
    attitude_bandwidth: float | None = None,
    yaw_bandwidth: float | None = None,
    bend_bandwidth: Any = None,
    damping_ratio: float = 1.0,
    integral_share: float = 0.2,
    feedforward: str = "weight",
    rate: float = 250.0,
    latency: float = 0.0,
    rotor_lag: float | None = None,
    bend: Any = None,
    tilt: float = 0.7,
    thrust: Any = None,
    moment: Any = None,
    speed: float = 5.0,
    bend_moment: float | None = None,
    bend_speed: float | None = None,
    noise: Mapping[str, float] | None = None,
) -> Controller:
    """Fly to set-points (`Setpoints`) by thrust along the body's z axis, moment and bend servos.

    Bandwidths [rad/s]: of position, roll and pitch, yaw, and the bends' servos, one for all
    sections or one each, 0 for a section that hangs free. Those not given are 20 for the attitude,
    at most 0.5 / rotor_lag, and 5 for the bends, or as much less as the hovering vehicle needs to
    bear half as much delay again; an eighth of the attitude's for position, two fifths for yaw.
    integral_share: of the integral's pole in the position's, 0 for none. feedforward: of the arms,
    "none", "weight" or "reaction". rate: how often it acts [Hz]; latency: how long after it sensed
    its push acts [s]; rotor_lag: of first order, which its gains must bear [s], the rotors' by
    default; bend: vectors (2 per section) [1/m] at which the arms are held besides straight, or
    rows of them, which the gains must bear, too; noise: standard deviations per axis of "position"
    [m], "velocity" [m/s], "attitude" [rad] and "gyro" [rad/s].

    Without `bend` gains and latency_margin are of straight arms, free sections where they rest
    under their weight; held bent they may bear less. Latencies up to 0.25 s are looked at, or half
    as much again as that there is: a longer margin is told as that.

    Limits: tilt [rad], thrust (least, most) [N], by default 0.1 times the weight, or the rotors'
    least if that is more, and what the rotors have, or 2 times the weight; moment (3,) [N m], speed
    of approach [m/s], and of each component of a bend bend_moment [N m²] and bend_speed
    [1/(m s)]. Raises InputError, also for gains that the delays make unstable, at 9.81 m/s².
    """
    check_single_vehicle(vehicle)
    checks.choice("feedforward", feedforward, FEEDFORWARD)
    period = 1.0 / checks.positive("rate", rate, " [Hz]")
    if rate > _FASTEST:
        raise InputError(
            f"rate is {shown(rate)}; give at most {_FASTEST:g} [Hz], beyond which its margin takes "
            "minutes to find."
        )
    late = checks.number("latency", latency, least=0.0, otherwise=" [s]")
    lag = _lag(vehicle, rotor_lag)
    ratio = checks.positive("damping_ratio", damping_ratio)
    share = checks.number("integral_share", integral_share, least=0.0)
    bends = np.empty((0, vehicle.layout.bends)) if bend is None else _bends(vehicle, bend)
    if not real_gains(ratio, share):
        raise InputError(
            f"integral_share is {shown(integral_share)}, with which damping_ratio {ratio:g} has no "
            "real gains; give a smaller share, such as 0.2."
        )
    given = {
        "position": _bandwidth("position_bandwidth", position_bandwidth),
        "attitude": _bandwidth("attitude_bandwidth", attitude_bandwidth),
        "yaw": _bandwidth("yaw_bandwidth", yaw_bandwidth),
        "bend": _bend_bandwidth(bend_bandwidth, vehicle.sections),
    }
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
    )


def _known(vehicle: Vehicle) -> dict[str, np.ndarray]:
    """Mass [kg] and inertia (3, 3) [kg m²] that are among the gains for a vehicle."""
    found = hover(vehicle, GRAVITY)
    return {"mass": np.array(found.mass), "inertia": found.inertia}


def _bandwidths(gains: Mapping[str, Any]) -> np.ndarray:
    """The slowest of position, and of roll and pitch (..., 2) [rad/s], but for their integrals."""
    position = np.sqrt(np.asarray(gains["position"]) * np.asarray(gains["velocity"]))
    attitude = np.sqrt(np.asarray(gains["attitude"])[..., :2])
    return np.stack([position.min(axis=-1), attitude.min(axis=-1)], axis=-1)


def _at_limits(gains: Mapping[str, Any], push: np.ndarray) -> dict[str, np.ndarray]:
    """Which parts of pushes (runs, samples, numbers) are at limits; a free section has none."""
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
    """Limits by name, checked; None is none."""
    weight = vehicle.mass * GRAVITY
    able = _thrust_of(vehicle, weight) if thrust is None else thrust
    least_most = checks.vector("thrust", able, 2)
    if not 0.0 < least_most[0] < weight < least_most[1]:
        raise InputError(
            f"thrust is {shown(least_most.tolist())}; give the least and the most [N], above 0, "
            f"with the weight of {weight:.3g} N in between."
        )
    if not 0.0 < checks.positive("tilt", tilt, " [rad]") <= 1.4:
        raise InputError(f"tilt is {shown(tilt)}; give an angle of at most 1.4 [rad].")
    most = checks.row("moment", _NO_LIMIT if moment is None else moment, 3)
    if not (most > 0.0).all():
        raise InputError(f"moment is {shown(moment)}; give three largest moments above 0 [N m].")
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
    """The least and the most thrust [N]: what the rotors have along z, or of the weight."""
    least, rotors = 0.1 * weight, vehicle.uav.rotors
    if rotors is None:
        return least, 2.0 * weight
    lowest, highest = (limit * float(rotors.allocation[2].sum()) for limit in rotors.thrust_limits)
    return max(least, lowest), highest


def _lag(vehicle: Vehicle, given: Any) -> float:
    """The rotors' lag [s]: as given, or the vehicle's if it has rotors."""
    if given is None:
        rotors = vehicle.uav.rotors
        return 0.0 if rotors is None else float(rotors.lag)
    return checks.number("rotor_lag", given, least=0.0, otherwise=" [s]")


def _bandwidth(name: str, value: Any) -> float | None:
    return None if value is None else checks.positive(name, value, " [rad/s]")


def _bend_bandwidth(value: Any, sections: int) -> np.ndarray | None:
    """One bandwidth of 0 or more for each section (sections,)."""
    if value is None:
        return None
    found = checks.row("bend_bandwidth", value, sections)
    if not (found >= 0.0).all():
        raise InputError(f"bend_bandwidth is {shown(value)}; give 0 or more [rad/s].")
    return found


def _bends(vehicle: Vehicle, value: Any) -> np.ndarray:
    """Rows (postures, 2 per section) of bends that the arms can have [1/m]."""
    found = checks.rows("bend", value, vehicle.layout.bends)
    for each in found:
        check_bend("bend", value, np.hypot(*bend_vectors(each).T), vehicle)
    return found


def _noise(given: Any) -> dict[str, float]:
    """Standard deviations of all that is sensed, in order."""
    given = {} if given is None else given
    if not isinstance(given, Mapping):
        raise InputError(f"noise is {shown(given)}; give numbers by name: {', '.join(_NOISE)}.")
    for name in given:
        if name not in _NOISE:
            raise InputError(f"noise holds {shown(name)}; {nearest(str(name), _NOISE)}.")
    return {
        name: checks.number(f"noise.{name}", given.get(name, 0.0), least=0.0) for name in _NOISE
    }
