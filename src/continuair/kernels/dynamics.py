"""Device code of the models: the rate of the state of an aerial continuum manipulator.

With a' = a_o - g, what a body at B's origin feels, in body axes, and about the common centre of
mass, the rows of the coupled system are

    m a' + ω̇×c + J_c b̈ = F - force        I ω̇ + J b̈ = M - c×F/m - moment
    Jᵀ ω̇ + N b̈ = Q - J_cᵀ F/m - bend

with the bias (force, moment, bend) of what is quadratic in the rates. The decoupled model of Amiri
et al. leaves out the blocks between UAV and arm; about the arm's own base, N is then N₀ = N +
J_cᵀ J_c/m, and gravity acts on the bend. Models "without …" are coupled but for one part of what
decoupling drops: see continuair/analysis/couplings.py.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.bias import bias_code
from continuair.kernels.flight import flight_code
from continuair.kernels.forces.acting import acting_code
from continuair.kernels.types import MOMENTS, device_types, holding

MODELS = ("coupled", "decoupled", "independent")
"""Models to simulate with."""

REFERENCE = "coupled"
"""The model that the others are compared with."""

SIMPLER = ("decoupled", "independent")
"""The others, in which couplings are left out."""

PLANTS = ("coupled", "decoupled")
"""The paper's two models, on whose plants a law is judged."""

COUPLINGS = ("carriage", "inertia", "coriolis")
"""Couplings that a model "without …" lacks."""

COUPLED = ("coupled", "without carriage", "without coriolis")
"""Models whose mass matrix holds the blocks between UAV and arm."""

BLOCK_BIASED = ("decoupled", "without coriolis")
"""Models whose bias leaves out what UAV and arm do to one another."""

CARRIED = ("decoupled", "without carriage")
"""Models whose arm does not feel how the common centre of mass accelerates, but gravity."""

OWN_BASE = ("decoupled", "independent")
"""Models whose moment polynomials hold the inertia of bending about the arm's own base."""


@dataclass(frozen=True)
class Dynamics:
    """rate_of(y, branch, flight, row, push) -> dy/dt of one model, and its loads.

    freezes: rate_of reads what the flight keeps of its start, `Flight.frozen`.
    """

    model: str
    freezes: bool
    rate_of: Any
    loads: Any


@cache
def dynamics_code(precision: str, sections: int, model: str) -> Dynamics:
    """The rate of the state for one precision, number of sections and model."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    flight_structs, biases = flight_code(precision, sections), bias_code(precision, sections)
    freezes = model == "independent"
    loads = acting_code(precision, sections, frozen_arm=freezes)
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    vec2, vec3, quat = types.vec2, types.vec3, types.quat
    attitude_of, velocity_of, state_of = types.attitude_of, types.velocity_of, types.state_of
    bend_of, shape, Flight = types.bend_of, section.shape, flight_structs.Flight
    Load, load_of = loads.Load, loads.load_of
    Motion, motion_of = biases.Motion, biases.motion_of
    full_bias, block_bias, about_base = biases.full_bias, biases.block_bias, biases.about_base
    bend_force, own_bending = section.bend_force, section.own_bending
    solve_bending, solve_symmetric = section.solve_bending, section.solve_symmetric
    coupling_of, Shape = section.coupling_of, section.Shape
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)
    NP, ND = MOMENTS.index("NP"), MOMENTS.index("ND")

    @wp.struct
    class Accelerations:
        """a' in body axes, ω̇ and b̈."""

        base: vec3
        spin: vec3
        bend: vec2

    @wp.func
    def together(s: Shape, plant: Plant, m: Motion, force: vec3, moment: vec3, bend: vec2):
        """Solve the coupled rows: a Schur complement on the rotation."""
        c = coupling_of(s, plant.lever, m.b)
        n = one / s.f[NP]
        k = n * s.f[ND] / (s.f[NP] + m.u * s.f[ND])
        along = m.b[0] * c.spin_x + m.b[1] * c.spin_y
        x = n * c.spin_x - (k * m.b[0]) * along
        y = n * c.spin_y - (k * m.b[1]) * along
        schur = m.inertia - wp.outer(x, c.spin_x) - wp.outer(y, c.spin_y)
        out = Accelerations()
        out.spin = solve_symmetric(schur, moment - bend[0] * x - bend[1] * y)
        turned = vec2(wp.dot(c.spin_x, out.spin), wp.dot(c.spin_y, out.spin))
        out.bend = solve_bending(s, m.b, m.u, bend - turned)
        moved = wp.cross(out.spin, m.c) + out.bend[0] * c.base_x + out.bend[1] * c.base_y
        out.base = (force - moved) / plant.mass
        return out

    @wp.func
    def apart(s: Shape, plant: Plant, m: Motion, force: vec3, moment: vec3, bend: vec2):
        """Solve the rows of the vehicle with its arm frozen, and those of the bend, each alone."""
        out = Accelerations()
        out.spin = solve_symmetric(m.inertia, moment)
        out.bend = solve_bending(s, m.b, m.u, bend)
        out.base = (force - wp.cross(out.spin, m.c)) / plant.mass
        return out

    @wp.func
    def block_accelerations(y: State, flight: Flight, s: Shape, m: Motion, load: Load):
        """Any model but `independent`."""
        plant = flight.plant
        if wp.static(model in BLOCK_BIASED):
            if wp.static(model in COUPLED):
                bias = block_bias(about_base(s, plant, m), plant, m)
            else:
                bias = block_bias(s, plant, m)
        else:
            bias = full_bias(s, plant, m)
        # What pulls on every mass of the arm, per mass, in the axes of the body.
        pull = -load.force / plant.mass
        if wp.static(model in CARRIED):
            pull = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -flight.gravity))
        if wp.static(model == "without coriolis"):
            pull += bias.force / plant.mass
        if wp.static(model == "without inertia"):
            pull -= bias.force / plant.mass
        force = load.force - bias.force
        moment = load.moment - wp.cross(m.c, load.force) / plant.mass - bias.moment
        bend = load.bend - plant.stiffness * m.b - plant.damping * m.db
        bend += bend_force(s, m.b, pull) - bias.bend
        if wp.static(model in COUPLED):
            out = together(s, plant, m, force, moment, bend)
        elif wp.static(model == "without inertia"):
            out = apart(about_base(s, plant, m), plant, m, force, moment, bend)
        else:
            out = apart(s, plant, m, force, moment, bend)
        return out

    @wp.func
    def independent_accelerations(flight: Flight, s: Shape, m: Motion, load: Load):
        """A rigid vehicle with frozen payload, and the arm on a base fixed as it starts."""
        plant, frozen = flight.plant, flight.frozen
        c = frozen.moment
        out = Accelerations()
        bias = wp.cross(m.w, frozen.inertia * m.w)
        out.spin = frozen.inverse * (load.moment - wp.cross(c, load.force) / plant.mass - bias)
        moved = wp.cross(out.spin, c) + wp.cross(m.w, wp.cross(m.w, c))
        out.base = (load.force - moved) / plant.mass
        weight = wp.quat_rotate_inv(frozen.attitude, vec3(zero, zero, -flight.gravity))
        bend = load.bend - plant.stiffness * m.b - plant.damping * m.db
        bend += bend_force(s, m.b, weight) - own_bending(s, m.b, m.db, m.du, m.ddu)
        out.bend = solve_bending(s, m.b, m.u, bend)
        return out

    @wp.func
    def rate_of(y: State, branch: vec2, flight: Flight, row: int, push: Push):
        """dy/dt under the inputs of a row and a controller's push."""
        b = bend_of(y)
        s = shape(flight.coefficients, flight.vehicle, wp.dot(b, b))
        load = load_of(y, branch, flight, row, push)
        m = motion_of(y, s, flight.plant)
        if wp.static(freezes):
            a = independent_accelerations(flight, s, m, load)
        else:
            a = block_accelerations(y, flight, s, m, load)
        q = attitude_of(y)
        v = wp.quat_rotate(q, a.base)
        # half * q * (ω, 0), written out.
        w = m.w
        turn = quat(
            half * (q[3] * w[0] + q[1] * w[2] - q[2] * w[1]),
            half * (q[3] * w[1] + q[2] * w[0] - q[0] * w[2]),
            half * (q[3] * w[2] + q[0] * w[1] - q[1] * w[0]),
            -half * (q[0] * w[0] + q[1] * w[1] + q[2] * w[2]),
        )
        falling = vec3(v[0], v[1], v[2] - flight.gravity)
        return state_of(velocity_of(y), turn, m.db, falling, a.spin, a.bend)

    return holding(Dynamics, locals())
