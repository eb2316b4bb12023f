"""Laws of mechanics that Kane's equations with many digits keep, whatever the vehicle is."""

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from mpmath import mp, mpf

from tests.oracles.kane import DIGITS, accelerations, equations, solved, speeds
from tests.oracles.kane_algebra import (
    Vector,
    apply,
    cross,
    dot,
    exact,
    from_quaternion,
    largest_gap,
    plus,
    product,
    transposed,
)
from tests.oracles.kane_body import configuration, pieces, poses
from tests.oracles.kane_motion import Motion, inertia_in_world, motions
from tests.oracles.make_kane_cases import MODELS, held

CASES = held()
ALONE = CASES["1: bent, all at once"]
MANY = [CASES["1+1: bent, all at once"], CASES["2: far bent, all at once"]]
FEW = 3
"""Nodes where any number of rigid slices has to keep the law."""


@pytest.fixture(autouse=True)
def many_digits() -> Iterator[None]:
    with mp.workdps(DIGITS):
        yield


def parts(case: dict[str, Any]) -> tuple[Any, Any, Any]:
    """Copies of a case's vehicle, state and inputs, to be changed."""
    vehicle, state, inputs = (exact(case[part]) for part in ("vehicle", "state", "inputs"))
    return vehicle, state, inputs


@pytest.mark.parametrize("name", ["2: straight, at rest", "1+1: straight, at rest"])
def test_a_straight_vehicle_at_rest_falls_freely(name: str) -> None:
    found = accelerations(*parts(CASES[name]), nodes=FEW)
    gravity = exact(CASES[name]["inputs"]["gravity"])
    assert largest_gap(found, [mpf(0), mpf(0), -gravity] + [mpf(0)] * (len(found) - 3)) < 1e-24


@pytest.mark.parametrize("case", MANY, ids=lambda case: case["name"])
def test_momenta_and_energy_change_by_what_acts(case: dict[str, Any]) -> None:
    """Of all pieces, flown along the accelerations that were found.

    Reached: 1e-25, the square of the step times that of accelerations of 1e6.
    """
    vehicle, state, inputs = parts(case)
    change = solved(equations(vehicle, state, inputs, nodes=FEW), "coupled")
    at, body = configuration(vehicle, state), pieces(vehicle, FEW)
    here = poses(body, vehicle, at)
    flown = motions(body, vehicle, at, speeds(state), mpf("1e-16"), change)
    gained = still = [[mpf(0)] * 3, [mpf(0)] * 3, mpf(0)]
    for piece, (place, axes), of in zip(body, here, flown, strict=True):
        inertia = inertia_in_world(piece, axes)
        force = [piece.mass * x for x in plus(of.acceleration, [0, 0, inputs["gravity"]])]
        moment = plus(apply(inertia, of.spin_rate), cross(of.spin, apply(inertia, of.spin)))
        gained = plus_push(gained, place, of, force, moment)
    turning = apply(at.attitude, inputs["moment"])
    acting = plus_push(still, here[0][0], flown[0], inputs["force"], turning)
    for i, wrench in enumerate(inputs["tip_wrench"], 1):
        acting = plus_push(acting, here[i][0], flown[i], wrench[:3], wrench[3:])
    acting[2] += bending_power(vehicle, state, inputs)
    for found, expected in zip(gained, acting, strict=True):
        assert largest_gap([found], [expected]) < 1e-23


def plus_push(total: Any, place: Vector, of: Motion, force: Vector, moment: Vector) -> Any:
    """Force, moment about B and power, with those of one more push on a piece."""
    about_base = plus(cross(place, force), moment)
    power = dot(force, of.velocity) + dot(moment, of.spin)
    return [plus(total[0], force), plus(total[1], about_base), total[2] + power]


def bending_power(vehicle: Any, state: Any, inputs: Any) -> Any:
    """Of bend moments, springs and dampers."""
    power = mpf(0)
    for i, section in enumerate(s for arm in vehicle["arms"] for s in arm["sections"]):
        k, rate = state["bend"][i], state["bend_rate"][i]
        stiff, damped = (section[x] * section["length"] for x in ("bending_stiffness", "damping"))
        power += dot(inputs["bend_moment"][i], rate)
        power -= stiff * dot(k, rate) + damped * dot(rate, rate)
    return power


def test_a_section_is_two_halves_that_bend_alike() -> None:
    """All equations of the halves, added up, are those of the whole; reached: 1e-29."""
    vehicle, state, inputs = parts(ALONE)
    whole = equations(vehicle, state, inputs)
    vehicle["arms"][0]["sections"] = halves(vehicle["arms"][0]["sections"][0])
    state["bend"], state["bend_rate"] = state["bend"] * 2, state["bend_rate"] * 2
    inputs["bend_moment"] = [[x / 2 for x in inputs["bend_moment"][0]]] * 2
    both = equations(vehicle, state, inputs)
    alike = [[mpf(i in (j, j - 2 * (j > 7))) for j in range(10)] for i in range(8)]
    assert largest_gap(product(product(alike, both.mass), transposed(alike)), whole.mass) < 1e-26
    for name in ("bias", "bias_of_uav", "bias_of_bends", "force"):
        assert largest_gap(apply(alike, getattr(both, name)), getattr(whole, name)) < 1e-26


def halves(section: Any) -> list[Any]:
    """A section cut in the middle."""
    half, near, far = section["length"] / 2, [], []
    for disk in section["disks"]:
        if disk["position"] > half:
            far.append(disk | {"position": disk["position"] - half})
        else:
            near.append(disk)
    return [section | {"length": half, "disks": disks} for disks in (near, far)]


def test_a_body_on_the_tip_lies_beyond_it_along_the_tangent() -> None:
    """In axes of a straight tip: x is the body's x; y and z are against the body's."""
    vehicle, state, _ = parts(ALONE)
    arm = vehicle["arms"][0]
    arm["attitude"], arm["mount"] = exact([0, 0, 0, 1]), exact([0, 0, 0])
    arm["sections"][0]["length"] = mpf(1)
    arm["tip"]["centre"] = exact([1, 2, 3])
    arm["tip"]["inertia"] = exact([[9, 1, 2], [1, 8, 3], [2, 3, 7]])
    state["attitude"], state["bend"] = exact([0, 0, 0, 1]), exact([[0, 0]])
    body = pieces(vehicle, FEW)
    on_tip = next(i for i, piece in enumerate(body) if piece.offset)
    place, axes = poses(body, vehicle, configuration(vehicle, state))[on_tip]
    assert place == [1, -2, -4]
    assert inertia_in_world(body[on_tip], axes) == [[9, -1, -2], [-1, 8, 3], [-2, 3, 7]]


def test_a_round_body_at_the_tip_is_a_disk() -> None:
    vehicle, state, inputs = parts(ALONE)
    other = copy.deepcopy(vehicle)
    mass, transverse, axial = exact([0.1, 2e-4, 3e-4])
    moments = [transverse, transverse, axial]
    inertia = [[moments[i] * (i == j) for j in range(3)] for i in range(3)]
    vehicle["arms"][0]["tip"] = {"mass": mass, "centre": exact([0, 0, 0]), "inertia": inertia}
    section = other["arms"][0]["sections"][0]
    section["disks"].append(
        {"position": section["length"], "mass": mass, "inertia": [transverse, axial]}
    )
    other["arms"][0]["tip"] = None
    found, expected = (accelerations(each, state, inputs, nodes=FEW) for each in (vehicle, other))
    assert largest_gap(found, expected) < 1e-24


@pytest.mark.parametrize("model", MODELS)
def test_body_axes_are_a_choice(model: str) -> None:
    """A level mount under a turned body is a tilted one under other body axes."""
    vehicle, state, inputs = parts(ALONE)
    vehicle["arms"][0]["attitude"], state["attitude"] = exact([0, 0, 0, 1]), exact([0, 0, 0, 1])
    expected = accelerations(vehicle, state, inputs, model, nodes=FEW)
    turned = exact([0.3, -0.5, 0.2, 0.7])
    back = transposed(from_quaternion(turned))
    inertia = vehicle["uav"]["inertia"]
    vehicle["uav"]["inertia"] = product(product(back, inertia), transposed(back))
    vehicle["arms"][0]["attitude"] = [*(-x for x in turned[:3]), turned[3]]
    vehicle["arms"][0]["mount"] = apply(back, vehicle["arms"][0]["mount"])
    state["attitude"] = turned
    state["angular_velocity"] = apply(back, state["angular_velocity"])
    inputs["moment"] = apply(back, inputs["moment"])
    found = accelerations(vehicle, state, inputs, model, nodes=FEW)
    expected[3:6] = apply(back, expected[3:6])
    assert largest_gap(found, expected) < 1e-24
