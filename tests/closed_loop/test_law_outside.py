"""A law that reads a number from outside flies with the number that is there now."""

# Device code: its annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

from types import SimpleNamespace
from typing import Any

import pytest
import warp as wp

import continuair as ca

VEHICLE = ca.load_vehicle("paper")
SHARE = {"of the mass": 0.5}


def pushing(code: Any) -> SimpleNamespace:
    return law_of(SHARE["of the mass"], code)


def law_of(number: float, code: Any) -> SimpleNamespace:
    Real, Sense, push, vec3, Bends = code.Real, code.Sense, code.push, code.vec3, code.Bends
    share = Real(number)

    @wp.struct
    class Gains:
        mass: Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight + push(vec3(share * gains.mass, Real(0.0), Real(0.0)), vec3(), Bends())

    return SimpleNamespace(Gains=Gains, control=control)


class Pusher:
    """One whose method is a law, with a number of its own."""

    def __init__(self, number: float) -> None:
        self.number = number

    def law(self, code: Any) -> SimpleNamespace:
        return law_of(self.number, code)


def moved(law: Any = pushing) -> float:
    law = ca.Controller("mine", law, {"mass": VEHICLE.mass}, looks=False)
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    flight = ca.simulate(VEHICLE, ca.Scenario("x", start, controller=law, duration=0.1))
    return float(flight["position"][-1, 0])


def test_a_number_from_outside_is_the_one_that_is_there_now(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Compiled once by the function alone, every later flight had the first number."""
    slow = moved()
    assert moved() == slow
    monkeypatch.setitem(SHARE, "of the mass", 1.5)
    assert moved() == pytest.approx(3.0 * slow, rel=0.05)
    monkeypatch.setitem(SHARE, "of the mass", 0.5)
    assert moved() == slow


def test_a_method_flies_with_what_its_object_holds_now() -> None:
    pusher = Pusher(0.5)
    slow = moved(pusher.law)
    pusher.number = 1.5
    assert moved(pusher.law) == pytest.approx(3.0 * slow, rel=0.05)
