"""Errors that grow with the flight or multiply are told of, though single steps look exact."""

import numpy as np
import pytest

import continuair as ca
from continuair.scenario.scenarios import Scenario

VEHICLE = ca.load_vehicle("paper")


def on_top() -> ca.Vehicle:
    """An arm that stands on its UAV, which so falls over slowly under a force that carries it."""
    section = {
        "length": 0.6,
        "mass_per_length": 0.1,
        "bending_stiffness": 3.0,
        "damping_ratio": 0.1,
    }
    return ca.Vehicle(
        name="on top",
        uav={"mass": 1.8, "inertia": [0.02, 0.022, 0.035]},
        arm=[
            {
                "mount": [0.0, 0.0, 0.05],
                "attitude": [1.0, 0.0, 0.0, 0.0],
                "section": [section | {"radius": 0.004}],
                "tip": {"mass": 0.2, "inertia": [2e-5] * 3},
            }
        ],
    )


def falling_over() -> tuple[ca.Vehicle, Scenario]:
    vehicle = on_top()
    lift = [0.0, 0.0, 9.81 * vehicle.mass]
    return vehicle, Scenario("lift", [0, 0, 3, 0.05, 0, 0, 0.5, 0.4], force=lift, duration=20.0)


def drifting(kappa: float, duration: float) -> tuple[ca.Vehicle, Scenario]:
    """Rotors in open loop, whose thrust turns with what the arm that is let go leaves of spin."""
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0], "lag": 0.04}
    vehicle = VEHICLE.replace(
        {"arm.damping_ratio": 0.1, "uav.rotors": {**rotors, "torque_per_thrust": 0.02}}
    )
    command = [9.81 * vehicle.mass / 4.0] * 4
    q = [0, 0, 3, 0, 0, 0, kappa, 0.4]
    return vehicle, Scenario("let go", q, rotor_command=command, duration=duration)


@pytest.mark.parametrize(
    ("flown", "method"),
    [(falling_over(), "RK4"), (drifting(1.0, 5.0), "RK4"), (drifting(0.1, 5.0), "implicit")],
)
@pytest.mark.filterwarnings("ignore:step_error reaches", "ignore:nrmse_r and rmse_r_rad are NaN")
def test_it_knows_errors_that_grow_with_the_flight(
    flown: tuple[ca.Vehicle, Scenario], method: str
) -> None:
    """As drift, or where it is unstable, and not those of single steps alone."""
    vehicle, scenario = flown
    found = ca.simulate(vehicle, scenario, sample=0.05, method=method)
    fine = ca.simulate(vehicle, scenario, sample=0.05, step=2.5e-4)
    off = np.linalg.norm(found.tip_position - fine.tip_position, axis=-1).max()
    off = float(off / np.max(vehicle.reach))
    assert 0.3 * off < float(found.step_error) < 30.0 * off
    pairs = ca.run_pairs(vehicle, scenario, ["decoupled"], sample=0.05, method=method)
    told = float(pairs.step_error.sel(model="coupled")[0])
    assert told == pytest.approx(float(found.step_error), rel=0.3)


def tumbling() -> tuple[ca.Vehicle, Scenario]:
    """An arm on top of a UAV that a force carries: chaotic once it has fallen over."""
    section = {"length": 0.5, "mass_per_length": 0.06, "bending_stiffness": 0.5}
    arm = {
        "mount": [0.0, 0.0, 0.05],
        "attitude": [1.0, 0.0, 0.0, 0.0],
        "section": [section | {"damping_ratio": 0.02}],
        "tip": {"mass": 0.1, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]},
    }
    uav = {"mass": 1.5, "inertia": [0.015, 0.018, 0.027]}
    vehicle = ca.Vehicle(name="on top", uav=uav, arm=[arm])
    q, spin = [0, 0, 5, 0.02, 0, 0, 0.2, 0.3], [0, 0, 0, 0.1, 0.05, 0, 0, 0]
    lift = [0.0, 0.0, 9.81 * vehicle.mass]
    return vehicle, Scenario("lift", q, spin, force=lift, duration=60.0)


def limp(controlled: bool) -> tuple[ca.Vehicle, Scenario]:
    """Two sections that swing far, as a double pendulum does, the UAV held or carried."""
    sections = [(0.25, 0.08, 0.161, 0.005), (0.29, 0.113, 0.0198, 0.0)]
    q, duration = [0, 0, 5, 0, 0, 0, 5.76, -2.2, 3.332, -0.85], 10.0
    mass, tip = 4.0, 0.1
    if not controlled:
        sections = [(0.37, 0.074, 0.4015, 0.005), (0.48, 0.078, 0.0282, 0.0)]
        q, duration = [0, 0, 5, 0, 0, 0, 1.264, 2.42, 1.166, 2.88], 40.0
        mass, tip = 0.5, 0.3
    names = ("name", "length", "mass_per_length", "bending_stiffness", "damping_ratio")
    chain = [dict(zip(names, (f"s{i}", *each), strict=True)) for i, each in enumerate(sections)]
    body = {"mass": tip, "centre": [0.0, 0.0, 0.02], "inertia": [2e-5, 2e-5, 1e-5]}
    arm = {"mount": [0.0, 0.0, -0.05], "section": chain, "tip": body}
    inertia = [0.01 * mass, 0.012 * mass, 0.018 * mass]
    vehicle = ca.Vehicle(name="limp", uav={"mass": mass, "inertia": inertia}, arm=[arm])
    if controlled:
        law = ca.flight_controller(vehicle, bend_bandwidth=0.0)
        return vehicle, Scenario("swing", q, controller=law, duration=duration)
    rates, lift = [0, 0, 0, -0.02, -0.01, -0.04, 0, 0, 0, 0], [0, 0, 9.81 * vehicle.mass]
    return vehicle, Scenario("swing", q, rates, force=lift, duration=duration)


@pytest.mark.long
@pytest.mark.parametrize("flown", [tumbling(), limp(controlled=False), limp(controlled=True)])
@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_it_knows_errors_that_multiply(flown: tuple[ca.Vehicle, Scenario]) -> None:
    """By thousands and more, in flights that single steps would call exact."""
    vehicle, scenario = flown
    found = ca.simulate(vehicle, scenario, variables=["tip_position"])
    fine = ca.simulate(vehicle, scenario, step=1.25e-4, variables=["tip_position"])
    off = float(np.linalg.norm(found.tip_position - fine.tip_position, axis=-1).max())
    off /= float(np.max(vehicle.reach))
    assert off > 1e-3
    assert off / 20.0 < float(found.step_error) < 20.0 * off


@pytest.mark.filterwarnings("ignore:step_error reaches")
def test_what_a_run_is_told_to_grow_by_hangs_on_no_other_run_of_its_batch() -> None:
    """Of vehicles with steps of their own."""
    light, lift = VEHICLE.replace({"uav.mass": [1.0, 3.0]}), np.zeros((2, 3))
    lift[:, 2] = 9.81 * np.asarray(light.mass)
    together = Scenario("lift", [0, 0, 3, 0.05, 0, 0, 0.5, 0.4], force=lift, duration=4.0)
    found = ca.simulate(light, together, sample=0.02)
    assert found["step"][0] != found["step"][1]
    for run in (0, 1):
        alone = ca.simulate(light.select(run), together.replace(force=lift[run]), sample=0.02)
        assert float(alone.step_error) == float(found.step_error[run])
        np.testing.assert_array_equal(alone.tip_position, found.tip_position[run])


@pytest.mark.filterwarnings("ignore::continuair.ContinuairWarning")
def test_errors_that_multiply_under_a_pull_on_the_tip_are_told() -> None:
    """A limp arm on a light UAV that a constant force on its tip whips about: errors multiply by
    thousands, and those of a step and of half of it have no order."""
    uav = {"mass": 0.18, "inertia": [6e-4, 6e-4, 1e-3], "mount": [0.02, 0.0, -0.02]}
    arm = {"length": 0.3, "mass_per_length": 0.02, "bending_stiffness": 0.004}
    vehicle = ca.Vehicle(name="whipped", uav=uav, arm={**arm, "damping_ratio": 0.01})
    weight = 9.81 * float(vehicle.mass)
    for pull, duration in ((1.0, 3.0), (1.0, 2.0), (0.7, 3.0)):
        scenario = ca.Scenario(
            "whip", (0, 0, 5, 0, 0, 0, 2.0, 0.4), force=(0, 0, weight), duration=duration,
            tip_wrench=(0.3 * pull, 0.2 * pull, 0.9 * pull, 0, 0, 0),
        )  # fmt: skip
        flight = ca.simulate(vehicle, scenario, sample=0.02)
        exact = ca.simulate(vehicle, scenario, sample=0.02, method="DOP853", tolerance=1e-12)
        assert int(flight.status) == int(exact.status) == 0
        off = np.linalg.norm(flight.tip_position - exact.tip_position, axis=-1).max() / 0.3
        assert off < max(1e-3, 2.0 * float(flight.step_error))
