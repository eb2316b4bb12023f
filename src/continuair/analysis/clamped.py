"""Statics of an arm on a clamped base: its energy under gravity and tensions of its tendons.

Rows of coordinates belong to runs of a vehicle. Frames R of the cross-sections are found at Gauss
nodes by products of exponentials of fourth order; points p and derivatives of both are integrals of
the polynomials through the values at the nodes,

    p = l ∫ R ε,    ∂R = W × R with W = l ∫ R ∂κ,    P = l ∫ (W × R ε + R ∂ε).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from continuair.sections import kind_of
from continuair.sections.strain.nodes import gauss, integration, lagrange
from continuair.typing import Array
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.tendon_path import GEOMETRY, pieces, stretches

Rows: TypeAlias = NDArray[np.intp]

NODES = 16
"""Gauss nodes of a section: frames of a full circle then err by 1e-10."""

_SUBSTEPS = 2
"""Exponentials between two nodes."""

_TURNING = np.array([[0, -1, 0], [1, 0, 0], [0, 0, -1], *3 * [[0, 0, 0]]], float)
_ADVANCE = np.array([*3 * [[0, 0, 0]], [0, 0, -1], [1, 0, 0], [0, 1, 0]], float)
"""Turning and advance per unit of each of `COMPONENTS` (vehicle/strain.py)."""

_HALF_TURN = np.diag([1.0, -1.0, -1.0])
"""Axes of the body on a tip, whose z points out of the arm, in those of the last section."""


class Frames(NamedTuple):
    """Points (rows, n, 3) and axes (rows, n, 3, 3), and their derivatives (rows, n, q, 3)."""

    points: Array
    axes: Array
    moved: Array
    turned: Array


@dataclass(frozen=True)
class ClampedSection:
    """A section of an arm over runs.

    Parameters
    ----------
    coordinates : int
        Number of coordinates.
    length : ndarray, shape (runs,)
        Length [m].
    stiffness : ndarray, shape (runs, coordinates, coordinates)
        Elastic force per coordinate.
    backbone : ndarray, shape (runs, NODES)
        Masses at the nodes [kg].
    to_places, at_places : ndarray, shape (runs, n, NODES)
        Integrals to, and values at, the places of `frames`: disks, then markers, then the tip.
    disks : ndarray, shape (runs, disks)
        Masses of the disks [kg].
    strains : tuple of tuple of int
        Component and order of each coordinate.
    """

    coordinates: int
    length: Array
    stiffness: Array
    backbone: Array
    to_places: Array
    at_places: Array
    disks: Array
    strains: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, section: Section, markers: Array, runs: int) -> ClampedSection:
        """Return a section; markers (runs, n): their distances from its base [m]."""
        kind, length, disks = kind_of(section), per_run(section.length, runs), section.disks
        stiffness = kind.stiffness(section, runs)[:, :, None] * np.eye(kind.coordinates)
        for pair, (j, k) in enumerate(kind.couples):
            between = kind.between(section, runs)[0][:, pair]
            stiffness[:, j, k] = stiffness[:, k, j] = between
        x, weights = gauss(NODES)
        shares = np.broadcast_to(section.mass_shares(x)[0], (runs, NODES))
        of_disks = [per_run(disk.position, runs) for disk in disks]
        places = [*of_disks, *markers.T, length]
        return cls(
            kind.coordinates, length, stiffness,
            per_run(section.backbone_mass, runs)[:, None] * weights * shares,
            *_to_places(x, np.stack(places, axis=1) / length[:, None]),
            np.stack([np.zeros(runs), *(per_run(d.mass, runs) for d in disks)], axis=1)[:, 1:],
            kind.strains,
        )  # fmt: skip

    def frames(self, q: Array, run: Rows) -> tuple[Frames, Array, Array]:
        """Return frames at the places, and first moment (rows, 3) and its derivatives of the mass.

        q (rows, coordinates); run (rows,). Lengths are from the section's base, in its axes.
        """
        nodes, length = gauss(NODES)[0], self.length[run][:, None, None]
        kappa, advance = _strains(self.strains, nodes)
        axes = _turned(self.strains, q, self.length[run])
        t = length * _of(axes, _along(q, advance) + np.array([0.0, 0.0, -1.0]))
        turning = length[..., None] * _of(axes[:, :, None], kappa)
        moving = length[..., None] * _of(axes[:, :, None], advance)
        to_nodes = integration(nodes)
        W = _summed(to_nodes[:-1], turning)
        rate = np.cross(W, t[:, :, None, :]) + moving
        p, P = to_nodes[:-1] @ t, _summed(to_nodes[:-1], rate)
        mass = self.backbone[run]
        first = np.einsum("rk,rki->ri", mass, p)
        slope = np.einsum("rk,rkqi->rqi", mass, P)
        to_places = self.to_places[run]
        found = Frames(
            to_places @ t,
            (self.at_places[run] @ axes.reshape(len(q), NODES, 9)).reshape(len(q), -1, 3, 3),
            _summed(to_places, rate),
            _summed(to_places, turning),
        )
        disks, count = self.disks[run], self.disks.shape[1]
        first = first + np.einsum("re,rei->ri", disks, found.points[:, :count])
        slope = slope + np.einsum("re,reqi->rqi", disks, found.moved[:, :count])
        return found, first, slope


def _strains(strains: tuple[tuple[int, int], ...], at: Array) -> tuple[Array, Array]:
    """Return κ and ε per coordinate (n, q, 3) at shares of the length (n,)."""
    values = np.stack(
        [legendre.Legendre.basis(order)(2.0 * at - 1.0) for _, order in strains], axis=-1
    )
    of = [component for component, _ in strains]
    return values[..., None] * _TURNING[of], values[..., None] * _ADVANCE[of]


def _along(q: Array, unit: Array) -> Array:
    """Return Σ_j q_j (rows, q) of vectors (n, q, 3), as (rows, n, 3)."""
    return np.asarray(np.tensordot(q, unit, (1, 1)))


def _of(axes: Array, vectors: Array) -> Array:
    return np.asarray((axes @ vectors[..., None])[..., 0])


def _summed(weights: Array, values: Array) -> Array:
    """Return Σ_k weights (…, n, k) values (rows, k, q, 3)."""
    flat = values.reshape(*values.shape[:2], -1)
    return np.asarray((weights @ flat).reshape(len(flat), -1, *values.shape[2:]))


def _to_places(nodes: Array, at: Array) -> tuple[Array, Array]:
    """Return integrals to, and values at, places (rows, n) of polynomials through the nodes."""
    x, weights = gauss(len(nodes))
    inner = at[..., None] * x
    along = lagrange(nodes, inner.reshape(len(at), -1)).reshape(*inner.shape, len(nodes))
    return at[..., None] * np.einsum("n,renk->rek", weights, along), lagrange(nodes, at)


def _turned(strains: tuple[tuple[int, int], ...], q: Array, length: Array) -> Array:
    """Return the axes (rows, nodes, 3, 3) of the cross-sections at the Gauss nodes."""
    edges = np.concatenate([[0.0], gauss(NODES)[0]])
    shares = np.arange(_SUBSTEPS) / _SUBSTEPS
    begins = (edges[:-1, None] + np.diff(edges)[:, None] * shares).ravel()
    steps = np.repeat(np.diff(edges) / _SUBSTEPS, _SUBSTEPS)
    middle, aside = begins + 0.5 * steps, np.sqrt(3.0) / 6.0 * steps
    one, two = (_along(q, _strains(strains, middle + side * aside)[0]) for side in (-1.0, 1.0))
    h = (length[:, None] * steps)[..., None]
    turn = 0.5 * h * (one + two) + np.sqrt(3.0) / 12.0 * h * h * np.cross(one, two)
    each = Rotation.from_rotvec(turn.swapaxes(0, 1).reshape(-1, 3)).as_matrix()
    each = each.reshape(len(steps), len(q), 3, 3)
    found = np.empty((len(q), NODES, 3, 3))
    axes = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    for index, part in enumerate(each):
        axes = axes @ part
        if index % _SUBSTEPS == _SUBSTEPS - 1:
            found[:, index // _SUBSTEPS] = axes
    return found


@dataclass(frozen=True)
class _Stretch:
    """Pieces of one tendon in one section: rows (runs, pieces, n), as of `pieces`."""

    tendon: int
    section: int
    rows: Array
    straight: bool


class ClampedArm:
    """An arm over runs, on a clamped base.

    Parameters
    ----------
    arm : ArmChain
        The arm, of a vehicle or of a batch.
    runs : int
        Number of runs.
    markers : list of ndarray, optional
        Of each section, the distances (runs, n) of its markers from its base [m].
    """

    def __init__(self, arm: ArmChain, runs: int, markers: list[Array] | None = None) -> None:
        none = [np.zeros((runs, 0))] * len(arm.section)
        self.sections = [
            ClampedSection.of(section, at, runs)
            for section, at in zip(arm.section, markers or none, strict=True)
        ]
        ends = np.cumsum([0, *(each.coordinates for each in self.sections)])
        self.of_section = [slice(*pair) for pair in zip(ends[:-1], ends[1:], strict=True)]
        self.coordinates = int(ends[-1])
        self.tendons = sum(group.count for group in arm.tendon)
        self._stretches = _stretches(arm, runs)
        self.stiffness = np.zeros((runs, self.coordinates, self.coordinates))
        for own, section in zip(self.of_section, self.sections, strict=True):
            self.stiffness[:, own, own] = section.stiffness
        tip = arm.tip
        self._tip_mass = np.zeros(runs) if tip is None else per_run(tip.mass, runs)
        centre = np.zeros((runs, 3)) if tip is None else per_run(tip.centre, runs, 3)
        self._tip_centre = centre @ _HALF_TURN

    def natural(self, run: Rows) -> Array:
        """Return 1/l of coordinates that turn cross-sections, and 1 of others (rows, q)."""
        turning = [[component < 3 for component, _ in each.strains] for each in self.sections]
        each = [
            np.where(own, 1.0 / section.length[run, None], 1.0)
            for own, section in zip(turning, self.sections, strict=True)
        ]
        return np.concatenate(each, axis=1)

    def energy(self, q: Array, run: Rows, tensions: Array, gravity: Array) -> tuple[Array, Array]:
        """Return the potential energy (rows,) and its derivatives (rows, coordinates).

        Parameters
        ----------
        q : ndarray, shape (rows, coordinates)
            Coordinates of all sections.
        run : ndarray, shape (rows,)
            The run of each row.
        tensions : ndarray, shape (rows, tendons)
            Tensions [N].
        gravity : ndarray, shape (rows, 3)
            Acceleration of gravity in axes of the arm's base [m/s²].
        """
        pull = _of(self.stiffness[run], q)
        energy, slope = 0.5 * (pull * q).sum(-1), pull
        first, moved, _ = self._chained(q, run)
        energy = energy - (gravity * first).sum(-1)
        slope = slope - _of(moved, gravity)
        for each in self._stretches:
            own = self.of_section[each.section]
            strains = self.sections[each.section].strains
            length, pulled = _length(each, strains, q[:, own], run)
            force = tensions[:, each.tendon]
            energy = energy + force * length
            slope[:, own] += force[:, None] * pulled
        return energy, slope

    def markers(self, q: Array, run: Rows) -> tuple[list[Array], list[Array]]:
        """Return points (rows, n, 3) and axes (rows, n, 3, 3) of each section's markers."""
        _, _, frames = self._chained(q, run)
        points, axes = [], []
        for section, (at, turned) in zip(self.sections, frames, strict=True):
            own = slice(section.disks.shape[1], -1)
            points.append(at[:, own])
            axes.append(turned[:, own])
        return points, axes

    def _chained(self, q: Array, run: Rows) -> tuple[Array, Array, list[tuple[Array, Array]]]:
        """Return Σ m r (rows, 3) and its derivatives (rows, q, 3), and frames in base axes."""
        rows = len(q)
        place, axes = np.zeros((rows, 3)), np.broadcast_to(np.eye(3), (rows, 3, 3))
        P, W = np.zeros((2, rows, self.coordinates, 3))
        first, slope, frames = np.zeros((rows, 3)), np.zeros((rows, self.coordinates, 3)), []
        for own, section in zip(self.of_section, self.sections, strict=True):
            found, moment, moment_slope = section.frames(q[:, own], run)
            mass = (section.backbone.sum(1) + section.disks.sum(1))[run, None]
            turned = _of(axes, moment)
            first = first + mass * place + turned
            slope = slope + mass[..., None] * P + np.cross(W, turned[:, None])
            slope[:, own] += moment_slope @ axes.swapaxes(-1, -2)
            to = axes.swapaxes(-1, -2)
            points = place[:, None] + found.points @ to
            frames.append((points, axes[:, None] @ found.axes))
            P = P + np.cross(W, (points[:, -1] - place)[:, None])
            P[:, own] += found.moved[:, -1] @ to
            W = W.copy()
            W[:, own] += found.turned[:, -1] @ to
            place, axes = points[:, -1], frames[-1][1][:, -1]
        off = _of(axes, self._tip_centre[run])
        mass = self._tip_mass[run, None]
        first = first + mass * (place + off)
        slope = slope + mass[..., None] * (P + np.cross(W, off[:, None]))
        return first, slope, frames


def _stretches(arm: ArmChain, runs: int) -> list[_Stretch]:
    """Return the stretches of all tendons of an arm."""
    found, tendon = [], 0
    for group in arm.tendon:
        rows, own = pieces(group, arm, runs), _sections_of(group, arm)
        for each in range(group.count):
            begun = 0
            for section, count in own:
                at = rows[:, each, begun : begun + count]
                found.append(_Stretch(tendon, section, at, group.guides == "disks"))
                begun += count
            tendon += 1
    return found


def _sections_of(group: Tendon, arm: ArmChain) -> list[tuple[int, int]]:
    """Return the section, and the number of pieces, of each stretch of a group."""
    return [(each.section, each.pieces) for each in stretches(group, arm)]


def _length(
    stretch: _Stretch, strains: tuple[tuple[int, int], ...], q: Array, run: Rows
) -> tuple[Array, Array]:
    """Return the length (rows,) of a stretch [m] and its derivatives (rows, coordinates)."""
    rows = stretch.rows[run]
    basis = np.stack(
        [rows[..., GEOMETRY + order - 1] if order else np.ones(rows.shape[:-1])
         for _, order in strains], axis=-1,
    )  # fmt: skip
    e = np.zeros((*rows.shape[:-1], len(COMPONENTS)))
    for column, (component, _) in enumerate(strains):
        e[..., component] += q[:, None, column] * basis[..., column]
    zero = np.zeros(rows.shape[:-1])
    offset = np.stack([rows[..., 1], rows[..., 2], zero], axis=-1)
    kappa = np.stack([e[..., 1], -e[..., 0], -e[..., 2]], axis=-1)
    tau = np.stack([e[..., 4] + rows[..., 3], e[..., 5] + rows[..., 4], -1.0 - e[..., 3]], axis=-1)
    tau = tau + np.cross(kappa, offset)
    size, by_tau, by_kappa = _chord(rows[..., 0], tau, kappa, stretch.straight)
    by_kappa = by_kappa + np.cross(offset, by_tau)
    of = [component for component, _ in strains]
    slope = by_kappa @ _TURNING[of].T + by_tau @ _ADVANCE[of].T
    return (rows[..., 0] * size).sum(-1), (rows[..., :1] * slope * basis).sum(1)


def _chord(length: Array, tau: Array, kappa: Array, straight: bool) -> tuple[Array, Array, Array]:
    """Return the advance of a tendon per length, and its derivatives in τ and κ.

    straight: along the chord of a curve of constant τ and κ, of which, with the angle φ = l |κ|,
    |chord|² = l² (c τ² + d (l τ·κ)²), c = 2 (1 - cos φ)/φ² and d = (1 - c)/φ².
    """
    if not straight:
        size = np.linalg.norm(tau, axis=-1)
        return size, tau / size[..., None], np.zeros(tau.shape)
    square = length**2 * (kappa * kappa).sum(-1)
    along = length * (tau * kappa).sum(-1)
    c, c_rate, d, d_rate = _series(square)
    whole = (tau * tau).sum(-1)
    size = np.sqrt(c * whole + d * along * along)
    aside, rate = (d * along * length)[..., None], c_rate * whole + d_rate * along * along
    by_tau = c[..., None] * tau + aside * kappa
    by_kappa = (rate * length**2)[..., None] * kappa + aside * tau
    return size, by_tau / size[..., None], by_kappa / size[..., None]


def _series(square: Array) -> tuple[Array, Array, Array, Array]:
    """Return c and d of `_chord` and their derivatives, as power series in φ²."""
    found: list[Array] = []
    for first in (2, 4):
        value, rate, term = np.zeros_like(square), np.zeros_like(square), 2.0
        for k in range(2, first + 1):
            term /= k
        for k in range(14):
            value = value + term * square**k
            rate = rate + (k * term * square ** (k - 1) if k else 0.0)
            term /= -(2 * k + first + 1) * (2 * k + first + 2)
        found += [value, rate]
    return found[0], found[1], found[2], found[3]
