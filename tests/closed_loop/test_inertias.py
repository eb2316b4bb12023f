"""Inertias that controllers are tuned by, against the kinetic energy of flights."""

import numpy as np
import pytest

import continuair as ca
from continuair.controllers.inertias import straight_inertia
from continuair.equations.level import level_inertia
from tests.sections.strains import flying, rod


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
    assert energy == pytest.approx(float(start["kinetic_energy"][0]), rel=1e-12)


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
    energy = moving @ level_inertia(vehicle, (kappa[:, None] * along).ravel()) @ moving / 2
    assert energy == pytest.approx(float(start["kinetic_energy"][0]), rel=1e-12)


@pytest.mark.long
def test_an_arm_whose_strain_varies_moves_with_the_energy_that_its_inertia_gives() -> None:
    vehicle, random = flying(rod(bending=1, nodes=12)), np.random.default_rng(7)
    q, qd = np.zeros((2, 10))
    q[6:], qd[:] = random.normal(size=4), random.normal(size=10)
    scenario = ca.Scenario("moving", q, qd, duration=1e-4)
    start = ca.simulate(vehicle, scenario, sample=1e-4, variables=["kinetic_energy"])
    energy = qd @ level_inertia(vehicle, q[6:]) @ qd / 2
    assert energy == pytest.approx(float(start["kinetic_energy"][0]), rel=1e-9)
