"""Kane's equations with many digits against themselves, and the kernels against them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start
from continuair.vehicle.layout import GENERAL, ONE_SECTION, TIP
from tests.oracles.kane import DIGITS, equations, solved
from tests.oracles.kane_algebra import (
    Matrix,
    dot,
    exact,
    from_quaternion,
    largest_gap,
    product,
)
from tests.oracles.kane_body import arc
from tests.oracles.kane_motion import rate, spin
from tests.oracles.make_kane_cases import MODELS, drawn, held

CASES = held()
FAR = CASES["1: far bent, all at once"]
LEVEL = [
    case
    for case in CASES.values()
    if len(case["state"]["bend"]) == 1
    and case["vehicle"]["arms"][0]["attitude"] == [0, 0, 0, 1]
    and not case["vehicle"]["arms"][0]["tip"]
]
"""What the kernels of one section can fly."""
GROUPS = (slice(0, 3), slice(3, 6), slice(6, 8))


@pytest.fixture(autouse=True)
def many_digits() -> Iterator[None]:
    with mp.workdps(DIGITS):
        yield


def parts(case: dict[str, Any]) -> tuple[Any, Any, Any]:
    """A case's vehicle, state and inputs."""
    return case["vehicle"], case["state"], case["inputs"]


def stored(case: dict[str, Any], model: str) -> np.ndarray:
    """v̇, ω̇ and k̈ of the file in one row."""
    return np.concatenate([np.ravel(each) for each in case["expected"][model].values()])


def test_file_holds_the_cases_that_are_drawn() -> None:
    assert [case["name"] for case in drawn()] == list(CASES)
    for case in drawn():
        assert parts(case) == parts(CASES[case["name"]])


@pytest.mark.parametrize("name", ["1: bent, all at once", "2: nearly straight"])
def test_stored_numbers_are_what_the_equations_give(name: str) -> None:
    rows = equations(*parts(CASES[name]))
    for model in MODELS:
        found = np.array(solved(rows, model), float)
        np.testing.assert_allclose(found, stored(CASES[name], model), rtol=1e-15, atol=0)


@pytest.mark.long
def test_more_nodes_more_digits_and_another_step_change_nothing() -> None:
    """At 5 rad, the farthest bend of all cases; reached: 1e-31."""
    rows = equations(*parts(FAR))
    with mp.workdps(80):
        fine = equations(*parts(FAR), nodes=32, step="1e-21")
        for model in MODELS:
            assert largest_gap(solved(rows, model), solved(fine, model)) < 1e-26


@pytest.mark.parametrize("bend", [[3.0, -4.0], [0.0, 1e-9], [0.0, 0.0]])
def test_slices_are_normal_to_the_backbone_and_do_not_twist(bend: list[float]) -> None:
    """The tangent is p', and no spin is along it; the tip is where a circle ends."""
    k, s, h = exact(bend), mpf("0.7"), mpf("1e-20")
    (p0, R0), (p1, R1), (p2, R2) = (arc(k, s + ds) for ds in (-h, mpf(0), h))
    tangent = [-row[2] for row in R1]
    assert largest_gap(rate(p0, p2, h), tangent) < 1e-35
    assert abs(dot(spin(R0, R1, R2, h), tangent)) < 1e-35
    κ, ψ = mp.hypot(*k), mp.atan2(k[1], k[0])
    twisted = product(about(2, ψ), about(1, -κ * s))
    assert largest_gap(product(twisted, about(2, -ψ)), R1) < 1e-55
    out, down = ((1 - mp.cos(κ * s)) / κ, mp.sin(κ * s) / κ) if κ else (mpf(0), s)
    assert largest_gap(p1, [out * mp.cos(ψ), out * mp.sin(ψ), -down]) < 1e-40


def about(axis: int, angle: Any) -> Matrix:
    """The rotation about an axis."""
    vector = [mp.sin(angle / 2) if i == axis else mpf(0) for i in range(3)]
    return from_quaternion([*vector, mp.cos(angle / 2)])


@pytest.mark.targets
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("case", LEVEL, ids=lambda case: case["name"])
def test_kernels_of_one_section_give_the_stored_numbers(case: dict[str, Any], model: str) -> None:
    """Each of v̇, ω̇ and k̈ by its own norm, or 1 where it is less; reached: 1e-12."""
    _, state, inputs = parts(case)
    row, where = np.zeros(ONE_SECTION.state), ONE_SECTION
    row[where.attitude] = state["attitude"]
    row[where.bend], row[where.bend_rate] = state["bend"][0], state["bend_rate"][0]
    row[where.velocity], row[where.angular_velocity] = state["velocity"], state["angular_velocity"]
    table = np.zeros((1, 1, where.inputs))
    for name in ("force", "moment", "bend_moment", "tip_wrench"):
        table[0, 0, where.of_input[name]] = np.ravel(inputs[name])
    engine = Engine(one_section(case["vehicle"]), model)
    drive = Drive(table, False, GENERAL + TIP, inputs["gravity"])
    rates = engine.derivative(Start(row[None], np.zeros((1, 2))), drive)[0]
    found, expected = rates[where.velocity.start :], stored(case, model)
    for group in GROUPS:
        size = max(1.0, float(np.linalg.norm(expected[group])))
        assert np.linalg.norm((found - expected)[group]) < 1e-11 * size


def one_section(vehicle: Any) -> ca.Vehicle:
    """A vehicle of the package with one level arm of one section."""
    arm = vehicle["arms"][0]
    section = arm["sections"][0]
    area = np.pi * section["radius"] ** 2
    changes: dict[str, Any] = {f"uav.{name}": value for name, value in vehicle["uav"].items()}
    changes |= {f"arm.{name}": section[name] for name in ("length", "radius", "damping", "disks")}
    changes["uav.mount"] = arm["mount"]
    changes["arm.density"] = section["mass_per_length"] / area
    second_moment = area * section["radius"] ** 2 / 4
    changes["arm.youngs_modulus"] = section["bending_stiffness"] / second_moment
    return ca.load_vehicle("slender").replace(changes)
