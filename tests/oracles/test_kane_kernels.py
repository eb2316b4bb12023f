"""The kernels against Kane's equations with many digits, for every shape of arms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import continuair as ca
from tests.oracles.make_kane_cases import MODELS, held

CASES = held()
SECTION = ("length", "bending_stiffness", "mass_per_length", "radius", "damping", "disks")
NOTHING = {"mass": 0.0, "centre": [0.0, 0.0, 0.0], "inertia": np.zeros((3, 3))}
GROUPS = ("acceleration", "angular_acceleration", "bend_acceleration")
SHAPES = ("1", "2", "3", "4", "1+1", "2+2", "1+3")
OFTEN = ("1", "2", "1+1")
"""Shapes whose kernels are compiled in every run of the tests."""


def vehicle_of(case: dict[str, Any]) -> ca.Vehicle:
    """The vehicle of a case. A body without mass on every tip spares kernels of their own."""
    arms = [
        {
            "mount": arm["mount"],
            "attitude": arm["attitude"],
            "section": [{name: each[name] for name in SECTION} for each in arm["sections"]],
            "tip": arm["tip"] or NOTHING,
        }
        for arm in case["vehicle"]["arms"]
    ]
    return ca.Vehicle(name=case["name"], uav=case["vehicle"]["uav"], arm=arms)


def cases_of(shape: str) -> list[dict[str, Any]]:
    """Those with turned mounts: what is level has kernels of its own."""
    named = [case for name, case in CASES.items() if name.split(":")[0] == shape]
    return [case for case in named if "level mount" not in case["name"]]


def marked(shape: str) -> Any:
    return shape if shape in OFTEN else pytest.param(shape, marks=pytest.mark.slow)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("shape", [marked(shape) for shape in SHAPES])
def test_accelerations_are_those_of_kanes_equations(shape: str, model: str) -> None:
    """Each of v̇, ω̇ and k̈ by its own norm, or 1 where it is less; reached: 1.1e-12."""
    cases = cases_of(shape)
    assert len(cases) == 9
    for case in cases:
        found = ca.accelerations(vehicle_of(case), **case["state"], **case["inputs"], model=model)
        for group, values in zip(GROUPS, found, strict=True):
            expected = np.array(case["expected"][model][group])
            size = max(1.0, float(np.linalg.norm(expected)))
            assert np.linalg.norm(values - expected) < 1e-11 * size, (case["name"], group)


@pytest.mark.parametrize("name", ["2: far bent, level mount", "2: nearly straight, level mount"])
def test_arms_that_are_neither_turned_nor_loaded_need_no_kernel_for_it(name: str) -> None:
    case = CASES[name]
    case["vehicle"]["arms"][0]["tip"] = None
    bare = vehicle_of(case).describe()
    del bare["arm"][0]["tip"]
    found = ca.accelerations(ca.Vehicle(**bare), **case["state"], **case["inputs"])
    for group, values in zip(GROUPS, found, strict=True):
        expected = np.array(case["expected"]["coupled"][group])
        assert np.linalg.norm(values - expected) < 1e-11 * np.linalg.norm(expected)
