"""Accelerations of any model: in the paper's coordinates, and in regular ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive, Engine, Start, check_device
from continuair.errors import InputError, shown
from continuair.flight.prepare import check_same_runs
from continuair.kernels.dynamics import MODELS
from continuair.vehicle.arc import bend_vectors, polar_of
from continuair.vehicle.coordinates import branches_of, paper_accelerations, state_from_paper
from continuair.vehicle.layout import FIELDS, GENERAL, PAPER, TIP
from continuair.vehicle.vehicle import Vehicle, check_vehicle

_REGULAR = 1e-9
"""Smallest |cos θ| at which Euler accelerations keep some digits."""


def forward_dynamics(
    vehicle: Vehicle,
    q: Any,
    qd: Any,
    tau: Any = 0.0,
    tip_wrench: Any = 0.0,
    *,
    model: str = "coupled",
    gravity: float = 9.81,
    dtype: str = "float64",
    device: str = "cpu",
) -> np.ndarray:
    """Accelerations q̈ in the paper's coordinates, (8,) or (n, 8), through the kernels.

    q, qd: (8,) or (n, 8), for several sections 6 + 2 numbers per section; tau: generalised forces
    conjugate to q, 0 for none; tip_wrench: force and moment on the tip in world axes (6,) or (n,
    6), of several arms in turn. model, gravity, dtype, device: as in `simulate`.

    Eq. of motion, Amiri et al. ψ̈a divides by κ: |κ| below κ_s counts as κ_s (Remark 1). NaN where
    |κ| l exceeds 2π. Raises InputError, also where the coordinates are singular: at cos θ = 0, and
    at κ = 0 if κ_s is 0.
    """
    gravity = _checked(vehicle, model, gravity, dtype, device)
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
    start = Start(state_from_paper(at, rates), branches_of(at))
    rate = engine.derivative(
        start, Drive(inputs, False, GENERAL + PAPER + TIP, gravity), compiled=True
    )
    found = paper_accelerations(at, rates, rate, thresholds)
    return found if np.ndim(q) == 2 or n > 1 else found[0]


def accelerations(
    vehicle: Vehicle,
    *,
    attitude: Any = (0.0, 0.0, 0.0, 1.0),
    bend: Any = None,
    velocity: Any = None,
    angular_velocity: Any = None,
    bend_rate: Any = None,
    force: Any = None,
    moment: Any = None,
    bend_moment: Any = None,
    tip_wrench: Any = None,
    gravity: float = 9.81,
    model: str = "coupled",
    dtype: str = "float64",
    device: str = "cpu",
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Accelerations (v̇, ω̇, k̈) in coordinates without singularities, through the kernels.

    attitude: (4,) x y z w, body to world, of any length above 0. bend, bend_rate, bend_moment:
    (N, 2) over all sections, arm by arm from the base out [1/m, 1/(m s), N m²], a bend moment
    conjugate to its bend. velocity, force: (3,) of B's origin and at it, world axes.
    angular_velocity, moment: (3,), body axes. tip_wrench: (arms, 6), force and moment on each tip
    about it, world axes. gravity, dtype, device: as in `simulate`.

    What is missing is 0. All take a leading axis for a batch (n, …), as the vehicle may have runs.

    Returns v̇ = dv/dt (3,) in world axes, which is -gravity in free fall, ω̇ (3,) in body axes and k̈
    (N, 2), each with the leading axis of a batch; NaN where a section is bent beyond a full circle.
    `independent` freezes its arms as they are here. Raises InputError.
    """
    gravity = _checked(vehicle, model, gravity, dtype, device)
    layout = vehicle.layout
    per_section, per_arm = bend_vectors(np.zeros(layout.bends)).shape, (layout.arms, 6)
    given = {
        "attitude": (attitude, (4,)),
        "bend": (bend, per_section),
        "velocity": (velocity, (3,)),
        "angular_velocity": (angular_velocity, (3,)),
        "bend_rate": (bend_rate, per_section),
        "force": (force, (3,)),
        "moment": (moment, (3,)),
        "bend_moment": (bend_moment, per_section),
        "tip_wrench": (tip_wrench, per_arm),
    }
    arrays = {name: _batch_of(name, *each) for name, each in given.items()}
    lengths = np.linalg.norm(arrays["attitude"], axis=1)
    if not (lengths > 0.0).all():
        raise InputError("attitude has length 0; give a quaternion x y z w.")
    arrays["attitude"] = arrays["attitude"] / lengths[:, None]
    n = _runs(vehicle, arrays)
    states, inputs = np.zeros((n, layout.state)), np.zeros((1, n, layout.inputs))
    for name in ("attitude", "bend", "velocity", "angular_velocity", "bend_rate"):
        states[:, getattr(layout, name)] = arrays[name]
    for name in ("force", "moment", "bend_moment", "tip_wrench"):
        inputs[0, :, layout.of_input[name]] = arrays[name]
    engine = Engine(vehicle, model, dtype, device)
    # No polar torque acts, so that no branch of the bend is needed.
    start = Start(states, np.zeros((n, layout.branch_angles)))
    rate = engine.derivative(start, Drive(inputs, False, GENERAL + TIP, gravity), compiled=True)
    found = [rate[:, where] for where in (layout.velocity, layout.angular_velocity)]
    found.append(rate[:, layout.bend_rate].reshape(n, *per_section))
    alone = n == 1 and not any(np.ndim(value) > len(one) for value, one in given.values())
    v, w, k = (each[0] for each in found) if alone and vehicle.runs is None else found
    return v, w, k


def _checked(vehicle: Any, model: Any, gravity: Any, dtype: Any, device: Any) -> float:
    """The gravity; InputError for what is not known of these."""
    check_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    checks.choice("dtype", dtype, ("float64", "float32"))
    check_device(device)
    return checks.gravity(gravity)


def _runs(vehicle: Vehicle, arrays: Mapping[str, np.ndarray]) -> int:
    """How many runs there are of a vehicle and of rows; InputError where they differ."""
    sizes = {"vehicle": vehicle.runs or 1} | {name: len(rows) for name, rows in arrays.items()}
    n = max(sizes.values())
    check_same_runs(n, sizes)
    return n


def _batch_of(name: str, value: Any, one: tuple[int, ...]) -> np.ndarray:
    """Rows (n or 1, numbers) of a quantity whose value for one run has a shape; None is 0."""
    if value is None:
        return np.zeros((1, int(np.prod(one))))
    found = checks.finite_array(value)
    if (
        found is None
        or found.ndim not in (len(one), len(one) + 1)
        or found.shape[-len(one) :] != one
    ):
        raise InputError(
            f"{name} is {shown(value)}; give finite numbers of shape {one}, or with a leading axis "
            "for a batch."
        )
    return found.reshape(len(found) if found.ndim > len(one) else 1, int(np.prod(one)))


def _check_regular(q: np.ndarray, kappa_s: np.ndarray) -> None:
    """Refuse configurations at which Euler angles or polar bend have no accelerations."""
    if (np.abs(np.cos(q[:, 4])) < _REGULAR).any():
        raise InputError(
            "q holds a pitch of a quarter turn, where roll and yaw have no accelerations; give "
            "another pitch, or simulate, whose state has no singularity."
        )
    if ((polar_of(q)[0] == 0.0) & (kappa_s == 0.0)).any():
        raise InputError(
            "q holds a bend of 0 while its kappa_s is 0, where psi_a has no acceleration; give a "
            "bend, or a kappa_s above 0."
        )
