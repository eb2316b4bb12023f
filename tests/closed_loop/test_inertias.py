"""Inertias that controllers are tuned by, against the kinetic energy of flights."""

import numpy as np
import pytest

import continuair as ca
from continuair.controllers.inertias import straight_inertia


@pytest.mark.parametrize("name", ["paper", "two_section", "dual_arm"])
def test_a_straight_vehicle_moves_with_the_energy_that_its_inertia_gives(name: str) -> None:
    vehicle, random = ca.load_vehicle(name), np.random.default_rng(5)
    rates, towards = random.normal(size=vehicle.sections), random.normal(size=vehicle.sections)
    q, qd = np.zeros((2, 6 + 2 * vehicle.sections))
    qd[:6] = random.normal(size=6)
    q[7::2], qd[6::2] = towards, rates
    start = ca.simulate(vehicle, ca.Scenario("moving", q, qd, duration=1e-4), sample=1e-4)
    bend_rates = rates[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=-1)
    moving = np.concatenate([qd[:6], bend_rates.ravel()])
    energy = moving @ straight_inertia(vehicle) @ moving / 2
    assert energy == pytest.approx(float(start["kinetic_energy"][0]), rel=1e-7)
