"""Vibration modes of arms on a clamped base, a free base, and a hovering vehicle."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.linear import linearize
from continuair.analysis.trim import configuration
from continuair.analysis.vibration import Vibration, real_shapes, vibration
from continuair.engine.engine import Engine
from continuair.errors import InputError
from continuair.flight.frequencies import bend_compliance
from continuair.flight.holding import holding
from continuair.sections import of_pairs
from continuair.typing import Array, ArrayLike, Model
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_vehicle

Base = Literal["free", "clamped", "hovering"]
"""Base on which arms vibrate."""


@dataclass(frozen=True)
class Modes:
    """Vibration modes about a configuration.

    Parameters
    ----------
    frequencies : ndarray, shape (modes,) or (runs, modes)
        |λ| of motions exp(λ t), ascending [rad/s]. Of a batch all arrays begin with its runs, each
        in its own order: where frequencies cross, a column changes its shape.
    damping : ndarray, shape (modes,)
        Damping ratios -Re λ / |λ|, of the sections' damping alone.
    shapes : ndarray, shape (coordinates, modes)
        Mode shapes in (body translation 3, body rotation 3, bend), without motions that have no
        stiffness; (bends, modes) for a clamped base.

    Notes
    -----
    An overdamped mode, of damping ratio 1 or more, is described by its slower root, which solves λ²
    + 2 ζ ω λ + ω² = 0. Shapes have unit norm and are real, taken at the phase where the motion is
    largest. The first significant bend is positive; of modes with equal frequency and damping, the
    first bends most along x.
    """

    frequencies: Array
    damping: Array
    shapes: Array


def modes(
    vehicle: Vehicle, q: ArrayLike | None = None, *, base: Base = "free", gravity: float = 9.81
) -> Modes:
    """Return the vibration modes about a configuration.

    Parameters
    ----------
    vehicle : Vehicle
        A vehicle with arms, or a batch, such as draws of an `UncertainVehicle`.
    q : array_like, shape (8,), optional
        Paper coordinates, at which bend moments hold the arms. Default: straight arms. Those of all
        runs of a batch.
    base : {"free", "clamped", "hovering"}, default "free"
        "hovering": carried by a constant force in world axes at B's origin, under which the vehicle
        also swings like a pendulum, and held level by a constant moment in body axes, which may
        make it flutter.
    gravity : float, optional
        Acceleration of gravity [m/s²]. It has no effect on a free base, which is in free fall.

    Returns
    -------
    Modes
        Frequencies, damping ratios and shapes.

    Raises
    ------
    InputError
        If an argument cannot be used, or the vehicle buckles, topples or flutters about `q`.

    Examples
    --------
    >>> slender = ca.load_vehicle("slender")
    >>> for base in ("clamped", "free"):
    ...     print(f"{base}: {ca.modes(slender, base=base).frequencies[0]:.1f} rad/s")
    clamped: 29.0 rad/s
    free: 47.9 rad/s
    """
    check_has_arms(check_vehicle(vehicle))
    checks.choice("base", base, get_args(Base))
    gravity = checks.gravity(gravity)
    if vehicle.runs is None:
        return _of_one(vehicle, q, base, gravity)
    found = [_of_run(vehicle, run, q, base, gravity) for run in range(vehicle.runs)]
    if len({len(each.frequencies) for each in found}) > 1:
        raise InputError(
            "vehicle",
            "holds runs with different numbers of modes",
            "give one run at a time, as in vehicle.select(0)",
        )
    return Modes(*(np.array([getattr(each, of.name) for each in found]) for of in fields(Modes)))


def _of_run(vehicle: Vehicle, run: int, q: ArrayLike | None, base: Base, gravity: float) -> Modes:
    """Return the modes of one run of a batch; its number is told with what is wrong with it."""
    try:
        return _of_one(vehicle.select(run), q, base, gravity)
    except InputError as error:
        raise error.located(f"run {run}") from None


def _of_one(vehicle: Vehicle, q: ArrayLike | None, base: Base, gravity: float) -> Modes:
    """Return the modes of one vehicle."""
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


def _bending(vehicle: Vehicle, at: Array, free: bool, gravity: float) -> tuple[Vibration, Array]:
    """Return the vibration of the bends, and shapes (coordinates or bends, modes)."""
    acting = 0.0 if free else gravity
    model: Model = "coupled" if free else "independent"
    held = holding(Engine(vehicle, "decoupled"), at[None], acting)[0][vehicle.layout.bend_moment]
    A, _ = linearize(vehicle, at, bend_moment=held, model=model, gravity=acting)
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    damping = bend_compliance(Engine(vehicle, model), at)[0] @ of_pairs(vehicle, "damping")[0]
    found = vibration(-A[rate, bend], damping, _first(vehicle), at)
    if not free:
        return found, found.shapes
    # The base follows the bend: its accelerations per acceleration of the bend.
    base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], found.shapes)
    return found, np.vstack([base_rows, found.shapes])


def _hovering(vehicle: Vehicle, at: Array, gravity: float) -> tuple[Vibration, Array]:
    """Return the vibration of a hovering vehicle, and shapes (coordinates, modes)."""
    layout = vehicle.layout
    held = holding(Engine(vehicle, "decoupled"), at[None], gravity)[0]
    inputs = {name: held[getattr(layout, name)] for name in ("force", "moment", "bend_moment")}
    A, B = linearize(vehicle, at, **inputs, gravity=gravity)
    n = len(A) // 2
    # Translation and yaw have no stiffness. Their columns of K, 0 but for rounding, would mix into
    # the shapes.
    adrift, resisted = _split(_attitude(at), n)
    K = -A[n:, :n] @ resisted
    D = B[n:, layout.bend_moment] @ of_pairs(vehicle, "damping")[0] @ resisted[6:]
    found = vibration(resisted.T @ K, resisted.T @ D, _first(vehicle), at)
    drifts = adrift.T @ (K @ found.shapes / found.roots**2 + D @ found.shapes / found.roots)
    return found, resisted @ found.shapes - adrift @ drifts


def _split(attitude: Rotation, n: int) -> tuple[Array, Array]:
    """Return orthonormal directions (n, 4) without stiffness, and the others (n, n - 4).

    In (world translation, body rotation, bend); the first are translations and yaw.
    """
    upright = np.linalg.svd(attitude.inv().apply([[0.0, 0.0, 1.0]]))[2].T
    directions = np.eye(n)
    directions[3:6, 3:6] = upright
    return directions[:, :4], directions[:, 4:]


def _attitude(at: Array) -> Rotation:
    """Return the base's attitude at paper coordinates."""
    return Rotation.from_euler("ZYX", at[[5, 4, 3]])


def _first(vehicle: Vehicle) -> Array:
    """Return numbers (bends,) that sort equal modes: along x first, and of the first sections."""
    bends = vehicle.layout.bends
    sections = enumerate(part for arm in vehicle.arms for part in arm.section)
    return np.array([
        (2.0 if component == 0 else 1.0) - index / bends
        for index, part in sections for component, _ in part.orders.coordinates
    ])  # fmt: skip
