"""Bending frequencies, automatic step, and (below) trim, linearisation and modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.coordinates import state_from_paper
from continuair.errors import InputError, shown
from continuair.kernels.engine import Engine
from continuair.kernels.loads import GENERAL, TIP
from continuair.layout import Layout
from continuair.vehicle import Vehicle

STEP_PHASE = 0.2
"""Largest ω_max h of the automatic step: RK4 then keeps the amplitude of the stiffest mode."""


def bend_compliance(engine: Engine, q: Any) -> np.ndarray:
    """Bend block of M⁻¹, (runs, bends, bends) [1/(kg m⁴)], at rest in the configurations q.

    It is the acceleration of the bend under a unit bend moment: for an engine of `coupled` on the
    free base, for one of `independent` on a clamped one.
    """
    q = np.atleast_2d(q)
    runs = max(len(q), engine.vehicle.runs or 1)
    layout = engine.layout
    q = np.broadcast_to(q, (runs, layout.coordinates))
    states = state_from_paper(q, np.zeros(q.shape))

    def pushed(bend_moment: Any) -> np.ndarray:
        inputs = np.zeros((1, 1, layout.inputs))
        inputs[..., layout.bend_moment] = bend_moment
        return engine.derivative(states, q[:, -1], inputs, 0.0, GENERAL)[:, layout.bend_rate]

    still = pushed(0.0)
    return np.stack([pushed(unit) - still for unit in np.eye(layout.bends)], axis=-1)


def bending_frequencies(vehicle: Vehicle, q: Any = None) -> tuple[float, float]:
    """Highest bending frequency [rad/s] of the arm, clamped and on the free vehicle.

    q: paper coordinates (8,), the straight arm by default. Raises InputError.
    """
    at = _configuration(q, Layout(vehicle.sections).coordinates)
    clamped, free = (
        float(fastest_frequency(Engine(vehicle, model), at).max())
        for model in ("independent", "coupled")
    )
    return clamped, free


def fastest_frequency(engine: Engine, q: Any) -> np.ndarray:
    """ω_max (runs,) [rad/s] from the pencil (K, M) at q: the largest √eig(E I l [M⁻¹]_bend)."""
    arm = engine.vehicle.arm
    compliance = bend_compliance(engine, q)
    stiffness = np.asarray(arm.bending_stiffness) * np.asarray(arm.length)
    largest = np.linalg.eigvalsh(0.5 * (compliance + compliance.swapaxes(1, 2)))[:, -1]
    return np.sqrt(largest * stiffness)


def automatic_step(coupled: Engine, q: Any) -> float:
    """Step [s] with ω_max h = 0.2 for the stiffest run, straight and at the initial bends.

    coupled: an engine of the coupled model, whose free base raises the frequencies most.
    """
    q = np.atleast_2d(q)
    straight = np.array(q)
    straight[:, 6::2] = 0.0
    # A run that starts bent past a full circle has no frequency; it ends with a status.
    found = np.concatenate([fastest_frequency(coupled, at) for at in (straight, q)])
    if not np.isfinite(found).any():
        raise InputError(
            "vehicle has no finite bending frequency: its arm is too heavy or too "
            "soft beside its UAV; check arm.length, arm.radius and uav.mass."
        )
    return float(STEP_PHASE / np.nanmax(found))


@dataclass(frozen=True)
class Modes:
    """Vibration about a configuration: frequencies [rad/s] ascending, damping ratios, shapes.

    shapes: (coordinates, modes) in (body translation 3, body rotation 3, bend) for a free base,
    rigid-body modes left out; (bends, modes) for a clamped one. Columns have unit norm.
    """

    frequencies: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray


def modes(vehicle: Vehicle, q: Any = None, *, base: str = "free", gravity: float = 9.81) -> Modes:
    """Bending modes of the arm at rest in the configuration q, on a free or clamped base.

    q: paper coordinates (8,), the straight arm by default. The stiffness is that of the arm and,
    for a clamped base, of gravity, which a free base in free fall does not feel. InputError.
    """
    if base not in ("free", "clamped"):
        raise InputError(f"base is {shown(base)}; use 'free' or 'clamped'.")
    at = _configuration(q, Layout(vehicle.sections).coordinates)
    free = base == "free"
    A, _ = linearize(
        vehicle, at, model="coupled" if free else "independent", gravity=0.0 if free else gravity
    )
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    compliance = bend_compliance(Engine(vehicle, "coupled" if free else "independent"), at)[0]
    stiffness = -A[rate, bend]
    eigenvalues, vectors = np.linalg.eig(stiffness)
    order = np.argsort(eigenvalues.real)
    frequencies = np.sqrt(eigenvalues.real[order])
    shapes = vectors.real[:, order]
    d = vehicle.arm.structural_damping * vehicle.arm.length
    modal = np.linalg.solve(compliance, shapes)
    mass = np.einsum("im,im->m", shapes, modal)
    damping = d * np.einsum("im,im->m", shapes, shapes) / (2.0 * frequencies * mass)
    if free:
        # The base follows the bend: its accelerations per acceleration of the bend.
        base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], shapes)
        shapes = np.vstack([base_rows, shapes])
    return Modes(frequencies, damping, shapes / np.linalg.norm(shapes, axis=0))


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
    velocity 3 (body), bend rate 2; inputs: world force 3, body moment 3, bend moment 2. The four
    inputs given, a hover's from `trim`, hold at the operating point. Central differences of fourth
    order: about 1e-9 relative. Raises InputError.
    """
    _check_single(vehicle)
    if model not in ("coupled", "decoupled", "independent"):
        raise InputError(f"model is {shown(model)}; use coupled, decoupled or independent.")
    layout = Layout(vehicle.sections)
    n = layout.coordinates
    at, rates = _configuration(q, n), _configuration(qd, n)
    centre = state_from_paper(at[None], rates[None])[0]
    steps = np.array([-2.0, -1.0, 1.0, 2.0]) * _DIFFERENCE
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * _DIFFERENCE)
    inputs = np.zeros(layout.inputs)
    inputs[layout.force] = _numbers("force", force, 3)
    inputs[layout.moment] = _numbers("moment", moment, 3)
    inputs[layout.bend_moment] = _numbers("bend_moment", bend_moment, layout.bends)
    inputs[layout.tip_wrench] = _numbers("tip_wrench", tip_wrench, 6)
    states = np.array([_perturbed(centre, i, h) for i in range(2 * n) for h in steps])
    engine = Engine(vehicle, model)

    def differences(states: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        rate = engine.derivative(
            states,
            np.full(len(states), at[-1]),
            inputs,
            gravity,
            GENERAL + TIP,
            np.broadcast_to(centre, states.shape),
        )
        return np.einsum("h,ihk->ki", weights, _tangent(rate, states, layout).reshape(-1, 4, 2 * n))

    A = differences(states, inputs[None, None])
    # A rotation perturbation is carried round by the body's own spin.
    A[3:6, 3:6] -= _skew(centre[layout.angular_velocity])
    pushed = np.tile(inputs, (n, 4, 1))
    for i in range(n):
        pushed[i, :, i] += steps
    B = differences(np.tile(centre, (4 * n, 1)), pushed.reshape(1, 4 * n, -1))
    return A, B


@dataclass(frozen=True)
class Trim:
    """A hovering equilibrium: paper coordinates q (8,) and the inputs that hold it.

    force [N, world], moment [N m, body, about B's origin], bend_moment [N m²].
    """

    q: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    bend_moment: np.ndarray


def trim(
    vehicle: Vehicle,
    *,
    bend: Any = None,
    yaw: float = 0.0,
    position: Any = (0.0, 0.0, 0.0),
    tip_wrench: Any = 0.0,
    gravity: float = 9.81,
) -> Trim:
    """Hover with level base: the inputs that make every acceleration zero.

    bend: bend vector (2,) [1/m] to hold, or None for the bend that the arm takes by itself under
    gravity and tip_wrench (6,) [N, N m, world axes], with no bend moment. Raises InputError.
    """
    _check_single(vehicle)
    yaw, position = float(_numbers("yaw", yaw, 1)[0]), _numbers("position", position, 3)
    tip_wrench = _numbers("tip_wrench", tip_wrench, 6)
    engine = Engine(vehicle, "decoupled")
    layout = engine.layout

    def residual(k: np.ndarray) -> np.ndarray:
        """Force on each bend coordinate, world force and body moment left over at bend k."""
        state = np.zeros((1, layout.state))
        state[0, layout.attitude] = 0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
        state[0, layout.bend] = k
        inputs = np.zeros((1 + layout.bends, 1, 1, layout.inputs))
        inputs[..., layout.tip_wrench] = tip_wrench
        inputs[1:, 0, 0, layout.bend_moment] = np.eye(layout.bends)
        rows = [
            engine.derivative(state, np.zeros(1), row, gravity, GENERAL + TIP)[0, layout.bend_rate]
            for row in inputs
        ]
        compliance = np.column_stack([row - rows[0] for row in rows[1:]])
        return np.linalg.solve(compliance, rows[0])

    if bend is None:
        # Slow to import, and every simulation imports this module.
        from scipy.optimize import root

        solution = root(residual, np.zeros(layout.bends), tol=1e-13)
        k = solution.x
        if np.abs(residual(k)).max() > 1e-8 * max(1.0, np.abs(tip_wrench).max()):
            raise InputError(
                "tip_wrench leaves the arm no equilibrium below a full circle; give "
                "a smaller wrench, or the bend to hold."
            )
    else:
        k = _numbers("bend", bend, layout.bends)
    q = np.concatenate([position, [0.0, 0.0, yaw], [np.hypot(*k), np.arctan2(k[1], k[0])]])
    A_force = _balance(engine, q, tip_wrench, gravity)
    return Trim(q, A_force[:3], A_force[3:], -residual(k) if bend is not None else 0.0 * k)


def _balance(engine: Engine, q: np.ndarray, tip_wrench: Any, gravity: float) -> np.ndarray:
    """World force and body moment that leave the base without acceleration."""
    layout = engine.layout
    state = np.repeat(state_from_paper(q[None], np.zeros((1, len(q)))), 7, axis=0)
    inputs = np.zeros((1, 7, layout.inputs))
    inputs[..., layout.tip_wrench] = tip_wrench
    inputs[0, 1:, :6] = np.eye(6)
    rate = engine.derivative(state, np.full(7, q[-1]), inputs, gravity, GENERAL + TIP)
    rate = np.hstack([rate[:, layout.velocity], rate[:, layout.angular_velocity]])
    return np.linalg.solve((rate[1:] - rate[0]).T, -rate[0])


_DIFFERENCE = 2e-3


def _configuration(q: Any, width: int) -> np.ndarray:
    return np.zeros(width) if q is None else _numbers("q or qd", q, width)


def _numbers(name: str, value: Any, width: int) -> np.ndarray:
    """One number for all, or `width` of them, as an array (width,)."""
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.array([np.nan])
    if found.shape not in ((), (width,)) or not np.isfinite(found).all():
        raise InputError(f"{name} is {shown(value)}; give {width} finite numbers.")
    return np.broadcast_to(found, width).copy()


def _check_single(vehicle: Vehicle) -> None:
    if vehicle.runs is not None:
        raise InputError(
            f"vehicle holds {vehicle.runs} runs, but one is looked at here; use vehicle.select(i)."
        )


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
    return np.hstack([rate[:, layout.position], spin, rate[:, layout.attitude.stop :]])
