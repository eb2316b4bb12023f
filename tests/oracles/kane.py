"""Kane's equations with sixty digits, for UAVs with any number of arms of any number of sections.

It knows where material is and how it is turned (`kane_body.poses`), and nothing else: partial
velocities, velocities and accelerations of rigid pieces are central differences of their poses, and
the equations are Kane's sums over the pieces. No formula of the package is in it, and no import.
Vehicle, state and inputs are dictionaries, as in `kane_cases.json`:

    vehicle  {"uav": {"mass", "inertia" (3, 3)}, "arms": [arm, ...]}
    arm      {"mount" (3), "attitude" (4), "sections": [section, ...], "tip": tip or None}
    section  {"length", "bending_stiffness", "mass_per_length", "radius", "damping", "disks":
              [{"position", "mass", "inertia" (transverse, axial)}, ...]}
    tip      {"mass", "centre" (3), "inertia" (3, 3) about the centre}, in axes of the tip
    state    {"attitude" (4), "bend" (sections, 2), "velocity" (3), "angular_velocity" (3),
              "bend_rate" (sections, 2)}
    inputs   {"force" (3), "moment" (3), "bend_moment" (sections, 2), "tip_wrench" (arms, 6),
              "gravity"}

SI units. Quaternions are x y z w, of any length: attitude of the UAV, body to world, and of an arm,
hanging axes of its mount to body. Sections are counted along all arms. Velocity, force and tip
wrench (force and moment that act on the tip, about it) are in world axes; angular velocity and
moment in body axes; damping is per unit length [N m² s]; bend moments [N m²] are conjugate to the
bend vectors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpmath import mp, mpf

from tests.oracles.kane_algebra import Matrix, Vector, apply, cross, dot, exact, plus
from tests.oracles.kane_body import Configuration, Piece, configuration, pieces, poses
from tests.oracles.kane_motion import (
    Motion,
    PartialMotion,
    inertia_in_world,
    motions,
    partial_motions,
)

NODES = 24
DIGITS = 60
STEP = "1e-16"
"""Of the differences [s]: truncation and rounding then leave some 25 digits."""


@dataclass(frozen=True)
class Equations:
    """M u̇ + bias = force of the speeds u = (v in world axes, ω in body axes, k̇ of all sections).

    The bias is that of all speeds, that of (v, ω) alone and that of k̇ alone.
    """

    mass: Matrix
    bias: Vector
    bias_of_uav: Vector
    bias_of_bends: Vector
    force: Vector


def accelerations(
    vehicle: Any,
    state: Any,
    inputs: Any,
    model: str = "coupled",
    *,
    nodes: int = NODES,
    digits: int = DIGITS,
    step: str = STEP,
) -> Vector:
    """(v̇ in world axes, ω̇ in body axes, k̈ of all sections): 6 + 2 per section numbers.

    model: "coupled" or "decoupled", see `solved`. v̇ is inertial: (0, 0, -gravity) in free fall.
    """
    with mp.workdps(digits):
        return solved(equations(vehicle, state, inputs, nodes=nodes, step=step), model)


def equations(
    vehicle: Any, state: Any, inputs: Any, *, nodes: int = NODES, step: str = STEP
) -> Equations:
    """Kane's equations of a vehicle in a state under inputs, with the digits that are set."""
    vehicle, state, inputs, h = exact(vehicle), exact(state), exact(inputs), mpf(step)
    at, u, body = configuration(vehicle, state), speeds(state), pieces(vehicle, nodes)
    here = poses(body, vehicle, at)
    partials = partial_motions(body, vehicle, at, len(u), h)
    inertias = [inertia_in_world(piece, axes) for piece, (_, axes) in zip(body, here, strict=True)]
    still = [mpf(0)] * len(u)
    every, of_uav, of_bends = (
        _bias(body, inertias, partials, motions(body, vehicle, at, each, h))
        for each in (u, u[:6] + still[6:], still[:6] + u[6:])
    )
    mass = mass_matrix(body, inertias, partials)
    force = _forces(body, vehicle, at, partials, state, inputs)
    return Equations(mass, every, of_uav, of_bends, force)


def solved(found: Equations, model: str) -> Vector:
    """u̇ of a model. The decoupled one lacks the blocks between UAV and bends, of M and of C.

    C is the Christoffel matrix. With B the symmetric bilinear form of the quadratic form bias, its
    diagonal blocks give B(u, (v, ω, 0)) in the rows of the UAV and B(u, (0, 0, k̇)) in those of the
    bends. By polarisation each is ½ [bias + own bias - the other's own].
    """
    mass, bias = found.mass, found.bias
    if model == "decoupled":
        rows = range(len(bias))
        mass = [[mass[i][j] if (i < 6) == (j < 6) else mpf(0) for j in rows] for i in rows]
        own = found.bias_of_uav[:6] + found.bias_of_bends[6:]
        other = found.bias_of_bends[:6] + found.bias_of_uav[6:]
        bias = [(b + o - x) / 2 for b, o, x in zip(bias, own, other, strict=True)]
    left = [f - b for f, b in zip(found.force, bias, strict=True)]
    return list(mp.lu_solve(mp.matrix(mass), mp.matrix(left)))


def speeds(state: Any) -> Vector:
    """u of a state."""
    rates = [rate for pair in state["bend_rate"] for rate in pair]
    return [*state["velocity"], *state["angular_velocity"], *rates]


def mass_matrix(body: list[Piece], inertias: list[Matrix], partials: list[PartialMotion]) -> Matrix:
    """Σ velocity · m velocity + spin · I spin of all pieces, by pairs of speeds."""
    n = len(partials[0].velocity)
    M = [[mpf(0)] * n for _ in range(n)]
    for piece, inertia, partial in zip(body, inertias, partials, strict=True):
        for j in range(n):
            momentum = [piece.mass * x for x in partial.velocity[j]]
            spin_momentum = apply(inertia, partial.spin[j])
            for i in range(j + 1):
                M[i][j] += dot(partial.velocity[i], momentum) + dot(partial.spin[i], spin_momentum)
    return [[M[min(i, j)][max(i, j)] for j in range(n)] for i in range(n)]


def _bias(
    body: list[Piece], inertias: list[Matrix], partials: list[PartialMotion], moving: list[Motion]
) -> Vector:
    """What motions at constant speeds need: Σ velocity · m a + spin · (I α + Ω × I Ω), by speed."""
    rows = [mpf(0)] * len(partials[0].velocity)
    for piece, inertia, partial, of in zip(body, inertias, partials, moving, strict=True):
        force = [piece.mass * x for x in of.acceleration]
        moment = plus(apply(inertia, of.spin_rate), cross(of.spin, apply(inertia, of.spin)))
        rows = plus(rows, _work(partial, force, moment))
    return rows


def _forces(
    body: list[Piece],
    vehicle: Any,
    at: Configuration,
    partials: list[PartialMotion],
    state: Any,
    inputs: Any,
) -> Vector:
    """Generalised forces: weight, what acts on UAV and tips, and in the bends."""
    rows, zero = [mpf(0)] * len(partials[0].velocity), [mpf(0)] * 3
    for piece, partial in zip(body, partials, strict=True):
        rows = plus(rows, _work(partial, [*zero[:2], -piece.mass * inputs["gravity"]], zero))
    rows = plus(rows, _work(partials[0], inputs["force"], apply(at.attitude, inputs["moment"])))
    tips = partials[1 : 1 + len(vehicle["arms"])]
    for partial, wrench in zip(tips, inputs["tip_wrench"], strict=True):
        rows = plus(rows, _work(partial, wrench[:3], wrench[3:]))
    sections = [section for arm in vehicle["arms"] for section in arm["sections"]]
    for i, section in enumerate(sections):
        stiff, damped = (section["length"] * section[x] for x in ("bending_stiffness", "damping"))
        for j in range(2):
            rows[6 + 2 * i + j] += (
                inputs["bend_moment"][i][j]
                - stiff * state["bend"][i][j]
                - damped * state["bend_rate"][i][j]
            )
    return rows


def _work(partial: PartialMotion, force: Vector, moment: Vector) -> Vector:
    """The power of a force and a moment on a piece per unit of every speed."""
    moves = zip(partial.velocity, partial.spin, strict=True)
    return [dot(velocity, force) + dot(spin, moment) for velocity, spin in moves]
