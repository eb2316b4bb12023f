"""Paths of tendons along an arm, in pieces over which the strain of the backbone is known.

A tendon at the offset o of the cross-section advances by τ = ε + κ×o + o' per length of the
backbone, after F. Renda et al., IEEE RA-L 5(3), 2020. A piece is a node of a quadrature along a
channel, or the gap between two disks, over which strain and offset take their means. A helical
tendon turns about the backbone at a constant rate per arc length.
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
    for section, span in zip(passed, spans, strict=True):
        at, width, values, rates = _along(tendon, section, span, highest, runs)
        out = np.zeros((runs, at.shape[1], GEOMETRY + 2 * highest))
        out[..., 0] = width
        out[..., 1:3], out[..., 3:GEOMETRY] = _offsets(
            tendon, whole[:, None], begun[:, None] + at, width
        )
        out[..., GEOMETRY : GEOMETRY + highest], out[..., GEOMETRY + highest :] = values, rates
        parts.append(out)
        begun = begun + span
    each = np.concatenate(parts, axis=1)
    angles = per_run(tendon.angles, runs, tendon.count)
    found = np.repeat(each[:, None], tendon.count, axis=1)
    for index in range(tendon.count):
        angle = angles[:, index, None]
        found[:, index, :, 1:3] = _turned(each[..., 1:3], angle)
        found[:, index, :, 3:GEOMETRY] = _turned(each[..., 3:GEOMETRY], angle)
    return found


def _offsets(tendon: Tendon, whole: Array, at: Array, width: Array) -> tuple[Array, Array]:
    """Return offset [m] and its rate [-], (runs, n, 2) both, of a tendon at the angle 0.

    whole: length of the backbone (runs, 1) beside the tendon; at, width: middle and length (runs,
    n) of its pieces [m]. Between disks they are the mean and the slope of a straight chord.
    """
    runs = len(whole)
    base, end = (each[:, None] for each in np.moveaxis(per_run(tendon.offset, runs, 2), 1, 0))
    slope, rate = (end - base) / whole, per_run(tendon.turn, runs)[:, None] / whole

    def offset(at: Array) -> Array:
        distance = base + slope * at
        return _turned(np.stack([distance, np.zeros_like(at)], axis=-1), rate * at)

    advance = np.stack([slope + 0.0 * at, rate * (base + slope * at)], axis=-1)
    advance = _turned(advance, rate * at)
    if not (tendon.guides == "disks" and tendon.turns):
        return offset(at), advance
    near, far = offset(at - 0.5 * width), offset(at + 0.5 * width)
    filled = width[..., None] > 0.0
    chord = (far - near) / np.where(filled, width[..., None], 1.0)
    return 0.5 * (near + far), np.where(filled, chord, advance)


def _turned(vectors: Array, angle: Array) -> Array:
    """Return vectors (..., 2) turned by angles (...) [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


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
    parallel = bool(np.all(base == end)) and not tendon.turns
    return parallel and (orders == CONSTANT or bends_alone)


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
