"""Device code of the sum of all terms of a vehicle."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code


@dataclass(frozen=True)
class Acting:
    """Device functions of one term; None for functions that it does not have.

    Parameters
    ----------
    on_uav : wp.Function, optional
        ``load(y, along, flight, row, push) -> Load``, from state, followed branches, run, row of
        inputs and actuator wrench: generalised force on the UAV and the bends.
    on_arm : callable, optional
        Function of the index of an arm that returns a device function as `on_uav`, of the force
        through that arm, about B's origin. Base reactions include it.
    rates : wp.Function, optional
        ``rates(rate, y, flight, row, push)``: rate of the state, with the rates of the term's own
        states filled in.
    excess : wp.Function, optional
        ``excess(y, flight, row, push)``: demand beyond the limits of the term, as a share of their
        range.
    misdirected : wp.Function, optional
        ``misdirected(begun, end, along, flight, row, push, step)``: bound of the tip error in a
        step, of a length [s], from a wrong direction of the force [arm lengths].
    settled : wp.Function, optional
        ``settled(y, flight, row, push)``: the state after an accepted step, with the step memory of
        the term updated: states of its own that tell what it has passed through.
    laden : wp.Function, optional
        ``laden(plant, y)``: the parameters of the vehicle in a state, with the body that the term
        adds to a tip.
    switch : wp.Function, optional
        ``switch(y, flight, time) -> (State, Load, Real)`` at the start of a step: the state with
        the memory of the term switched, the impulse on the vehicle that this causes [N s, N m s],
        and 1 where it switches.
    energy : wp.Function, optional
        ``energy(y, flight, row)``: potential energy [J].
    """

    on_uav: wp.Function | None = None
    on_arm: Callable[[int], wp.Function] | None = None
    rates: wp.Function | None = None
    excess: wp.Function | None = None
    misdirected: wp.Function | None = None
    settled: wp.Function | None = None
    laden: wp.Function | None = None
    switch: wp.Function | None = None
    energy: wp.Function | None = None


@dataclass(frozen=True)
class ActingCode:
    """Sums over all terms.

    load_of(y, along, flight, row, push): total load. load_on_arm(arm): function of the total load
    through an arm. The other fields are those of Acting, combined; None if no term has any.
    """

    Load: Any
    load_of: Any
    load_on_arm: Any
    with_rates: Any
    excess_of: Any
    misdirected: Any
    settled: Any
    laden: Any
    switch: Any


@cache
def acting_code(numbers: Numbers, tree: Tree, frozen_arm: bool) -> ActingCode:
    """Return the sums; frozen_arm: loads act on an arm whose base stays at its initial pose."""
    types, loads = device_types(numbers, tree), load_code(numbers, tree)
    Real, State, Push, Along = types.Real, types.State, types.Push, types.Along
    Plant = types.Plant
    Flight, Load, plus = flight_code(numbers, tree).Flight, loads.Load, loads.plus
    parts = [term.device(Device(numbers, tree, frozen_arm)) for term in tree.terms]
    arms = len(tree.sections)

    @wp.func
    def nothing(y: State, along: Along, flight: Flight, row: int, push: Push):
        return Load()

    def together(first: Any, second: Any) -> Any:
        @wp.func
        def load(y: State, along: Along, flight: Flight, row: int, push: Push):
            return plus(first(y, along, flight, row, push), second(y, along, flight, row, push))

        return load

    def summed(functions: list[Any]) -> Any:
        found = functions[0] if functions else nothing
        for each in functions[1:]:
            found = together(found, each)
        return found

    each, by_arm = [], []
    for part in parts:
        each += [part.on_uav] if part.on_uav else []
        if part.on_arm:
            by_arm.append([part.on_arm(arm) for arm in range(arms)])
            each.append(summed(by_arm[-1]))
    load_of = summed(each)

    def load_on_arm(arm: int) -> Any:
        return summed([functions[arm] for functions in by_arm])

    def rated(first: Any, second: Any) -> Any:
        @wp.func
        def rates(rate: State, y: State, flight: Flight, row: int, push: Push):
            return second(first(rate, y, flight, row, push), y, flight, row, push)

        return rates

    def larger(first: Any, second: Any) -> Any:
        @wp.func
        def excess(y: State, flight: Flight, row: int, push: Push):
            return wp.max(first(y, flight, row, push), second(y, flight, row, push))

        return excess

    def worse(first: Any, second: Any) -> Any:
        @wp.func
        def found(
            begun: State, end: State, along: Along, flight: Flight, row: int, push: Push, step: Real
        ):  # fmt: skip
            one = first(begun, end, along, flight, row, push, step)
            return wp.max(one, second(begun, end, along, flight, row, push, step))

        return found

    def both(first: Any, second: Any) -> Any:
        @wp.func
        def found(y: State, flight: Flight, row: int, push: Push):
            return second(first(y, flight, row, push), flight, row, push)

        return found

    def more(first: Any, second: Any) -> Any:
        @wp.func
        def laden(plant: Plant, y: State):
            return second(first(plant, y), y)

        return laden

    def switched(first: Any, second: Any) -> Any:
        @wp.func
        def found(y: State, flight: Flight, time: Real):
            begun, load, now = first(y, flight, time)
            end, also, then = second(begun, flight, time)
            return end, plus(load, also), wp.max(now, then)

        return found

    laden = _folded(more, [part.laden for part in parts])
    switch = _folded(switched, [part.switch for part in parts])
    with_rates = _folded(rated, [part.rates for part in parts])
    excess_of = _folded(larger, [part.excess for part in parts])
    misdirected = _folded(worse, [part.misdirected for part in parts])
    settled = _folded(both, [part.settled for part in parts])
    return holding(ActingCode, locals())


def _folded(joined: Callable[[Any, Any], Any], functions: list[Any]) -> Any:
    """Return several functions combined into one, or None."""
    found = None
    for each in functions:
        if each is not None:
            found = each if found is None else joined(found, each)
    return found
