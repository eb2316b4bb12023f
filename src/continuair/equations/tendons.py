"""Lengths of tendons, from the curve of the backbone and the places of their guides."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.polynomial.legendre import leggauss

from continuair.equations.strain import rod_curve, strain_of
from continuair.equations.turns import Array
from continuair.typing import ArrayLike
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.section import Section
from continuair.vehicle.tendon import Tendon, section_of
from continuair.vehicle.vehicle import Vehicle

_NODES = 48
"""Gauss-Legendre nodes of a section."""


def tendon_lengths(vehicle: Vehicle, coordinates: ArrayLike) -> Array:
    """Return the lengths of all tendons, from the arms' bases to their ends.

    Along a channel at the offset o(s) of the cross-section a tendon advances by ε + κ×o + o' per
    length of the backbone, in axes of the cross-section. Between disks it is straight.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    coordinates : array_like (..., n)
        Coordinates of all sections, arm by arm from the base: the bend vectors of arcs [1/m].
        Complex numbers are kept, for derivatives by complex steps.

    Returns
    -------
    array (..., tendons)
        Lengths [m].
    """
    q, found, first = np.asarray(coordinates), [], 0
    for arm in vehicle.arms:
        for group in arm.tendon:
            length = _along_disks if group.guides == "disks" else _along_channel
            found += [length(arm, group, angle, q[..., first:]) for angle in group.angles]
        first += sum(section.coordinates for section in arm.section)
    return np.stack(found, axis=-1) if found else np.zeros((*q.shape[:-1], 0))


def _offset(group: Tendon, angle: float, share: float) -> Array:
    """Return the offset (3,) [m] at a share of the tendon's length along the backbone."""
    base, end = group.offset
    angle = angle + group.turn * share
    return (base + (end - base) * share) * np.array([np.cos(angle), np.sin(angle), 0.0])


def _offset_rate(group: Tendon, angle: float, share: float) -> Array:
    """Return the derivative (3,) [m] of the offset by that share."""
    base, end = group.offset
    angle = angle + group.turn * share
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    return (end - base) * outward + (base + (end - base) * share) * group.turn * around


def _passed(
    arm: ArmChain, group: Tendon, q: Array
) -> Iterator[tuple[Section, float, float, Array]]:
    """Yield each section that a tendon passes, where it begins and ends in it, and its q."""
    last, first, begun = section_of(group, [each.name for each in arm.section]), 0, 0.0
    for index, section in enumerate(arm.section[: last + 1]):
        own = q[..., first : first + section.coordinates]
        span = group.end if index == last and group.end is not None else section.length
        yield section, begun, span, own
        first, begun = first + section.coordinates, begun + span


def _along_channel(arm: ArmChain, group: Tendon, angle: float, q: Array) -> Array:
    parts = list(_passed(arm, group, q))
    whole = sum(span for _, _, span, _ in parts)
    nodes, weights = leggauss(_NODES)
    found = np.zeros(q.shape[:-1], q.dtype)
    for section, begun, span, own in parts:
        for node, weight in zip(nodes, weights, strict=True):
            at = 0.5 * span * (1.0 + node)
            turning, advance = strain_of(section.orders, own, at / section.length)
            share = (begun + at) / whole
            moved = advance + np.cross(turning, _offset(group, angle, share))
            moved = moved + _offset_rate(group, angle, share) / whole
            found = found + 0.5 * span * weight * np.sqrt((moved * moved).sum(-1))
    return found


def _along_disks(arm: ArmChain, group: Tendon, angle: float, q: Array) -> Array:
    parts = list(_passed(arm, group, q))
    whole = sum(span for _, _, span, _ in parts)
    place, axes = np.zeros(3, q.dtype), np.eye(3, dtype=q.dtype)
    before, found = place + _offset(group, angle, 0.0), np.zeros(q.shape[:-1], q.dtype)
    for section, begun, span, own in parts:
        ends = np.unique([span, *(disk.position for disk in section.disks if disk.position < span)])
        ends = ends[ends > 0.0]
        points, frames = rod_curve(section.orders, section.length, own, ends)
        points = place[..., None, :] + np.einsum("...ij,...pj->...pi", axes, points)
        frames = axes[..., None, :, :] @ frames
        for index, end in enumerate(ends):
            o = _offset(group, angle, (begun + end) / whole)
            guide = points[..., index, :] + frames[..., index, :, :] @ o
            found = found + np.sqrt(((guide - before) ** 2).sum(-1))
            before = guide
        place, axes = points[..., -1, :], frames[..., -1, :, :]
    return found
