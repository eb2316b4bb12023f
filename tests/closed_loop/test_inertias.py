"""Inertias that controllers are tuned by, against the kinetic energy of flights."""

import numpy as np
import pytest

import continuair as ca
from continuair.controllers.inertias import held_inertia, straight_inertia


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


@pytest.mark.parametrize("name", ["paper", "two_section", "dual_arm"])
def test_a_bent_vehicle_moves_with_the_energy_that_its_inertia_gives(name: str) -> None:
    vehicle, random = ca.load_vehicle(name), np.random.default_rng(6)
    kappa, towards, spin = random.normal(size=(3, vehicle.sections))
    kappa = np.abs(kappa) + 0.3
    q, qd = np.zeros((2, 6 + 2 * vehicle.sections))
    q[6::2], q[7::2], qd[6::2], qd[7::2] = (
        kappa,
        towards,
        random.normal(size=vehicle.sections),
        spin,
    )
    qd[:6] = random.normal(size=6)
    start = ca.simulate(vehicle, ca.Scenario("moving", q, qd, duration=1e-4), sample=1e-4)
    along = np.stack([np.cos(towards), np.sin(towards)], axis=-1)
    across = np.stack([-np.sin(towards), np.cos(towards)], axis=-1)
    rates = qd[6::2, None] * along + (kappa * spin)[:, None] * across
    moving = np.concatenate([qd[:6], rates.ravel()])
    energy = moving @ held_inertia(vehicle, kappa[:, None] * along) @ moving / 2
    assert energy == pytest.approx(float(start["kinetic_energy"][0]), rel=1e-7)
