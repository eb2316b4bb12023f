"""Linearisation, and the highest bending frequencies."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.trim import configuration
from continuair.engine.engine import Drive, Engine, Start
from continuair.flight.frequencies import fastest_frequency
from continuair.kernels.dynamics import MODELS
from continuair.typing import Array, ArrayLike, Model
from continuair.vehicle.bending import DIFFERENCE
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, TIP, Layout
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_STEPS = np.array([-2.0, -1.0, 1.0, 2.0]) * DIFFERENCE
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * DIFFERENCE)
"""Central differences of fourth order, in all coordinates and rates [m, rad, 1/m]."""


def bending_frequencies(vehicle: Vehicle, q: ArrayLike | None = None) -> tuple[float, float]:
    """Return the highest bending frequencies of the arm.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q : array_like, shape (coordinates,), optional
        Paper coordinates. Default: straight arms at the origin.

    Returns
    -------
    clamped : float
        With the base clamped [rad/s].
    free : float
        With the base free [rad/s].

    Raises
    ------
    InputError
        If `vehicle` is a batch, or `q` cannot be used.
    """
    at = configuration("q", q, check_single_vehicle(vehicle, strain=True))
    clamped, free = (
        float(fastest_frequency(Engine(vehicle, model), at).max())
        for model in ("independent", "coupled")
    )
    return clamped, free


def linearize(
    vehicle: Vehicle,
    q: ArrayLike | None = None,
    qd: ArrayLike | None = None,
    *,
    force: ArrayLike = 0.0,
    moment: ArrayLike = 0.0,
    bend_moment: ArrayLike = 0.0,
    tip_wrench: ArrayLike = 0.0,
    model: Model = "coupled",
    gravity: float = 9.81,
) -> tuple[Array, Array]:
    """Linearise the dynamics about a configuration and its rates.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).
    q, qd : array_like, shape (8,), optional
        Paper coordinates and their rates at the operating point. Default: at rest at the origin
        with straight arms. The bend must stay 0.005 1/m below a full circle.
    force : array_like, shape (3,), optional
        Force in world axes [N]. This and the three other inputs act at the operating point; those
        of hover are given by `trim`.
    moment : array_like, shape (3,), optional
        Moment in body axes [N m].
    bend_moment : array_like, shape (2,), optional
        Generalised forces conjugate to the bend vectors, two per section [N m²].
    tip_wrench : array_like, shape (6,), optional
        Force and moment at the tip in world axes, six per arm [N, N m].
    model : {"coupled", "decoupled", "independent"}, default "coupled"
        As in `simulate`.
    gravity : float, optional
        Acceleration of gravity [m/s²].

    Returns
    -------
    A : ndarray, shape (16, 16)
        With respect to position 3 (world), rotation 3 (body axes), bend 2, velocity 3 (world),
        angular velocity 3 (body) and bend rate 2. Each further section adds its bend and bend rate,
        arm by arm from the base out.
    B : ndarray, shape (16, 8)
        With respect to world force 3, body moment 3 and bend moment 2 (per section).

    Raises
    ------
    InputError
        If `vehicle` is a batch, or an argument cannot be used.

    Notes
    -----
    Central differences of fourth order. Relative errors are about 1e-9 for arms of a metre, 1e-3
    for arms of millimetres, and up to 3e-5 for arms of 50 m. Quadratic drag is not smooth at rest;
    there it appears as the linear drag that it has at 1.3 mm/s.

    Examples
    --------
    >>> A, B = ca.linearize(ca.load_vehicle("paper"))
    >>> A.shape, B.shape
    ((16, 16), (16, 8))
    """
    check_single_vehicle(vehicle, strain=True)
    checks.choice("model", model, MODELS)
    gravity = checks.gravity(gravity)
    engine = Engine(vehicle, model)
    n = engine.layout.coordinates
    at = configuration("q", q, vehicle)
    rates = np.zeros(n) if qd is None else checks.vector("qd", qd, n, or_zero=True)
    centre = state_from_paper(at[None], rates[None], engine.layout)[0]
    held = _held(engine.layout, force, moment, bend_moment, tip_wrench)

    def slopes(states: Array, inputs: Array) -> Array:
        """Return central differences of the tangents of perturbed states or inputs."""
        frozen, angles = (
            np.broadcast_to(centre, states.shape),
            np.repeat(branches_of(at[None], engine.layout), len(states), axis=0),
        )
        acting = Drive(inputs, False, GENERAL + TIP, gravity)
        rate = engine.derivative(Start(states, angles, frozen), acting)
        tangent = _tangent(rate, states, engine.layout).reshape(-1, len(_STEPS), 2 * n)
        return np.einsum("h,ihk->ki", _WEIGHTS, tangent)

    states = np.array([_perturbed(centre, i, h) for i in range(2 * n) for h in _STEPS])
    A = slopes(states, held[None, None])
    # A rotation perturbation rotates with the body's angular velocity.
    A[3:6, 3:6] -= _skew(centre[engine.layout.angular_velocity])
    inputs = np.tile(held, (n, len(_STEPS), 1))
    for i in range(n):
        inputs[i, :, i] += _STEPS
    B = slopes(np.tile(centre, (len(_STEPS) * n, 1)), inputs.reshape(1, len(_STEPS) * n, -1))
    return A, B


def _held(
    layout: Layout,
    force: ArrayLike,
    moment: ArrayLike,
    bend_moment: ArrayLike,
    tip_wrench: ArrayLike,
) -> Array:
    """Return the inputs at the operating point as a row, or raise InputError."""
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


def _skew(w: Array) -> Array:
    """Return the matrix of the cross product w × (·)."""
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def _perturbed(centre: Array, index: int, h: float) -> Array:
    """Return the state moved by h along one of the perturbations."""
    state = centre.copy()
    if 3 <= index < 6:
        turn = Rotation.from_rotvec(h * np.eye(3)[index - 3])
        attitude = Rotation.from_quat(centre[Layout.attitude])
        state[Layout.attitude] = (attitude * turn).as_quat()
    else:
        state[index if index < 3 else index + 1] += h
    return state


def _tangent(rate: Array, states: Array, layout: Layout) -> Array:
    """Return rates (n, 2 coordinates) of the perturbations from rates (n, state) of the states."""
    spin = states[:, layout.angular_velocity]
    moving = slice(layout.bend.start, layout.bend_rate.stop)
    return np.hstack([rate[:, layout.position], spin, rate[:, moving]])
