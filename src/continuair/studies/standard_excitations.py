"""Standard excitations: the same six flights for every vehicle, scaled by its own size and time.

Loads are dimensionless, so that one number means the same for every vehicle. Frequencies are over
the arm's clamped one, ω_c. Loads are over the vehicle's weight, or given by the angle that they
would cause without gravity, under which a hanging arm bends less.

Every flight starts at rest with the arm bent by an angle, 45 degrees off the plane of the load, and
lasts a number of clamped periods. Oscillating loads act about a hover in which all inputs hold the
bent arm and compensate the weight, so that only the load causes motion, in any model. When the arm
is released, a constant force compensates the weight, and nothing holds the arm. In a fall nothing
acts at all.

In a loop (`standard_loops`) a flight controller holds the hover. Of the other inputs only the bend
moment remains, for the arm. A fall has no loop, as motors are off. With several arms, the one that
carries the camera is excited, and the others start straight. Its sections bend alike, and a moment
on them is shared so that they do. Lateral is along x of that arm's mount, and a moment on the UAV
is about its y.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from continuair import checks
from continuair.analysis.excited import ExcitedArm, excited_arm
from continuair.analysis.trim import held_hover
from continuair.controllers.controller import Controller
from continuair.controllers.inertias import rigid_inertia
from continuair.flight.rotors import still
from continuair.scenario.excitations import Shared, Swelling, Wave, plus
from continuair.scenario.scenarios import Scenario
from continuair.studies.standard_loops import hover_loop
from continuair.typing import Array
from continuair.vehicle.bending import constant_bends, evenly_bent
from continuair.vehicle.layout import OF_NAME
from continuair.vehicle.section import Section
from continuair.vehicle.vehicle import Vehicle

PERIODS = 10.0
"""Duration of a standard flight [clamped periods]."""

SAMPLES_PER_PERIOD = 40
"""Samples that are compared, per clamped period."""

BEND_DIRECTION = np.pi / 4
"""Direction of the bend at the start, from the plane of the load [rad]."""


@dataclass(frozen=True)
class Excitation:
    """One of the standard excitations.

    meaning: the load in words; load: definition of its load ratio, and its value in a moderate
    flight; amplitude: of the input, from a vehicle, the load ratio and the frequency ratio; on:
    input and component.
    """

    meaning: str
    load: str
    moderate: float
    on: tuple[str, int] | None = None
    amplitude: Callable[[Vehicle, ExcitedArm, Any, Any, float], Any] | None = None


def _weights(vehicle: Vehicle, _arm: ExcitedArm, load: Any, _frequency: Any, gravity: float) -> Any:
    return load * np.asarray(vehicle.mass) * gravity


def _rocking(vehicle: Vehicle, arm: ExcitedArm, load: Any, frequency: Any, _gravity: float) -> Any:
    rate = np.asarray(frequency) * arm.frequency
    return load * _rocking_inertia(vehicle, arm) * rate**2


def _bending(
    _vehicle: Vehicle, arm: ExcitedArm, load: Any, _frequency: Any, _gravity: float
) -> Any:
    return load * arm.moments[..., 0]


def _tip_bending(
    _vehicle: Vehicle, arm: ExcitedArm, load: Any, _frequency: Any, _gravity: float
) -> Any:
    # A lateral tip force F does the work of Q = F l² / 2 on the straight arm's bend.
    return load * 2.0 * arm.stiffness / np.asarray(arm.length) ** 2


EXCITATIONS = {
    "force": Excitation(
        "a lateral force on the UAV, as from tilting, oscillates",
        "force over the vehicle's weight",
        0.2,
        ("force", 0),
        _weights,
    ),
    "moment": Excitation(
        "a moment on the UAV oscillates",
        "angle by which it would rock the rigid vehicle about B's origin [rad]",
        0.1,
        ("moment", 1),
        _rocking,
    ),
    "bend": Excitation(
        "the arm's actuation oscillates",
        "angle by which it would bend the arm at rest without gravity [rad]",
        0.2,
        ("bend_moment", 0),
        _bending,
    ),
    "tip": Excitation(
        "a lateral force at the tip, as in contact, oscillates",
        "angle by which it would bend the arm at rest without gravity [rad]",
        0.2,
        ("tip_wrench", 0),
        _tip_bending,
    ),
    "release": Excitation("the bent arm is let go in hover", "none", 0.0),
    "fall": Excitation("the vehicle with its bent arm falls freely", "none", 0.0),
}
"""The standard excitations by name."""


def standard_scenario(
    name: str,
    vehicle: Vehicle,
    load: Any = None,
    frequency: Any = 0.5,
    bend: Any = 0.2,
    *,
    periods: float = PERIODS,
    gravity: float = 9.81,
    loop: str | Controller = "none",
    bandwidth: float | None = None,
    swell: float = 0.0,
) -> Scenario:
    """Return one standard excitation of a vehicle, single or batched, as a scenario to simulate.

    name: one of EXCITATIONS; load: its load ratio, by default the moderate one; frequency: over the
    arm's clamped frequency; bend: the angle of the arm's end at the start, κ₀ l [rad]. All three
    are numbers, or arrays over the vehicle's runs. The duration is that many clamped periods, the
    longest of a batch's: give `duration` to `simulate` or `run_pairs` where they differ. loop: one
    of LOOPS, for a single vehicle; bandwidth: of its attitude [rad/s], or the controller of the
    hover; swell: share of the duration over which an oscillating load grows. Raises InputError.
    """
    excitation = EXCITATIONS[checks.choice("excitation", name, EXCITATIONS)]
    controller = loop if isinstance(loop, Controller) else hover_loop(vehicle, loop, bandwidth)
    arm = excited_arm(vehicle)
    load = excitation.moderate if load is None else load
    clamped = np.asarray(arm.frequency)
    duration = float(periods * 2.0 * np.pi / np.min(clamped))
    q = evenly_bent(vehicle, arm.places, np.asarray(bend) / arm.length, BEND_DIRECTION)
    inputs: dict[str, Any] = still(vehicle)
    if excitation.on is not None and excitation.amplitude is not None:
        amplitude = np.asarray(excitation.amplitude(vehicle, arm, load, frequency, gravity))
        hertz = np.asarray(frequency) * clamped / (2.0 * np.pi)
        inputs, channel = held_hover(vehicle, q, gravity), excitation.on[0]
        if controller is not None:
            inputs = {"bend_moment": inputs["bend_moment"]}
        wave: Any = _wave(excitation.on, arm, vehicle, amplitude, hertz, duration)
        wave = Swelling(wave, swell * duration) if swell else wave
        inputs[channel] = plus(wave, inputs.get(channel))
    elif name == "fall":
        controller = None
    elif controller is not None:
        inputs = {}
    else:
        inputs["force"] = np.multiply.outer(np.asarray(vehicle.mass) * gravity, [0.0, 0.0, 1.0])
    return Scenario(name, q, duration=duration, gravity=gravity, controller=controller, **inputs)


def _wave(
    on: tuple[str, int],
    arm: ExcitedArm,
    vehicle: Vehicle,
    amplitude: Array,
    hertz: Array,
    last: float,
) -> Wave | Shared:
    """Return a sine on an input's component of the vehicle, or of an arm and its sections.

    Forces and moments are along the axes of the arm's mount.
    """
    channel, component = OF_NAME[on[0]], on[1]
    width = channel.width(vehicle.layout)
    if channel.per == "section":
        component = int(constant_bends(vehicle)[arm.places.start, component])
    else:
        component += {"vehicle": 0, "arm": arm.index}[channel.per] * len(channel.axes)
    wave = Wave(width, component, amplitude, hertz, hertz, 0.0, last)
    if channel.per == "section":
        return _shared(wave, arm, vehicle) if len(arm.places) > 1 else wave
    return wave if _is_level(arm) else _turned(wave, arm, on[1])


def _is_level(arm: ExcitedArm) -> bool:
    """Return whether an arm's mount has the axes of the body."""
    return bool((arm.axes == np.eye(3)).all())


def _turned(wave: Wave, arm: ExcitedArm, axis: int) -> Shared:
    """A wave on a vector's first component, or another, along that axis of the arm's mount."""
    shares = np.zeros((*arm.axes.shape[:-2], wave.width))
    first = wave.component - axis
    shares[..., first : first + 3] = arm.axes[..., axis]
    return _spread(wave, shares)


def _shared(wave: Wave, arm: ExcitedArm, vehicle: Vehicle) -> Shared:
    """Return a wave on the first section of an arm, shared so that its further ones bend alike."""
    shares = np.zeros((*arm.moments.shape[:-1], wave.width))
    for place, section in enumerate(arm.places):
        along_x = constant_bends(vehicle)[section, 0]
        shares[..., along_x] = arm.moments[..., place] / arm.moments[..., 0]
    return _spread(wave, shares)


def _spread(wave: Wave, shares: Array) -> Shared:
    """Return a wave on several components of an input, by their shares (..., width)."""
    return Shared(replace(wave, width=1, component=0), shares)


def sample_time(vehicle: Vehicle) -> float:
    """Return the time between the samples of a standard flight [s], the shortest of a batch's."""
    return float(2.0 * np.pi / np.max(excited_arm(vehicle).frequency) / SAMPLES_PER_PERIOD)


def _moments(arm: Section) -> tuple[Array, Array]:
    """Return the means of s and s² over the mass of the backbone [m, m²]."""
    length = np.asarray(arm.length)
    if not arm.tapered:
        return length / 2.0, length**2 / 3.0
    nodes, weights = np.polynomial.legendre.leggauss(4)
    places = (1.0 + nodes) / 2.0
    masses = arm.mass_shares(places)[0] * weights / 2.0
    return length * (masses @ places), length**2 * (masses @ places**2)


def _rocking_inertia(vehicle: Vehicle, excited: ExcitedArm) -> Array:
    """Inertia of the vehicle with its arms straight about B's origin, y of the mount [kg m²]."""
    if vehicle.has_arm_list:
        each = [vehicle] if vehicle.runs is None else map(vehicle.select, range(vehicle.runs))
        inertia = np.squeeze([rigid_inertia(one)[3:6, 3:6] for one in each])
        y = excited.axes[..., 1]
        return np.asarray((y * (inertia @ y[..., None])[..., 0]).sum(-1))
    arm = vehicle.arm
    x, _, z = np.transpose(vehicle.uav.mount)
    own = np.asarray(vehicle.uav.inertia)[..., 1, 1]
    first, second = _moments(arm)
    backbone = arm.backbone_mass * (x**2 + z**2 - 2.0 * z * first + second)
    backbone = backbone + arm.transverse_inertia_per_length * arm.length
    total: Array = own + backbone
    for disk in arm.disks:
        total = total + disk.transverse_inertia + disk.mass * (x**2 + (z - disk.position) ** 2)
    return total
