"""Linearisation, and the fastest bending frequencies."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.trim import configuration
from continuair.engine.engine import Drive, Engine, Start
from continuair.flight.frequencies import fastest_frequency
from continuair.kernels.dynamics import MODELS
from continuair.vehicle.bending import DIFFERENCE
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, TIP, Layout
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_STEPS = np.array([-2.0, -1.0, 1.0, 2.0]) * DIFFERENCE
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * DIFFERENCE)
"""Central differences of fourth order, in all coordinates and rates [m, rad, 1/m]."""


def bending_frequencies(vehicle: Vehicle, q: Any = None) -> tuple[float, float]:
    """Highest bending frequency [rad/s] of the arm, clamped and on the free vehicle.

    q: paper coordinates (coordinates,), straight arms by default. Raises InputError.
    """
    at = configuration("q", q, check_single_vehicle(vehicle))
    clamped, free = (
        float(fastest_frequency(Engine(vehicle, model), at).max())
        for model in ("independent", "coupled")
    )
    return clamped, free


def linearize(
    vehicle: Vehicle,
    q: Any = None,
    qd: Any = None,
    *,
    force: Any = 0.0,
    moment: Any = 0.0,
    bend_moment: Any = 0.0,
    tip_wrench: Any = 0.0,
    model: str = "coupled",
    gravity: float = 9.81,
) -> tuple[np.ndarray, np.ndarray]:
    """A (16, 16) and B (16, 8) of the dynamics about a configuration and its rates.

    Perturbations: position 3 (world), rotation 3 (body axes), bend 2, velocity 3 (world), angular
    velocity 3 (body), bend rate 2; inputs: world force 3, body moment 3, bend moment 2. Of several
    sections each has its 2, arm by arm from the base out, and each arm a tip_wrench. The four
    inputs given, a hover's from `trim`, hold at the operating point. Central differences of fourth
    order: about 1e-9 relative for arms of a metre, 1e-3 for arms of millimetres, up to 3e-5 for
    arms of 50 m; quadratic drag at rest, where it is not smooth, comes out as a linear one of 1.3
    mm/s of it in place of none. The bend must leave room for them below a full circle, 0.005 1/m.
    Raises InputError.
    """
    check_single_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    gravity = checks.gravity(gravity)
    engine = Engine(vehicle, model)
    n = engine.layout.coordinates
    at = configuration("q", q, vehicle)
    rates = np.zeros(n) if qd is None else checks.vector("qd", qd, n, or_zero=True)
    centre = state_from_paper(at[None], rates[None])[0]
    held = _held(engine.layout, force, moment, bend_moment, tip_wrench)

    def slopes(states: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        frozen, angles = (
            np.broadcast_to(centre, states.shape),
            np.repeat(branches_of(at[None]), len(states), axis=0),
        )
        acting = Drive(inputs, False, GENERAL + TIP, gravity)
        rate = engine.derivative(Start(states, angles, frozen), acting)
        tangent = _tangent(rate, states, engine.layout).reshape(-1, len(_STEPS), 2 * n)
        return np.einsum("h,ihk->ki", _WEIGHTS, tangent)

    states = np.array([_perturbed(centre, i, h) for i in range(2 * n) for h in _STEPS])
    A = slopes(states, held[None, None])
    # A rotation perturbation is carried round by the body's own spin.
    A[3:6, 3:6] -= _skew(centre[engine.layout.angular_velocity])
    pushed = np.tile(held, (n, len(_STEPS), 1))
    for i in range(n):
        pushed[i, :, i] += _STEPS
    B = slopes(np.tile(centre, (len(_STEPS) * n, 1)), pushed.reshape(1, len(_STEPS) * n, -1))
    return A, B


def _held(layout: Layout, force: Any, moment: Any, bend_moment: Any, tip_wrench: Any) -> np.ndarray:
    """A row of inputs, or InputError."""
    inputs = np.zeros(layout.inputs)
    inputs[layout.force] = checks.vector("force", force, 3, or_zero=True)
    inputs[layout.moment] = checks.vector("moment", moment, 3, or_zero=True)
    inputs[layout.bend_moment] = checks.vector(
        "bend_moment", bend_moment, layout.bends, or_zero=True
    )
    inputs[layout.tip_wrench] = checks.vector(
        "tip_wrench", tip_wrench, 6 * layout.arms, or_zero=True
    )
    return inputs


def _skew(w: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def _perturbed(centre: np.ndarray, index: int, h: float) -> np.ndarray:
    """The state moved by h along one of the perturbations."""
    state = centre.copy()
    if 3 <= index < 6:
        turn = Rotation.from_rotvec(h * np.eye(3)[index - 3])
        attitude = Rotation.from_quat(centre[Layout.attitude])
        state[Layout.attitude] = (attitude * turn).as_quat()
    else:
        state[index if index < 3 else index + 1] += h
    return state


def _tangent(rate: np.ndarray, states: np.ndarray, layout: Layout) -> np.ndarray:
    """Rates (n, 2 coordinates) of the perturbations from rates (n, state) of the states."""
    spin = states[:, layout.angular_velocity]
    moving = slice(layout.bend.start, layout.bend_rate.stop)
    return np.hstack([rate[:, layout.position], spin, rate[:, moving]])
