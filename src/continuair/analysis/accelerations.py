"""Accelerations of any model at a configuration, in the paper's coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair import checks
from continuair.engine.engine import Drive, Engine, Start, check_device
from continuair.errors import InputError
from continuair.flight.prepare import check_same_runs
from continuair.kernels.dynamics import MODELS
from continuair.vehicle.coordinates import paper_accelerations, state_from_paper
from continuair.vehicle.layout import FIELDS, GENERAL, PAPER, TIP, Layout
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

    q, qd: (8,) or (n, 8); tau: generalised forces (8,) or (n, 8), 0 for none; tip_wrench: force
    and moment on the tip in world axes (6,) or (n, 6). ψ̈a divides by κ: |κ| below κ_s counts as
    κ_s (Remark 1). NaN where |κ| l exceeds 2π. dtype, device: as in `simulate`. Eq. of motion,
    Amiri et al. Raises InputError, also where the coordinates are singular: at cos θ = 0, and at
    κ = 0 if κ_s is 0.
    """
    check_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    checks.choice("dtype", dtype, ("float64", "float32"))
    check_device(device)
    gravity = checks.gravity(gravity)
    layout = Layout(vehicle.shape)
    arrays = {
        name: checks.rows(name, value, width)
        for name, value, width in (
            ("q", q, layout.coordinates),
            ("qd", qd, layout.coordinates),
            ("tau", tau, layout.coordinates),
            ("tip_wrench", tip_wrench, 6),
        )
    }
    sizes = {"vehicle": vehicle.runs or 1} | {name: len(rows) for name, rows in arrays.items()}
    n = max(sizes.values())
    check_same_runs(n, sizes)
    _check_regular(arrays["q"], vehicle.arm.kappa_s)
    at, rates = (np.broadcast_to(arrays[name], (n, layout.coordinates)) for name in ("q", "qd"))
    inputs = np.zeros((1, n, layout.inputs))
    for field in ("tau", "tip_wrench"):
        layout.add(inputs, FIELDS[field], arrays[field])
    engine = Engine(vehicle, model, dtype, device)
    start = Start(state_from_paper(at, rates), at[:, 7::2])
    rate = engine.derivative(start, Drive(inputs, False, GENERAL + PAPER + TIP, gravity))
    accelerations = paper_accelerations(at, rates, rate, vehicle.arm.kappa_s)
    return accelerations if np.ndim(q) == 2 or n > 1 else accelerations[0]


def _check_regular(q: np.ndarray, kappa_s: Any) -> None:
    """Refuse configurations at which Euler angles or polar bend have no accelerations."""
    if (np.abs(np.cos(q[:, 4])) < _REGULAR).any():
        raise InputError(
            "q holds a pitch of a quarter turn, where roll and yaw have no accelerations; give "
            "another pitch, or simulate, whose state has no singularity."
        )
    if ((q[:, 6] == 0.0) & (np.asarray(kappa_s) == 0.0)).any():
        raise InputError(
            "q holds a bend of 0 while arm.kappa_s is 0, where psi_a has no acceleration; give a "
            "bend, or a kappa_s above 0."
        )
