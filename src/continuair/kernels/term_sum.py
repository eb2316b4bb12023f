"""Device code of all that acts on a vehicle: the sum of its terms, none known here by name."""

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
    """The device functions of one term; None for those that it does not have.

    Attributes
    ----------
    on_uav : wp.func
        ``load(y, along, flight, row, push)`` of state, branches, run, row of inputs and push: the
        `Load` on the UAV and the bends.
    on_arm : callable
        Of the index of an arm: the device function, as on_uav, of the load through that arm, on the
        vehicle about B's origin and on the bends. Base reactions account for it.
    rates : wp.func
        ``rates(rate, y, flight, row, push)``: the rate of a state with those of the term's states.
    excess : wp.func
        ``excess(y, flight, row, push)``: the part of its range by which more is asked of it than it
        gives.
    misdirected : wp.func
        ``misdirected(begun, end, along, flight, row)``: how far it may have moved the tip the wrong
        way in a step [arm lengths].
    energy : wp.func
        ``energy(y, flight, row)``: its potential energy [J].
    """

    on_uav: Any = None
    on_arm: Callable[[int], Any] | None = None
    rates: Any = None
    excess: Any = None
    misdirected: Any = None
    energy: Any = None


@dataclass(frozen=True)
class ActingCode:
    """load_of(y, along, flight, row, push), all that acts; load_on_arm(arm), the function of what
    acts through an arm. The rest as in Acting, of all terms; None where no term has any."""

    Load: Any
    load_of: Any
    load_on_arm: Any
    with_rates: Any
    excess_of: Any
    misdirected: Any


@cache
def acting_code(numbers: Numbers, tree: Tree, frozen_arm: bool) -> ActingCode:
    """The sums; frozen_arm: what acts on an arm finds its base where it was at the start."""
    types, loads = device_types(numbers, tree), load_code(numbers, tree)
    State, Push, Along = types.State, types.Push, types.Along
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
        def found(begun: State, end: State, along: Along, flight: Flight, row: int):
            return wp.max(
                first(begun, end, along, flight, row), second(begun, end, along, flight, row)
            )

        return found

    with_rates = _folded(rated, [part.rates for part in parts])
    excess_of = _folded(larger, [part.excess for part in parts])
    misdirected = _folded(worse, [part.misdirected for part in parts])
    return holding(ActingCode, locals())


def _folded(joined: Callable[[Any, Any], Any], functions: list[Any]) -> Any:
    """One function of several, None of none."""
    found = None
    for each in functions:
        if each is not None:
            found = each if found is None else joined(found, each)
    return found
