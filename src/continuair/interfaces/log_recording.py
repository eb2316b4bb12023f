"""The recording that `identify` takes, of a log's signals by their roles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.errors import InputError, shown
from continuair.flight.rotors import lag_rate
from continuair.identification.recording import FEWEST_ROWS, SENSORS, Recording
from continuair.interfaces.log_motors import thrust_curve, with_rotors
from continuair.interfaces.log_signals import Signal, aligned, check_unit
from continuair.vehicle.layout import ONE_SECTION
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

Array = np.ndarray

HELD = ("thrust", "torque", "bend_moment", "rotors")
"""Roles of signals that are held from a sample to the next."""

_CHORD_TOLERANCE = 0.1
"""Tolerance of the tip's distance from the arm's base to that of an arc, over the length."""

_MOST_HALF = 0.85 * np.pi
"""Half the turn of an arm at most [rad]: beyond it, its end is too near its base."""


@dataclass(frozen=True)
class Choices:
    """Checked choices of a log: rate [Hz] or None, window [s] or None, place of the IMU [m], and
    thrust curve (n, 2) or None."""

    rate: float | None
    window: tuple[float, float] | None
    imu_position: Array
    thrust_curve: Array | None = None


def choices(rate: Any, window: Any, imu_position: Any, curve: Any = None) -> Choices:
    """Check a rate [Hz], a window (from, to) [s] since the log's start, a place of the IMU, and a
    thrust curve, as `thrust_curve` takes it.

    Raises InputError.
    """
    if rate is not None:
        rate = checks.positive("rate", rate, " [Hz]")
    if window is not None:
        first, last = checks.vector("window", window, 2).tolist()
        if not first < last:
            raise InputError("window", f"is {shown(window)}", "give two times [s] that ascend")
        window = first, last
    place = checks.vector("imu_position", imu_position, 3)
    return Choices(rate, window, place, thrust_curve(curve))


def check_roles(vehicle: Vehicle, roles: Any) -> None:
    """Raise InputError unless a vehicle's flight follows from signals of these roles."""
    check_single_vehicle(vehicle, strain=True)
    arm = "bend" in roles, "tip" in roles or "camera" in roles
    if any(arm) and not vehicle.arms:
        raise InputError(
            "topics",
            f"names one for the arm's bend, but vehicle {shown(vehicle.name)} has no arm",
            "leave it out",
        )
    if vehicle.arms and sum(arm) != 1:
        raise InputError(
            "topics",
            f"names {'both bend and a pose of the tip' if all(arm) else 'nothing'} to measure the "
            "arm's bend",
            "name one topic for bend, tip or camera",
        )
    if arm[1] and vehicle.layout.widths != ONE_SECTION.widths:
        raise InputError(
            "topics",
            "names the pose of a tip, which does not determine the "
            f"{vehicle.layout.bends} coordinates of the vehicle's sections",
            "name a topic for bend",
        )
    if ("thrust" in roles) != ("torque" in roles):
        given, missing = ("thrust", "torque") if "thrust" in roles else ("torque", "thrust")
        raise InputError(given, f"is named without {missing}", "name both")
    named = [role for role in ("rotors", "motors", "thrust") if role in roles]
    if len(named) > 1:
        raise InputError(
            named[0], f"and {named[1]} are both named, and would act twice", "name one of the two"
        )
    if named in (["rotors"], ["motors"]) and vehicle.uav.rotors is None:
        raise InputError(
            named[0],
            "is named, but the vehicle has no [uav.rotors]",
            "give it some, or name thrust and torque",
        )


def recording(
    name: str, vehicle: Vehicle, signals: Mapping[str, Signal], chosen: Choices
) -> Recording:
    """Return signals by role on one uniform grid; raises InputError.

    Measured, interpolated by a spline: position (n, 3) of the UAV and tip (n, 3), world axes, z up
    [m]; attitude (n, 4), body to world, x y z w; bend (n, bends) [1/m], axes of each section's
    base; velocity (n, 3), world axes [m/s]; gyro (n, 3) [rad/s] and accelerometer (n, 3) [m/s²],
    body axes.

    Held, averaged over intervals: thrust (n, 3) [N] and torque (n, 3) [N m] on the UAV in body
    axes, z up; bend_moment (n, bends) [N m²]; rotors (n, rotors), commanded thrusts [N], or motors
    (n, rotors), the signals of which a thrust curve makes thrusts. For rotors
    with a lag the mean is that of the speed, as the lag acts on it.
    """
    signals = with_rotors(vehicle, signals, chosen.thrust_curve)
    _check_widths(vehicle, signals)
    times, signals = aligned(signals, HELD, chosen.rate, chosen.window)
    if len(times) < FEWEST_ROWS:
        raise InputError(
            "data",
            f"makes {len(times)} rows",
            f"give {FEWEST_ROWS} or more, by a longer window or a higher rate",
        )
    check_unit(signals["attitude"])
    position, attitude = signals["position"].at(times), signals["attitude"].turned_at(times)
    rotors = _commanded(vehicle, signals, times)
    pushes = [role for role in HELD if role in signals and role != "rotors"]
    found = {role: signals[role].mean_from(times) for role in pushes}
    return Recording(
        name=name,
        time=times - times[0],
        position=position,
        attitude=attitude,
        bend=_bends(vehicle, signals, times, position, attitude),
        inputs=_inputs(vehicle, signals["attitude"], times, found)
        if found or rotors is not None
        else None,
        rotor_command=rotors,
        sampling=_sampling(name, times, signals.values()),
        imu_position=chosen.imu_position,
        **{sensor: signals[sensor].at(times) for sensor in SENSORS if sensor in signals},
    )


def _commanded(vehicle: Vehicle, signals: Mapping[str, Signal], times: Array) -> Array | None:
    """Return commanded thrusts (n, rotors) [N], of rotors with a lag those of the mean speed."""
    if "rotors" not in signals:
        return None
    rotors = vehicle.uav.rotors
    if rotors is None or not lag_rate(vehicle).any():
        return signals["rotors"].mean_from(times)
    return rotors.thrusts_of(signals["rotors"].mapped(rotors.speeds_of).mean_from(times))


def _check_widths(vehicle: Vehicle, signals: Mapping[str, Signal]) -> None:
    bends = vehicle.layout.bends
    rotors = vehicle.uav.rotors.count if vehicle.uav.rotors else 0
    for role, width in (("bend", bends), ("bend_moment", bends), ("rotors", rotors)):
        if role in signals and signals[role].values.shape[1] != width:
            raise InputError(
                str(signals[role].topic),
                f"holds {signals[role].values.shape[1]} numbers, but the vehicle has {width}",
                f"name {width} of its fields",
            )


def _inputs(vehicle: Vehicle, attitude: Signal, times: Array, found: Mapping[str, Array]) -> Array:
    """Force in world axes, moment in body axes and bend moments (n, 6 + bends), 0 where unknown.

    The force turns with the body: it is that of the middle of each interval.
    """
    layout = vehicle.layout
    rows = np.zeros((len(times), layout.push.stop))
    if "thrust" in found:
        middle = np.append(0.5 * (times[1:] + times[:-1]), times[-1])
        turn = Rotation.from_quat(attitude.turned_at(middle))
        rows[:, layout.force] = turn.apply(found["thrust"])
        rows[:, layout.moment] = found["torque"]
    if "bend_moment" in found:
        rows[:, layout.bend_moment] = found["bend_moment"]
    return rows


def _bends(
    vehicle: Vehicle,
    signals: Mapping[str, Signal],
    times: Array,
    position: Array,
    attitude: Array,
) -> Array:
    if not vehicle.arms:
        return np.zeros((len(times), 0))
    if "bend" in signals:
        return signals["bend"].at(times)
    arm = vehicle.arms[0]
    body = Rotation.from_quat(attitude).inv().apply(signals["tip"].at(times) - position)
    chord = Rotation.from_quat(arm.attitude).inv().apply(body - np.array(arm.mount))
    return bends_of_tips(str(signals["tip"].topic), chord, float(arm.section[0].length))


def bends_of_tips(name: str, chord: Array, length: float) -> Array:
    """Bend vectors (n, 2) [1/m] of one section, of its ends (n, 3) [m] in the axes of its base.

    An arc that turns by φ = κ l ends at an angle of φ / 2 from its start, 2 sin(φ / 2) / κ away,
    Eq. (2), Amiri et al. Raises InputError where the arm cannot end so far away, or so near.
    """
    out, far = np.hypot(*chord[:, :2].T), np.linalg.norm(chord, axis=1)
    half = np.arctan2(out, -chord[:, 2])
    expected = length * np.sinc(np.minimum(half, _MOST_HALF) / np.pi)
    off = float(np.sqrt(np.mean((far - expected) ** 2)))
    if off > _CHORD_TOLERANCE * length:
        raise InputError(
            name,
            (
                f"is {far.mean():.3g} m from the base, but an arc of {length:g} m there "
                f"ends at {expected.mean():.3g} m"
            ),
            "check the poses' axes, the arm's length and mount",
        )
    turn = np.divide(2.0 * half / length, out, out=np.zeros_like(out), where=out > 0.0)
    return np.asarray(turn[:, None] * chord[:, :2])


def _sampling(name: str, times: Array, signals: Iterable[Signal]) -> str:
    usual = {each.topic.role: 1.0 / each.period for each in signals}
    rates = ", ".join(f"{role} {rate:.3g} Hz" for role, rate in usual.items())
    return (
        f"{name}: {times[0]:.6g} to {times[-1]:.6g} s in {len(times)} rows every "
        f"{times[1] - times[0]:.3g} s, resampled from {rates}."
    )
