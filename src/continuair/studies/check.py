"""Properties that follow from a vehicle's parameters, as lines of names and values."""

from __future__ import annotations

from math import pi

import numpy as np

from continuair.analysis.backbone import angle_of, parts, sections_of
from continuair.analysis.beam import curvature_error
from continuair.analysis.excited import excited_arm, name_of_excited_arm
from continuair.analysis.groups import GRAVITY, place
from continuair.analysis.modes import Base, modes
from continuair.analysis.trim import Trim, trim
from continuair.engine.engine import Engine
from continuair.errors import InputError
from continuair.flight.rotors import hovering_thrusts
from continuair.flight.steps import automatic_step
from continuair.typing import Array
from continuair.vehicle.bending import evenly_bent
from continuair.vehicle.coordinates import bends_of
from continuair.vehicle.rotors import Rotors
from continuair.vehicle.tendon import section_of
from continuair.vehicle.uncertain import UncertainVehicle, band
from continuair.vehicle.vehicle import Vehicle

Lines = list[tuple[str, ...]]

MODES = ("modes", "rad/s", "lowest Hz", "damping")
"""Columns of `modes_of`."""

BANDS = ("of the uncertain vehicle", "median", "90 % of the draws")
"""Columns of `bands_of`."""

_DRAWS = 64

PHASE = 0.2
"""Of the fastest mode in a fixed step of RK4 that follows it [rad]."""

BENT = 1.0
"""Angle by which the arm with the camera is bent to compute the rotors' margin [rad]."""

_SIDES = 72
"""Directions of that bend: the worst one is met to 1e-3 of the bend's effect."""

_ALIKE = 1e-3
"""Frequencies that differ by less than this share are shown once."""


def at_rest(vehicle: Vehicle) -> Trim | None:
    """Return the equilibrium hover of the arms; None if there is none below a full circle."""
    try:
        return trim(vehicle)
    except InputError:
        return None


def facts(vehicle: Vehicle, rest: Trim | None) -> Lines:
    """Return masses, couplings, sections, sag, rates and the error of constant curvature, by name.

    rest: of `at_rest`.
    """
    if not vehicle.arms:
        return [("mass", f"{vehicle.mass:.4g} kg"), *_of_hover(vehicle)]
    mass, groups = sum(arm.mass for arm in vehicle.arms), place(vehicle)
    which = f", {name_of_excited_arm(vehicle)}" if len(vehicle.arms) > 1 else ""
    return [
        ("arm mass", f"{mass:.4g} kg"),
        ("arm mass / UAV mass", f"{mass / vehicle.uav.mass:.4g}"),
        ("coupling, 0 to 1", f"{groups['coupling']:.3g}"),
        (f"gravity number g / l ω²{which}", f"{groups['gravity_number']:.3g}"),
        *_of_sections(vehicle),
        *_of_tendons(vehicle),
        *_angles(vehicle, rest),
        *_of_rotors(vehicle),
        *_of_rates(vehicle),
        *(_beside_a_beam(vehicle) if vehicle.is_one_arc else []),
    ]


def modes_of(vehicle: Vehicle, rest: Trim | None) -> Lines:
    """Return modes of straight arms without gravity, and about `at_rest` with it, as in MODES."""
    if not vehicle.arms:
        return []
    straight = np.zeros(vehicle.layout.coordinates)
    lines: Lines = [
        ("clamped, g = 0", *_told(vehicle, straight, "clamped", 0.0)),
        ("free fall", *_told(vehicle, straight, "free", 0.0)),
    ]
    if rest is not None:
        for base in ("clamped", "hovering"):
            lines.append((base, *_told(vehicle, rest.q, base, 9.81)))
    return lines


def bands_of(uncertain: UncertainVehicle) -> Lines:
    """Return mass, lowest clamped frequency and damping of the median and of 90 % of the draws."""

    def of(vehicle: Vehicle) -> dict[str, Array]:
        found = {"mass [kg]": np.asarray(vehicle.mass)}
        if vehicle.arms:
            clamped = modes(vehicle, base="clamped", gravity=0.0)
            found["lowest clamped frequency [Hz]"] = clamped.frequencies[..., 0] / (2.0 * pi)
            found["its damping ratio"] = clamped.damping[..., 0]
        return found

    medians, drawn = of(uncertain.vehicle), of(uncertain.draws(_DRAWS))
    return [
        (name, f"{value:.4g}", "{:.4g} to {:.4g}".format(*band(np.resize(drawn[name], _DRAWS))))
        for name, value in medians.items()
    ]


def _of_sections(vehicle: Vehicle) -> Lines:
    if not vehicle.has_arm_list:
        return [("bending stiffness EI", f"{vehicle.arm.bending_stiffness:.4g} N m²")]
    return [
        (
            f"section {arm.name}.{section.name}",
            f"{section.length:.4g} m, {section.mass:.4g} kg, "
            f"EI {section.bending_stiffness:.4g} N m²",
        )
        for arm in vehicle.arms
        for section in arm.section
    ]


def _of_tendons(vehicle: Vehicle) -> Lines:
    """Return, of each group, its tendons and the curvature that one of them causes per newton."""
    found: Lines = []
    for arm in vehicle.arms:
        for group in arm.tendon:
            last = section_of(group, [section.name for section in arm.section])
            section = arm.section[last]
            near, far = (1e3 * each for each in group.offset)
            bent = group.offset[1] / section.bending_stiffness
            found.append((
                f"tendons {arm.name}.{group.name}",
                f"{group.count} at {near:.3g}{f' to {far:.3g}' * (near != far)} mm, "
                f"{f'turning by {group.turn:.3g} rad, ' * bool(group.turn)}to section "
                f"{section.name}, "
                f"{bent:.3g} rad/m per N there",
            ))  # fmt: skip
    return found


def _angles(vehicle: Vehicle, rest: Trim | None) -> Lines:
    if rest is None:
        return [("angles at rest", "none: no balance below a full circle")]
    bends = bends_of(rest.q, vehicle.layout)
    own = [each for arm, bend in parts(vehicle, bends) for each in sections_of(arm, bend)]
    angles = [float(angle_of(section, bend)) for section, bend in own]
    return [("angles at rest", ", ".join(f"{angle:.3g}" for angle in angles) + " rad")]


def _of_hover(vehicle: Vehicle) -> Lines:
    """Return the thrust margin of the busiest rotor of a vehicle without arms in hover."""
    rotors = vehicle.uav.rotors
    if rotors is None:
        return []
    level = np.zeros((1, vehicle.layout.coordinates))
    thrusts = hovering_thrusts(Engine(vehicle, "decoupled"), level, GRAVITY)
    return [("rotors' margin", _left(*thrusts, rotors))]


def _of_rotors(vehicle: Vehicle) -> Lines:
    """Return the thrust margin of the busiest rotor in hover, arm straight or bent to any side.

    Rotor wash is included.
    """
    rotors, arm = vehicle.uav.rotors, excited_arm(vehicle)
    if rotors is None:
        return []
    sides = 2.0 * pi / _SIDES * np.arange(_SIDES)
    bent = evenly_bent(vehicle, arm.places, float(BENT / arm.length), sides)
    q = np.vstack([np.zeros((1, vehicle.layout.coordinates)), bent])
    thrusts, aside = hovering_thrusts(Engine(vehicle, "decoupled"), q, GRAVITY)
    by = f"{name_of_excited_arm(vehicle)} bent by {BENT:g} rad"
    return [
        ("rotors' margin, arm straight", _left(thrusts[:1], aside[:1], rotors)),
        (f"rotors' margin, {by}", _left(thrusts[1:], aside[1:], rotors)),
    ]


def _left(thrusts: np.ndarray, aside: np.ndarray, rotors: Rotors) -> str:
    """Return the margin of the largest thrusts (ways, rotors), or why hover is not possible.

    aside (ways,): horizontal force of the rotors on the level vehicle [N].
    """
    if aside.max() > 0.0:
        return f"none: rotors that lean push a level vehicle sideways by {aside.max():.3g} N"
    lowest, highest = rotors.limits.T
    below, above = lowest - thrusts, thrusts - highest
    if (below <= 0.0).all() and (above <= 0.0).all():
        return f"{1.0 - (thrusts / highest).max():.0%}"
    most = below if (below > 0.0).any() else above
    way, rotor = np.unravel_index(np.argmax(most), most.shape)
    return (
        f"none: a rotor would have to give {thrusts[way, rotor]:.3g} N of "
        f"{lowest[rotor]:g} to {highest[rotor]:g}"
    )


def _told(vehicle: Vehicle, q: np.ndarray, base: Base, gravity: float) -> tuple[str, str, str]:
    """Return distinct frequencies [rad/s] in order; the lowest [Hz], and its damping ratio."""
    try:
        found = modes(vehicle, q, base=base, gravity=gravity)
    except InputError:
        return ("none: not stable", "", "")
    each = found.frequencies
    different = each[np.append(True, np.diff(each) > _ALIKE * each[1:])]
    rates = ", ".join(f"{rate:.4g}" for rate in different)
    return rates, f"{each[0] / (2.0 * pi):.4g}", f"{found.damping[0]:.2g}"


def _of_rates(vehicle: Vehicle) -> Lines:
    straight = np.zeros(vehicle.layout.coordinates)
    step = float(automatic_step(Engine(vehicle, "coupled"), straight).min())
    fastest = PHASE / step
    return [
        ("fastest rate, with damping", f"{fastest:.4g} 1/s"),
        (f"fixed step of RK4, {PHASE:g} over it", f"{1e3 * step:.3g} ms"),
    ]


def _beside_a_beam(vehicle: Vehicle) -> Lines:
    return [
        (
            f"linear beam: {name}",
            f"{entry['reference']:.4g} {entry['units']} ({entry['error']:+.1%})",
        )
        for name, entry in curvature_error(vehicle).items()
        if entry["error"] and "decoupled" not in name
    ]
