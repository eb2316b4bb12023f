"""Tendons: tensions along paths beside the backbone, with friction, slack, and motors that lag.

With λ the length of a tendon in a stretch, tensions T act on the coordinates q as -T ∂λ/∂q, after
F. Renda et al., IEEE RA-L 5(3), 2020. Nothing acts on the UAV: motors and guides are internal.
"""

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.arguments import arguments
from continuair.device.elementary import elementary_code
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types, holding
from continuair.errors import InputError
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.logs import push_reader
from continuair.kernels.term_sum import Acting
from continuair.terms.term import Term
from continuair.typing import Array
from continuair.vehicle.layout import COMMAND, TENDON_VARIABLES, TENDONS
from continuair.vehicle.runs import per_run
from continuair.vehicle.strain import COMPONENTS
from continuair.vehicle.tendon import Tendon
from continuair.vehicle.tendon_path import (
    GEOMETRY,
    highest_order,
    pieces,
    straight_lengths,
    stretches,
)
from continuair.vehicle.tendon_sharing import lifts_of, shares_of
from continuair.vehicle.vehicle import Vehicle

NUMBERS = (
    "pretension", "stiffness", "damping", "least", "most", "lag", "rate", "least_taken",
    "most_taken", "friction", "holding", "slip_unit", "straight",
)  # fmt: skip
"""Numbers of a group of tendons in the device's Plant, in order."""


@dataclass(frozen=True)
class Route:
    """Path of a group of equal tendons, for which kernels are compiled.

    Parameters
    ----------
    sections : tuple of int
        Section of each stretch, among those of all arms.
    counts : tuple of int
        Pieces of each stretch.
    highest : int
        Highest order of a strain along the path.
    tendons : int
        Number of tendons.
    straight : bool
        Whether they run straight from disk to disk.
    by_length : bool
        Whether winches command their lengths.
    lags, prompt, damps, rubs : bool
        Whether, in some runs, motors lag, do not lag, tendons are damped, and rub.
    """

    sections: tuple[int, ...]
    counts: tuple[int, ...]
    highest: int
    tendons: int
    straight: bool
    by_length: bool
    lags: bool
    prompt: bool
    damps: bool
    rubs: bool

    @property
    def pieces(self) -> int:
        """Return the number of pieces of a tendon."""
        return sum(self.counts)

    @property
    def rows(self) -> int:
        """Return the number of rows of the group in the table of coefficients."""
        return self.tendons * self.pieces

    @property
    def motors(self) -> int:
        """Return the number of states of motors."""
        return self.tendons * self.lags

    @property
    def slips(self) -> int:
        """Return the number of states of friction."""
        return self.tendons * len(self.counts) * self.rubs


@dataclass(frozen=True)
class Tendons(Term):
    """Tendons of all arms.

    Parameters
    ----------
    routes : tuple of Route
        Paths of the groups, arm by arm.
    """

    field: ClassVar[str] = "arm.tendon"
    flown: ClassVar[tuple[str, ...]] = ("tendon", "tendon_share", "tendon_lift")

    routes: tuple[Route, ...]

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if an arm has tendons, else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        Tendons or None
            The term.
        """
        found, first = [], 0
        for arm in vehicle.arms:
            for group in arm.tendon:
                parts = stretches(group, arm)
                found.append(
                    Route(
                        tuple(first + part.section for part in parts),
                        tuple(part.pieces for part in parts),
                        highest_order(group, arm),
                        group.count,
                        straight=group.guides == "disks",
                        by_length=group.command == "length",
                        lags=group.lags,
                        prompt=bool((np.asarray(group.lag) == 0.0).any()),
                        damps=bool(np.any(group.damping)),
                        rubs=group.rubs,
                    )
                )
            first += len(arm.section)
        return cls(tuple(found)) if found else None

    @property
    def stiff(self) -> bool:  # type: ignore[override]
        """Return whether tendons are faster than their arms: by lengths, friction or lag."""
        return any(each.by_length or each.rubs or each.lags for each in self.routes)

    @property
    def states(self) -> dict[str, int]:
        """Return the states of motors, and of the friction before each stretch."""
        motors, slips = (sum(getattr(each, name) for each in self.routes)
                         for name in ("motors", "slips"))  # fmt: skip
        return {"tendon_motor": motors, "tendon_slip": slips}

    def state_units(self, vehicle: Vehicle, runs: int) -> dict[str, Array]:
        """Return what bends the softest section by a radian, by tension or by length.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.

        Returns
        -------
        dict of str to ndarray
            Tensions [N] or lengths [m] of motors, and deflections of guides [m] (runs, n).
        """
        motors, slips = [np.zeros((runs, 0))], [np.zeros((runs, 0))]
        units = self._slip_units(vehicle, runs)
        for route, (_, group), unit in zip(self.routes, groups_of(vehicle), units, strict=True):
            held = per_run(group.friction_stiffness, runs)
            motor = per_run(group.offset, runs, 2)[:, 0] if route.by_length else unit * held
            motors.append(np.repeat(motor[:, None], route.motors, axis=1))
            slips.append(np.repeat(unit[:, None], route.slips, axis=1))
        return {"tendon_motor": np.hstack(motors), "tendon_slip": np.hstack(slips)}

    def _slip_units(self, vehicle: Vehicle, runs: int) -> list[Array]:
        """Return deflections of guides (runs,) [m] whose force bends by a radian, per group."""
        found = []
        for arm, group in groups_of(vehicle):
            sections = [per_run(part.bending_stiffness / part.length, runs) for part in arm.section]
            offset = per_run(group.offset, runs, 2)[:, 0]
            force = np.min(sections, axis=0) / offset
            found.append(force / per_run(group.friction_stiffness, runs))
        return found

    @property
    def counts(self) -> dict[str, int]:
        """Return the number of tendons."""
        return {"tendon": sum(each.tendons for each in self.routes)}

    @property
    def variables(self) -> dict[str, int]:
        """Return the variables of each tendon."""
        return dict.fromkeys(TENDON_VARIABLES, self.counts["tendon"])

    @property
    def rows(self) -> int:
        """Return the number of pieces of all tendons."""
        return sum(each.rows for each in self.routes)

    @property
    def columns(self) -> int:
        """Return the numbers of a piece."""
        return GEOMETRY + 2 * max(each.highest for each in self.routes)

    def table(self, vehicle: Vehicle, runs: int, at: slice) -> Array:
        """Return the pieces of all tendons.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.
        at : slice
            The requested runs.

        Returns
        -------
        ndarray, shape (n, rows, columns)
            The pieces, group by group and tendon by tendon.
        """
        found = []
        for arm, group in groups_of(vehicle):
            each = pieces(group, arm, runs)[at]
            each = each.reshape(len(each), -1, each.shape[-1])
            missing = self.columns - each.shape[-1]
            found.append(np.pad(each, ((0, 0), (0, 0), (0, missing))))
        return np.concatenate(found, axis=1)

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the fields ``tendon``, NUMBERS per group, ``tendon_share`` and ``tendon_lift``.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field. ``tendon_share`` maps bend moments to tensions [1/m²], and tensions
            ``tendon_lift`` bend no arm.
        """
        return {
            "tendon": (len(self.routes), len(NUMBERS)),
            "tendon_share": (self.counts["tendon"], tree.layout.bends),
            "tendon_lift": (self.counts["tendon"],),
        }

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the fields of `parameters`.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        runs = len(plants)
        units = self._slip_units(vehicle, runs)
        plants["tendon_share"] = shares_of(vehicle, runs)
        plants["tendon_lift"] = lifts_of(vehicle, runs)
        for index, (arm, group) in enumerate(groups_of(vehicle)):
            straight = straight_lengths(pieces(group, arm, runs))[:, 0]
            limits, strokes = (
                per_run(group.tension_limits, runs, 2),
                per_run(group.strokes, runs, 2),
            )
            rest = {
                "stiffness": 1.0 if group.stiffness is None else group.stiffness,
                "rate": np.inf if group.rate is None else group.rate,
                "least": limits[:, 0], "most": limits[:, 1],
                "least_taken": strokes[:, 0], "most_taken": strokes[:, 1],
                "holding": group.friction_stiffness, "slip_unit": units[index],
                "straight": straight,
            }  # fmt: skip
            for column, name in enumerate(NUMBERS):
                value = rest[name] if name in rest else getattr(group, name)
                plants["tendon"][:, index, column] = per_run(value, runs)

    def device(self, code: Device) -> Acting:
        """Return the device functions of the tendons.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on the bends, rates of motors and of slips, and the step memory of friction.
        """
        found = tendon_code(code.numbers, code.tree, self)
        with_states, rubs = any(self.states.values()), any(each.rubs for each in self.routes)
        return Acting(
            on_uav=found.load,
            rates=found.rates if with_states else None,
            misdirected=found.misdirected if rubs else None,
            settled=found.settled if rubs else None,
        )

    def left(self, numbers: Numbers, tree: Tree) -> wp.Function:
        """Return the device function that removes the bend moments from an actuator wrench.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Function
            ``straight(push) -> Push``. Tendons exert the bend moments that a controller asks for.
        """
        types = device_types(numbers, tree)
        Push, Bends = types.Push, types.Bends
        push_of, force_of, moment_of = types.push_of, types.force_of, types.moment_of

        @wp.func
        def straight(push: Push):
            return push_of(force_of(push), moment_of(push), Bends())

        return straight

    def observer(self, numbers: Numbers, tree: Tree) -> wp.Kernel:
        """Return the kernel of the variables of tendons along a log.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Kernel
            The kernel, which writes the columns of TENDON_VARIABLES.
        """
        return _observer(numbers, tree, self)


def groups_of(vehicle: Vehicle) -> list[tuple[Any, Tendon]]:
    """Return the groups of tendons of a vehicle, each with its arm, in order."""
    return [(arm, group) for arm in vehicle.arms for group in arm.tendon]


@dataclass(frozen=True)
class TendonCode:
    """Device functions of all tendons: those of `Acting`, and the one that writes variables."""

    load: Any
    rates: Any
    misdirected: Any
    settled: Any
    observe: Any


@dataclass(frozen=True)
class _Place:
    """Where the numbers of a route are.

    group: row of `plant.tendon`. tendon: its first tendon. row: its first row in the table. motor,
    slip: first columns of its states.
    """

    group: int
    tendon: int
    row: int
    motor: int
    slip: int


def _places(tree: Tree, term: Tendons) -> list[_Place]:
    row, tendon = tree.first_row_of(term), 0
    motor, slip = (tree.layout.of_state[name].start for name in ("tendon_motor", "tendon_slip"))
    found = []
    for group, route in enumerate(term.routes):
        found.append(_Place(group, tendon, row, motor, slip))
        row, tendon = row + route.rows, tendon + route.tendons
        motor, slip = motor + route.motors, slip + route.slips
    return found


@cache
def tendon_code(numbers: Numbers, tree: Tree, term: Tendons) -> TendonCode:
    """Return the device functions of all tendons of a vehicle."""
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Cell, Flight = types.Cell, flight_code(numbers, tree).Flight
    each = [
        _route_code(numbers, tree, route, place)
        for route, place in zip(term.routes, _places(tree, term), strict=True)
    ]

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        return Load()

    @wp.func
    def rates(rate: State, y: State, flight: Flight, row: int, push: Push):
        return rate

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
        if route.lags or route.rubs:
            rates = and_rates(rates, code.rates)
        if route.rubs:
            misdirected = and_misdirected(misdirected, code.reversed_in)
            settled = and_settled(settled, code.settle)
    return holding(TendonCode, locals())


@dataclass(frozen=True)
class _RouteCode:
    """pull(y, flight, row, push): forces on the bends. reversed_in(begun, end, flight, row, push,
    step): error of a step in which sliding reverses. settle(y, flight, row, push): state without
    deflections beyond friction. rates and observe: as of TendonCode."""

    pull: Any
    rates: Any
    reversed_in: Any
    settle: Any
    observe: Any


def _route_code(numbers: Numbers, tree: Tree, route: Route, place: _Place) -> _RouteCode:
    types, code = device_types(numbers, tree), number_code(numbers)
    Flight, keep, of_row = flight_code(numbers, tree).Flight, code.keep, code.of_row
    Cell, Real, State, Push, Bends = types.Cell, types.Real, types.State, types.Push, types.Bends
    layout, above, grown = types.layout, code.above, elementary_code(numbers).grown
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
    of_path = _path_code(numbers, tree, route, place)
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
        if (flight.groups & COMMAND) != 0:
            plant = flight.plant
            asked = bend_moment_of(push)
            for t in range(count):
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
    def asked_of(flight: Flight, row: int, shares: Shares, path: Path, t: int):
        """Return what the motor of a tendon follows, within the stroke of a winch."""
        plant = flight.plant
        out = zero
        if (flight.groups & TENDONS) != 0:
            out = of_row(flight.inputs, row, flight.run, commands + tendon + t)
        if wp.static(by_length):
            if (flight.groups & COMMAND) != 0:
                out += shares[t] / plant.tendon[group, stiffness]
                out += plant.tendon[group, straight] - path.length
            out = wp.min(out, plant.tendon[group, most_taken])
            out = wp.max(out, plant.tendon[group, least_taken])
        else:
            out += shares[t]
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


@dataclass(frozen=True)
class _PathCode:
    """Path, a struct; path_of(y, flight, tendon); pulled_by(bends, path, tensions), with the forces
    on the bends of tensions that lengthen the path."""

    Path: Any
    path_of: Any
    pulled_by: Any


def _path_code(numbers: Numbers, tree: Tree, route: Route, place: _Place) -> _PathCode:
    types = device_types(numbers, tree)
    Real, State, Bends = types.Real, types.State, types.Bends
    Flight, layout = flight_code(numbers, tree).Flight, types.layout
    many, first, pieces_of_one, rubs = len(route.counts), place.row, route.pieces, route.rubs
    own = [layout.of_section[section] for section in route.sections]
    widest = max(each.stop - each.start for each in own)
    PerStretch = wp.types.vector(many, Real)
    Columns = wp.types.matrix((many, widest), Real)
    zero, half = Real(0.0), Real(0.5)

    @wp.struct
    class Path:
        """Length and rate of length, of the whole and of each stretch; the derivatives of the
        lengths in the coordinates of their sections; the turn of the tendon before each stretch's
        middle [rad]."""

        length: Real
        speed: Real
        speeds: PerStretch
        turns: PerStretch
        columns: Columns

    @wp.func
    def begun(y: State, flight: Flight, start: int):
        return Path(), zero

    def and_stretch(before: Any, index: int) -> Any:
        """Return the function that adds a stretch; its second result is half the last turn."""
        section, count = route.sections[index], route.counts[index]
        offset, width = sum(route.counts[:index]), own[index].stop - own[index].start
        along = _stretch_code(numbers, tree, route, section)
        rate_at, unit_at = layout.bend_rate_of(section).start, own[index].start

        @wp.func
        def found(y: State, flight: Flight, start: int):
            out, turned = before(y, flight, start)
            part = along(y, flight, start + offset, count)
            speed = zero
            for j in range(width):
                out.columns[index, j] = part.columns[j]
                speed += part.columns[j] * y[rate_at + j] / flight.plant.unit[unit_at + j]
            out.length += part.length
            out.speed += speed
            out.speeds[index] = speed
            if wp.static(rubs):
                out.turns[index] = turned + half * part.turn
            return out, half * part.turn

        return found

    summed = begun
    for index in range(many):
        summed = and_stretch(summed, index)

    @wp.func
    def path_of(y: State, flight: Flight, tendon: int):
        out, _ = summed(y, flight, first + pieces_of_one * tendon)
        return out

    @wp.func
    def pulled_by(out: Bends, path: Path, tensions: PerStretch):
        return out

    def and_pull(before: Any, index: int) -> Any:
        start, width = own[index].start, own[index].stop - own[index].start

        @wp.func
        def found(out: Bends, path: Path, tensions: PerStretch):
            out = before(out, path, tensions)
            for j in range(width):
                out[start + j] = out[start + j] + tensions[index] * path.columns[index, j]
            return out

        return found

    for index in range(many):
        pulled_by = and_pull(pulled_by, index)
    return holding(_PathCode, locals())


@cache
def _stretch_code(numbers: Numbers, tree: Tree, route: Route, section: int) -> Any:
    """Return the function of some pieces in a section: their length, turn and derivatives."""
    types, code = device_types(numbers, tree), number_code(numbers)
    Real, vec3, State = types.Real, types.vec3, types.State
    Flight, layout = flight_code(numbers, tree).Flight, types.layout
    row_of, Row = code.row_reader(types.Row), types.Row
    own, y_at, highest = layout.of_section[section], layout.bend_of(section).start, route.highest
    strains = tree.kind_of(section).strains
    if not strains:
        raise InputError(
            Tendons.field,
            f"passes a section of the kind {tree.kind_of(section).name}, whose strain is not known",
            "define strains in that kind",
        )
    width, unit_at, rubs, straight = own.stop - own.start, own.start, route.rubs, route.straight
    Coordinates, Strain = (wp.types.vector(n, Real) for n in (width, len(COMPONENTS)))
    zero, one = Real(0.0), Real(1.0)
    polynomial = elementary_code(numbers).polynomial
    # Of the angle φ between two disks, in φ²: 2 (1 - cos φ)/φ², what it lacks to 1 over φ², and
    # their derivatives.
    chords = [2.0 * (-1.0) ** k / factorial(2 * k + 2) for k in range(14)]
    lacks = [2.0 * (-1.0) ** k / factorial(2 * k + 4) for k in range(14)]
    chord_of, lack_of = (polynomial(terms[::-1]) for terms in (chords, lacks))
    chord_rate_of, lack_rate_of = (
        polynomial([k * term for k, term in enumerate(terms)][:0:-1]) for terms in (chords, lacks)
    )

    @wp.struct
    class Part:
        """Length [m], turn of the tendon [rad], and derivatives of the length in coordinates."""

        length: Real
        turn: Real
        columns: Coordinates

    @wp.func
    def strain_of(q: Coordinates, row: Row):
        return Strain()

    @wp.func
    def strain_rate_of(q: Coordinates, row: Row):
        return Strain()

    @wp.func
    def added(out: Coordinates, row: Row, slope: Strain):
        return out

    def and_strain(before: Any, column: int, component: int, first: int) -> Any:
        """Return the sum with a coordinate; first: column of its polynomial, -1 for a constant."""

        @wp.func
        def constant(q: Coordinates, row: Row):
            out = before(q, row)
            out[component] = out[component] + q[column]
            return out

        @wp.func
        def varying(q: Coordinates, row: Row):
            out = before(q, row)
            out[component] = out[component] + q[column] * row[first]
            return out

        return constant if first < 0 else varying

    def and_added(before: Any, column: int, component: int, first: int) -> Any:
        @wp.func
        def constant(out: Coordinates, row: Row, slope: Strain):
            out = before(out, row, slope)
            out[column] = out[column] + slope[component]
            return out

        @wp.func
        def varying(out: Coordinates, row: Row, slope: Strain):
            out = before(out, row, slope)
            out[column] = out[column] + slope[component] * row[first]
            return out

        return constant if first < 0 else varying

    for column, (component, order) in enumerate(strains):
        at = GEOMETRY + order - 1 if order else -1
        strain_of = and_strain(strain_of, column, component, at)
        added = and_added(added, column, component, at)
        if order:
            strain_rate_of = and_strain(strain_rate_of, column, component, at + highest)

    @wp.func
    def along(y: State, flight: Flight, first: int, count: int):
        q = Coordinates()
        for j in range(width):
            q[j] = y[y_at + j] / flight.plant.unit[unit_at + j]
        out = Part()
        for i in range(count + wp.min(flight.stride, 0)):
            row = row_of(flight.coefficients, flight.vehicle, first + i)
            e = strain_of(q, row)
            length = row[0]
            o = vec3(row[1], row[2], zero)
            d = vec3(row[3], row[4], zero)
            # Bend, twist, stretch and shear: turning κ and advance τ per length of the backbone.
            kappa = vec3(e[1], -e[0], -e[2])
            tau = vec3(e[4], e[5], -one - e[3]) + wp.cross(kappa, o) + d
            whole = wp.dot(tau, tau)
            square = whole
            # Half the derivatives of the squared length by τ and κ.
            by_tau = tau
            by_kappa = vec3()
            if wp.static(straight):
                # The chord of a curve with constant κ and τ, in its own axes.
                angle = length * length * wp.dot(kappa, kappa)
                along_axis = length * wp.dot(tau, kappa)
                chord = chord_of(angle)
                lack = lack_of(angle)
                square = chord * whole + lack * along_axis * along_axis
                rate = chord_rate_of(angle) * whole + lack_rate_of(angle) * along_axis * along_axis
                by_tau = chord * tau + lack * along_axis * length * kappa
                by_kappa = rate * length * length * kappa + lack * along_axis * length * tau
            size = wp.sqrt(square)
            by_tau = by_tau / size
            by_kappa = by_kappa / size
            slope = Strain(
                by_tau[2] * o[0] - by_kappa[1], by_tau[2] * o[1] + by_kappa[0],
                by_tau[0] * o[1] - by_tau[1] * o[0] - by_kappa[2], -by_tau[2],
                by_tau[0], by_tau[1],
            )  # fmt: skip
            out.length += length * size
            out.columns = added(out.columns, row, length * slope)
            if wp.static(rubs):
                g = strain_rate_of(q, row)
                turning = vec3(g[1], -g[0], -g[2])
                change = vec3(g[4], g[5], -g[3]) + wp.cross(turning, o) + wp.cross(kappa, d)
                advance = wp.sqrt(whole)
                unit = tau / advance
                bent = (change - wp.dot(unit, change) * unit) / advance + wp.cross(kappa, unit)
                out.turn += length * wp.sqrt(wp.dot(bent, bent))
        return out

    return along


def _observer(numbers: Numbers, tree: Tree, term: Tendons) -> Any:
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
