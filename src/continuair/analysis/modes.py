"""Modes: how arms vibrate on a clamped base, on a free one, and on that of a hovering vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.linear import linearize
from continuair.analysis.trim import configuration
from continuair.engine.engine import Engine
from continuair.errors import InputError, shown
from continuair.flight.holding import holding
from continuair.flight.steps import bend_compliance
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_EQUAL = 1e-6
"""Squares of frequencies that differ by less than this share are those of modes alike."""
_COUNTS = 0.1
"""A bend of a mode counts from this share of its largest; no symmetry makes just this share."""


@dataclass(frozen=True)
class Modes:
    """Vibration about a configuration: frequencies [rad/s] ascending, damping ratios, shapes.

    shapes: (coordinates, modes) in (body translation 3, body rotation 3, bend), motions that
    nothing resists left out; (bends, modes) for a clamped base.

    Columns have unit norm; the first bend that counts is positive, and of modes of one frequency
    the first bends most along x. The damping is that of the sections.
    """

    frequencies: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray


def modes(vehicle: Vehicle, q: Any = None, *, base: str = "free", gravity: float = 9.81) -> Modes:
    """Modes about the configuration q, on a free or clamped base, or of the hovering vehicle.

    q: paper coordinates (8,), the straight arm by default; a bend moment holds the arm there.
    base: "free", "clamped" or "hovering"; the last is carried by a constant force in world axes at
    B's origin, under which the vehicle swings like a pendulum, too.

    The stiffness is that of the arm and of gravity, which a free base in free fall does not feel.
    Raises InputError, also where it does not vibrate about q.

    >>> slender = ca.load_vehicle("slender")
    >>> for base in ("clamped", "free"):
    ...     print(f"{base}: {ca.modes(slender, base=base).frequencies[0]:.1f} rad/s")
    clamped: 29.0 rad/s
    free: 47.9 rad/s
    """
    check_single_vehicle(vehicle)
    checks.choice("base", base, ("free", "clamped", "hovering"))
    gravity = checks.gravity(gravity)
    at = configuration("q", q, vehicle)
    if base == "hovering":
        squares, shapes, modal = _hovering(vehicle, at, gravity)
    else:
        squares, shapes, modal = _bending(vehicle, at, base == "free", gravity)
    if not (squares > 0.0).all():
        raise InputError(
            f"q is {shown(at)}, about which the vehicle does not vibrate but buckles or topples; "
            "give a configuration near a stable balance (a hanging arm, less gravity or a stiffer "
            "arm)."
        )
    frequencies, bends = np.sqrt(squares), shapes[-Layout(vehicle.shape).bends :]
    lost = np.einsum("i,im,im->m", _of_bends(vehicle, "structural_damping"), bends, bends)
    if len(shapes) > len(bends):
        # Velocities of the linear system are in world axes, shapes in those of the body.
        shapes = np.vstack([_attitude(at).inv().as_matrix() @ shapes[:3], shapes[3:]])
    damping = lost / (2.0 * frequencies * modal)
    return Modes(frequencies, damping, shapes / np.linalg.norm(shapes, axis=0))


def _bending(
    vehicle: Vehicle, at: np.ndarray, free: bool, gravity: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Squares of frequencies (bends,), shapes (coordinates or bends, bends) and modal masses."""
    felt = 0.0 if free else gravity
    model = "coupled" if free else "independent"
    held = holding(Engine(vehicle, "decoupled"), at[None], felt)[0][
        Layout(vehicle.shape).bend_moment
    ]
    A, _ = linearize(vehicle, at, bend_moment=held, model=model, gravity=felt)
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    compliance = bend_compliance(Engine(vehicle, model), at)[0]
    # Held by a constant moment the arm is conservative: no mode grows while it vibrates.
    squares, shapes = _eigenmodes(-A[rate, bend], n - 6)
    modal = np.einsum("im,im->m", shapes, np.linalg.solve(compliance, shapes))
    if free:
        # The base follows the bend: its accelerations per acceleration of the bend.
        base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], shapes)
        shapes = np.vstack([base_rows, shapes])
    return squares, shapes, modal


def _hovering(
    vehicle: Vehicle, at: np.ndarray, gravity: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `_bending`, of all motions that something resists."""
    layout = Layout(vehicle.shape)
    held = holding(Engine(vehicle, "decoupled"), at[None], gravity)[0]
    push = {name: held[getattr(layout, name)] for name in ("force", "moment", "bend_moment")}
    A, B = linearize(vehicle, at, **push, gravity=gravity)
    n = len(A) // 2
    # Nothing resists translation, nor turning about the vertical: a solver that met their columns
    # of K, 0 but for rounding, would mix them into the shapes.
    adrift, resisted = _split(_attitude(at), n)
    K = -A[n:, :n] @ resisted
    squares, along = _eigenmodes(resisted.T @ K, n - 6)
    with np.errstate(divide="ignore", invalid="ignore"):
        shapes = resisted @ along + adrift @ (adrift.T @ K @ along / squares)
    return squares, shapes, np.einsum("im,im->m", shapes, np.linalg.solve(B[n:], shapes))


def _split(attitude: Rotation, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (n, 4) and (n, n - 4), in (world translation, body rotation, bend):
    translations and turning about the vertical, and all others."""
    upright = np.linalg.svd(attitude.inv().apply([[0.0, 0.0, 1.0]]))[2].T
    directions = np.eye(n)
    directions[3:6, 3:6] = upright
    return directions[:, :4], directions[:, 4:]


def _attitude(at: np.ndarray) -> Rotation:
    return Rotation.from_quat(state_from_paper(at[None], 0.0 * at[None])[0][Layout.attitude])


def _of_bends(vehicle: Vehicle, per_length: str) -> np.ndarray:
    """A property of the sections per length, times their length, of each bend (bends,)."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    return np.repeat([getattr(each, per_length) * each.length for each in sections], 2)


def _eigenmodes(stiffness: np.ndarray, bends: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues ascending and eigenvectors in columns, whose last rows are the bends.

    A solver leaves signs, and the vectors of equal eigenvalues, to rounding: they are chosen here.
    """
    values, vectors = np.linalg.eig(stiffness)
    order = np.argsort(values.real)
    values, vectors = values.real[order], vectors.real[:, order]
    apart = np.flatnonzero(np.diff(values) > _EQUAL * np.abs(values[1:])) + 1
    for equal in np.split(np.arange(len(values)), apart):
        if len(equal) > 1:
            shifted = stiffness - values[equal].mean() * np.eye(len(values))
            space = np.linalg.svd(shifted)[2][-len(equal) :].T
            along_x = space[-bends::2]
            vectors[:, equal] = space @ np.linalg.eigh(-along_x.T @ along_x)[1]
    bend = vectors[-bends:]
    counts = np.abs(bend) > _COUNTS * np.abs(bend).max(axis=0)
    first = np.take_along_axis(bend, counts.argmax(axis=0)[None], axis=0)
    return values, vectors * np.sign(first)
