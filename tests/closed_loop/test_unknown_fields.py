"""A law that uses a field which its structs have not is told the name that it has there."""

# Device code: its annotations are Warp types made at run time, which mypy cannot follow.
# mypy: ignore-errors

from types import SimpleNamespace
from typing import Any

import pytest
import warp as wp

import continuair as ca
from tests.refusals import refused

VEHICLE = ca.load_vehicle("paper")


def of_features(code: Any) -> SimpleNamespace:
    Sense, Push = code.Sense, code.Push

    @wp.struct
    class Gains:
        k: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        if sense.sight.features[0] > gains.k:
            return sense.weight
        return Push()

    return SimpleNamespace(Gains=Gains, control=control)


def of_image(code: Any) -> SimpleNamespace:
    Sense, Push = code.Sense, code.Push

    @wp.struct
    class Gains:
        k: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        if sense.image[0] > gains.k:
            return sense.weight
        return Push()

    return SimpleNamespace(Gains=Gains, control=control)


def of_speed(code: Any) -> SimpleNamespace:
    Sense, push, Bends = code.Sense, code.push, code.Bends

    @wp.struct
    class Gains:
        k: code.Real

    @wp.func
    def slowed(sense: Sense, k: code.Real):
        return -k * sense.velocty

    @wp.func
    def control(sense: Sense, gains: Gains):
        return sense.weight + push(slowed(sense, gains.k), sense.angular_velocity, Bends())

    return SimpleNamespace(Gains=Gains, control=control)


def of_gains(code: Any) -> SimpleNamespace:
    Sense = code.Sense

    @wp.struct
    class Gains:
        gain: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        return gains.gian * sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


def that_writes(code: Any) -> SimpleNamespace:
    Sense = code.Sense

    @wp.struct
    class Gains:
        k: code.Real

    @wp.func
    def control(sense: Sense, gains: Gains):
        out = sense.sight
        out.features = sense.desired
        return sense.weight

    return SimpleNamespace(Gains=Gains, control=control)


@pytest.mark.parametrize(
    ("law", "field", "name"),
    [
        (of_features, "sense.sight.features", "image"),
        (of_image, "sense.image", "sight.image"),
        (of_speed, "sense.velocty", "velocity"),
        (of_gains, "gains.gian", "gain"),
        (that_writes, "out.features", "image"),
    ],
)
def test_the_name_on_the_device_is_told(law: Any, field: str, name: str) -> None:
    target = ca.Target(ca.paths.letter("M"))
    task = ca.Scenario(
        "looking",
        [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        controller=ca.Controller("mine", law, {"gain" if law is of_gains else "k": 1.0}),
        target=target,
        duration=0.01,
    )
    with refused("law") as error:
        ca.simulate(VEHICLE, task)
    assert field in error.value.problem and f"use {name} (" in error.value.remedy
    assert error.value.__cause__ is None and error.value.__suppress_context__
