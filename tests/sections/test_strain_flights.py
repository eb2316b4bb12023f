"""Flights, equilibria and modes of arms whose strain varies along them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.equations.strain import rod_curve
from continuair.figures import plot
from continuair.interfaces.csv_table import to_csv
from continuair.interfaces.gltf import to_gltf
from continuair.interfaces.mcap_log import to_mcap
from continuair.vehicle.strain import Orders
from continuair.viewer.scene import scene
from tests.refusals import refused
from tests.sections.strains import flying, rod

LINEAR = flying(rod(bending=1))
FALL = ca.Scenario("fall", [0, 0, 1, 0.1, 0, 0, 1.0, 0.3, 0.2, 0.1], duration=0.2)
DAMPED = flying(rod(bending=1, damping_ratio=0.1))
STRETCHING = flying(rod(bending=1, stretch=0, damping_ratio=0.05))
STRETCHED = ca.Scenario("stretched", [0, 0, 1, 0, 0, 0, 1.0, 0, 0, 0, 1e-5], duration=0.3)
SIDEWAYS = Rotation.from_euler("y", -90, degrees=True).as_quat().tolist()


def test_exponentials_of_a_rod_converge_with_the_fourth_order() -> None:
    orders = Orders(2, 1, 1, 0)
    random = np.random.default_rng(0)
    strain = random.normal(size=len(orders.coordinates))
    strain[orders.turning :] *= 0.1
    ends = [rod_curve(orders, 0.5, strain, [0.5], 2**n)[0] for n in (3, 4, 5, 10)]
    errors = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([4.0, 4.0], abs=0.1)


def test_a_flight_with_few_nodes_is_that_of_its_vehicle() -> None:
    """Its tips are off the exact curve: with the fewest nodes, by more than 1e-3 of the arm."""
    few = flying(rod(bending=1, nodes=3))
    bent = ca.Scenario("bent", [0, 0, 1, 0, 0, 0, 8.0, 3.0, 2.0, -2.0], duration=1e-3)
    flight = ca.simulate(few, bent, sample=1e-3)
    ends = ca.backbone(few, flight, points=5).isel(arm=0, point=-1)
    off = float(np.abs(ends - flight.tip_position.isel(arm=0)).max())
    assert 5e-4 < off < 1e-2
    longer = few.replace({"arm.0.section.0.length": 0.6})
    with refused("vehicle"):
        ca.backbone(longer, flight)


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
    return abs(float(found.y[2, -1]))


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


@pytest.mark.long
def test_a_simulation_takes_the_steps_of_a_flight() -> None:
    flight = ca.simulate(LINEAR, FALL, method="RK4", step=1e-3, duration=0.01, sample=0.01)
    simulation = ca.Simulation(LINEAR, FALL, step=1e-3, control_period=0.01)
    simulation.step()
    strain = simulation.state[LINEAR.layout.bend]
    np.testing.assert_allclose(strain, flight.strain[-1], rtol=0, atol=1e-12)


def test_stretch_needs_the_implicit_method() -> None:
    with refused("method"):
        ca.simulate(STRETCHING, STRETCHED)
    with refused("method"):
        ca.run_pairs(STRETCHING, STRETCHED)


@pytest.mark.long
def test_stretch_is_integrated_with_the_second_order() -> None:
    options: dict[str, Any] = {"method": "implicit", "sample": 0.1, "variables": ["strain"]}
    ends = [
        ca.simulate(STRETCHING, STRETCHED, step=step, **options).strain[-1].to_numpy()
        for step in (4e-3, 2e-3, 1e-3)
    ]
    first, second = (np.linalg.norm(np.diff(ends, axis=0)[i]) for i in (0, 1))
    assert np.log2(first / second) == pytest.approx(2.0, abs=0.3)


@pytest.mark.long
def test_a_controller_holds_place_and_arm() -> None:
    start = [0.3, 0, 1, 0, 0, 0, 0.5, 0, 0, 0]
    law = ca.flight_controller(DAMPED)
    wanted = ca.Setpoints(position=[0, 0, 1])
    scenario = ca.Scenario("hover", start, duration=4.0, controller=law, setpoints=wanted)
    flight = ca.simulate(DAMPED, scenario, check=True)
    assert float(flight.error_estimate) < 1e-6
    np.testing.assert_allclose(flight.position[-1], [0, 0, 1], atol=0.01)
    np.testing.assert_allclose(flight.strain[-1], start[6:], atol=1e-3)


@pytest.mark.long
def test_a_camera_on_the_tip_reaches_its_image() -> None:
    law = ca.servoing(**ca.design(DAMPED, 3.0, conditioning=0.0))
    start = [0, 0, 3, 0, 0, 0, 0.3, 0, -0.2, 0]
    target = ca.Target(ca.paths.hold((0.1, -0.05, 0.3)), distance=2.0)
    scenario = ca.Scenario("seeing", start, duration=12.0, controller=law, target=target)
    flight = ca.simulate(DAMPED, scenario, sample=0.1, variables=["feature_error"])
    assert float(abs(flight.feature_error[0]).max()) > 50.0
    assert float(abs(flight.feature_error[-1]).max()) < 1.0


@pytest.mark.long
def test_advice_is_given_for_a_strain_that_varies() -> None:
    """Without damping of the base, a soft arm is decoupled for slow motion alone."""
    found = ca.advise(DAMPED, ["hover"])
    limit = found["excitations"]["bend"]["models"]["decoupled"]["limit_hz"]
    assert 0.1 < limit < found["clamped_hz"]


def test_a_flight_is_drawn_and_exported(tmp_path: Path) -> None:
    options: dict[str, Any] = {"rtol": 1e-9, "duration": 0.1, "sample": 0.01}
    flight = ca.simulate(LINEAR, FALL, **options)
    seen = scene(flight, LINEAR)
    tips = flight.tip_position.isel(arm=0)
    np.testing.assert_allclose(seen.bodies.lines[0][:, -1], tips, atol=1e-6)
    for name, write in (("a.csv", to_csv), ("a.glb", to_gltf), ("a.mcap", to_mcap)):
        write(flight, str(tmp_path / name))
    header, first, *_ = (tmp_path / "a.csv").read_text().splitlines()
    columns = dict(zip(header.split(","), first.split(","), strict=True))
    assert float(columns["strain_0.0.bend_x_1"]) == np.asarray(FALL.q)[7]
    assert len(plot.snapshots(flight, [0.0, 0.1]).axes) == 1
