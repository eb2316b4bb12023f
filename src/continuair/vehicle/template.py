"""Template of a vehicle file: TOML with the unit and meaning of every field."""

from __future__ import annotations

import json
import math
import re
import tomllib
from dataclasses import dataclass
from string import Template
from typing import get_args

from continuair import checks
from continuair.vehicle.allocation import LayoutName, layout_geometry
from continuair.vehicle.members import MOST_ARMS
from continuair.vehicle.vehicle import Vehicle

LAYOUTS: tuple[str, ...] = get_args(LayoutName)
"""Names of the layouts of rotors."""

# Of superelastic nitinol [kg/m³, Pa].
_DENSITY, _MODULUS = 6450.0, 60e9
_THRUST_TO_WEIGHT = 2.0
_TILT = 0.35
_COMMENT_COLUMN = 34


@dataclass(frozen=True)
class Outline:
    """Main parameters of a new vehicle, from which the other fields of its file are estimated.

    Parameters
    ----------
    name : str
        Name of the vehicle.
    mass : float, default 1.8
        Mass of the UAV without arm [kg].
    layout : str, default "quad_x"
        Name of a rotor layout.
    lever : float, default 0.2
        Distance of each rotor from the UAV's z axis [m].
    length : float, default 0.5
        Length of the arm [m], divided into equal sections.
    sections : int, default 1
        Number of sections.
    load : float, default 0.08
        Mass on the tip [kg].
    radius : float, optional
        Radius of the backbone [m]. By default the relative sag under a given load is the same for
        arms of all lengths.

    Raises
    ------
    InputError
        If no valid vehicle has these parameters.
    """

    name: str
    mass: float = 1.8
    layout: str = "quad_x"
    lever: float = 0.2
    length: float = 0.5
    sections: int = 1
    load: float = 0.08
    radius: float | None = None

    def __post_init__(self) -> None:
        for field, unit in (("mass", "kg"), ("lever", "m"), ("length", "m")):
            checks.positive(field, getattr(self, field), f" [{unit}]")
        checks.choice("layout", self.layout, LAYOUTS)
        checks.whole("sections", self.sections, 1, MOST_ARMS)
        checks.number("load", self.load, least=0.0, otherwise=" [kg]")
        checks.positive("radius", self.backbone_radius, " [m]")
        Vehicle(**tomllib.loads(as_template(self)))

    @property
    def backbone_radius(self) -> float:
        """Return the given radius, or the one estimated from the length [m]."""
        # A cantilever's sag over its length goes with the load and l² / r⁴.
        return _rounded(2e-3 * math.sqrt(self.length)) if self.radius is None else self.radius


def as_template(outline: Outline) -> str:
    """Return the TOML text of a vehicle, with the unit and meaning of every field."""
    if outline.sections == 1:
        arm = [_ARM + _SECTION, _TIP_DISK, _TENDONS]
    else:
        following = [_NEXT] * (outline.sections - 1)
        arm = [_ARMS, _FIRST + _SECTION, _DISKS, *following, _TIP_BODY, _TENDONS]
    text = Template("\n".join([_UAV, *arm, _CAMERA])).substitute(_values(outline))
    return "".join(f"{_aligned(line)}\n" for line in text.splitlines())


def renamed(text: str, name: str) -> str:
    """Return the TOML text of a vehicle with another name; comments are kept."""
    line = f"name = {json.dumps(name, ensure_ascii=False)}"
    return re.sub(r"^name = .*$", lambda _: line, text, count=1, flags=re.MULTILINE)


def _values(outline: Outline) -> dict[str, float | str]:
    """Return the values that fill the template."""
    mass, lever, radius = outline.mass, outline.lever, outline.backbone_radius
    per_length, second_moment = _DENSITY * math.pi * radius**2, math.pi / 4 * radius**4
    weight = 9.81 * (mass + per_length * outline.length + outline.load)
    rotors = len(layout_geometry(outline.layout, lever, 0.0, 0.0)[2])
    upwards = math.cos(_TILT) if outline.layout == "hex_tilted" else 1.0
    return {
        "name": json.dumps(outline.name, ensure_ascii=False),
        "mass": mass,
        "rolling": _rounded(mass * lever**2 / 4),
        "yawing": _rounded(mass * lever**2 / 2),
        "mount": _MOUNT if outline.sections == 1 else "",
        "layout": outline.layout,
        "lever": lever,
        "lean": _TILT,
        "tilt": "tilt" if outline.layout == "hex_tilted" else "# tilt",
        "thrust": _rounded(_THRUST_TO_WEIGHT * weight / (rotors * upwards)),
        "length": outline.length / outline.sections,
        "radius": radius,
        "density": _DENSITY,
        "modulus": f"{_MODULUS / 1e9:g}e9",
        "per_length": _rounded(per_length),
        "stiffness": _rounded(_MODULUS * second_moment),
        "load": outline.load,
    }


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _aligned(line: str) -> str:
    """Return a line with its comment in the common column."""
    field, mark, comment = line.rpartition("  # ")
    return f"{field:<{_COMMENT_COLUMN - 2}}  # {comment}" if mark else line


_UAV = """\
# A vehicle to begin with. Every field stands here with its unit and what it means; those behind a
# "#" have their defaults, or say the same in another way. What is an estimate says so.
# SI units. Body axes: x forward, y left, z up, at the UAV's centre of mass.
name = $name  # for titles and results

[uav]
mass = $mass  # kg, without the arm
inertia = [$rolling, $rolling, $yawing]  # kg m2, about the centre of mass: diagonal or 3 rows of 3
# The inertia is an estimate, of a flat disk that reaches to the rotors: measure yours.
$mount
[uav.rotors]  # leave out this table for forces and moments that act directly
layout = "$layout"  # quad_, hex_, octo_ with x or plus, hex_tilted, coaxial_x8
lever = $lever  # m, from the z axis to each rotor
height = 0.0  # m, of the rotors' plane above the centre of mass
$tilt = $lean  # rad, of hex_tilted alone: how far each rotor leans
thrust_limits = [0.0, $thrust]  # N, of one rotor; an estimate, which lifts twice the weight
torque_per_thrust = 0.016  # m, drag torque over thrust
lag = 0.04  # s, in which the speed follows its command; 0 for at once
# lag_down = 0.06  # s, the same of a rotor that slows down
# thrust_model_factor = 1.0  # -, PX4's THR_MDL_FAC: 1 for thrusts as squares of commands
# hub_drag = [0.1, 0.2]  # N s/m, at the greatest speed, across and along the axis; k_d, k_z
# translational_lift = 0.0  # N s2/m2, over the square of the speed across the axis; k_h
# radius = 0.12  # m, of a rotor's disk, from which its power and its wash follow
# In place of layout, lever, height and tilt, rotors one by one:
# [[uav.rotors.rotor]]
# position = [0.14, 0.14, 0.0]  # m, body axes
# axis = [0.0, 0.0, 1.0]  # -, of its thrust
# spin = 1  # 1 counter-clockwise about its axis, -1 clockwise
# thrust_limits = [0.0, $thrust]  # N, of this rotor, in place of the common ones

# [uav.drag]
# linear = [0.25, 0.25, 0.1]  # N s/m, along the body axes
# quadratic = [0.0, 0.0, 0.0]  # N s2/m2
"""

_MOUNT = """\
mount = [0.0, 0.0, -0.05]  # m, where the arm's base sits, body axes
"""

_ARM = """\
[arm]  # one section; the straight arm is -z of the body axes
"""

_ARMS = """\
[[arm]]  # as many as there are, each with its sections and tip
name = "arm"  # for paths such as arm.arm.section.0.length
mount = [0.0, 0.0, -0.05]  # m, where the arm's base sits, body axes
attitude = [0.0, 0.0, 0.0, 1.0]  # x y z w, arm axes to body axes; the straight arm is its -z
"""

_FIRST = """\
[[arm.section]]  # from the base to the tip
# name = "base"  # for paths; without one its index
"""

_SECTION = """\
length = $length  # m, of the backbone
radius = $radius  # m, of the round, solid backbone
density = $density  # kg/m3; this one is of nitinol
# mass_per_length = $per_length  # kg/m, in place of the density
youngs_modulus = $modulus  # Pa; an estimate, of nitinol
# bending_stiffness = $stiffness  # N m2, in place of Young's modulus
damping_ratio = 0.02  # -, of the section's own clamped first mode; an estimate
# damping = 0.0  # N m2 s, structural, per unit length, in place of the ratio
# drag_coefficient = 1.1  # -, of the backbone in air that flows across it
# kappa_s = 1e-3  # 1/m, smallest curvature that polar inputs are divided by
# disks = { count = 10, mass = 0.002, inertia = [1e-7, 2e-7] }  # equal ones, the last at the end
"""

_TIP_DISK = """\
[[arm.disks]]  # what the tip carries; spacers are such disks, too
position = $length  # m along the arm; its length is the tip
mass = $load  # kg
inertia = [0.0, 0.0]  # kg m2, transverse and axial; 0 for a point
"""

_DISKS = """\
# Disks one by one, as many as there are:
# [[arm.section.disks]]
# position = $length  # m along the section; its length is the section's end
# mass = 0.002  # kg
# inertia = [1e-7, 2e-7]  # kg m2, transverse and axial
"""

_NEXT = """\
[[arm.section]]
length = $length  # m
radius = $radius  # m
density = $density  # kg/m3
youngs_modulus = $modulus  # Pa
damping_ratio = 0.02  # -
"""

_TIP_BODY = """\
[arm.tip]  # a rigid body on the tip of the arm above
mass = $load  # kg
centre = [0.0, 0.0, 0.0]  # m, tip axes: z along the tangent, out of the tip
inertia = [0.0, 0.0, 0.0]  # kg m2, about its own centre; 0 for a point
"""

_TENDONS = """\
# Tendons that bend the arm above: equal ones at several angles, as many groups as there are.
# [[arm.tendon]]
# angles = [0.0, 2.0944, 4.1888]  # rad, about the backbone, from x towards y
# offset = 0.01  # m, from the backbone; [0.02, 0.01] for tendons that converge
# turn = 0.0  # rad, about the backbone from the base to their end: helical tendons
# section = "0"  # in which they end; the last if left out
# end = 0.1  # m, along that section; its length if left out
# guides = "channel"  # or "disks": straight from disk to disk
# command = "tension"  # what motors follow; or "length"
# pretension = 1.0  # N, of a straight arm at a command of 0
# limits = [0.0, 40.0]  # N, least and greatest tension
# lag = 0.03  # s, in which a motor follows its command
# rate = 50.0  # N/s, or m/s of winches
# friction = 0.1  # -, on the guides
# friction_stiffness = 2e4  # N/m, before a tendon slides
# With command = "length", of winches:
# stiffness = 2e4  # N/m, of tendon and motor in series
# damping = 10.0  # N s/m, of the same
# stroke = [-0.02, 0.02]  # m, least and greatest length taken in
"""

_CAMERA = """\
[camera]  # at the tip, looking along the arm's tangent
# arm = "arm"  # which carries it; the first if left out
focal_length = [800.0, 800.0]  # px, along the image's axes
principal_point = [500.0, 500.0]  # px, where the optical axis meets the image
image_size = [1000, 1000]  # px, width and height
position = [0.0, 0.0, 0.0]  # m, in the tip frame
attitude = [0.0, 0.0, 0.0, 1.0]  # x y z w, camera axes to tip frame
tip_frame = "untwisted"  # or "frenet", which spins with the direction of the bend
# noise = 0.5  # px, standard deviation of a point's coordinates in the image
# frame_rate = 60.0  # Hz; 0 for a frame at every instant of control
# latency = 0.02  # s, from a frame's exposure until the law has it
"""
