"""Accelerations of any number of arms and sections: against Kane's equations, and the kernels."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations as eq
from continuair.typing import Model
from tests.equations.trees import TREES, flights, of_case
from tests.oracles.make_kane_cases import held
from tests.refusals import refused

MASKS = {"coupled": "coupled", "decoupled": "block"}
MODELS = pytest.mark.parametrize("model", MASKS)
# Polar coordinates lose their digits towards the straight section.
CASES = [
    case for case in held().values() if np.linalg.norm(case["state"]["bend"], axis=1).min() > 0.05
]


def gap(found: Sequence[Any], expected: Sequence[Any]) -> float:
    """The largest error of v̇, ω̇ and k̈, each as a share of its own norm, or of 1 where less."""
    pairs = [(np.asarray(a), np.asarray(b)) for a, b in zip(found, expected, strict=True)]
    norms = [(float(np.linalg.norm(a - b)), float(np.linalg.norm(b))) for a, b in pairs]
    return max(error / max(1.0, size) for error, size in norms)


@MODELS
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_readable_equations_are_kanes(case: dict[str, Any], model: str) -> None:
    """Reached: 2e-13 with four sections, 5e-14 with fewer."""
    found = eq.accelerations(
        of_case(case["vehicle"]), **case["state"], **case["inputs"], mask=MASKS[model]
    )
    assert gap(found, list(case["expected"][model].values())) < 1e-12


def largest_gap_of_kernels(vehicle: ca.Vehicle, model: Model, states: int, seed: int) -> float:
    """Over random states; polar roundings at |κ| near 0.05 1/m leave up to 3e-11."""
    given = flights(vehicle, states, seed)
    fast = ca.accelerations(vehicle, **given, model=model)
    gaps = []
    for i in range(states):
        alone = {name: value[i] for name, value in given.items()}
        slow = eq.accelerations(vehicle, **alone, mask=MASKS[model])
        gaps.append(gap([group[i] for group in fast], slow))
    return max(gaps)


@MODELS
@pytest.mark.parametrize(
    "vehicle",
    [
        # A kernel for each shape and model; two sections and two arms are in the short tests.
        pytest.param(tree, id=name, marks=[pytest.mark.long] * (name not in ("2", "1+1")))
        for name, tree in TREES.items()
    ],
)
def test_kernels_are_the_readable_equations(vehicle: ca.Vehicle, model: Model) -> None:
    assert largest_gap_of_kernels(vehicle, model, 8, seed=61) < 1e-10


@pytest.mark.soak
@MODELS
def test_kernels_are_the_readable_equations_at_a_thousand_states(model: Model) -> None:
    gaps = [largest_gap_of_kernels(vehicle, model, 200, seed=62) for vehicle in TREES.values()]
    assert max(gaps) < 1e-10


@MODELS
@pytest.mark.parametrize("name", ["paper", "two_section"])
def test_below_kappa_s_they_are_those_of_the_bend_that_is_given(name: str, model: Model) -> None:
    """Bend vectors need no Remark 1, by which half of κ_s would count as κ_s."""
    vehicle = ca.load_vehicle(name)
    bend = np.array([[4e-4, 3e-4], [0.3, 0.1]])[: vehicle.sections]
    bend_rate = np.array([[0.1, 0.3], [0.2, -0.1]])[: vehicle.sections]
    spin, lift = np.array([0.2, 0.1, 0.3]), np.array([0.0, 0.0, 25.0])
    given: dict[str, Any] = {
        "bend": bend,
        "bend_rate": bend_rate,
        "angular_velocity": spin,
        "force": lift,
    }
    found = eq.accelerations(vehicle, **given, mask=MASKS[model])
    expected = ca.accelerations(vehicle, **given, model=model)
    assert gap(found, expected) < 1e-6


def test_what_is_missing_is_zero() -> None:
    vehicle = TREES["2+1"]
    bend = np.full((3, 2), 0.7)
    vectors = ("velocity", "angular_velocity", "force", "moment")
    zeros: dict[str, Any] = {name: np.zeros(3) for name in vectors}
    zeros |= {"bend_rate": np.zeros((3, 2)), "bend_moment": np.zeros((3, 2))}
    zeros |= {"tip_wrench": np.zeros((2, 6)), "attitude": [0, 0, 0, 2]}
    all_given = eq.accelerations(vehicle, bend=bend, **zeros)
    for a, b in zip(eq.accelerations(vehicle, bend=bend), all_given, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("words", "field"),
    [
        ({"bend": np.ones(2)}, "bend"),
        ({"bend": [[1, 0], [0, 0], [0, 1]]}, "bend"),
        ({"attitude": np.zeros(4)}, "attitude"),
        ({"attitude": [0, np.sqrt(0.5), 0, np.sqrt(0.5)]}, "attitude"),
        ({"tip_wrench": np.ones(6)}, "tip_wrench"),
        ({"mask": "decoupled"}, "mask"),
    ],
)
def test_a_bad_state_is_named(words: dict[str, Any], field: str) -> None:
    with refused(field):
        eq.accelerations(TREES["2+1"], **({"bend": np.ones((3, 2))} | words))
