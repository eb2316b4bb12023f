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
_NOTHING = 1e-13
"""Share of the largest square of a frequency below which one is 0 but for rounding."""


@dataclass(frozen=True)
class Modes:
    """Vibration about a configuration: frequencies [rad/s] ascending, damping ratios, shapes.

    shapes: (coordinates, modes) in (body translation 3, body rotation 3, bend), motions that
    nothing resists left out; (bends, modes) for a clamped base.

    Columns have unit norm; the first bend that counts is positive, and of modes of one frequency
    the first bends most along x. The damping is that of the sections, to first order.
    """

    frequencies: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray


def modes(vehicle: Vehicle, q: Any = None, *, base: str = "free", gravity: float = 9.81) -> Modes:
    """Modes about the configuration q, on a free or clamped base, or of the hovering vehicle.

    q: paper coordinates (8,), the straight arm by default; a bend moment holds the arm there.
    base: "free", "clamped" or "hovering"; the last is carried by a constant force in world axes at
    B's origin, under which the vehicle swings like a pendulum, too, and held level by a constant
    moment in body axes, which may make it flutter.

    The stiffness is that of the arm and of gravity, which a free base in free fall does not feel.
    Raises InputError, also where it buckles, topples or flutters about q and does not vibrate.

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
        squares, shapes, damping = _hovering(vehicle, at, gravity)
    else:
        squares, shapes, damping = _bending(vehicle, at, base == "free", gravity)
    frequencies = np.sqrt(squares)
    if base != "clamped":
        # Velocities of the linear system are in world axes, shapes in those of the body.
        shapes = np.vstack([_attitude(at).inv().as_matrix() @ shapes[:3], shapes[3:]])
    return Modes(
        frequencies, damping / (2.0 * frequencies), shapes / np.linalg.norm(shapes, axis=0)
    )


def _bending(
    vehicle: Vehicle, at: np.ndarray, free: bool, gravity: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Squares of frequencies (bends,), shapes (coordinates or bends, bends) and dampings [1/s]."""
    felt = 0.0 if free else gravity
    model = "coupled" if free else "independent"
    held = holding(Engine(vehicle, "decoupled"), at[None], felt)[0][
        Layout(vehicle.shape).bend_moment
    ]
    A, _ = linearize(vehicle, at, bend_moment=held, model=model, gravity=felt)
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    compliance = bend_compliance(Engine(vehicle, model), at)[0]
    squares, shapes = _eigenmodes(-A[rate, bend], n - 6, at)
    # Nothing resists a turn, about the vertical, of an upright arm that leans over.
    vibrates = squares > 0.0
    to_modes = np.linalg.inv(shapes)[vibrates]
    squares, shapes = squares[vibrates], shapes[:, vibrates]
    damping = _dampings(to_modes, compliance @ _damped(vehicle, shapes))
    if free:
        # The base follows the bend: its accelerations per acceleration of the bend.
        base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], shapes)
        shapes = np.vstack([base_rows, shapes])
    return squares, shapes, damping


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
    squares, along = _eigenmodes(resisted.T @ K, n - 6, at)
    # Nor, of some vehicles, a turn about a level arm through the centre of mass.
    vibrates = squares > 0.0
    squares, to_modes, along = squares[vibrates], np.linalg.inv(along)[vibrates], along[:, vibrates]
    shapes = resisted @ along + adrift @ (adrift.T @ K @ along / squares)
    slowed = B[n:, layout.bend_moment] @ _damped(vehicle, shapes)
    return squares, shapes, _dampings(to_modes, resisted.T @ slowed)


def _split(attitude: Rotation, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (n, 4) and (n, n - 4), in (world translation, body rotation, bend):
    translations and turning about the vertical, and all others."""
    upright = np.linalg.svd(attitude.inv().apply([[0.0, 0.0, 1.0]]))[2].T
    directions = np.eye(n)
    directions[3:6, 3:6] = upright
    return directions[:, :4], directions[:, 4:]


def _attitude(at: np.ndarray) -> Rotation:
    return Rotation.from_quat(state_from_paper(at[None], 0.0 * at[None])[0][Layout.attitude])


def _damped(vehicle: Vehicle, shapes: np.ndarray) -> np.ndarray:
    """Moments (bends, modes) of the sections' damping against shapes' rates, bends last."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    each = np.repeat([section.structural_damping * section.length for section in sections], 2)
    return np.asarray(each[:, None] * shapes[-len(each) :])


def _dampings(to_modes: np.ndarray, slowed: np.ndarray) -> np.ndarray:
    """The part along each mode (modes,) [1/s] of accelerations (n, modes).

    to_modes: left eigenvectors (modes, n), which in a hover differ from the right ones, as the
    constant moment that holds an arm off the centre has no potential.
    """
    part: np.ndarray = np.einsum("mi,im->m", to_modes, slowed)
    return part


def _check_vibrates(squares: np.ndarray, at: np.ndarray) -> None:
    """Raise InputError unless all squares of frequencies are real and above 0."""
    grows = np.abs(squares.imag) > _EQUAL * np.abs(squares)
    if (grows & (squares.real > 0.0)).any():
        rate = np.sqrt(squares[grows]).max()
        raise InputError(
            f"q is {shown(at)}, about which the hovering vehicle flutters: it swings at "
            f"{rate.real:.3g} rad/s, wider by {abs(rate.imag):.2g} 1/s, as the moment that holds "
            "it is constant; mount the arm nearer the centre, or fly it with a controller."
        )
    if not (squares.real > 0.0).all():
        raise InputError(
            f"q is {shown(at)}, about which the vehicle does not vibrate but buckles or topples; "
            "give a configuration near a stable balance (a hanging arm, less gravity or a stiffer "
            "arm)."
        )


def _eigenmodes(stiffness: np.ndarray, bends: int, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues ascending, 0 where nothing resists, and eigenvectors in columns, whose last rows
    are the bends.

    A solver leaves signs, and the vectors of equal eigenvalues, to rounding: they are chosen here.
    """
    values, vectors = np.linalg.eig(stiffness)
    resisted = np.abs(values) > _NOTHING * np.abs(values).max()
    _check_vibrates(values[resisted], at)
    values = np.where(resisted, values, 0.0)
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
    return values, vectors * np.where(first < 0.0, -1.0, 1.0)
