"""Terms of a user's own that would act otherwise than they say."""

from dataclasses import dataclass
from typing import Any

import pytest
import warp as wp

import continuair as ca
from continuair.terms import Acting, Device
from tests.refusals import refused

VEHICLE = ca.load_vehicle("slender")
FALL = ca.Scenario("fall", [0.0] * 8, duration=0.01)


@dataclass(frozen=True)
class Rounded(ca.Term):
    """A drag of the tips by a number that single precision does not hold."""

    def device(self, code: Device) -> Acting:
        types = code.types
        Real, State, Flight, vec3 = types.Real, types.State, code.Flight, types.vec3

        def wrench_of(arm: int) -> Any:
            world_tip = code.tips.world_tip_of(arm)

            @wp.func
            def wrench(y: State, flight: Flight, row: int):
                return -Real(0.1) * world_tip(y, flight.plant).velocity, vec3()

            return wrench

        return Acting(on_arm=code.on_tip(wrench_of))


@dataclass(frozen=True)
class Untold(ca.Term):
    """An energy that it does not tell of."""

    def device(self, code: Device) -> Any:
        types, Flight = code.types, code.Flight
        State, Real = types.State, types.Real

        @wp.func
        def energy(y: State, flight: Flight, row: int):
            return Real(0.0)

        return Acting(energy=energy)


@dataclass(frozen=True)
class Nothing(ca.Term):
    """No Acting."""

    def device(self, code: Device) -> Any:
        return None


class Bare(ca.Term):
    """Numbers of a class that is no dataclass are no fields."""

    stiffness: float = 2.0

    def device(self, code: Device) -> Any:
        return Acting()


@dataclass(frozen=True)
class Astray(ca.Term):
    """A drag of the tips by a field that their motion lacks."""

    def device(self, code: Device) -> Acting:
        types = code.types
        State, Flight, vec3 = types.State, code.Flight, types.vec3

        def wrench_of(arm: int) -> Any:
            world_tip = code.tips.world_tip_of(arm)

            @wp.func
            def wrench(y: State, flight: Flight, row: int):
                return -world_tip(y, flight.plant).velocty, vec3()

            return wrench

        return Acting(on_arm=code.on_tip(wrench_of))


@dataclass(frozen=True)
class Elsewhere(ca.Term):
    """A term that asks for an arm that is not there."""

    def device(self, code: Device) -> Acting:
        code.tips.world_tip_of(7)
        return Acting()


@pytest.mark.parametrize(
    ("term", "field", "fact"),
    [
        (Elsewhere(), "term Elsewhere", "IndexError"),
        (Astray(), "term Astray", "velocty"),
        (Bare(), "terms.term Bare", "stiffness"),
        (Rounded(), "term Rounded", "0.1"),
        (Untold(), "term Untold", "energy"),
        (Nothing(), "term Nothing", "NoneType"),
    ],
)
def test_it_is_refused_in_a_sentence(term: ca.Term, field: str, fact: str) -> None:
    with refused(field) as caught:
        ca.simulate(VEHICLE.replace({"terms": (term,)}), FALL)
    assert fact in caught.value.problem
