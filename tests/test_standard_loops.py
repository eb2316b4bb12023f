"""Standard excitations in a loop: the hover is held, the arm is not, and loads swell."""

from typing import Any, cast

import numpy as np
import pytest

import continuair as ca
from continuair.studies.standard_excitations import standard_scenario
from continuair.studies.standard_loops import LOOPS, bent_growth, hover_loop
from tests.refusals import refused

VEHICLE = ca.load_vehicle("slender")
ROTORS = {
    "layout": "quad_x",
    "lever": 0.25,
    "thrust_limits": [0.0, 15.0],
    "lag": 0.03,
    "torque_per_thrust": 0.02,
}


@pytest.mark.parametrize("loop", LOOPS)
def test_without_a_load_every_loop_leaves_the_bent_arm_still(loop: str) -> None:
    scenario = standard_scenario("force", VEHICLE, load=0.0, bend=0.5, periods=2.0, loop=loop)
    flight = ca.simulate(VEHICLE, scenario, sample=0.02)
    tip = flight["tip_position"].to_numpy()
    # The law makes the arm's weight anew at every instant, to rounding.
    assert np.abs(tip - tip[0]).max() < 1e-10
    assert (scenario.controller is None) == (loop == "none")


def offset_after_a_push(loop: str, bandwidth: float) -> float:
    """How far the UAV is after a push of a tenth of its weight for a second, 9 s after it [m]."""
    scenario = standard_scenario("release", VEHICLE, bend=0.0, loop=loop, bandwidth=bandwidth)
    push = 0.1 * VEHICLE.mass * 9.81
    pushed = scenario.replace(
        force=lambda t: np.array([push * (t < 1.0), 0.0, 0.0]), duration=10.0, jumps=[1.0]
    )
    place = ca.simulate(VEHICLE, pushed, sample=0.1)["position"].to_numpy()
    assert abs(place[-1, 2] - place[0, 2]) < 0.02
    return float(place[-1, 0] - place[0, 0])


def test_a_place_is_held_by_the_position_loop_alone() -> None:
    # One second at 0.981 m/s², and what it gained for nine more: 9.3 m of a rigid vehicle. The arm,
    # which lags, tilts it forward meanwhile.
    assert 9.3 < offset_after_a_push("attitude", 8.0) < 12.0
    assert abs(offset_after_a_push("position", 20.0)) < 0.05


@pytest.mark.long
def test_a_loop_with_its_arm_bent_grows_as_its_flights_do() -> None:
    """An arm that leaves upwards: a tilt of 1e-6 rad, from the second four seconds to the third."""
    arm = {
        "section": [{"length": 0.6, "bending_stiffness": 0.4, "mass_per_length": 0.1,
                     "damping_ratio": 0.05}],
        "attitude": [0.0, -np.sin(np.pi / 3.0), 0.0, np.cos(np.pi / 3.0)],
        "tip": {"mass": 0.1, "inertia": [1e-4, 1e-4, 1e-4]},
    }  # fmt: skip
    vehicle = ca.Vehicle(name="up", uav={"mass": 2.0, "inertia": [0.02, 0.02, 0.04]}, arm=[arm])
    held = cast(ca.Controller, hover_loop(vehicle, "position"))
    scenario = standard_scenario("force", vehicle, load=0.0, loop=held)
    q = np.array(scenario.q)
    tilted = scenario.replace(q=q + 1e-6 * np.eye(len(q))[3:5].sum(0), duration=12.0)
    turning = np.linalg.norm(ca.simulate(vehicle, tilted, sample=0.01)["angular_velocity"], axis=1)
    before, after = turning[400:800].max(), turning[800:].max()
    growth = bent_growth(vehicle, held, q)
    assert growth == pytest.approx(np.log(after / before) / 4.0, rel=0.05)
    assert growth > 0.1


def test_rotors_fly_the_loop_where_there_are_any() -> None:
    vehicle = VEHICLE.replace({"uav.rotors": ROTORS})
    scenario = standard_scenario("moment", vehicle, loop="position")
    flight = ca.simulate(vehicle, scenario, sample=0.02)
    weight = vehicle.mass * 9.81
    assert float(flight["rotor_thrust"].sum("rotor").mean()) == pytest.approx(weight, rel=0.02)


def test_a_fall_has_no_loop_and_a_release_has() -> None:
    found = {
        name: standard_scenario(name, VEHICLE, loop="position") for name in ("fall", "release")
    }
    assert found["fall"].controller is None
    assert found["release"].controller is not None
    assert found["release"].force is None and found["release"].bend_moment is None


def test_a_swelling_load_grows_smoothly_to_its_size() -> None:
    plain, swelling = (
        standard_scenario("force", VEHICLE, loop="position", swell=swell) for swell in (0.0, 0.4)
    )
    until = 0.4 * swelling.duration
    one, other = cast(Any, plain.force), cast(Any, swelling.force)
    at = [(one(t), other(t)) for t in (0.3 * until, 1.1 * until)]
    share = np.sin(0.15 * np.pi) ** 2
    np.testing.assert_allclose(at[0][1], share * at[0][0], rtol=1e-12)
    np.testing.assert_array_equal(at[1][1], at[1][0])


def test_loops_and_bandwidths_that_cannot_be_are_refused() -> None:
    with refused("loop"):
        hover_loop(VEHICLE, "positon")
    with refused("bandwidth"):
        hover_loop(VEHICLE, "none", 8.0)
    with refused("loop"):
        hover_loop(VEHICLE.replace({"uav.mass": [1.0, 2.0]}), "position")


def test_what_settles_does_not_count_in_a_loop_without_a_target() -> None:
    scenario = standard_scenario("moment", VEHICLE, loop="position")
    sample, settle = 0.04, 0.4 * scenario.duration
    found = ca.run_pairs(VEHICLE, scenario, sample=sample, settle=settle).isel(run=0)
    tips = [
        ca.simulate(VEHICLE, scenario, model=model, sample=sample)["tip_position"]
        for model in ("coupled", "decoupled")
    ]
    late = (tips[1] - tips[0]).sel(time=slice(settle, None))
    rms = float((late**2).sum("axis").mean("time") ** 0.5)
    assert float(found["rmse_t_m"][1]) == pytest.approx(rms, rel=1e-9)
