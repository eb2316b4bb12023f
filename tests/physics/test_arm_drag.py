"""Drag of the arms and the wash of the rotors on them, against the paper's own Jacobians."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start
from continuair.equations import kinematics
from continuair.studies.check import facts
from continuair.typing import Model
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import FIELDS, GENERAL, ONE_SECTION, PAPER
from continuair.vehicle.rotors import AIR_DENSITY
from tests.refusals import refused

Array = np.ndarray

BARE = ca.load_vehicle(Path(__file__).parents[1] / "three_sections.toml")
BARE = BARE.replace({"arm.left.section.tip.radius": 0.003})
LEFT, RIGHT = "arm.left.section", "arm.1.section"
COEFFICIENTS = {f"{LEFT}.base": 1.2, f"{LEFT}.tip": 0.8, f"{RIGHT}.0": 1.1}
DRAGGED = BARE.replace({f"{name}.drag_coefficient": c for name, c in COEFFICIENTS.items()})
SLENDER = ca.load_vehicle("slender")
CYLINDER = SLENDER.replace({"arm.drag_coefficient": 1.1})
RNG = np.random.default_rng(11)
Q = np.array([0.1, 0.2, 0.3, 0.2, -0.4, 0.6, 1.5, 0.3, -2.0, 1.1, 1.2, -0.7])
QD = RNG.uniform(-3.0, 3.0, 12)


def generalised(vehicle: ca.Vehicle, q: Array, qd: Array, wash: Any = None) -> Array:
    """Σ Jᵀ f of three Gauss nodes of every section, f = -½ρ C_d d |v_n| v_n per length, v_n what is
    across the tangent; wash(point): velocity of the air at a point, world axes."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    found = np.zeros(len(q))
    for a, arm in enumerate(vehicle.arms):
        for k, section in enumerate(arm.section):
            s = 0.5 * section.length * (1.0 + nodes)
            J = kinematics.jacobian(vehicle, q, s, arm=a, section=k)[:, :3]
            v = J @ qd
            if wash is not None:
                v = v - wash(kinematics.position(vehicle, q, s, arm=a, section=k))
            t = kinematics.tangents(vehicle, q, s, arm=a, section=k)
            v = v - (v * t).sum(-1, keepdims=True) * t
            assert section.drag_coefficient is not None
            size = 0.5 * AIR_DENSITY * section.drag_coefficient * 2.0 * section.radius
            share = 0.5 * section.length * weights * size * np.linalg.norm(v, axis=1)
            found -= np.einsum("nij,ni->j", J, share[:, None] * v)
    return found


@pytest.mark.parametrize("model", ["coupled", pytest.param("decoupled", marks=pytest.mark.long)])
def test_drag_is_what_its_nodes_do_through_the_jacobian(model: Model) -> None:
    """Two sections in line and another arm; rounding of the Jacobians with polar coordinates."""
    found = ca.forward_dynamics(DRAGGED, Q, QD, model=model)
    tau = generalised(DRAGGED, Q, QD)
    expected = ca.forward_dynamics(BARE, Q, QD, tau, model=model)
    without = ca.forward_dynamics(BARE, Q, QD, model=model)
    assert np.abs(found - without).max() > 0.1
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(without).max())


@pytest.mark.long
def test_the_independent_arm_feels_the_air_on_a_base_at_rest() -> None:
    still = np.concatenate([np.zeros(6), QD[6:]])
    tau = np.concatenate([generalised(DRAGGED, Q, QD)[:6], generalised(DRAGGED, Q, still)[6:]])
    found = ca.forward_dynamics(DRAGGED, Q, QD, model="independent")
    expected = ca.forward_dynamics(BARE, Q, QD, tau, model="independent")
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-7)


ROTORS = {
    "layout": "quad_x",
    "lever": 0.2,
    "height": 0.02,
    "thrust_limits": [0.0, 14.0],
    "torque_per_thrust": 0.016,
    "lag": 0.04,
    "radius": 0.12,
}


def risen(x: Array) -> Array:
    """A cubic from 0 at -1 to 1 at 1."""
    part = np.clip(0.5 * (x + 1.0), 0.0, 1.0)
    return np.asarray(part**2 * (3.0 - 2.0 * part))


def test_rotors_wash_the_parts_of_an_arm_that_are_below_their_disks() -> None:
    """An arm that hangs from a boom's end and bends out of the wash; rotors turn differently."""
    bare = SLENDER.replace({"uav.mount": (0.14, 0.14, -0.05), "uav.rotors": ROTORS})
    blown = bare.replace({"arm.drag_coefficient": 1.1})
    q = np.array([0.0, 0.0, 1.0, 0.1, -0.2, 0.3, 0.32, 0.6])
    qd = np.array([0.5, -0.3, 0.2, 0.4, 0.1, -0.5, 0.3, 0.2])
    speeds = np.array([0.8, 0.6, 0.7, 0.5])
    R, corner, area = kinematics.rotation(q), 0.2 * np.sqrt(0.5), np.pi * 0.12**2
    hubs = corner * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])

    def wash(points: Array) -> Array:
        body = (points - q[:3]) @ R
        areas = ((body[:, None, :2] - hubs) ** 2).sum(axis=2) / 0.12**2
        inside = risen((1.0 - areas) / 0.5) * risen(-body[:, 2:] / (0.5 * 0.12))
        assert inside.max() == 1.0 and ((inside > 0.0) & (inside < 1.0)).any()
        induced = np.sqrt(14.0 * speeds**2 / (2.0 * AIR_DENSITY * area))
        return -(inside @ induced)[:, None] * R[:, 2]

    state = np.hstack([state_from_paper(q[None], qd[None], ONE_SECTION), speeds[None]])
    start = Start(state, branches_of(q[None], ONE_SECTION))
    rates = []
    for vehicle, tau in ((blown, np.zeros(8)), (bare, generalised(blown, q, qd, wash))):
        engine = Engine(vehicle, "coupled")
        inputs = np.zeros((1, 1, engine.layout.inputs))
        engine.layout.add(inputs, FIELDS["tau"], tau)
        rates.append(engine.derivative(start, Drive(inputs, False, GENERAL + PAPER, 9.81)))
    np.testing.assert_allclose(rates[0], rates[1], rtol=1e-10, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("lag", [0.0, 0.04])
def test_left_alone_rotors_hold_a_vehicle_whose_arms_hang_in_their_wash(lag: float) -> None:
    """Two stiff booms below a quadrotor: the wash pushes them down by a hundredth of the weight."""
    boom = {"length": 0.5, "radius": 0.008, "density": 400.0, "youngs_modulus": 2e11}
    ahead, behind = (
        {
            "name": name,
            "mount": [0.0, 0.0, -0.05],
            "attitude": Rotation.from_euler("y", angle, degrees=True).as_quat().tolist(),
            "section": [{**boom, "drag_coefficient": 1.2, "kappa_s": 1e-7}],
        }
        for name, angle in (("ahead", -90.0), ("behind", 80.0))
    )
    rotors = {**ROTORS, "layout": "quad_plus", "lever": 0.3, "lag": lag, "thrust_limits": [0, 15]}
    vehicle = ca.Vehicle(
        name="booms",
        uav={"mass": 2.0, "inertia": [0.03, 0.03, 0.05], "rotors": rotors},
        arm=[ahead, behind],
    )
    q = np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    flight = ca.simulate(vehicle, ca.Scenario("hover", q, duration=1.0), sample=0.1)
    # Along x it is pushed, as the boom behind is not level.
    np.testing.assert_allclose(flight.position[:, 1:], np.outer(np.ones(11), [0, 3]), atol=1e-4)
    thrusts = flight.rotor_thrust[0].to_numpy()
    induced = np.sqrt(thrusts / (2.0 * AIR_DENSITY * np.pi * 0.12**2))
    hubs = 0.3 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])

    def wash(points: Array) -> Array:
        areas = ((points[:, None, :2] - hubs) ** 2).sum(axis=2) / 0.12**2
        inside = risen((1.0 - areas) / 0.5) * risen((0.02 + 3.0 - points[:, 2:]) / (0.5 * 0.12))
        return -(inside @ induced)[:, None] * [0.0, 0.0, 1.0]

    down = generalised(vehicle, q, np.zeros(10), wash)[2]
    assert -0.1 * 9.81 * vehicle.mass < down < -0.005 * 9.81 * vehicle.mass
    assert thrusts.sum() + down == pytest.approx(9.81 * vehicle.mass, rel=1e-9)
    tight = vehicle.replace({"uav.rotors.thrust_limits": [0.0, 1.05 * float(thrusts.max())]})
    told = {each[0]: each[1] for each in facts(tight, None)}
    assert told["rotors' margin, arm straight"] == f"{1.0 - 1.0 / 1.05:.0%}" == "5%"


@pytest.mark.long
def test_tilted_rotors_hold_a_vehicle_against_what_the_wash_pushes_aside_too() -> None:
    """Six rotors of any wrench, and a stiff boom that leans under one: at rest for a second."""
    boom = {"length": 0.5, "radius": 0.008, "density": 400.0, "youngs_modulus": 2e11}
    leaning = Rotation.from_euler("ZY", [30.0, -45.0], degrees=True).as_quat().tolist()
    rotors = {**ROTORS, "layout": "hex_tilted", "tilt": 0.3, "lever": 0.3, "lag": 0.0}
    held = []
    for drag in ({}, {"drag_coefficient": 1.2}):
        vehicle = ca.Vehicle(
            name="leaning",
            uav={"mass": 2.0, "inertia": [0.03, 0.03, 0.05], "rotors": rotors},
            arm=[{"mount": [0, 0, -0.05], "attitude": leaning, "section": [{**boom, **drag}]}],
        )
        flight = ca.simulate(vehicle, ca.Scenario("hover", np.zeros(8), duration=1.0), sample=0.1)
        assert float(np.abs(flight.position).max()) < 2e-4
        assert vehicle.uav.rotors is not None
        held.append(vehicle.uav.rotors.allocation @ flight.rotor_thrust[0].to_numpy())
    assert abs(held[1] - held[0])[0] > 0.005


FINE: dict[str, Any] = {"method": "RK4", "step": 1e-4}


@pytest.mark.long
def test_an_arm_that_swings_through_the_edge_of_a_wash_is_followed() -> None:
    """A light arm, between the wash of a disk and still air: off by less than a thousandth."""
    changes = {
        "uav.rotors": {**ROTORS, "radius": 0.15},
        "arm.drag_coefficient": 1.2,
        "arm.radius": 0.012,
        "arm.density": 60.0,
        "arm.youngs_modulus": 2e6,
    }
    light = SLENDER.replace(changes)
    start = ca.Scenario("edge", (0, 0, 2, 0, 0, 0, 1.5, 0.8), bend_moment=swinging, duration=1.5)
    fine, steps, found = (
        ca.simulate(light, start, sample=0.01, variables=["tip_position"], **given)
        for given in (FINE, {"method": "RK4", "step": "auto"}, {})
    )
    for flight in (steps, found):
        off = np.linalg.norm(flight.tip_position - fine.tip_position, axis=1).max()
        assert off < 1e-3 * light.arm.length


@pytest.mark.long
def test_the_edges_of_a_wash_are_resolved() -> None:
    """A light arm that is let go crosses the wash of small rotors at 10 m/s."""
    rotors = {"layout": "quad_x", "lever": 0.15, "thrust_limits": [0.1, 14.0], "lag": 0.03}
    light = ca.Vehicle(
        name="light",
        uav={
            "mass": 1.6,
            "inertia": [0.015, 0.016, 0.03],
            "rotors": {**rotors, "torque_per_thrust": 0.015, "radius": 0.04},
        },
        arm={
            "length": 0.7,
            "radius": 0.03,
            "mass_per_length": 0.012,
            "bending_stiffness": 0.1,
            "damping_ratio": 0.01,
            "drag_coefficient": 1.2,
        },
    )
    command = [9.81 * light.mass / 4.0] * 4
    start = ca.Scenario("edges", (0, 0, 3, 0, 0, 0, 4, 0.75), rotor_command=command, duration=0.6)
    found = ca.simulate(light, start, sample=0.02, variables=["tip_position"], check=True)
    exact = ca.simulate(light, start, sample=0.02, variables=["tip_position"], rtol=1e-10)
    off = float(np.linalg.norm(found.tip_position - exact.tip_position, axis=1).max()) / 0.7
    assert off < 1e-3
    assert off < 3.0 * float(found.error_estimate)


def swinging(t: float) -> list[float]:
    return [0.02 * np.sin(7.0 * t), 0.02 * np.cos(5.8 * t)]


def test_wind_only_matters_relative_to_the_vehicle() -> None:
    """Carried along by the wind without gravity, it flies as in still air."""
    wind, q = np.array([2.0, -1.0, 0.5]), (0, 0, 0, 0.1, 0.2, 0.3, 0.8, 0.4)
    moving = (1.0, 2.0, -1.0, 0.3, 0.1, 0.2, 0.5, 0.2)
    given: dict[str, Any] = {"gravity": 0.0, "duration": 0.5}
    still = ca.simulate(CYLINDER, ca.Scenario("still", q, moving, **given), sample=0.01)
    carried = np.add(moving, [*wind, 0, 0, 0, 0, 0])
    blown = ca.simulate(CYLINDER, ca.Scenario("blown", q, carried, wind=wind, **given), sample=0.01)
    drift = wind * still.time.to_numpy()[:, None]
    np.testing.assert_allclose(blown.position - drift, still.position, atol=1e-10)
    np.testing.assert_allclose(blown.bend, still.bend, atol=1e-9)


def test_the_reaction_at_the_base_is_what_moves_the_uav() -> None:
    """m_u Δv = ∫ R f dt + m_u g t: what the arm puts on the UAV holds its own drag."""
    q, wind = (0, 0, 0, 0.1, 0.2, 0.3, 0.8, 0.4), (6.0, 3.0, 0.0)
    scenario = ca.Scenario("blown", q, wind=wind, duration=0.4)
    flight = ca.simulate(CYLINDER, scenario, method="RK4", step=2e-4)
    turn = Rotation.from_quat(flight.attitude.to_numpy())
    force = turn.apply(flight.base_force.to_numpy())
    ends = force[0] + force[-1] + 4.0 * force[1:-1:2].sum(0) + 2.0 * force[2:-1:2].sum(0)
    v = turn.apply(flight.velocity.to_numpy())
    gained = SLENDER.uav.mass * (v[-1] - v[0]) + [0.0, 0.0, SLENDER.uav.mass * 9.81 * 0.4]
    # Simpson's rule at 1 ms of what vibrates at ω = 48 rad/s.
    np.testing.assert_allclose(gained, 1e-3 / 3.0 * ends, atol=1e-6 * np.abs(force).max())
    assert float(np.abs(flight.base_force[0]).max()) > 0.01


def test_drag_without_a_radius_is_refused_in_one_sentence() -> None:
    with refused("arm.left.section.tip.radius"):
        ca.load_vehicle(Path(__file__).parents[1] / "three_sections.toml").replace(
            {"arm.left.section.tip.drag_coefficient": 1.0}
        )
