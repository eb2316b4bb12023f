"""Trim, linearisation, bending frequencies and modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.engine.engine import Drive, Engine, Start
from continuair.errors import InputError, shown
from continuair.flight.steps import bend_compliance, fastest_frequency
from continuair.kernels.dynamics import MODELS
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, TIP, Layout
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_DIFFERENCE = 2e-3
_STEPS = np.array([-2.0, -1.0, 1.0, 2.0]) * _DIFFERENCE
_WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * _DIFFERENCE)
"""Central differences of fourth order."""

_ROOM = 2.5 * _DIFFERENCE
"""What a bend leaves below a full circle [1/m], so that its differences are still inside."""
_BALANCED = 1e-9
"""Share of E I that a bend moment may be off where an arm is in balance."""
_STARTS = np.array(
    [[0.0, 0.0]]
    + [[r * np.cos(a), r * np.sin(a)] for r in (0.5, 2.0) for a in np.arange(8) * np.pi / 4.0]
)
"""Bends times the length from which a balance is looked for: straight, and all round."""
_EQUAL = 1e-6
"""Squares of frequencies that differ by less than this share are those of modes alike."""
_COUNTS = 0.1
"""A bend of a mode counts from this share of its largest; no symmetry makes just this share."""


def bending_frequencies(vehicle: Vehicle, q: Any = None) -> tuple[float, float]:
    """Highest bending frequency [rad/s] of the arm, clamped and on the free vehicle.

    q: paper coordinates (coordinates,), straight arms by default. Raises InputError.
    """
    at = _configuration("q", q, check_single_vehicle(vehicle))
    clamped, free = (
        float(fastest_frequency(Engine(vehicle, model), at).max())
        for model in ("independent", "coupled")
    )
    return clamped, free


@dataclass(frozen=True)
class Modes:
    """Vibration about a configuration: frequencies [rad/s] ascending, damping ratios, shapes.

    shapes: (coordinates, modes) in (body translation 3, body rotation 3, bend) for a free base,
    rigid-body modes left out; (bends, modes) for a clamped one. Columns have unit norm; the first
    bend that counts is positive, and of modes of one frequency the first bends most along x.
    """

    frequencies: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray


def modes(vehicle: Vehicle, q: Any = None, *, base: str = "free", gravity: float = 9.81) -> Modes:
    """Bending modes of the arm about the configuration q, on a free or clamped base.

    q: paper coordinates (8,), the straight arm by default; a bend moment holds the arm there. The
    stiffness is that of the arm and, for a clamped base, of gravity, which a free base in free fall
    does not feel. Raises InputError, also where the arm is buckled and does not vibrate about q.
    """
    check_single_vehicle(vehicle)
    checks.choice("base", base, ("free", "clamped"))
    gravity = checks.gravity(gravity)
    at = _configuration("q", q, vehicle)
    free = base == "free"
    felt = 0.0 if free else gravity
    held = _holding(vehicle, at[None], felt)[0][Layout(vehicle.shape).bend_moment]
    A, _ = linearize(
        vehicle, at, bend_moment=held, model="coupled" if free else "independent", gravity=felt
    )
    n = len(A) // 2
    base_rate, bend, rate = slice(n, n + 6), slice(6, n), slice(n + 6, 2 * n)
    compliance = bend_compliance(Engine(vehicle, "coupled" if free else "independent"), at)[0]
    stiffness = -A[rate, bend]
    squares, shapes = _eigenmodes(stiffness)
    if not (squares > 0.0).all():
        raise InputError(
            f"q is {shown(at)}, about which the arm does not vibrate but buckles; give a "
            "configuration near a stable balance (a hanging arm, less gravity or a stiffer arm)."
        )
    frequencies = np.sqrt(squares)
    modal = np.linalg.solve(compliance, shapes)
    mass = np.einsum("im,im->m", shapes, modal)
    lost = np.einsum("i,im,im->m", _of_bends(vehicle, "structural_damping"), shapes, shapes)
    damping = lost / (2.0 * frequencies * mass)
    if free:
        # The base follows the bend: its accelerations per acceleration of the bend.
        base_rows = A[base_rate, bend] @ np.linalg.solve(A[rate, bend], shapes)
        # Velocities of the linear system are in world axes, shapes in those of the body.
        attitude = state_from_paper(at[None], np.zeros((1, n)))[0][Layout.attitude]
        base_rows[:3] = Rotation.from_quat(attitude).inv().as_matrix() @ base_rows[:3]
        shapes = np.vstack([base_rows, shapes])
    return Modes(frequencies, damping, shapes / np.linalg.norm(shapes, axis=0))


def _of_bends(vehicle: Vehicle, per_length: str) -> np.ndarray:
    """A property of the sections per length, times their length, of each bend (bends,)."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    return np.repeat([getattr(each, per_length) * each.length for each in sections], 2)


def _eigenmodes(stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues (bends,) ascending and eigenvectors (bends, bends) in columns.

    A solver leaves signs, and the vectors of equal eigenvalues, to rounding: they are chosen here.
    """
    values, vectors = np.linalg.eig(stiffness)
    # Held by a constant moment the arm is conservative: no mode grows while it vibrates.
    order = np.argsort(values.real)
    values, vectors = values.real[order], vectors.real[:, order]
    apart = np.flatnonzero(np.diff(values) > _EQUAL * np.abs(values[1:])) + 1
    for equal in np.split(np.arange(len(values)), apart):
        if len(equal) > 1:
            shifted = stiffness - values[equal].mean() * np.eye(len(values))
            space = np.linalg.svd(shifted)[2][-len(equal) :].T
            along_x = space[::2]
            vectors[:, equal] = space @ np.linalg.eigh(-along_x.T @ along_x)[1]
    counts = np.abs(vectors) > _COUNTS * np.abs(vectors).max(axis=0)
    first = np.take_along_axis(vectors, counts.argmax(axis=0)[None], axis=0)
    return values, vectors * np.sign(first)


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
    order: about 1e-9 relative for arms of a metre, 1e-3 for arms of millimetres. The bend must
    leave room for them below a full circle, 0.005 1/m. Raises InputError.
    """
    check_single_vehicle(vehicle)
    checks.choice("model", model, MODELS)
    gravity = checks.gravity(gravity)
    engine = Engine(vehicle, model)
    n = engine.layout.coordinates
    at = _configuration("q", q, vehicle)
    rates = np.zeros(n) if qd is None else checks.row("qd", qd, n)
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
    inputs[layout.force] = checks.row("force", force, 3)
    inputs[layout.moment] = checks.row("moment", moment, 3)
    inputs[layout.bend_moment] = checks.row("bend_moment", bend_moment, layout.bends)
    inputs[layout.tip_wrench] = checks.row("tip_wrench", tip_wrench, 6 * layout.arms)
    return inputs


@dataclass(frozen=True)
class Trim:
    """A hovering equilibrium: paper coordinates q (8,) and the inputs that hold it.

    force [N, world], moment [N m, body, about B's origin], bend_moment [N m²], of each section.
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

    bend: bend vector (2,) [1/m] to hold, of each section in turn, or None for the bend that the
    arms take by themselves under gravity and tip_wrench (6,) [N, N m, world axes], of each arm in
    turn, with no bend moment. Raises InputError.
    """
    check_single_vehicle(vehicle)
    gravity = checks.gravity(gravity)
    yaw, position = float(checks.row("yaw", yaw, 1)[0]), checks.row("position", position, 3)
    layout = Layout(vehicle.shape)
    tip_wrench = checks.row("tip_wrench", tip_wrench, 6 * layout.arms)

    def held(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Paper coordinates at bend k, and the push that holds the vehicle there."""
        x, y = k.reshape(-1, 2).T
        polar = np.stack([np.hypot(x, y), np.arctan2(y, x)], axis=-1).ravel()
        q = np.concatenate([position, [0.0, 0.0, yaw], polar])
        return q, _holding(vehicle, q[None], gravity, tip_wrench)[0]

    if bend is None:
        k = _free_bend(vehicle, lambda k: held(k)[1][layout.bend_moment])
    else:
        k = checks.vector("bend", bend, layout.bends)
        _check_bend("bend", bend, np.linalg.norm(k.reshape(-1, 2), axis=1), vehicle)
    q, push = held(k)
    bend_moment = np.zeros(layout.bends) if bend is None else push[layout.bend_moment]
    return Trim(q, push[layout.force], push[layout.moment], bend_moment)


def _free_bend(vehicle: Vehicle, needed: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """The bend (bends,) that needs no bend moment to be held, and that the arm comes back to.

    needed: the bend moment [N m²] that holds a bend. The nearest such bend to straight.
    """
    # Slow to import.
    from scipy.optimize import root

    sections = [section for arm in vehicle.arms for section in arm.section]
    length = np.repeat([each.length for each in sections], 2)
    stiffness = np.repeat([each.bending_stiffness for each in sections], 2)

    def unbalanced(x: np.ndarray) -> np.ndarray:
        """Moments over E I, at bends of x over the lengths."""
        return needed(x / length) / stiffness

    found = [
        x
        for start in _STARTS
        for x in [root(unbalanced, np.tile(start, len(sections)), tol=1e-13).x]
        if np.abs(unbalanced(x)).max() < _BALANCED
        and _is_stable(unbalanced, x, np.sqrt(stiffness / length))
    ]
    if not found:
        raise InputError(
            "gravity and tip_wrench leave the arm no stable equilibrium below a full circle that "
            "is found; give less of them, or the bend to hold."
        )
    return np.asarray(min(found, key=lambda x: float(np.linalg.norm(x))) / length)


def _is_stable(
    unbalanced: Callable[[np.ndarray], np.ndarray], x: np.ndarray, share: np.ndarray
) -> bool:
    """Whether moments rise with the bend in every direction; share: √(E I / l) of each bend.

    Moments over E I per bend times l are not symmetric where sections differ: over √(E I l) each,
    they are, and tell of the potential's curvature.
    """
    slopes = np.stack(
        [
            (unbalanced(x + _DIFFERENCE * unit) - unbalanced(x - _DIFFERENCE * unit))
            for unit in np.eye(len(x))
        ]
    )
    slopes = slopes * share / share[:, None]
    return bool(np.linalg.eigvalsh(slopes + slopes.T)[0] > 0.0)


def held_hover(vehicle: Vehicle, q: np.ndarray, gravity: float = 9.81) -> dict[str, Any]:
    """Return force, moment and bend_moment that keep vehicles at rest, level, at a bend.

    vehicle: plain or batched; q: (8,) or (runs, 8) paper coordinates. As `trim`, for a batch.
    """
    held = _holding(vehicle, np.atleast_2d(q), gravity)
    held = held[0] if np.ndim(q) == 1 and vehicle.runs is None else held
    layout = Layout(vehicle.shape)
    return {
        "force": held[..., layout.force],
        "moment": held[..., layout.moment],
        "bend_moment": held[..., layout.bend_moment],
    }


def _holding(
    vehicle: Vehicle, rows: np.ndarray, gravity: float, tip_wrench: Any = 0.0
) -> np.ndarray:
    """Pushes (runs, coordinates) under which nothing accelerates at rest; rows: (runs, 8)."""
    engine = Engine(vehicle, "decoupled")
    layout = engine.layout
    rows = np.broadcast_to(rows, (max(len(rows), vehicle.runs or 1), layout.coordinates))
    state = state_from_paper(rows, np.zeros(rows.shape))
    # Unit pushes would be lost in the rounding of a large vehicle's accelerations.
    scale = _scale_of_pushes(vehicle, len(rows))

    def pushed(push: np.ndarray) -> np.ndarray:
        inputs = np.zeros((1, len(rows), layout.inputs))
        inputs[..., layout.tip_wrench] = tip_wrench
        inputs[0, :, layout.push] = scale * push
        acting = Drive(inputs, False, GENERAL + TIP, gravity)
        return engine.derivative(Start(state, branches_of(rows)), acting)[
            :, layout.velocity.start :
        ]

    still = pushed(np.zeros(layout.coordinates))
    answers = [pushed(unit) - still for unit in np.eye(layout.coordinates)]
    return scale * np.linalg.solve(np.stack(answers, axis=-1), -still[..., None])[..., 0]


def _scale_of_pushes(vehicle: Vehicle, runs: int) -> np.ndarray:
    """Sizes of pushes (runs, coordinates): forces, moments and bend moments as vibration has."""
    sections = [section for arm in vehicle.arms for section in arm.section]
    columns = []
    for power, section in [(1, sections[0]), (2, sections[0]), *((3, each) for each in sections)]:
        inertial = vehicle.mass * np.square(section.clamped_frequency) * section.length**power
        columns += [np.broadcast_to(inertial, runs)] * (3 if power < 3 else 2)
    return np.stack(columns, axis=-1)


def _configuration(name: str, q: Any, vehicle: Vehicle) -> np.ndarray:
    width = Layout(vehicle.shape).coordinates
    at = np.zeros(width) if q is None else checks.row(name, q, width)
    _check_bend(name, at, np.abs(at[6::2]), vehicle)
    return at


def _check_bend(name: str, value: Any, kappas: np.ndarray, vehicle: Vehicle) -> None:
    sections = (section for arm in vehicle.arms for section in arm.section)
    for kappa, section in zip(kappas, sections, strict=True):
        largest = 2.0 * np.pi / section.length - _ROOM
        if kappa > largest:
            raise InputError(
                f"{name} is {shown(value)}, which bends a section of {section.length:g} m to "
                f"{kappa:g} 1/m; give a bend of at most {largest:.4g} 1/m, just below a full "
                "circle."
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
