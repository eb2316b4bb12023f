"""Device code of tendons: their tensions, motors and friction, and what they do on the bends."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.logs import push_reader
from continuair.terms.tendons.path import path_code
from continuair.terms.tendons.route import NUMBERS, Place, Route, places_of
from continuair.vehicle.layout import BENDING, TENDON_VARIABLES, TENDONS


@dataclass(frozen=True)
class TendonCode:
    """Device functions of all tendons: those of `Acting`, and the one that writes variables."""

    load: Any
    rates: Any
    excess: Any
    misdirected: Any
    settled: Any
    observe: Any


@cache
def tendon_code(numbers: Numbers, tree: Tree, term: Any) -> TendonCode:
    """Return the device functions of all tendons of a vehicle."""
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Cell, Flight = types.Cell, flight_code(numbers, tree).Flight
    each = [
        _route_code(numbers, tree, route, place)
        for route, place in zip(term.routes, places_of(tree, term, term.routes), strict=True)
    ]

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        return Load()

    @wp.func
    def rates(rate: State, y: State, flight: Flight, row: int, push: Push):
        return rate

    @wp.func
    def excess(y: State, flight: Flight, row: int, push: Push):
        return Real(0.0)

    @wp.func
    def misdirected(
        begun: State, end: State, along: Along, flight: Flight, row: int, push: Push, step: Real
    ):  # fmt: skip
        return Real(0.0)

    @wp.func
    def settled(y: State, flight: Flight, row: int, push: Push):
        return y

    @wp.func
    def observe(
        out: wp.array3d(dtype=Cell), sample: int, y: State, flight: Flight, row: int, push: Push
    ):
        pass

    def and_load(before: Any, pull: Any) -> Any:
        @wp.func
        def found(y: State, along: Along, flight: Flight, row: int, push: Push):
            out = before(y, along, flight, row, push)
            out.bend += pull(y, flight, row, push)
            return out

        return found

    def and_rates(before: Any, change: Any) -> Any:
        @wp.func
        def found(rate: State, y: State, flight: Flight, row: int, push: Push):
            return change(before(rate, y, flight, row, push), y, flight, row, push)

        return found

    def and_excess(before: Any, beyond: Any) -> Any:
        @wp.func
        def found(y: State, flight: Flight, row: int, push: Push):
            return wp.max(before(y, flight, row, push), beyond(y, flight, row, push))

        return found

    def and_misdirected(before: Any, reversed_in: Any) -> Any:
        @wp.func
        def found(
            begun: State, end: State, along: Along, flight: Flight, row: int, push: Push, step: Real
        ):  # fmt: skip
            out = before(begun, end, along, flight, row, push, step)
            return wp.max(out, reversed_in(begun, end, flight, row, push, step))

        return found

    def and_settled(before: Any, settle: Any) -> Any:
        @wp.func
        def found(y: State, flight: Flight, row: int, push: Push):
            return settle(before(y, flight, row, push), flight, row, push)

        return found

    def and_observe(before: Any, write: Any) -> Any:
        @wp.func
        def found(
            out: wp.array3d(dtype=Cell), sample: int, y: State, flight: Flight, row: int,
            push: Push,
        ):  # fmt: skip
            before(out, sample, y, flight, row, push)
            write(out, sample, y, flight, row, push)

        return found

    for route, code in zip(term.routes, each, strict=True):
        load, observe = and_load(load, code.pull), and_observe(observe, code.observe)
        excess = and_excess(excess, code.excess)
        if route.lags or route.rubs:
            rates = and_rates(rates, code.rates)
        if route.rubs:
            misdirected = and_misdirected(misdirected, code.reversed_in)
            settled = and_settled(settled, code.settle)
    return holding(TendonCode, locals())


@dataclass(frozen=True)
class _RouteCode:
    """pull(y, flight, row, push): forces on the bends. excess(y, flight, row, push): largest
    command beyond the limits, as a share of their range. reversed_in(begun, end, flight, row, push,
    step): error of a step in which sliding reverses. settle(y, flight, row, push): state without
    deflections beyond friction. rates and observe: as of TendonCode."""

    pull: Any
    rates: Any
    excess: Any
    reversed_in: Any
    settle: Any
    observe: Any


def _route_code(numbers: Numbers, tree: Tree, route: Route, place: Place) -> _RouteCode:
    types, code = device_types(numbers, tree), number_code(numbers)
    Flight, keep, of_row = flight_code(numbers, tree).Flight, code.keep, code.of_row
    Cell, Real, State, Push, Bends = types.Cell, types.Real, types.State, types.Push, types.Bends
    layout, above, grown = types.layout, code.above, elementary_code(numbers).grown
    finite = code.finite
    zero, half, one = Real(0.0), Real(0.5), Real(1.0)
    count, bends, group, many = route.tendons, layout.bends, place.group, len(route.counts)
    tendon, motor, slip = place.tendon, place.motor, place.slip
    lags, prompt, rubs, by_length = route.lags, route.prompt, route.rubs, route.by_length
    damps, commands = route.damps, layout.of_input["tendon_command"].start
    bend_moment_of, slip_unit = types.bend_moment_of, NUMBERS.index("slip_unit")
    at = {name: NUMBERS.index(name) for name in NUMBERS}
    pretension, stiffness, damping = at["pretension"], at["stiffness"], at["damping"]
    least, most, lag, fastest = at["least"], at["most"], at["lag"], at["rate"]
    least_taken, most_taken = at["least_taken"], at["most_taken"]
    friction, holds, straight = at["friction"], at["holding"], at["straight"]
    of_path = path_code(numbers, tree, route, place)
    Path, path_of, pulled_by = of_path.Path, of_path.path_of, of_path.pulled_by
    Shares, PerStretch = wp.types.vector(count, Real), wp.types.vector(many, Real)

    @wp.struct
    class Pulled:
        """Tension at the motor, slack, stored energy, and of each stretch its tension and the
        deflection of the guides before it, within friction."""

        tension: Real
        slack: Real
        energy: Real
        tensions: PerStretch
        held: PerStretch

    @wp.func
    def shares_of(flight: Flight, push: Push):
        """Return tensions above the pretension that exert the bend moments of a controller."""
        out = Shares()
        if (flight.groups & BENDING) != 0:
            plant = flight.plant
            asked = bend_moment_of(push)
            for t in range(count):
                # The pretensions may bend the arm, too.
                out[t] = -plant.tendon_bent[tendon + t]
                for j in range(bends):
                    out[t] = out[t] + plant.tendon_share[tendon + t, j] * asked[j]
            # Tensions that bend no arm keep all tendons of the group taut.
            room = plant.tendon[group, pretension] - plant.tendon[group, least]
            lift = zero
            for t in range(count):
                weight = plant.tendon_lift[tendon + t]
                below = -(room + out[t]) / above(weight, zero, weight, one)
                lift = wp.max(lift, above(weight, zero, below, zero))
            for t in range(count):
                out[t] = out[t] + lift * plant.tendon_lift[tendon + t]
        return out

    @wp.func
    def commanded(flight: Flight, row: int, shares: Shares, path: Path, t: int):
        """Return the command of a tendon: tension above the pretension, or length taken in."""
        plant = flight.plant
        out = zero
        if (flight.groups & TENDONS) != 0:
            out = of_row(flight.inputs, row, flight.run, commands + tendon + t)
        if wp.static(by_length):
            if (flight.groups & BENDING) != 0:
                out += shares[t] / plant.tendon[group, stiffness]
                out += plant.tendon[group, straight] - path.length
        else:
            out += shares[t]
        return out

    @wp.func
    def asked_of(flight: Flight, row: int, shares: Shares, path: Path, t: int):
        """Return what the motor of a tendon follows, within the stroke of a winch."""
        out = commanded(flight, row, shares, path, t)
        if wp.static(by_length):
            out = wp.min(out, flight.plant.tendon[group, most_taken])
            out = wp.max(out, flight.plant.tendon[group, least_taken])
        return out

    @wp.func
    def excess(y: State, flight: Flight, row: int, push: Push):
        """Return the largest command beyond the limits, over their range, or over itself if that
        has no end."""
        plant = flight.plant
        out = zero
        shares = shares_of(flight, push)
        for t in range(count + wp.min(flight.stride, 0)):
            path = Path()
            if wp.static(by_length):
                path = path_of(y, flight, t)
            asked = commanded(flight, row, shares, path, t)
            low = plant.tendon[group, least] - plant.tendon[group, pretension]
            high = plant.tendon[group, most] - plant.tendon[group, pretension]
            if wp.static(by_length):
                low = plant.tendon[group, least_taken]
                high = plant.tendon[group, most_taken]
            beyond = wp.max(asked - high, low - asked)
            size = finite(high - low, high - low, wp.abs(asked))
            out = wp.max(out, above(beyond, zero, beyond / above(beyond, zero, size, one), zero))
        return out

    @wp.func
    def motor_rate(flight: Flight, y: State, asked: Real, t: int):
        plant = flight.plant
        time = plant.tendon[group, lag]
        limit = plant.tendon[group, fastest]
        change = (asked - y[motor + t]) / above(time, zero, time, one)
        change = wp.max(wp.min(change, limit), -limit)
        return above(time, zero, change, zero)

    @wp.func
    def motor_at(flight: Flight, y: State, asked: Real, t: int):
        out = asked
        if wp.static(lags):
            out = y[motor + t]
            if wp.static(prompt):
                out = above(flight.plant.tendon[group, lag], zero, out, asked)
        return out

    @wp.func
    def pulled_at(flight: Flight, y: State, row: int, shares: Shares, path: Path, t: int):
        """Return the tensions of a tendon: at its motor, and after each guide that it rubs on."""
        plant = flight.plant
        out = Pulled()
        asked = zero
        if wp.static(prompt or damps or not lags):
            asked = asked_of(flight, row, shares, path, t)
        taken = motor_at(flight, y, asked, t)
        held = plant.tendon[group, pretension] + taken
        if wp.static(by_length):
            k = plant.tendon[group, stiffness]
            held = plant.tendon[group, pretension]
            held += k * (taken + path.length - plant.tendon[group, straight])
            out.slack = wp.max(zero, -held) / k
            if wp.static(damps):
                speed = path.speed
                if wp.static(lags):
                    speed += motor_rate(flight, y, asked, t)
                damped = held + plant.tendon[group, damping] * speed
                held = above(held, zero, damped, held)
        high = plant.tendon[group, most]
        low = plant.tendon[group, least]
        tension = wp.max(wp.min(held, high), low)
        if wp.static(by_length):
            stretch = plant.tendon[group, pretension] / plant.tendon[group, stiffness]
            stretch += taken + path.length - plant.tendon[group, straight]
            spring = plant.tendon[group, stiffness] * stretch
            spring = wp.max(wp.min(spring, high), low)
            out.energy = spring * (stretch - half * spring / plant.tendon[group, stiffness])
        out.tension = tension
        for i in range(many):
            if wp.static(rubs):
                turned = plant.tendon[group, friction] * path.turns[i]
                # Elastic up to the friction of a belt, whose tension grows with exp(μ θ).
                force = plant.tendon[group, holds] * y[slip + many * t + i]
                force = wp.min(force, -tension * grown(-turned))
                force = wp.max(force, -tension * grown(turned))
                out.held[i] = force / plant.tendon[group, holds]
                out.energy += half * force * out.held[i]
                tension -= force
            out.tensions[i] = tension
        return out

    @wp.func
    def sliding_of(path: Path):
        """Return how fast a tendon slides towards the base at the guides of each stretch [m/s]."""
        out = PerStretch()
        sliding = zero
        for i in range(many):
            sliding -= path.speeds[many - 1 - i]
            out[many - 1 - i] = sliding
        return out

    @wp.func
    def pull(y: State, flight: Flight, row: int, push: Push):
        """Return the forces on the bends of all tendons of the group."""
        out = Bends()
        shares = shares_of(flight, push)
        # In a loop that is not unrolled: the code of a tendon is compiled once.
        for t in range(count + wp.min(flight.stride, 0)):
            path = path_of(y, flight, t)
            pulled = pulled_at(flight, y, row, shares, path, t)
            out = pulled_by(out, path, pulled.tensions)
        for j in range(bends):
            out[j] = -out[j] / flight.plant.unit[j]
        return out

    @wp.func
    def rates(rate: State, y: State, flight: Flight, row: int, push: Push):
        """Return the rate of the state with those of motors and slips."""
        shares = shares_of(flight, push)
        for t in range(count + wp.min(flight.stride, 0)):
            path = Path()
            if wp.static(rubs or by_length):
                path = path_of(y, flight, t)
            if wp.static(lags):
                asked = asked_of(flight, row, shares, path, t)
                rate[motor + t] = motor_rate(flight, y, asked, t)
            if wp.static(rubs):
                sliding = sliding_of(path)
                for i in range(many):
                    rate[slip + many * t + i] = sliding[i]
        return rate

    @wp.func
    def settle(y: State, flight: Flight, row: int, push: Push):
        """Return the state without what has slid in a step: deflections within friction."""
        shares = shares_of(flight, push)
        for t in range(count + wp.min(flight.stride, 0)):
            pulled = pulled_at(flight, y, row, shares, path_of(y, flight, t), t)
            for i in range(many):
                y[slip + many * t + i] = pulled.held[i]
        return y

    @wp.func
    def reversed_in(begun: State, end: State, flight: Flight, row: int, push: Push, step: Real):
        """Return how far tendons slide back in a step that begins with sliding the other way, in
        which guides seem to hold them from the end of the sliding on; over the unit of slips."""
        out = zero
        shares = shares_of(flight, push)
        for t in range(count + wp.min(flight.stride, 0)):
            path = path_of(end, flight, t)
            pulled = pulled_at(flight, end, row, shares, path, t)
            before = sliding_of(path_of(begun, flight, t))
            after = sliding_of(path)
            for i in range(many):
                beyond = end[slip + many * t + i] - pulled.held[i]
                forth = wp.abs(before[i])
                back = wp.abs(after[i])
                share = above(back, zero, back / above(back, zero, forth + back, one), zero)
                gone = half * back * share * step / flight.plant.tendon[group, slip_unit]
                turned = above(zero, before[i] * after[i], gone, zero)
                out = wp.max(out, above(zero, beyond * after[i], turned, zero))
        return out

    first = [layout.observed[name].start + tendon for name in TENDON_VARIABLES]
    tension_at, end_at, length_at, slack_at, taken_at, energy_at = first

    @wp.func
    def observe(
        out: wp.array3d(dtype=Cell), sample: int, y: State, flight: Flight, row: int, push: Push
    ):
        shares = shares_of(flight, push)
        for t in range(count + wp.min(flight.stride, 0)):
            path = path_of(y, flight, t)
            pulled = pulled_at(flight, y, row, shares, path, t)
            sliding = sliding_of(path)
            taken = zero
            before = pulled.tension
            for i in range(many):
                after = pulled.tensions[i]
                taken += (before - after) * sliding[i]
                before = after
            keep(out, flight.run, sample, tension_at + t, pulled.tension)
            keep(out, flight.run, sample, end_at + t, before)
            keep(out, flight.run, sample, length_at + t, path.length)
            keep(out, flight.run, sample, slack_at + t, pulled.slack)
            keep(out, flight.run, sample, taken_at + t, taken)
            keep(out, flight.run, sample, energy_at + t, pulled.energy)

    return holding(_RouteCode, locals())


def observer_of(numbers: Numbers, tree: Tree, term: Any) -> Any:
    types, code = device_types(numbers, tree), number_code(numbers)
    structs, write = flight_code(numbers, tree), tendon_code(numbers, tree, term).observe
    Cell, Vehicles, Drive = types.Cell, structs.Vehicles, arguments(numbers.precision).Drive
    flight_of, load_state, lanes = structs.flight_of, types.load_state, code.lanes
    logged_push = push_reader(numbers, tree)

    @wp.kernel(enable_backward=False, module="unique", module_options=code.options)
    def tendons(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        """Write the variables; drive: inputs, one row per sample or one for all."""
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        y = load_state(log, run, sample, flight.plant.unit)
        push = logged_push(log, run, sample)
        write(out, sample, y, flight, sample * flight.stride, push)

    return tendons
