"""Where the material of an aerial continuum manipulator is, and how it is turned, with many digits.

A section hangs along -z of its base and bends by the vector k [1/m]: its tangent turns from -z
towards k, by |k| s at the arc length s, and its slices turn with it, untwisted: by the rotation
vector s k × ẑ. The base of the next section is the tip of the last. Axes of an arm's tip are those
of its last slice times diag(1, -1, -1): z along the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from mpmath import mp, mpf

from tests.oracles.kane_algebra import (
    Matrix,
    Vector,
    apply,
    from_quaternion,
    plus,
    product,
    scaled,
    turn,
)

Pose = tuple[Vector, Matrix]


@dataclass(frozen=True)
class Piece:
    """A rigid piece in axes of its own (those of its slice), and where on the vehicle it is.

    arm: -1 for the UAV; section: within the arm; arc: arc length of the slice; offset: from the
    slice's centre to the piece's, in axes of the slice; inertia (3, 3): about the piece's centre.
    """

    mass: Any
    inertia: Matrix
    arm: int = -1
    section: int = 0
    arc: Any = 0
    offset: Vector | None = None


@dataclass(frozen=True)
class Configuration:
    """Position and attitude (3, 3) of the UAV, body to world, and bends by arm and section."""

    position: Vector
    attitude: Matrix
    bends: list[list[Vector]]


def configuration(vehicle: Any, state: Any) -> Configuration:
    """Where a state is, with B at the origin of the world."""
    bends, first = [], 0
    for arm in vehicle["arms"]:
        bends.append(state["bend"][first : first + len(arm["sections"])])
        first += len(arm["sections"])
    return Configuration([mpf(0)] * 3, from_quaternion(state["attitude"]), bends)


def moved(at: Configuration, speeds: Vector, t: Any, change: Vector | None = None) -> Configuration:
    """The configuration a time t later, at the speeds u + u̇ t of `kane`; change: u̇, or none.

    The body turns by ω t + ω̇ t²/2, whose spin is ω + ω̇ t up to t², as ω × ω is 0.
    """
    change = change or [mpf(0)] * len(speeds)
    way = [t * u + t * t / 2 * a for u, a in zip(speeds, change, strict=True)]
    bends, first = [], 6
    for arm in at.bends:
        starts = range(first, first + 2 * len(arm), 2)
        bends.append([plus(k, way[i : i + 2]) for k, i in zip(arm, starts, strict=True)])
        first += 2 * len(arm)
    return Configuration(plus(at.position, way[:3]), product(at.attitude, turn(way[3:6])), bends)


def arc(bend: Vector, s: Any) -> Pose:
    """Place and axes of the slice at the arc length s, in base axes of its section.

    The chord of an arc points along the tangent half way, and is shorter than the arc by the sinc
    of half the angle.
    """
    half = s / 2
    angle = half * mp.sqrt(bend[0] ** 2 + bend[1] ** 2)
    ratio = mp.sinc(angle)
    tangent = [half * ratio * bend[0], half * ratio * bend[1], -mp.cos(angle)]
    return scaled(s * ratio, tangent), turn([s * bend[1], -s * bend[0], mpf(0)])


def poses(body: list[Piece], vehicle: Any, at: Configuration) -> list[Pose]:
    """Where the centre of every piece is, and its axes, in world axes."""
    bases = [_bases(arm, bends, at) for arm, bends in zip(vehicle["arms"], at.bends, strict=True)]
    found = []
    for piece in body:
        place, axes = at.position, at.attitude
        if piece.arm >= 0:
            slice_ = arc(at.bends[piece.arm][piece.section], piece.arc)
            place, axes = _after(bases[piece.arm][piece.section], slice_)
        if piece.offset:
            place = plus(place, apply(axes, piece.offset))
        found.append((place, axes))
    return found


def _bases(arm: Any, bends: list[Vector], at: Configuration) -> list[Pose]:
    """Bases of an arm's sections, in world axes."""
    mount = arm["mount"], from_quaternion(arm["attitude"])
    chain = [_after((at.position, at.attitude), mount)]
    for section, bend in zip(arm["sections"][:-1], bends[:-1], strict=True):
        chain.append(_after(chain[-1], arc(bend, section["length"])))
    return chain


def _after(base: Pose, relative: Pose) -> Pose:
    return plus(base[0], apply(base[1], relative[0])), product(base[1], relative[1])


def pieces(vehicle: Any, nodes: int) -> list[Piece]:
    """The UAV, the tip of every arm as a point without mass, and whatever the arms consist of."""
    arms = vehicle["arms"]
    body = [Piece(vehicle["uav"]["mass"], vehicle["uav"]["inertia"])]
    for i, arm in enumerate(arms):
        end = len(arm["sections"]) - 1, arm["sections"][-1]["length"]
        body.append(Piece(mpf(0), _round(mpf(0), mpf(0)), i, *end))
    for i, arm in enumerate(arms):
        end = len(arm["sections"]) - 1, arm["sections"][-1]["length"]
        if arm["tip"]:
            body.append(_on_tip(arm["tip"], i, *end))
        for j, section in enumerate(arm["sections"]):
            body += _of_section(section, i, j, nodes)
    return body


def _on_tip(tip: Any, arm: int, section: int, end: Any) -> Piece:
    """The rigid body on an arm's tip: from axes of the tip to those of the last slice."""
    flip = [1, -1, -1]
    centre = [a * x for a, x in zip(flip, tip["centre"], strict=True)]
    inertia = [[flip[i] * flip[j] * tip["inertia"][i][j] for j in range(3)] for i in range(3)]
    return Piece(tip["mass"], inertia, arm, section, end, centre)


def _of_section(section: Any, arm: int, index: int, nodes: int) -> list[Piece]:
    """Slices of a solid, round backbone at Gauss–Legendre nodes, and disks."""
    found = []
    for x, weight in gauss(nodes, mp.dps):
        mass = section["mass_per_length"] * section["length"] * weight
        square = mass * section["radius"] ** 2
        place = section["length"] * x
        found.append(Piece(mass, _round(square / 4, square / 2), arm, index, place))
    for disk in section["disks"]:
        found.append(Piece(disk["mass"], _round(*disk["inertia"]), arm, index, disk["position"]))
    return found


def _round(transverse: Any, axial: Any) -> Matrix:
    zero = mpf(0)
    return [[transverse, zero, zero], [zero, transverse, zero], [zero, zero, axial]]


@cache
def gauss(nodes: int, digits: int) -> list[tuple[Any, Any]]:
    """Gauss–Legendre nodes and weights on [0, 1]: roots of the Legendre polynomial by Newton."""
    found = []
    with mp.workdps(digits + 10):
        for i in range(nodes):
            x = mp.cos(mp.pi * (i + mpf("0.75")) / (nodes + mpf("0.5")))
            for _ in range(digits.bit_length() + 1):  # digits double every time
                value, slope = _legendre(nodes, x)
                x -= value / slope
            found.append(((1 + x) / 2, 1 / ((1 - x**2) * _legendre(nodes, x)[1] ** 2)))
    return found


def _legendre(n: int, x: Any) -> tuple[Any, Any]:
    """The polynomial of degree n at x, and its slope."""
    before, here = mpf(1), x
    for j in range(2, n + 1):
        before, here = here, ((2 * j - 1) * x * here - (j - 1) * before) / j
    return here, n * (before - x * here) / (1 - x**2)
