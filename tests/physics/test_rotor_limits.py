"""Rotors whose thrust limits differ: who saturates, what is given up, and who may hover."""

import tomllib
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.errors import CannotHover, ContinuairWarning
from continuair.flight.fleet import Fleet
from continuair.interfaces.hovering import Hovering
from continuair.studies.check import _left
from continuair.vehicle.vehicle_file import as_toml
from tests.closed_loop.constant_push import constant_push
from tests.refusals import refused

COMMON, TORQUE, CORNER = (0.2, 8.0), 0.016, 0.14
CORNERS = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
MASS = 1.2
HOVER = MASS * 9.81 / 4.0


def quad(own: dict[int, Any] | None = None, common: Any = COMMON, lag: float = 0.03) -> ca.Vehicle:
    """Four rotors; own: limits of some of them, by their index."""
    listed: list[dict[str, Any]] = [
        {"position": [CORNER * x, CORNER * y, 0.0], "spin": (-1) ** i}
        for i, (x, y) in enumerate(CORNERS)
    ]
    for index, limits in (own or {}).items():
        listed[index]["thrust_limits"] = limits
    rotors = {"rotor": listed, "thrust_limits": common, "torque_per_thrust": TORQUE, "lag": lag}
    uav = {"mass": MASS, "inertia": [0.012, 0.014, 0.02], "rotors": rotors}
    return ca.Vehicle(name="quad", uav=uav)


def flown(vehicle: ca.Vehicle, sample: float = 0.1, **given: Any) -> Any:
    start = ca.Scenario("flight", (0, 0, 2, 0, 0, 0), **{"duration": 0.3} | given)
    return ca.simulate(vehicle, start, sample=sample)


def test_a_weak_rotor_saturates_alone() -> None:
    weak = quad({2: (0.0, 3.0)})
    with pytest.warns(ContinuairWarning, match="saturate"):
        flight = flown(weak, rotor_command=4 * [4.0], rotor_thrust=[4.0, 4.0, 3.0, 4.0])
    np.testing.assert_allclose(flight.rotor_thrust, 4 * [[4.0, 4.0, 3.0, 4.0]], rtol=1e-12)
    np.testing.assert_allclose(flight.saturation, 1.0 / 3.0, rtol=1e-12)


def test_the_excess_is_a_share_of_the_range_of_the_rotor_that_has_it() -> None:
    """1 N beyond 3 N is more than 2 N beyond 8 N."""
    weak = quad({2: (0.0, 3.0)})
    with pytest.warns(ContinuairWarning, match="saturate"):
        flight = flown(weak, rotor_command=[10.0, 3.0, 4.0, 3.0], duration=0.1)
    np.testing.assert_allclose(flight.saturation, 1.0 / 3.0, rtol=1e-12)


def test_limits_given_to_each_rotor_are_the_common_ones_to_the_bit() -> None:
    """With yaw given up, and rotors at both limits."""
    runs = []
    for vehicle in (quad(), quad(dict.fromkeys(range(4), COMMON), common=None)):
        law = ca.flight_controller(vehicle, attitude_bandwidth=25.0)
        q = (0, 0, 2, 0.5, -0.4, 1.5)
        start = ca.Scenario("turn", q, controller=law, duration=0.5, setpoints=ca.Setpoints(yaw=0))
        with pytest.warns(ContinuairWarning, match="saturate"):
            runs.append(ca.simulate(vehicle, start, sample=0.02))
    assert float(runs[0].saturation.max()) > 0.1
    for name in ("position", "attitude", "rotor_thrust", "saturation", "command"):
        assert np.array_equal(runs[0][name], runs[1][name]), name


def test_yaw_is_given_up_for_the_room_of_the_weakest_rotor() -> None:
    """Lift alone asks 4 N of each; rotor 1 has 0.5 N above it, of the 1 N that yaw asks."""
    weak = quad({1: (0.2, 4.5)}, lag=0.0)
    moment = 4.0 * TORQUE  # 1 N more of rotors that turn clockwise, 1 N less of the others
    law = constant_push([0.0, 0.0, 16.0], [0.0, 0.0, moment])
    with pytest.warns(ContinuairWarning, match="saturate"):
        flight = flown(weak, controller=law, duration=0.002, sample=0.001)
    np.testing.assert_allclose(flight.rotor_thrust[0], [3.5, 4.5, 3.5, 4.5], rtol=1e-12)
    assert float(flight.saturation[0]) == pytest.approx(0.5 / 4.3, rel=1e-12)


def test_a_rotor_with_a_higher_minimum_keeps_it_under_a_controller() -> None:
    idle = quad({3: (4.5, 8.0)}, lag=0.0)
    law = constant_push([0.0, 0.0, 16.0], [0.0, 0.0, 0.0])
    with pytest.warns(ContinuairWarning, match="saturate"):
        flight = flown(idle, controller=law, duration=0.002, sample=0.001)
    np.testing.assert_allclose(flight.rotor_thrust[0], [4.0, 4.0, 4.0, 4.5], rtol=1e-12)


def test_runs_have_limits_of_their_own() -> None:
    batch = quad().replace({"uav.rotors.rotor.2.thrust_limits": [[0.0, 3.0], [0.0, 3.5]]})
    settled: dict[str, Any] = {"rotor_command": 4 * [4.0], "duration": 0.6}
    with pytest.warns(ContinuairWarning, match="saturate"):
        both = flown(batch, **settled)
    for run, most in enumerate((3.0, 3.5)):
        alone = batch.select(run)
        assert alone == quad({2: (0.0, most)})
        with pytest.warns(ContinuairWarning, match="saturate"):
            expected = flown(alone, **settled)
        assert float(expected.rotor_thrust[-1, 2]) == pytest.approx(most, rel=1e-6)
        for name in ("rotor_thrust", "saturation", "position"):
            np.testing.assert_allclose(both[name].isel(run=run), expected[name], atol=1e-9)


def test_a_rotor_too_weak_to_hover_is_refused_by_its_field() -> None:
    with refused("uav.rotors.rotor.1.thrust_limits", CannotHover):
        flown(quad({1: (0.0, 0.9 * HOVER)}))
    flight = flown(quad({1: (0.0, 1.1 * HOVER)}))
    np.testing.assert_allclose(flight.rotor_thrust, HOVER, rtol=1e-9)


def test_rotors_that_do_not_lift_together_are_refused_by_the_weakest() -> None:
    with refused("uav.rotors.rotor.0.thrust_limits", CannotHover):
        quad({0: (0.0, 0.1)}, common=(0.0, 1.2 * HOVER))
    with refused("uav.rotors.thrust_limits", CannotHover):
        quad({0: (0.0, 8.0)}, common=(0.0, 0.3 * HOVER))


def test_the_margin_in_hover_is_that_of_the_busiest_rotor() -> None:
    rotors = quad({1: (0.2, 4.0)}).uav.rotors
    assert rotors is not None
    assert _left(np.full((1, 4), 3.0), np.zeros(1), rotors) == "25%"
    assert _left(np.full((1, 4), 4.2), np.zeros(1), rotors).endswith("4.2 N of 0.2 to 4")


def test_a_start_beyond_the_limit_of_one_rotor_is_refused() -> None:
    with refused("scenario.rotor_thrust"):
        flown(quad({2: (0.0, 3.5)}), rotor_thrust=4 * [3.6], rotor_command=4 * [3.0])


def test_a_controllers_thrust_ends_where_the_first_rotor_is_at_its_limit() -> None:
    """A quarter of the lift each, so that no moment is left."""
    law = ca.flight_controller(quad({0: (0.2, 5.0), 1: (0.6, 8.0)}))
    assert tuple(law.settings["thrust"]) == pytest.approx((4 * 0.6, 4 * 5.0), rel=1e-14)
    assert tuple(ca.flight_controller(quad()).settings["thrust"]) == (0.1 * 4.0 * HOVER, 32.0)
    with refused("uav.rotors.rotor.3.thrust_limits", CannotHover):
        ca.flight_controller(quad({3: (0.0, 0.9 * HOVER)}))


def test_a_controllers_thrust_is_that_of_rotors_that_carry_an_arm_at_one_side() -> None:
    arm = {"length": 0.3, "mass_per_length": 1.0, "bending_stiffness": 0.5}
    uav = {**dict(quad().uav), "mount": [0.1, 0.0, 0.0]}
    vehicle = ca.Vehicle(name="aside", uav=uav, arm=arm)
    weight = 9.81 * vehicle.mass
    # The pairs ahead and behind share the weight by the levers about the common centre of mass.
    ahead = 0.5 * (1.0 + 0.1 * 0.3 / vehicle.mass / CORNER)
    most = ca.flight_controller(vehicle).settings["thrust"][1]
    assert most == pytest.approx(8.0 / (0.5 * ahead), rel=1e-9) and weight < most < 32.0


def test_environments_command_each_rotor_within_its_limits() -> None:
    fleet = Fleet(quad({2: (0.0, 3.0)}, lag=0.0), 2, period=0.01)
    fleet.step(rotor_command=np.full((2, 4), 10.0))
    rotors = fleet.states[:, fleet.layout.rotor_speed]
    np.testing.assert_array_equal(rotors, 1.0)  # each at its own maximum


def test_a_vehicle_file_holds_the_limits_of_each_rotor() -> None:
    for vehicle in (quad({2: (0.0, 3.5)}), quad(dict.fromkeys(range(4), (0.0, 6.0)), common=None)):
        again = ca.Vehicle(**tomllib.loads(as_toml(vehicle)))
        assert again == vehicle and again.describe() == vehicle.describe()


@pytest.mark.parametrize(
    ("own", "common", "field"),
    [
        ({0: (0.0, 3.0)}, None, "uav.rotors.thrust_limits"),
        ({0: (3.0, 3.0)}, COMMON, "uav.rotors.rotor.0.thrust_limits"),
        ({1: (-1.0, 3.0)}, COMMON, "uav.rotors.rotor.1.thrust_limits"),
        ({1: 3.0}, COMMON, "uav.rotors.rotor.1.thrust_limits"),
    ],
)
def test_unusable_limits_are_refused(own: dict[int, Any], common: Any, field: str) -> None:
    with refused(field):
        quad(own, common)


def test_limits_change_by_their_name_as_a_value_or_over_runs() -> None:
    weak = quad().replace({"uav.rotors.rotor.1.thrust_limits": [0.0, 5.0]})
    assert weak == quad({1: (0.0, 5.0)})
    assert weak.replace({"uav.rotors.rotor.1.thrust_limits": None}) == quad()
    # A pair of pairs has one dimension more than the field.
    pairs = quad().replace({"uav.rotors.rotor.1.thrust_limits": [[0.0, 5.0], [0.0, 6.0]]})
    assert pairs.runs == 2 and pairs.select(1) == quad({1: (0.0, 6.0)})
    moved = quad({1: (0.0, 5.0)}).replace({"uav.rotors.thrust_limits": [[0.1, 7.0], [0.2, 9.0]]})
    assert moved.uav.rotors is not None
    np.testing.assert_array_equal(moved.uav.rotors.highest, [[7, 5, 7, 7], [9, 5, 9, 9]])


def test_actions_of_environments_span_the_limits_of_each_rotor() -> None:
    several = quad(lag=0.0).replace({"uav.rotors.rotor.2.thrust_limits": [[0.0, 3.5], [1.0, 5.0]]})
    hovering = Hovering(2, several, hold="uav", disturbance=0.0)
    hovering.begin((0, 1), [np.random.default_rng(0)] * 2)
    hovering.step(np.zeros((2, 4)))  # half way between the limits
    rotors = several.uav.rotors
    assert rotors is not None
    thrusts = rotors.thrusts_of(hovering.observed()[:, -4:])
    np.testing.assert_allclose(thrusts, [[4.1, 4.1, 1.75, 4.1], [4.1, 4.1, 3.0, 4.1]], rtol=1e-12)
