"""Device code of the models: the rate of the state of an aerial continuum manipulator.

With a' = a_o - g, the specific force at B's origin in body axes, and H, I, F, L, M of all arms
about it (kernels/arm/chain.py), the rows of the coupled system are

    m a' + ω̇×H + F b̈ = f        H×a' + (I_u + I) ω̇ + L b̈ = n        Fᵀ a' + Lᵀ ω̇ + M b̈ = Q

with loads minus bias on the right. Translation is eliminated first, which refers the other rows to
the common centre of mass, then the bends, by LDLᵀ. The decoupled model of Amiri et al. omits the
blocks between UAV and arms, F and L; gravity acts on the bends. Models "without …" are the coupled
model without one part of what decoupling omits, see continuair/analysis/couplings.py. They share
the code of the partly coupled model, in which `Plant.omitted` has a 1 for that part.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, get_args

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.chain import chain_code
from continuair.kernels.arm.rigid import rigid_code
from continuair.kernels.elastic import elastic_code
from continuair.kernels.elimination import elimination_code
from continuair.kernels.flight import flight_code
from continuair.kernels.term_sum import acting_code
from continuair.typing import Model

MODELS: tuple[Model, ...] = get_args(Model)
"""Dynamic models of a simulation."""

REFERENCE: Model = "coupled"
"""Model with which the others are compared."""

SIMPLER: tuple[Model, ...] = ("decoupled", "independent")
"""Models without some or all couplings."""

PLANTS: tuple[Model, ...] = ("coupled", "decoupled")
"""The paper's two models, as plants for a control law."""

COUPLINGS = ("carriage", "inertia", "coriolis")
"""Couplings that a model "without …" omits: common acceleration, inertia, velocity terms."""

WITHOUT = {f"without {coupling}": place for place, coupling in enumerate(COUPLINGS)}
"""Models without one coupling, and its place in `Plant.omitted`."""

PARTLY_COUPLED = "partly coupled"
"""The model whose code all of WITHOUT share."""


@dataclass(frozen=True)
class Dynamics:
    """Rate of the state of one model, rate_of(y, along, flight, row, push) -> dy/dt, and its loads.

    rate_of is rates(y, flight, a) with a = accelerations_of(y, flight, total, load), where total_of
    computes the recursion along the arms. freezes: whether rate_of reads `Flight.frozen`, values of
    the initial state. bias: its kind, of kernels/arm/chain.py. couples: whether the mass matrix has
    the blocks between UAV and arms.

    laden_of(flight, y): the flight with the bodies that terms add. switched(y, flight, time): the
    state after a switch of terms, and 1 where there is one. None without such terms.
    """

    model: str
    freezes: bool
    bias: str
    couples: bool
    total_of: Any
    accelerations_of: Any
    rates: Any
    rate_of: Any
    laden_of: Any
    switched: Any
    loads: Any


def bias_of(model: str) -> str:
    """Return the kind of bias of a model."""
    return {"independent": "alone", "decoupled": "block"}.get(model, "full")


@cache
def dynamics_code(numbers: Numbers, tree: Tree, model: str) -> Dynamics:
    """Return the rate of the state for one kind of numbers, tree of arms and model."""
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    freezes, partly = model == "independent", model == PARTLY_COUPLED
    bias, couples = bias_of(model), partly or model == "coupled"
    chain, solved = chain_code(numbers, tree, bias), elimination_code(numbers, tree)
    loads, elastic = acting_code(numbers, tree, frozen_arm=freezes), elastic_code(numbers, tree)
    between, coupled_springs = elastic.between, elastic.pairs > 0
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    Bends, Along = types.Bends, types.Along
    vec3, quat, Flight, Load = types.vec3, types.quat, structs.Flight, loads.Load
    attitude_of, velocity_of, spin_of = types.attitude_of, types.velocity_of, types.spin_of
    bends_of, bend_rates_of, state_of = types.bends_of, types.bend_rates_of, types.state_of
    load_of, Total, total_of = loads.load_of, chain.Total, chain.total_of
    Rows, Accelerations = solved.Rows, solved.Accelerations
    together, apart = solved.together, solved.apart
    zero, half, one, bends = Real(0.0), Real(0.5), Real(1.0), types.layout.bends
    carriage, inertia, coriolis = (COUPLINGS.index(name) for name in COUPLINGS)
    Table, width, layout = types.Table, types.layout.state, types.layout
    W, DB = layout.angular_velocity.start, layout.bend_rate.start

    @wp.func
    def bend_rows(y: State, plant: Plant, total: Total, load: Load, felt: vec3):
        """Return Q: loads, elasticity and damping minus bias, and Fᵀ times the specific force."""
        b = bends_of(y)
        db = bend_rates_of(y)
        out = Bends()
        for j in range(bends):
            held = plant.stiffness[j] * b[j] + plant.damping[j] * db[j]
            pull = total.F[0, j] * felt[0] + total.F[1, j] * felt[1] + total.F[2, j] * felt[2]
            out[j] = load.bend[j] - held - total.bend[j] + pull
        if wp.static(coupled_springs):
            out = out - between(plant, b, db)
        return out

    @wp.func
    def carried_accelerations(y: State, flight: Flight, total: Total, load: Load):
        """Return the accelerations of any model but "independent"."""
        plant, w = flight.plant, spin_of(y)
        rows = Rows()
        rows.force = load.force - total.force
        rows.moment = load.moment - total.moment - wp.cross(w, plant.uav_inertia * w)
        # Specific force on every mass of the arms, from the acceleration of their base or gravity.
        down = wp.quat_rotate_inv(attitude_of(y), vec3(zero, zero, -flight.gravity))
        felt = -rows.force / plant.mass
        if wp.static(model == "decoupled"):
            felt = down
        if wp.static(partly):
            carried = (one - plant.omitted[carriage]) * (load.force / plant.mass + down)
            felt = down - carried + (one - plant.omitted[inertia]) * total.force / plant.mass
        rows.bend = bend_rows(y, plant, total, load, felt)
        if wp.static(partly):
            total.F = (one - plant.omitted[inertia]) * total.F
            total.L = (one - plant.omitted[inertia]) * total.L
        if wp.static(couples):
            out = together(plant.mass, plant.uav_inertia + total.I, total, rows)
        else:
            out = apart(plant.mass, plant.uav_inertia + total.I, total, rows)
        return out

    if partly:
        in_full = total_of

        @wp.func
        def total_of(y: State, table: Table, plant: Plant, vehicle: int):  # type: ignore[no-redef]
            """Return the sum over all arms; without Coriolis coupling, with the blocks of its bias.

            The bias is a quadratic form Q of z = (ω, q̇), and its blocks are those of the bilinear
            form B: B(z, ω) = (Q(z) + Q(ω) - Q(q̇)) / 2 in the rows of the UAV, and the same with
            ω and q̇ exchanged in those of the arms.
            """
            off = half * plant.omitted[coriolis]
            out = Total()
            force = vec3()
            moment = vec3()
            bend = Bends()
            # ω, q̇ and z in turn, in a loop that is not unrolled: the code is compiled once.
            for row in range(3 + wp.min(vehicle, 0)):
                of_spin = Real(1 - row % 2)
                of_rates = Real((row + 1) // 2)
                seen = State()
                for j in range(width):
                    seen[j] = y[j]
                for j in range(3):
                    seen[W + j] = of_spin * y[W + j]
                for j in range(bends):
                    seen[DB + j] = of_rates * y[DB + j]
                out = in_full(seen, table, plant, vehicle)
                force += off * (of_rates + of_rates - one) * out.force
                moment += off * (of_rates + of_rates - one) * out.moment
                bend += off * (of_spin + of_spin - one) * out.bend
            out.force -= force
            out.moment -= moment
            out.bend -= bend
            return out

    @wp.func
    def independent_accelerations(y: State, flight: Flight, total: Total, load: Load):
        """Return the accelerations of a vehicle with frozen arms, and of arms on a fixed base."""
        plant, frozen, w = flight.plant, flight.frozen, spin_of(y)
        c = frozen.moment
        rows = Rows()
        felt = wp.quat_rotate_inv(frozen.attitude, vec3(zero, zero, -flight.gravity))
        rows.bend = bend_rows(y, plant, total, load, felt)
        out = Accelerations()
        out.bend = solved.bends_alone(total, rows)
        force = load.force - wp.cross(w, wp.cross(w, c))
        moment = load.moment - wp.cross(w, frozen.inertia * w)
        out.spin = frozen.inverse * (moment - wp.cross(c, force) / plant.mass)
        out.base = (force - wp.cross(out.spin, c)) / plant.mass
        return out

    accelerations_of = independent_accelerations if freezes else carried_accelerations

    @wp.func
    def rates(y: State, flight: Flight, a: Accelerations):
        """Return dy/dt of a state with given accelerations."""
        q = attitude_of(y)
        v = wp.quat_rotate(q, a.base)
        # half * q * (ω, 0), written out.
        w = spin_of(y)
        turn = quat(
            half * (q[3] * w[0] + q[1] * w[2] - q[2] * w[1]),
            half * (q[3] * w[1] + q[2] * w[0] - q[0] * w[2]),
            half * (q[3] * w[2] + q[0] * w[1] - q[1] * w[0]),
            -half * (q[0] * w[0] + q[1] * w[1] + q[2] * w[2]),
        )
        falling = vec3(v[0], v[1], v[2] - flight.gravity)
        return state_of(velocity_of(y), turn, bend_rates_of(y), falling, a.spin, a.bend)

    @wp.func
    def rate_of(y: State, along: Along, flight: Flight, row: int, push: Push):
        """Return dy/dt for a row of inputs and a controller's actuator wrench."""
        load = load_of(y, along, flight, row, push)
        total = total_of(y, flight.coefficients, flight.plant, flight.vehicle)
        return rates(y, flight, accelerations_of(y, flight, total, load))

    if loads.with_rates is not None:
        of_bodies, with_rates = rate_of, loads.with_rates

        @wp.func
        def rate_with_states(y: State, along: Along, flight: Flight, row: int, push: Push):
            """Return dy/dt with the rates of the terms' own states."""
            return with_rates(of_bodies(y, along, flight, row, push), y, flight, row, push)

        rate_of = rate_with_states

    laden_of = switched = None
    if loads.laden is not None:
        laden_of = _laden_code(numbers, tree, freezes)
        unladen_rate = rate_of

        @wp.func
        def laden_rate(y: State, along: Along, flight: Flight, row: int, push: Push):
            """Return dy/dt with the bodies that terms add."""
            return unladen_rate(y, along, laden_of(flight, y), row, push)

        rate_of = laden_rate

    if loads.switch is not None:
        switch, V = loads.switch, layout.velocity.start

        @wp.func
        def switched(y: State, flight: Flight, time: Real):
            """Return the state after a switch, with the velocities that its impulse leaves, and 1
            where there is a switch."""
            end, impulse, now = switch(y, flight, time)
            seen = laden_of(flight, end)
            total = total_of(end, seen.coefficients, seen.plant, seen.vehicle)
            pushed = accelerations_of(end, seen, total, impulse)
            still = accelerations_of(end, seen, total, Load())
            along = wp.quat_rotate(attitude_of(end), pushed.base - still.base)
            for j in range(3):
                end[V + j] = end[V + j] + now * along[j]
                end[W + j] = end[W + j] + now * (pushed.spin[j] - still.spin[j])
            for j in range(bends):
                end[DB + j] = end[DB + j] + now * (pushed.bend[j] - still.bend[j])
            return end, now

    return holding(Dynamics, locals())


def _laden_code(numbers: Numbers, tree: Tree, freezes: bool) -> Any:
    """Return the function of the flight with the bodies that terms add.

    Of a vehicle with frozen arms they are points at the tips.
    """
    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    rigid, laden = rigid_code(numbers, tree), acting_code(numbers, tree, freezes).laden
    State, Flight, vec3, mat33 = types.State, structs.Flight, types.vec3, types.mat33
    between, inverse_of, arms = rigid.between, rigid.inverse_of, len(tree.sections)

    @wp.func
    def laden_of(flight: Flight, y: State):
        out = flight
        out.plant = laden(flight.plant, y)
        if wp.static(freezes):
            tips = flight.frozen.tips
            for arm in range(arms):
                added = out.plant.body_mass[arm] - flight.plant.body_mass[arm]
                tip = vec3(tips[arm, 0], tips[arm, 1], tips[arm, 2])
                out.frozen.moment += added * tip
                out.frozen.inertia += between(tip, vec3(), added, mat33())
            c = out.frozen.moment / out.plant.mass
            out.frozen.inverse = inverse_of(
                out.frozen.inertia - between(c, vec3(), out.plant.mass, mat33())
            )
        return out

    return laden_of
