"""Accelerations of a model, in the paper's coordinates and in regular ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive, Engine, Start, check_device
from continuair.errors import InputError, shown
from continuair.flight.prepare import check_same_runs
from continuair.kernels.dynamics import MODELS
from continuair.typing import Array, ArrayLike, Model
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.coordinates import branches_of, paper_accelerations, state_from_paper
from continuair.vehicle.layout import FIELDS, GENERAL, PAPER, TIP
from continuair.vehicle.vehicle import Vehicle, check_arcs, check_vehicle

_REGULAR = 1e-9
"""Smallest |cos θ| at which Euler accelerations keep significant digits."""


def forward_dynamics(
    vehicle: Vehicle,
    q: ArrayLike,
    qd: ArrayLike,
    tau: ArrayLike = 0.0,
    tip_wrench: ArrayLike = 0.0,
    *,
    model: Model = "coupled",
    gravity: float = 9.81,
    dtype: Literal["float64", "float32"] = "float64",
    device: str = "cpu",
) -> Array:
    """Return the accelerations q̈ in the paper's coordinates.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    q, qd : array_like, shape (8,) or (n, 8)
        Paper coordinates and their rates [m, rad, 1/m, rad; per s]. Of N sections, 6 + 2 N numbers.
    tau : array_like, shape (8,) or (n, 8), optional
        Generalised forces conjugate to q [N, N m, N m², N m]; 0 for none.
    tip_wrench : array_like, shape (6,) or (n, 6), optional
        Force and moment on the tip in world axes [N, N m], six per arm; 0 for none.
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        As in `simulate`.
    gravity : float, optional
        Acceleration of gravity, along -z of the world [m/s²].
    dtype : {"float64", "float32"}, default "float64"
        Precision of the computation.
    device : str, optional
        "cpu" or a CUDA device.

    Returns
    -------
    ndarray, shape (8,) or (n, 8)
        Accelerations [m/s², rad/s², 1/(m s²), rad/s²]. NaN where |κ| l exceeds 2π.

    Raises
    ------
    InputError
        If an argument cannot be used, or the coordinates are singular: at cos θ = 0, and at κ = 0
        if κ_s is 0.

    Notes
    -----
    Eq. of motion, Amiri et al. (2026). ψ̈a is divided by κ: |κ| below κ_s counts as κ_s (Remark 1).
    """
    gravity = _checked(vehicle, model, gravity, dtype, device)
    check_arcs(vehicle)
    layout = vehicle.layout
    arrays = {
        name: checks.rows(name, value, width)
        for name, value, width in (
            ("q", q, layout.coordinates),
            ("qd", qd, layout.coordinates),
            ("tau", tau, layout.coordinates),
            ("tip_wrench", tip_wrench, 6 * layout.arms),
        )
    }
    n = _runs(vehicle, arrays)
    thresholds = vehicle.kappa_s
    _check_regular(arrays["q"], thresholds)
    at, rates = (np.broadcast_to(arrays[name], (n, layout.coordinates)) for name in ("q", "qd"))
    inputs = np.zeros((1, n, layout.inputs))
    for field in ("tau", "tip_wrench"):
        layout.add(inputs, FIELDS[field], arrays[field])
    engine = Engine(vehicle, model, dtype, device)
    start = Start(state_from_paper(at, rates, layout), branches_of(at, layout))
    rate = engine.derivative(
        start, Drive(inputs, False, GENERAL + PAPER + TIP, gravity), compiled=True
    )
    found = paper_accelerations(at, rates, rate, thresholds, layout)
    return found if np.ndim(q) == 2 or n > 1 else found[0]


def accelerations(
    vehicle: Vehicle,
    *,
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    bend: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    angular_velocity: ArrayLike | None = None,
    bend_rate: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    bend_moment: ArrayLike | None = None,
    tip_wrench: ArrayLike | None = None,
    strain: ArrayLike | None = None,
    strain_rate: ArrayLike | None = None,
    strain_force: ArrayLike | None = None,
    gravity: float = 9.81,
    model: Model = "coupled",
    dtype: Literal["float64", "float32"] = "float64",
    device: str = "cpu",
) -> tuple[Array, Array, Array]:
    """Return the accelerations (v̇, ω̇, k̈) in coordinates without singularities.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle, or a batch.
    attitude : array_like, shape (4,), optional
        Quaternion x y z w, body to world, of any length above 0.
    bend : array_like, shape (N, 2), optional
        Bend vectors of all sections, arm by arm from the base out [1/m].
    velocity : array_like, shape (3,), optional
        Velocity of B's origin in world axes [m/s].
    angular_velocity : array_like, shape (3,), optional
        Angular velocity in body axes [rad/s].
    bend_rate : array_like, shape (N, 2), optional
        Rates of the bend vectors [1/(m s)].
    force : array_like, shape (3,), optional
        Force at B's origin in world axes [N].
    moment : array_like, shape (3,), optional
        Moment in body axes [N m].
    bend_moment : array_like, shape (N, 2), optional
        Generalised forces conjugate to the bend vectors [N m²].
    tip_wrench : array_like, shape (arms, 6), optional
        Force on each tip and moment about it, in world axes [N, N m].
    strain : array_like, shape (M,), optional
        Coordinates of all sections, in place of `bend` for arms with a section whose strain varies:
        arm by arm, section by section, in a section by component (bend x, bend y, twist, stretch,
        shear x, shear y; those that it has), in a component by order of the Legendre polynomial
        [1/m; stretch and shear: -].
    strain_rate : array_like, shape (M,), optional
        Rates of `strain`.
    strain_force : array_like, shape (M,), optional
        Generalised forces conjugate to `strain` [N m²; stretch and shear: N m].
    gravity : float, optional
        Acceleration of gravity, along -z of the world [m/s²].
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        As in `simulate`. In "independent", the arms are frozen at these bends.
    dtype : {"float64", "float32"}, default "float64"
        Precision of the computation.
    device : str, optional
        "cpu" or a CUDA device.

    Returns
    -------
    v_dot : ndarray, shape (3,)
        Acceleration dv/dt of B's origin in world axes [m/s²]; -gravity in free fall.
    omega_dot : ndarray, shape (3,)
        Angular acceleration in body axes [rad/s²].
    k_dot_dot : ndarray, shape (N, 2) or (M,)
        Second derivatives of the bend vectors [1/(m s²)], or of `strain`.

    Raises
    ------
    InputError
        If an argument cannot be used.

    Notes
    -----
    Missing quantities are 0. All quantities may have a leading axis (n,) for a batch, and then so
    do the results. Results are NaN where a section is bent beyond a full circle.
    """
    gravity = _checked(vehicle, model, gravity, dtype, device)
    layout = vehicle.layout
    arcs, per_arm = not layout.strains, (layout.arms, 6)
    per_section = bend_vectors(np.zeros(layout.bends)).shape if arcs else (layout.bends,)
    of_arcs = {"bend": bend, "bend_rate": bend_rate, "bend_moment": bend_moment}
    of_strain = {"strain": strain, "strain_rate": strain_rate, "strain_force": strain_force}
    _check_unused(of_strain if arcs else of_arcs, of_arcs if arcs else of_strain)
    used = dict(zip(of_arcs, (of_arcs if arcs else of_strain).items(), strict=True))
    given: dict[str, tuple[Any, tuple[int, ...]]] = {
        "attitude": (attitude, (4,)),
        "velocity": (velocity, (3,)),
        "angular_velocity": (angular_velocity, (3,)),
        "force": (force, (3,)),
        "moment": (moment, (3,)),
        "tip_wrench": (tip_wrench, per_arm),
    }
    given |= {name: (value, per_section) for name, value in used.values()}
    arrays = {name: _batch_of(name, *each) for name, each in given.items()}
    lengths = np.linalg.norm(arrays["attitude"], axis=1)
    if not (lengths > 0.0).all():
        raise InputError("attitude", "has length 0", "give a quaternion x y z w")
    arrays["attitude"] = arrays["attitude"] / lengths[:, None]
    n = _runs(vehicle, arrays)
    states, inputs = np.zeros((n, layout.state)), np.zeros((1, n, layout.inputs))
    arrays |= {column: arrays[name] for column, (name, _) in used.items()}
    for name in ("attitude", "bend", "velocity", "angular_velocity", "bend_rate"):
        states[:, getattr(layout, name)] = arrays[name]
    for name in ("force", "moment", "bend_moment", "tip_wrench"):
        inputs[0, :, layout.of_input[name]] = arrays[name]
    engine = Engine(vehicle, model, dtype, device)
    # No polar torque acts, so the sign of the bend direction is not needed.
    start = Start(states, np.zeros((n, layout.branch_angles)))
    rate = engine.derivative(start, Drive(inputs, False, GENERAL + TIP, gravity), compiled=True)
    found = [rate[:, where] for where in (layout.velocity, layout.angular_velocity)]
    found.append(rate[:, layout.bend_rate].reshape(n, *per_section))
    alone = n == 1 and not any(np.ndim(value) > len(one) for value, one in given.values())
    v, w, k = (each[0] for each in found) if alone and vehicle.runs is None else found
    return v, w, k


def _check_unused(others: Mapping[str, Any], used: Mapping[str, Any]) -> None:
    """Raise InputError for coordinates of arcs given for strain fields, or the other way round."""
    for (name, value), instead in zip(others.items(), used, strict=True):
        if value is not None:
            raise InputError(
                name, "does not describe the sections of this vehicle", f"give {instead} instead"
            )


def _checked(vehicle: Any, model: Any, gravity: Any, dtype: Any, device: Any) -> float:
    """Return the gravity, or raise InputError for an unknown option."""
    check_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    checks.choice("dtype", dtype, ("float64", "float32"))
    check_device(device)
    return checks.gravity(gravity)


def _runs(vehicle: Vehicle, arrays: Mapping[str, Array]) -> int:
    """Return the number of runs of a vehicle and of rows, or raise InputError if they differ."""
    sizes = {"vehicle": vehicle.runs or 1} | {name: len(rows) for name, rows in arrays.items()}
    n = max(sizes.values())
    check_same_runs(n, sizes)
    return n


def _batch_of(name: str, value: Any, one: tuple[int, ...]) -> Array:
    """Return rows (n or 1, numbers) of a quantity with a shape per run; None is 0."""
    if value is None:
        return np.zeros((1, int(np.prod(one))))
    found = checks.finite_array(value)
    if (
        found is None
        or found.ndim not in (len(one), len(one) + 1)
        or found.shape[-len(one) :] != one
    ):
        raise InputError(
            name,
            f"is {shown(value)}",
            f"give finite numbers of shape {one}, or with a leading axis for a batch",
        )
    return found.reshape(len(found) if found.ndim > len(one) else 1, int(np.prod(one)))


def _check_regular(q: Array, kappa_s: Array) -> None:
    """Raise InputError where Euler angles or the polar bend have no accelerations."""
    if (np.abs(np.cos(q[:, 4])) < _REGULAR).any():
        raise InputError(
            "q",
            "has a pitch of ±π/2, where roll and yaw have no accelerations",
            "give another pitch, or use accelerations",
        )
    if ((polar_of(q)[0] == 0.0) & (kappa_s == 0.0)).any():
        raise InputError(
            "q",
            "has a bend of 0 while kappa_s is 0, where psi_a has no acceleration",
            "give a bend, or a kappa_s above 0",
        )
