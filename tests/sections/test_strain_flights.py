"""Flights, equilibria and modes of arms whose strain varies along them."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.equations.strain import rod_curve
from continuair.vehicle.strain import Orders
from tests.sections.strains import flying, rod

LINEAR = flying(rod(bending=1))
FALL = ca.Scenario("fall", [0, 0, 1, 0.1, 0, 0, 1.0, 0.3, 0.2, 0.1], duration=0.2)
SIDEWAYS = Rotation.from_euler("y", -90, degrees=True).as_quat().tolist()


def test_exponentials_of_a_rod_converge_with_the_fourth_order() -> None:
    orders = Orders(2, 1, 1, 0)
    random = np.random.default_rng(0)
    strain = random.normal(size=len(orders.coordinates))
    strain[orders.turning :] *= 0.1
    ends = [rod_curve(orders, 0.5, strain, [0.5], 2**n)[0] for n in (3, 4, 5, 10)]
    errors = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([4.0, 4.0], abs=0.1)


def test_a_free_flight_keeps_its_energy_and_its_momentum_falls_with_the_weight() -> None:
    flight = ca.simulate(LINEAR, FALL, rtol=1e-9, sample=0.01)
    energy = flight.kinetic_energy + flight.gravity_energy + flight.elastic_energy
    stored = float(flight.elastic_energy[0])
    assert float(abs(energy - energy[0]).max()) < 1e-8 * stored
    fallen = -9.81 * LINEAR.mass * flight.time
    np.testing.assert_allclose(flight.linear_momentum.sel(axis="z"), fallen, atol=1e-9)
    ends = ca.backbone(LINEAR, flight, points=5).isel(arm=0, point=-1)
    np.testing.assert_allclose(ends, flight.tip_position.isel(arm=0), atol=1e-8)


def elastica(load: float) -> float:
    """The sag of a level rod under its own weight, over its length; load: weight l²/(E I)."""

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], -load * (1.0 - s) * np.cos(y[0]), np.sin(y[0])])

    found = solve_bvp(
        slopes, lambda a, b: np.array([a[0], b[1], a[2]]), np.linspace(0.0, 1.0, 200),
        np.zeros((3, 200)), tol=1e-10, max_nodes=100_000,
    )  # fmt: skip
    return -float(found.y[2, -1])


@pytest.mark.parametrize(
    ("bending", "error"),
    [
        (1, 6e-3),
        pytest.param(2, 5e-4, marks=pytest.mark.long),
        pytest.param(3, 1e-4, marks=pytest.mark.long),
    ],
)
def test_a_level_arm_sags_as_the_elastica(bending: int, error: float) -> None:
    vehicle = flying(rod(bending=bending), attitude=SIDEWAYS)
    (section,) = vehicle.arms[0].section
    for load, share in ((5.0, 1.0), (0.5, 0.02)):
        gravity = load * section.bending_stiffness / section.length**3 / section.mass_per_length
        rest = ca.trim(vehicle, gravity=gravity)
        end, _ = rod_curve(section.orders, section.length, rest.q[6:], [section.length])
        sag = float(np.linalg.norm(end[0, :2])) / section.length
        assert sag == pytest.approx(elastica(load), rel=share * error)


def test_clamped_modes_are_those_of_the_clamped_rod() -> None:
    (section,) = LINEAR.arms[0].section
    found = ca.modes(LINEAR, base="clamped", gravity=0.0).frequencies
    assert found[:2] == pytest.approx(2 * [section.clamped_frequency], rel=1e-6)


def test_a_simulation_takes_the_steps_of_a_flight() -> None:
    flight = ca.simulate(LINEAR, FALL, method="RK4", step=1e-3, duration=0.01, sample=0.01)
    simulation = ca.Simulation(LINEAR, FALL, step=1e-3, control_period=0.01)
    simulation.step()
    strain = simulation.state[LINEAR.layout.bend]
    np.testing.assert_allclose(strain, flight.strain[-1], rtol=0, atol=1e-12)
