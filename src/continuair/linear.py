"""Bending frequencies, automatic step, and (below) trim, linearisation and modes."""

from __future__ import annotations

import numpy as np

from continuair.coordinates import state_from_paper
from continuair.kernels.dynamics import GENERAL, INPUTS
from continuair.kernels.engine import Engine
from continuair.vehicle import Vehicle

STEP_PHASE = 0.2
"""Largest ω_max h of the automatic step: RK4 then keeps the amplitude of the stiffest mode."""


def bend_compliance(vehicle: Vehicle, q: np.ndarray, model="coupled", device="cpu") -> np.ndarray:
    """Bend block of M⁻¹ in bend axes, (runs, 2, 2) [1/(kg m⁴)], at rest in the configurations q.

    It is the acceleration of the bend under a unit bend moment: for `coupled` on the free base,
    for `independent` on a clamped one.
    """
    q = np.atleast_2d(q)
    runs = max(len(q), vehicle.runs or 1)
    q = np.broadcast_to(q, (runs, 8))
    states = state_from_paper(q, np.zeros((runs, 8)))
    engine = Engine(vehicle, model, device=device)
    columns = []
    for axis in (None, 6, 7):
        inputs = np.zeros((1, 1, INPUTS))
        if axis is not None:
            inputs[0, 0, axis] = 1.0
        columns.append(engine.derivative(states, q[:, 7], inputs, 0.0, GENERAL)[:, 15:17])
    return np.stack([columns[1] - columns[0], columns[2] - columns[0]], axis=-1)


def bending_frequencies(vehicle: Vehicle, q=None) -> tuple[float, float]:
    """Highest bending frequency [rad/s] of the arm, clamped and on the free vehicle.

    q: paper coordinates (8,), the straight arm by default.
    """
    at = np.zeros(8) if q is None else np.asarray(q, float)
    clamped, free = (
        float(fastest_frequency(vehicle, at, model).max()) for model in ("independent", "coupled")
    )
    return clamped, free


def fastest_frequency(vehicle: Vehicle, q, model="coupled", device="cpu") -> np.ndarray:
    """ω_max (runs,) [rad/s] from the pencil (K, M) at q: the largest √eig(E I l [M⁻¹]_bend)."""
    compliance = bend_compliance(vehicle, q, model, device)
    stiffness = np.asarray(vehicle.arm.bending_stiffness) * np.asarray(vehicle.arm.length)
    largest = np.linalg.eigvalsh(0.5 * (compliance + compliance.swapaxes(1, 2)))[:, -1]
    return np.sqrt(largest * stiffness)


def automatic_step(vehicle: Vehicle, q, device="cpu") -> float:
    """Step [s] with ω_max h = 0.2 for the stiffest run, straight and at the initial bends."""
    q = np.atleast_2d(q)
    straight = np.array(q)
    straight[:, 6] = 0.0
    fastest = max(fastest_frequency(vehicle, at, "coupled", device).max() for at in (q, straight))
    return float(STEP_PHASE / fastest)
