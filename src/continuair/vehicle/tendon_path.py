"""Paths of tendons along an arm, in pieces over which the strain of the backbone is known.

A tendon at the offset o of the cross-section advances by τ = ε + κ×o + o' per length of the
backbone, after F. Renda et al., IEEE RA-L 5(3), 2020. A piece is a node of a quadrature along a
channel, or the gap between two disks, over which strain and offset take their means.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import Legendre, leggauss

from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section
from continuair.vehicle.strain import CONSTANT
from continuair.vehicle.tendon import Tendon, section_of

STRETCHES = 3
"""Stretches of a section between which friction changes the tension of a tendon."""

_NODES = 12
"""Nodes per section of a tendon whose path does not depend linearly on the strain."""

GEOMETRY = 5
"""Numbers of a piece before the polynomials: its length, the offset, and the offset's rate."""


@dataclass(frozen=True)
class Stretch:
    """Part of a tendon with one tension.

    Parameters
    ----------
    section : int
        Index of its section, among those of the arm.
    pieces : int
        Number of its pieces.
    """

    section: int
    pieces: int


def stretches(tendon: Tendon, arm: ArmChain) -> tuple[Stretch, ...]:
    """Return the stretches of a group's tendons, from the base to their end.

    Parameters
    ----------
    tendon : Tendon
        The group.
    arm : ArmChain
        Its arm.

    Returns
    -------
    tuple of Stretch
        The stretches.
    """
    found = []
    for index, section in enumerate(_passed(tendon, arm)):
        parts = STRETCHES if tendon.rubs else 1
        if tendon.guides == "disks":
            whole = len(section.disks) + 1
            edges = np.linspace(0, whole, min(parts, whole) + 1).round().astype(int)
            counts = np.diff(edges).tolist()
        else:
            counts = [1 if _is_linear(tendon, section) else _NODES // parts] * parts
        found += [Stretch(index, count) for count in counts]
    return tuple(found)


def highest_order(tendon: Tendon, arm: ArmChain) -> int:
    """Return the highest order of a strain along a group's tendons."""
    orders = [order for part in _passed(tendon, arm) for _, order in part.orders.coordinates]
    return max(orders)


def pieces(tendon: Tendon, arm: ArmChain, runs: int) -> Array:
    """Return the pieces of each tendon of a group, from the base to the end.

    Parameters
    ----------
    tendon : Tendon
        The group.
    arm : ArmChain
        Its arm.
    runs : int
        Number of runs.

    Returns
    -------
    ndarray, shape (runs, tendons, pieces, 5 + 2 p)
        Length of the backbone [m], offset (2) [m] and its rate (2) [-], and of the Legendre
        polynomials of order 1 to p, the highest of the arm, the values and their rates [1/m].
    """
    passed, highest = _passed(tendon, arm), highest_order(tendon, arm)
    spans = [per_run(section.length, runs) for section in passed]
    if tendon.end is not None:
        spans[-1] = per_run(tendon.end, runs)
    whole, begun, parts = sum(spans, np.zeros(runs)), np.zeros(runs), []
    base, end = np.moveaxis(per_run(tendon.offset, runs, 2), 1, 0)
    slope = (end - base) / whole
    for section, span in zip(passed, spans, strict=True):
        at, width, values, rates = _along(tendon, section, span, highest, runs)
        out = np.zeros((runs, at.shape[1], 3 + 2 * highest))
        out[..., 0] = width
        out[..., 1] = base[:, None] + slope[:, None] * (begun[:, None] + at)
        out[..., 2] = slope[:, None]
        out[..., 3 : 3 + highest], out[..., 3 + highest :] = values, rates
        parts.append(out)
        begun = begun + span
    each = np.concatenate(parts, axis=1)
    angles = per_run(tendon.angles, runs, tendon.count)
    found = np.empty((runs, tendon.count, each.shape[1], GEOMETRY + 2 * highest))
    for index in range(tendon.count):
        ways = np.stack([np.cos(angles[:, index]), np.sin(angles[:, index])], axis=-1)[:, None]
        found[:, index, :, 0] = each[..., 0]
        found[:, index, :, 1:3] = each[..., 1:2] * ways
        found[:, index, :, 3:5] = each[..., 2:3] * ways
        found[:, index, :, 5:] = each[..., 3:]
    return found


def straight_lengths(parts: Array) -> Array:
    """Return the lengths (runs, tendons) [m] of the pieces of tendons along a straight arm."""
    advance = np.sqrt(1.0 + np.square(parts[..., 3:5]).sum(axis=-1))
    return np.asarray((parts[..., 0] * advance).sum(axis=-1))


def _passed(tendon: Tendon, arm: ArmChain) -> tuple[Section, ...]:
    """Return the sections that a group's tendons pass, from the arm's base."""
    last = section_of(tendon, [section.name for section in arm.section])
    return arm.section[: last + 1]


def _is_linear(tendon: Tendon, section: Section) -> bool:
    """Return whether lengths depend linearly on the strain: of bends along parallel tendons."""
    base, end = np.moveaxis(np.asarray(tendon.offset, float), -1, 0)
    orders = section.orders
    bends_alone = orders.twist is None and orders.stretch is None and orders.shear is None
    return bool(np.all(base == end)) and (orders == CONSTANT or bends_alone)


def _along(
    tendon: Tendon, section: Section, span: Array, highest: int, runs: int
) -> tuple[Array, Array, Array, Array]:
    """Return place and length (runs, n) of the pieces in a section, and values and rates (runs, n,
    highest) of its polynomials."""
    length = per_run(section.length, runs)[:, None]
    if tendon.guides == "disks":
        disks = [per_run(disk.position, runs) for disk in section.disks]
        inside = np.minimum(np.sort(np.stack(disks, axis=1), axis=1), span[:, None])
        edges = np.concatenate([np.zeros((runs, 1)), inside, span[:, None]], axis=1)
    else:
        parts = STRETCHES if tendon.rubs else 1
        edges = span[:, None] * np.linspace(0.0, 1.0, parts + 1)
        if not _is_linear(tendon, section):
            return _gauss_nodes(edges, length, highest, _NODES // parts)
    width, middle = np.diff(edges, axis=1), 0.5 * (edges[:, 1:] + edges[:, :-1])
    values, rates = np.zeros((2, *width.shape, highest))
    filled = width > 0.0
    safe = np.where(filled, width, 1.0)
    for order in range(1, highest + 1):
        basis = Legendre.basis(order, domain=[0.0, 1.0])
        at, whole = edges / length, basis.integ()
        mean = np.diff(whole(at), axis=1) * length / safe
        values[..., order - 1] = np.where(filled, mean, basis(middle / length))
        rates[..., order - 1] = np.where(filled, np.diff(basis(at), axis=1) / safe, 0.0)
    return middle, width, values, rates


def _gauss_nodes(
    edges: Array, length: Array, highest: int, count: int
) -> tuple[Array, Array, Array, Array]:
    """Return the same at Gauss nodes between edges (runs, parts + 1)."""
    nodes, weights = leggauss(count)
    width, middle = np.diff(edges, axis=1), 0.5 * (edges[:, 1:] + edges[:, :-1])
    runs = len(edges)
    at = (middle[..., None] + 0.5 * width[..., None] * nodes).reshape(runs, -1)
    each = (0.5 * width[..., None] * weights).reshape(runs, -1)
    values, rates = np.zeros((2, *at.shape, highest))
    for order in range(1, highest + 1):
        basis = Legendre.basis(order, domain=[0.0, 1.0])
        values[..., order - 1] = basis(at / length)
        rates[..., order - 1] = basis.deriv()(at / length) / length
    return at, each, values, rates
