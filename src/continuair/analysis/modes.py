"""Modes: how arms vibrate on a clamped base, on a free one, and on that of a hovering vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.linear import linearize
from continuair.analysis.trim import configuration
from continuair.analysis.vibration import Vibration, real_shapes, vibration
from continuair.engine.engine import Engine
from continuair.flight.frequencies import bend_compliance
from continuair.flight.holding import holding
from continuair.vehicle.coordinates import state_from_paper
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle


@dataclass(frozen=True)
class Modes:
    """Vibration about a configuration: frequencies [rad/s] ascending, damping ratios, shapes.

    A swing decays as exp(λ t): frequencies are |λ|, damping ratios -Re λ / |λ|, of the sections'
    damping alone; those of a mode that creeps back, its ratio 1 or more, are of its slower root's
    motion, which solves λ² + 2 ζ ω λ + ω² = 0. shapes: (coordinates, modes) in (body translation
    3, body rotation 3, bend), motions that nothing resists left out; (bends, modes) for a clamped
    base.

    Columns have unit norm and are real, taken where the swing is largest; the first bend that
    counts is positive, and of modes alike in both the first bends most along x.
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
    check_has_arms(vehicle)
    checks.choice("base", base, ("free", "clamped", "hovering"))
    gravity = checks.gravity(gravity)
    at = configuration("q", q, vehicle)
    found, shapes = (
        _hovering(vehicle, at, gravity)
        if base == "hovering"
        else _bending(vehicle, at, base == "free", gravity)
    )
    if base != "clamped":
        # Velocities of the linear system are in world axes, shapes in those of the body.
        shapes = np.vstack([_attitude(at).inv().as_matrix() @ shapes[:3], shapes[3:]])
    bends = vehicle.layout.bends
    return Modes(found.frequencies, found.ratios, real_shapes(shapes, bends))


def _bending(
    vehicle: Vehicle, at: np.ndarray, free: bool, gravity: float
) -> tuple[Vibration, np.ndarray]:
    """The vibration of the bends, and shapes (coordinates or bends, modes)."""
    felt = 0.0 if free else gravity
    model = "coupled" if free else "independent"
    held = holding(Engine(vehicle, "decoupled"), at[None], felt)[0][vehicle.layout.bend_moment]
    A, _ = linearize(vehicle, at, bend_moment=held, model=model, gravity=felt)
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    damping = bend_compliance(Engine(vehicle, model), at)[0] * _dampings(vehicle)
    found = vibration(-A[rate, bend], damping, n - 6, at)
    if not free:
        return found, found.shapes
    # The base follows the bend: its accelerations per acceleration of the bend.
    base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], found.shapes)
    return found, np.vstack([base_rows, found.shapes])


def _hovering(vehicle: Vehicle, at: np.ndarray, gravity: float) -> tuple[Vibration, np.ndarray]:
    """As `_bending`, of all motions that something resists."""
    layout = vehicle.layout
    held = holding(Engine(vehicle, "decoupled"), at[None], gravity)[0]
    push = {name: held[getattr(layout, name)] for name in ("force", "moment", "bend_moment")}
    A, B = linearize(vehicle, at, **push, gravity=gravity)
    n = len(A) // 2
    # Nothing resists translation, nor turning about the vertical: a solver that met their columns
    # of K, 0 but for rounding, would mix them into the shapes.
    adrift, resisted = _split(_attitude(at), n)
    K = -A[n:, :n] @ resisted
    D = B[n:, layout.bend_moment] * _dampings(vehicle) @ resisted[6:]
    found = vibration(resisted.T @ K, resisted.T @ D, n - 6, at)
    drifts = adrift.T @ (K @ found.shapes / found.roots**2 + D @ found.shapes / found.roots)
    return found, resisted @ found.shapes - adrift @ drifts


def _split(attitude: Rotation, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Orthonormal directions (n, 4) and (n, n - 4), in (world translation, body rotation, bend):
    translations and turning about the vertical, and all others."""
    upright = np.linalg.svd(attitude.inv().apply([[0.0, 0.0, 1.0]]))[2].T
    directions = np.eye(n)
    directions[3:6, 3:6] = upright
    return directions[:, :4], directions[:, 4:]


def _attitude(at: np.ndarray) -> Rotation:
    return Rotation.from_quat(state_from_paper(at[None], 0.0 * at[None])[0][Layout.attitude])


def _dampings(vehicle: Vehicle) -> np.ndarray:
    """Moment of each bend per its rate (bends,), of the sections' damping."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    return vehicle.layout.per_coordinate(
        [section.structural_damping * section.length for section in sections]
    )
