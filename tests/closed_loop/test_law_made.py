"""A law that reads a number from outside flies with the number that is there now."""

# Device code: its annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

import importlib.util
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import warp as wp

import continuair as ca
from continuair.device.types import Tree
from continuair.engine import factory
from continuair.engine.law_made import made_law
from continuair.sections import arcs
from continuair.terms import UavDrag

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


@dataclass
class Held:
    number: float


class Pusher:
    """One whose method is a law, as it is itself, with a number of its own."""

    shared = 0.5

    def __init__(self) -> None:
        self.number, self.held = 0.5, Held(0.5)

    def law(self, code: Any) -> SimpleNamespace:
        return law_of(self.number, code)

    def deeper(self, code: Any) -> SimpleNamespace:
        return law_of(self.held.number, code)

    def of_its_class(self, code: Any) -> SimpleNamespace:
        return law_of(self.shared, code)

    def __call__(self, code: Any) -> SimpleNamespace:
        return law_of(self.number, code)


def from_a_file(path: Path) -> Any:
    return lambda code: law_of(float(path.read_text("ascii")), code)


def moved(law: Any = pushing) -> float:
    law = ca.Controller("mine", law, {"mass": VEHICLE.mass}, looks=False)
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    flight = ca.simulate(VEHICLE, ca.Scenario("x", start, controller=law, duration=0.1))
    return float(flight["position"][-1, 0])


@pytest.mark.long
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


@pytest.mark.parametrize("kind", ["method", "deeper", "class", "callable", "file"])
def test_it_is_wherever_the_law_reads_it(
    kind: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pusher, path = Pusher(), tmp_path / "number"
    path.write_text("0.5", "ascii")
    law = {
        "method": pusher.law,
        "deeper": pusher.deeper,
        "class": pusher.of_its_class,
        "callable": pusher,
        "file": from_a_file(path),
    }[kind]
    slow = moved(law)
    pusher.number = pusher.held.number = 1.5
    monkeypatch.setattr(Pusher, "shared", 1.5)
    path.write_text("1.5", "ascii")
    assert moved(law) == pytest.approx(3.0 * slow, rel=0.05)


def test_a_law_that_gives_the_same_is_not_compiled_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    assert moved(Pusher().law) == moved(Pusher().deeper)
    monkeypatch.setattr(factory, "rollout_kernel", None)
    assert moved(Pusher().of_its_class) == moved()


@pytest.mark.long
@pytest.mark.parametrize("lanes", [1, 8])
def test_laws_differ_by_their_last_digit(lanes: int) -> None:
    """In single precision, by which Warp tells a pack's numbers apart, both are the same."""
    near = 0.5 + 1e-9
    made = [
        made_law(partial(law_of, number), "float64", Tree(arcs(1)), 0, lanes)
        for number in (0.5, near)
    ]
    assert made[0] != made[1] and made[0].name != made[1].name
    slow, same, faster = (moved(partial(law_of, each)) for each in (0.5, 0.5, near))
    assert slow == same
    assert faster / slow - 1.0 == pytest.approx(2e-9, rel=1e-3)


def test_a_law_of_the_same_text_is_another_one_for_another_tree_of_arms() -> None:
    trees = (
        Tree(arcs(1)),
        Tree(arcs(1), bodies=True),
        Tree(arcs(1), turned=True),
        Tree(arcs(1), terms=(UavDrag(),)),
    )
    assert len({made_law(pushing, "float64", tree, 0) for tree in (*trees, Tree(arcs(1)))}) == 4


def test_a_law_whose_file_is_edited_flies_on_as_the_program_has_read_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "edited.py"
    text = Path(__file__).read_text("utf-8")
    path.write_text(text, "utf-8")
    spec = importlib.util.spec_from_file_location("edited", path)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "edited", module)
    spec.loader.exec_module(module)
    before = moved(module.pushing)
    assert before > 0.0
    text = text.replace("share * gains.mass", "-share * gains.mass")
    path.write_text(text, "utf-8")
    assert moved(module.pushing) == before
