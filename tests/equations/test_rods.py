"""Equations for sections of any kind are those in the paper's coordinates."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations as eq


@pytest.mark.parametrize("name", ["paper", "two_section", "dual_arm"])
@pytest.mark.parametrize("mask", ["coupled", "block"])
def test_arcs_accelerate_as_in_polar_coordinates(name: str, mask: Any) -> None:
    vehicle, random = ca.load_vehicle(name), np.random.default_rng(3)
    bends = vehicle.layout.bends
    common: dict[str, Any] = {
        key: random.normal(size=3) for key in ("angular_velocity", "force", "moment")
    }
    common["attitude"] = random.normal(size=4)
    own = random.normal(size=(3, bends))
    strain: dict[str, Any] = dict(zip(("strain", "strain_rate", "strain_force"), own, strict=True))
    pairs = own.reshape(3, -1, 2)
    bend: dict[str, Any] = dict(zip(("bend", "bend_rate", "bend_moment"), pairs, strict=True))
    found = eq.rod_accelerations(vehicle, **common, **strain, mask=mask)
    expected = eq.accelerations(vehicle, **common, **bend, mask=mask)
    for one, other in zip(found, expected, strict=True):
        assert np.linalg.norm(one - np.ravel(other)) < 1e-10 * np.linalg.norm(other)
