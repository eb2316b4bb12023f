"""Metrics: the printed formula, readings with a unit, and rotations of known angle."""

import math
import warnings
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import continuair as ca
from amiri2026.open_loop_tests import open_loop_test
from amiri2026.overstated_angles import of_overstated_angles
from continuair.analysis.metrics import (
    compare,
    euler_angles,
    geodesic_angle,
    joint_speed,
    nrmse,
    regular_speed,
    rmse,
    rotation_metric,
    tip_euler,
)
from continuair.errors import ContinuairWarning
from continuair.typing import Model
from continuair.vehicle.vehicle import load_vehicle
from tests.refusals import refused
from tests.synthetic import flight

# Sums of a thousand rounded terms.
ROUNDING = 1e-12
DOWN = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])

seeds = st.integers(0, 10**6)


def paths(seed: int) -> tuple[Any, Any]:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(50, 3)), generator.normal(size=(50, 3))


def rotations(seed: int, count: int = 20) -> Rotation:
    return Rotation.random(count, random_state=seed)


def moved(dataset: xr.Dataset, turn: Rotation, shift: list[float]) -> xr.Dataset:
    """Return the dataset as an observer sees it whose axes are turned and shifted."""
    tip = turn.apply(dataset["tip_position"].to_numpy()) + shift
    attitude = (turn * Rotation.from_quat(dataset["tip_attitude"].to_numpy())).as_quat()
    return dataset.assign(
        tip_position=(("time", "axis"), tip), tip_attitude=(("time", "quaternion"), attitude)
    )


def test_nrmse_is_the_printed_formula_worked_by_hand() -> None:
    coupled = [[0.0, 0.0], [4.0, 1.0], [2.0, 3.0]]
    other = [[0.0, 1.0], [4.0, 1.0], [0.0, 3.0]]
    # Squares 1 + 4; ranges 4 and 3 in each of 3 samples: 3 (16 + 9).
    assert nrmse(coupled, other) == pytest.approx(math.sqrt(5 / 75), rel=ROUNDING)


@given(seeds, st.floats(0.1, 10), st.floats(-100, 100))
def test_nrmse_depends_on_neither_unit_nor_origin(seed: int, scale: float, shift: float) -> None:
    a, b = paths(seed)
    changed = nrmse(scale * a + shift, scale * b + shift)
    # A shift of 100 costs three or four digits of differences of order 0.1.
    assert changed == pytest.approx(nrmse(a, b), rel=1e-12)


def test_nrmse_takes_the_range_of_the_reference_alone() -> None:
    narrow, wide = np.array([[0.0], [1.0]]), np.array([[0.0], [2.0]])
    assert nrmse(narrow, wide) == pytest.approx(2 * nrmse(wide, narrow), rel=ROUNDING)


def test_nrmse_against_a_motionless_reference_is_infinite_unless_both_agree() -> None:
    still = np.ones((4, 3))
    assert nrmse(still, still) == 0
    assert nrmse(still, still + 1) == math.inf
    # What rounding moves is still.
    shaken = still + 1.0 + 1e-15 * np.arange(still.size).reshape(still.shape)
    assert nrmse(shaken, shaken + 1) == math.inf
    assert nrmse(shaken, shaken[::-1]) == 0


@given(seeds)
def test_rmse_is_symmetric_and_zero_only_for_equal_paths(seed: int) -> None:
    a, b = paths(seed)
    assert rmse(a, b) == rmse(b, a) > 0
    assert rmse(a, a) == 0


def test_rmse_of_a_constant_offset_is_its_length() -> None:
    path, _ = paths(1)
    assert rmse(path, path + [3.0, 0.0, 4.0]) == pytest.approx(5.0, rel=ROUNDING)


def test_metrics_of_a_batch_are_those_of_its_runs() -> None:
    a, b = zip(*(paths(seed) for seed in range(3)), strict=True)
    for metric in (nrmse, rmse):
        together = np.asarray(metric(np.stack(a), np.stack(b)))
        alone = [float(metric(x, y)) for x, y in zip(a, b, strict=True)]
        np.testing.assert_allclose(together, alone, rtol=ROUNDING)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.5, 3.0, math.pi])
def test_geodesic_angle_of_a_known_rotation_keeps_its_digits(angle: float) -> None:
    turned = Rotation.from_rotvec([0.0, 0.6 * angle, 0.8 * angle]).as_quat()
    start = Rotation.from_euler("xyz", [0.3, -1.0, 2.0])
    both = (start * Rotation.from_quat(turned)).as_quat()
    # Quaternions hold 1e-16 each, so angles hold about that, absolutely.
    assert geodesic_angle(start.as_quat(), both) == pytest.approx(angle, rel=0, abs=2e-15)


@given(seeds, seeds, seeds)
def test_geodesic_angle_is_symmetric_blind_to_sign_and_observer_and_at_most_a_half_turn(
    first: int, second: int, third: int
) -> None:
    a, b, observer = (rotations(seed) for seed in (first, second, third))
    angle = geodesic_angle(a.as_quat(), b.as_quat())
    assert (angle <= math.pi).all()
    np.testing.assert_allclose(geodesic_angle(b.as_quat(), -a.as_quat()), angle, rtol=0, atol=1e-14)
    seen = geodesic_angle((observer * a).as_quat(), (observer * b).as_quat())
    # Rounding of 1e-16 in the quaternions; near a half turn nothing amplifies it.
    np.testing.assert_allclose(seen, angle, rtol=0, atol=1e-14)
    np.testing.assert_allclose(angle, (a.inv() * b).magnitude(), rtol=0, atol=5e-14)


def test_a_straight_level_arm_has_zero_tip_angles() -> None:
    np.testing.assert_allclose(euler_angles(np.tile(DOWN.as_quat(), (3, 1))), 0, rtol=0, atol=1e-15)


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-3, 3))
def test_tip_angles_are_roll_pitch_yaw_of_the_turned_tip(
    roll: float, pitch: float, yaw: float
) -> None:
    tip = Rotation.from_euler("ZYX", [yaw, pitch, roll]) * DOWN
    # At a pitch of 1.5 the arc sine multiplies roundings by 1/cos 1.5 = 14.
    np.testing.assert_allclose(
        euler_angles(tip.as_quat()[None])[0], [roll, pitch, yaw], rtol=0, atol=1e-13
    )


def test_a_tumble_and_a_spin_are_followed_without_jumps() -> None:
    turns = np.linspace(0, 4 * math.pi, 1001)
    zero = np.zeros_like(turns)
    for column in range(3):
        expected = np.column_stack([turns if i == column else zero for i in range(3)])
        tip = Rotation.from_euler("ZYX", expected[:, ::-1]) * DOWN
        np.testing.assert_allclose(euler_angles(tip.as_quat()), expected, rtol=0, atol=1e-7)


def test_angles_that_go_apart_beside_the_vertical_are_no_rotation() -> None:
    """Two tumbles 0.1 rad apart, on either side of a pitch of 90°, end whole turns apart."""
    time = np.linspace(0.0, 1.0, 1001)
    pitches = Rotation.from_rotvec(np.outer(2.0 * math.pi * time, [0.0, 1.0, 0.0]))
    tumbles = []
    for lean in (-0.05, 0.05):
        attitude = Rotation.from_rotvec([0.0, 0.0, lean]) * Rotation.from_rotvec([lean, 0.0, 0.0])
        dataset = flight(load_vehicle("paper"), open_loop_test("B").replace(duration=1.0))
        turned = (pitches * attitude * DOWN).as_quat()
        tumbles.append(dataset.assign(tip_attitude=(("time", "quaternion"), turned)))
    with pytest.warns(ContinuairWarning, match="overstate"):
        found = compare(*tumbles)
    assert found["angle_rad"] < 0.2 and found["rmse_r_rad"] > math.pi
    assert rotation_metric([found]) == "angle_rad"
    assert rotation_metric([{"rmse_r_rad": 3.2, "angle_rad": 2.0}]) == "angle_rad"
    assert rotation_metric([{"rmse_r_rad": 3.1, "angle_rad": 2.0}]) == "rmse_r_rad"
    told = of_overstated_angles([("Test A, decoupled", found), ("Test B, decoupled", found)])
    assert "in 2 of 2 flights" in told[0] and "Test A" in told[0]


def test_comparing_a_flight_with_itself_finds_nothing() -> None:
    dataset = flight(load_vehicle("paper"), open_loop_test("B"))
    assert set(compare(dataset, dataset).values()) == {0.0}


def test_comparison_finds_the_known_difference_of_two_flights() -> None:
    vehicle, scenario = load_vehicle("paper"), open_loop_test("B")
    coupled, other = (flight(vehicle, scenario, model=m) for m in ("coupled", "decoupled"))
    metrics = compare(coupled, other)
    # The mean of (0.2 t²)² over 1 s is 0.04/5; 1001 samples add 3e-3 of it.
    expected = pytest.approx(math.sqrt(0.04 / 5), rel=3e-3)
    assert metrics["rmse_t_m"] == metrics["rmse_x_m"] == expected
    assert metrics["rmse_r_rad"] == expected
    assert metrics["rmse_pitch_rad"] == expected
    assert metrics["angle_rad"] == expected
    for axis in ("y_m", "z_m", "roll_rad", "yaw_rad"):
        assert metrics[f"rmse_{axis}"] == pytest.approx(0, abs=1e-14)
    assert tip_euler(other)[-1] == pytest.approx([0, 0.5, 0], abs=1e-14)


def test_position_and_geodesic_metrics_do_not_depend_on_the_observer() -> None:
    vehicle, scenario = load_vehicle("paper"), open_loop_test("B")
    flights = [flight(vehicle, scenario, model=m) for m in ("coupled", "decoupled")]
    turn = Rotation.from_euler("z", 0.7)
    seen = compare(*(moved(f, turn, [3.0, -2.0, 1.0]) for f in flights))
    metrics = compare(*flights)
    for name in ("rmse_t_m", "angle_rad", "rmse_z_m"):
        assert seen[name] == pytest.approx(metrics[name], rel=ROUNDING, abs=0)


FLIGHT = flight(load_vehicle("paper"), open_loop_test("B"))
THREE, TWO = (xr.concat([FLIGHT] * runs, "run") for runs in (3, 2))


@pytest.mark.parametrize(
    ("coupled", "other", "field"),
    [
        (1, 2, "coupled"),
        (FLIGHT, None, "other"),
        (FLIGHT, FLIGHT.drop_vars("tip_position"), "other"),
        (FLIGHT.drop_vars(["time"]), FLIGHT, "coupled"),
        (FLIGHT.isel(time=-1), FLIGHT.isel(time=-1), "coupled"),
        (FLIGHT, FLIGHT.isel(time=slice(5)), "other"),
        (FLIGHT, FLIGHT.assign_coords(time=FLIGHT["time"] + 0.25), "other"),
        (
            FLIGHT,
            FLIGHT.assign_coords(axis=list("xyz")).isel(axis=[0, 1]),
            "flight",
        ),
        (
            FLIGHT,
            FLIGHT.assign(tip_attitude=2.0 * FLIGHT["tip_attitude"]),
            "tip_attitude of other",
        ),
        (THREE, TWO, "other"),
        (FLIGHT, THREE, "other"),
    ],
)
def test_what_cannot_be_compared_is_told(coupled: Any, other: Any, field: str) -> None:
    with refused(field):
        compare(coupled, other)


def test_times_that_are_rounded_otherwise_are_the_same() -> None:
    thinned = FLIGHT.assign_coords(time=FLIGHT["time"] * (1.0 + 1e-15))
    assert compare(FLIGHT, thinned) == compare(FLIGHT, FLIGHT)


def test_comparing_a_masked_flight_warns_of_what_it_lacks() -> None:
    masked = FLIGHT.assign(status=((), np.int8(0))).where(FLIGHT["time"] <= 0.5)
    lost = int((FLIGHT["time"] > 0.5).sum())
    with pytest.warns(ContinuairWarning, match=f"other .* {lost} of") as caught:
        assert math.isnan(compare(FLIGHT, masked)["rmse_t_m"])
    assert len(caught) == 1 and caught[0].filename == __file__


def test_comparing_runs_that_ended_early_warns_and_names_the_status() -> None:
    late = FLIGHT["time"] > 0.5
    ended = FLIGHT.where(~late).assign(status=((), np.int8(2)), end_time=((), 0.5))
    with pytest.warns(ContinuairWarning, match="other .* 0.5 s .*status 2"):
        assert math.isnan(compare(FLIGHT, ended)["rmse_t_m"])
    batch = xr.concat([FLIGHT, ended], "run")
    with pytest.warns(ContinuairWarning, match="run 1 of coupled") as caught:
        result = np.asarray(compare(batch, xr.concat([FLIGHT, FLIGHT], "run"))["rmse_t_m"])
    assert len(caught) == 1
    assert result[0] == 0 and math.isnan(result[1])


def of_test_a() -> list[xr.Dataset]:
    return [ca.simulate(ca.load_vehicle("paper"), open_loop_test("A"), model=model, sample=2e-3)
            for model in ("coupled", "decoupled")]  # fmt: skip


def test_a_part_of_a_flight_is_compared_by_angles_that_begin_alike() -> None:
    """Test A tumbles through pitch = π/2: two parts must not begin on different triples."""
    coupled, other = of_test_a()
    for start in np.arange(0.2, 0.6, 0.02):
        parts = [flight.sel(time=slice(start, None)) for flight in (coupled, other)]
        assert ca.compare(*parts)["rmse_r_rad"] < 0.5


def test_axes_in_another_order_are_the_same_flight() -> None:
    coupled, other = of_test_a()
    turned = coupled.sel(axis=list("zyx"), quaternion=list("wxyz"))
    assert ca.compare(turned, other) == ca.compare(coupled, other)


def test_runs_are_compared_with_themselves_alone() -> None:
    vehicles = ca.load_vehicle("paper").replace({"uav.mass": [1.0, 2.0, 3.0]})
    flights = [ca.simulate(vehicles, open_loop_test("B"), model=model, sample=0.1)
               for model in ("coupled", "decoupled")]  # fmt: skip
    with refused("other"):
        ca.compare(flights[0].sel(run=[0, 1]), flights[1].sel(run=[1, 2]))
    with refused("other"):
        ca.compare(flights[0].isel(run=[2, 1, 0]), flights[1])


@pytest.mark.long
def test_arms_are_compared_with_themselves_alone() -> None:
    vehicle = ca.load_vehicle("dual_arm")
    scenario = ca.Scenario(
        "pushed", [0, 0, 0, 0, 0, 0, 0.3, 0, 0.2, 1], duration=0.1, force=[1, 0, 30]
    )
    coupled, other = (
        ca.simulate(vehicle, scenario, model=model, sample=0.01)
        for model in ("coupled", "decoupled")
    )
    found = ca.compare(coupled, other)
    turned = ca.compare(coupled, other.isel(arm=[1, 0]))
    for name, values in found.items():
        np.testing.assert_array_equal(turned[name], values)
    alone = ca.compare(coupled.isel(arm=1), other.isel(arm=1))
    assert alone["rmse_t_m"] == np.asarray(found["rmse_t_m"])[1]
    with refused("other"):
        ca.compare(coupled.isel(arm=0), other.isel(arm=1))
    with refused("other"):
        ca.compare(coupled, other.isel(arm=1))


def swinging(offset: float) -> xr.Dataset:
    """A vehicle that turns steadily while its bend passes zero at a distance of `offset` [1/m].

    q = [t, 2 t, 0, 0.3, 0.2 t, 0.1, κ, ψa]; the bend is (0.5 t, offset) on its polar branch.
    """
    time = np.linspace(-1.0, 1.0, 2001)
    bend = np.column_stack([0.5 * time, np.full_like(time, offset)])
    q = np.zeros((len(time), 8))
    q[:, 0], q[:, 1], q[:, 3], q[:, 4], q[:, 5] = time, 2 * time, 0.3, 0.2 * time, 0.1
    q[:, 6], q[:, 7] = np.linalg.norm(bend, axis=1), np.arctan2(bend[:, 1], bend[:, 0])
    turn = Rotation.from_euler("ZYX", q[:, [5, 4, 3]])
    # Pitch alone changes, about the y axis as roll has turned it.
    spin = 0.2 * np.column_stack([np.zeros_like(time), np.cos(q[:, 3]), -np.sin(q[:, 3])])
    velocity = turn.inv().apply(np.tile([1.0, 2.0, 0.0], (len(time), 1)))
    return xr.Dataset(
        {
            "q": (("time", "coordinate"), q),
            "velocity": (("time", "axis"), velocity),
            "angular_velocity": (("time", "axis"), spin),
            "bend_rate": (("time", "bend_axis"), np.tile([0.5, 0.0], (len(time), 1))),
        },
        {"time": time},
    )


def test_the_papers_speed_is_the_norm_of_the_derivative_of_its_coordinates() -> None:
    flown = swinging(0.3)
    derivative = np.gradient(flown["q"].to_numpy(), flown["time"].to_numpy(), axis=0)
    # Central differences of 1 ms are wrong by h²/6 of third derivatives up to 2 (0.5/0.3)³.
    np.testing.assert_allclose(
        joint_speed(flown)[1:-1], np.linalg.norm(derivative[1:-1], axis=1), rtol=0, atol=2e-6
    )


@pytest.mark.parametrize("offset", [1e-2, 1e-4])
def test_the_papers_speed_grows_without_bound_where_the_bend_passes_zero(offset: float) -> None:
    flown = swinging(offset)
    # There the bend turns by 0.5 / offset [rad/s], and every other rate stays.
    assert joint_speed(flown).max() == pytest.approx(0.5 / offset, rel=0.01)
    np.testing.assert_allclose(regular_speed(flown), math.sqrt(5.0 + 0.04 + 0.25), rtol=1e-12)


def test_flights_that_one_alone_was_joined_from_are_not_paired_by_place() -> None:
    vehicle = ca.load_vehicle("paper").replace({"arm.radius": [0.004, 0.005]})
    names: list[Model] = ["coupled", "decoupled"]
    scenario = open_loop_test("A").replace(duration=0.1)
    both = xr.concat(
        [ca.simulate(vehicle, scenario, model=name, sample=0.01) for name in names],
        xr.Variable("model", names),
    )
    first, second = (both.sel(model=name) for name in names)
    with refused("other"):
        ca.compare(first, both)
    with refused("other"):
        ca.compare(both, first)
    apart = ca.compare(first, second)["rmse_t_m"]
    twice = ca.compare(both.sel(model=names[:1]), both.sel(model=names[:1]).transpose("time", ...))
    moved = np.asarray(twice["rmse_t_m"])
    assert (moved == 0.0).all() and moved.shape == (2, 1)
    joined = ca.compare(
        both.isel(model=[0, 0]).drop_vars("model").transpose("model", ...), both.drop_vars("model")
    )
    np.testing.assert_array_equal(joined["rmse_t_m"], np.transpose([np.zeros(2), apart]))
    named = first.rename(run="radius")
    with refused("other"):
        ca.compare(named.assign_coords(radius=[4, 5]), named.assign_coords(radius=[5, 6]))


def test_flights_that_are_given_the_wrong_way_round_are_told_of() -> None:
    vehicle, test = ca.load_vehicle("paper"), open_loop_test("B")
    coupled, other = (ca.simulate(vehicle, test, model=name) for name in ("coupled", "decoupled"))
    with pytest.warns(ca.ContinuairWarning, match="coupled"):
        ca.compare(other, coupled)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ca.compare(coupled, other)
        ca.compare(coupled, coupled)
        ca.compare(other, other)


@pytest.mark.long
def test_what_is_but_rounding_differs_by_nothing_wherever_it_is() -> None:
    """A tip held at the world's origin, and angles of a tip that only climbs."""
    vehicle = ca.load_vehicle("paper")
    rest = ca.trim(vehicle, bend=(0.3, 0.2))
    scenario = ca.Scenario(
        "held",
        rest.q,
        force=rest.force,
        moment=rest.moment,
        bend_moment=rest.bend_moment,
        duration=0.2,
    )
    start = np.array(rest.q)
    start[:3] -= ca.simulate(vehicle, scenario)["tip_position"].isel(time=0).to_numpy()
    rotors = {"layout": "octo_plus", "lever": 0.24, "thrust_limits": [0.0, 20.0]}
    slender = ca.load_vehicle("slender").replace(
        {"uav.rotors": {**rotors, "torque_per_thrust": 0.015}}
    )
    climb = ca.Setpoints(position=ca.paths.line([0, 0, 0], [0, 0, 1.0], duration=1.0))
    up = ca.Scenario(
        "climb",
        np.zeros(8),
        controller=ca.flight_controller(slender),
        setpoints=climb,
        duration=0.5,
    )
    for each, flown in ((vehicle, scenario.replace(q=start)), (slender, up)):
        # Of error control, steps at rest grow until they err by the tolerance.
        options: dict[str, Any] = {"method": "RK4", "step": "auto"}
        models = [
            ca.simulate(each, flown, model=model, **options) for model in ("coupled", "decoupled")
        ]
        found, pairs = ca.compare(*models), ca.run_pairs(each, flown, ["decoupled"], **options)
        assert np.all(found["nrmse_r"] == 0.0) and np.all(pairs["nrmse_r"] == 0.0)
        np.testing.assert_allclose(pairs["nrmse_t"][0, 1], found["nrmse_t"], rtol=1e-9)
        assert np.all(found["nrmse_t"] < 1e-9)
