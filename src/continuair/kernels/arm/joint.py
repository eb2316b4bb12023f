"""Device code of the bias accelerations of a section's tip, for any kind of section.

The biases g_a and g_w of the tip (sections/kind.py) are split in the same parts as those of a
section.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.sections.kind import section_types


@dataclass(frozen=True)
class JointCode:
    """Functions of a section's tip, defined below."""

    full_carried: Any
    turning_carried: Any
    bending_carried: Any
    carried_on: Any


@cache
def joint_code(numbers: Numbers, tree: Tree, coordinates: int) -> JointCode:
    """Return the functions for one kind of numbers, and a number of coordinates."""
    types, own = device_types(numbers, tree), section_types(numbers, tree, coordinates)
    Real, vec3, Joint, Carried = types.Real, types.vec3, own.Joint, own.Carried
    half, two = Real(0.5), Real(2.0)

    @wp.func
    def full_carried(alone: Carried, j: Joint, w: vec3):
        """Return g_a and g_w; alone: those of a section on a base at rest."""
        out = alone
        out.base += wp.cross(w, wp.cross(w, j.p) + two * j.moved)
        out.spin += wp.cross(w, j.turned)
        return out

    @wp.func
    def turning_carried(j: Joint, w: vec3, v: vec3):
        """Return the symmetric forms of z = (w, q̇) and (v, 0)."""
        out = Carried()
        out.base = half * (wp.cross(w, wp.cross(v, j.p)) + wp.cross(v, wp.cross(w, j.p)))
        out.base += wp.cross(v, j.moved)
        out.spin = half * wp.cross(v, j.turned)
        return out

    @wp.func
    def bending_carried(alone: Carried, j: Joint, w: vec3, v: vec3):
        """Return the symmetric forms of z = (w, q̇) and (v, q̇)."""
        out = alone
        out.base += half * (wp.cross(w, wp.cross(v, j.p)) + wp.cross(v, wp.cross(w, j.p)))
        out.base += wp.cross(w + v, j.moved)
        out.spin += half * wp.cross(w + v, j.turned)
        return out

    @wp.func
    def carried_on(on: Carried, by: Carried, j: Joint):
        """Return the bias accelerations at the tip, in its axes, of base and section."""
        out = Carried()
        back = wp.transpose(j.R)
        out.base = back * (on.base + wp.cross(on.spin, j.p) + by.base)
        out.spin = back * (on.spin + by.spin)
        return out

    return holding(JointCode, locals())
