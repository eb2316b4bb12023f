"""One coupling at a time: flights without it agree with the readable form, in the plane."""

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import continuair as ca
from continuair import equations
from continuair.analysis.couplings import attribution
from continuair.engine.adaptive import Tolerance
from continuair.flight.prepare import prepare
from continuair.flight.rollout import fly
from continuair.kernels.dynamics import COUPLINGS
from tests.refusals import refused

pytestmark = pytest.mark.targets

VEHICLE = ca.load_vehicle("paper").replace({"arm.length": 0.6, "arm.kappa_s": 0.0})
START = np.array([0.0, 0.0, 5.0, 0.0, 0.3, 0.0, 0.8, 0.0])
RATES = np.array([0.2, 0.0, -0.1, 0.0, 1.5, 0.0, 3.0, 0.0])
FORCE = np.array([4.0, 0.0, 12.0])
DURATION = 0.05
PLANE = [0, 2, 4, 6]
MASK = np.zeros((8, 8))
MASK[:6, :6] = MASK[6:, 6:] = 1.0


def tip_without(
    coupling: str, vehicle: ca.Vehicle, scenario: ca.Scenario, sample: float
) -> xr.DataArray:
    """Tip position of the coupled model without one coupling."""
    flight = prepare(
        vehicle, scenario, sample=sample, method="Tsit5", tolerance=Tolerance(relative=1e-6)
    )
    return fly(flight, f"without {coupling}", ("tip_position",))["tip_position"]


def readable(coupling: str) -> np.ndarray:
    """Tip position at the end, from M and C of the paper with blocks masked, motion in the plane.

    There the paper's rates are those of the body, so that M and C divide the couplings alike.
    """
    common = FORCE / VEHICLE.mass - [0.0, 0.0, 9.81]

    def rate(_: float, y: np.ndarray) -> np.ndarray:
        q, qd = np.zeros(8), np.zeros(8)
        q[PLANE], qd[PLANE] = y[:4], y[4:]
        M, C = equations.mass_matrix(VEHICLE, q), equations.coriolis_matrix(VEHICLE, q, qd)
        force = -equations.gravity_vector(VEHICLE, q)
        force[:3] += FORCE
        carried = np.zeros(8)
        carried[6:] = M[6:, :3] @ common
        if coupling == "coriolis":
            C = C * MASK
        elif coupling == "inertia":
            M, force = M * MASK, force - C @ qd - carried
            C = np.zeros((8, 8))
        else:
            force = force + carried
        rows = np.ix_(PLANE, PLANE)
        qdd = np.linalg.solve(M[rows], (force - C @ qd)[PLANE])
        return np.concatenate([y[4:], qdd])

    end = solve_ivp(
        rate,
        (0.0, DURATION),
        np.concatenate([START[PLANE], RATES[PLANE]]),
        rtol=1e-9,
        atol=1e-11,
    ).y[:4, -1]
    q = np.zeros(8)
    q[PLANE] = end
    return np.asarray(equations.position(VEHICLE, q, VEHICLE.arm.length))


@pytest.fixture(scope="module")
def scenario() -> ca.Scenario:
    return ca.Scenario("plane", START, RATES, force=FORCE, duration=DURATION)


@pytest.mark.long
@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_flight_without_one_coupling_agrees_with_the_readable_form(
    coupling: str, scenario: ca.Scenario
) -> None:
    tip = tip_without(coupling, VEHICLE, scenario, 2.5e-4).isel(time=-1).to_numpy()
    # A tolerance of 1e-6 errs by some 1e-7 m; carriage, the least of the couplings, moves the tip
    # by 2e-5.
    assert np.abs(tip - readable(coupling)).max() < 3e-7


def test_free_fall_carries_the_arm_along_and_hovering_does_not() -> None:
    """Dropping carriage bends the falling arm under its weight; in a hover it changes nothing."""
    falling = ca.Scenario("fall", [0, 0, 5, 0, 0.5, 0, 0, 0], duration=0.3)
    held = ca.Scenario(
        "hover", [0, 0, 5, 0, 0.5, 0, 0, 0], force=[0, 0, 9.81 * VEHICLE.mass], duration=0.3
    )
    shift = []
    for scenario in (falling, held):
        flight = ca.simulate(VEHICLE, scenario, sample=1e-2, method="Tsit5", rtol=1e-6)
        coupled = flight["tip_position"]
        without = tip_without("carriage", VEHICLE, scenario, 1e-2)
        shift.append(float(abs(without - coupled).max()))
    assert shift[0] > 1e-4
    assert shift[1] < 1e-13


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_batches_fly_as_their_runs_do(coupling: str, scenario: ca.Scenario) -> None:
    both, short = VEHICLE.replace({"uav.mass": [1.5, 2.5]}), scenario.replace(duration=0.05)
    together = tip_without(coupling, both, short, 2.5e-4)
    for run in range(2):
        alone = tip_without(coupling, both.select(run), short, 2.5e-4)
        np.testing.assert_allclose(together.isel(run=run), alone, rtol=0, atol=1e-13)


def test_attribution_tells_how_far_each_of_these_flights_is_from_the_coupled_one(
    scenario: ca.Scenario,
) -> None:
    found = attribution(VEHICLE, scenario, 1e-2)
    flight = ca.simulate(VEHICLE, scenario, sample=1e-2, method="Tsit5", rtol=1e-6)
    coupled = flight["tip_position"]
    assert list(found) == [*COUPLINGS, "decoupled"]
    for coupling in COUPLINGS:
        off = tip_without(coupling, VEHICLE, scenario, 1e-2) - coupled
        rms = float((off**2).sum("axis").mean("time") ** 0.5)
        assert found[coupling]["rmse_t_m"] == pytest.approx(rms, rel=1e-12)


def test_loops_around_a_camera_are_refused() -> None:
    law = ca.servoing(**ca.design(ca.load_vehicle("paper"), 6.0))
    looking = ca.Scenario("look", [0] * 8, controller=law, target=ca.Target(ca.paths.hold()))
    with refused("scenario"):
        attribution(VEHICLE, looking, 1e-2)
