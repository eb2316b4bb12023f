"""The hold controller: where it goes, and that it stays."""

import warnings
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.controllers.controller import Controller, stack
from continuair.errors import ContinuairWarning
from continuair.flight.provenance import FLOWN_MODEL, PROVENANCE
from continuair.flight.trajectory import COUNTED
from tests.closed_loop import flights
from tests.refusals import refused

POSITION, BEND = [0.3, -0.2, 4.0], [0.4, -0.3]
ATTITUDE = Rotation.from_euler("ZYX", [2.0, 0.2, -0.1])


def held(bend_rate: float = 5.0, duration: float = 10.0) -> xr.Dataset:
    vehicle = flights.VEHICLE.replace({"uav.mount": [0.02, 0.01, -0.05]})
    controller = ca.hold(vehicle, POSITION, ATTITUDE.as_quat(), BEND, bend_rate=bend_rate)
    scenario = ca.Scenario("hold", flights.start(), duration=duration, controller=controller)
    return ca.simulate(vehicle, scenario)


def test_it_reaches_position_attitude_and_bend_and_keeps_them() -> None:
    run = held().isel(time=slice(8000, None))
    # A loop of 3 rad/s leaves (1 + 24) exp(-24) = 1e-9 of its start, and the bend's less.
    np.testing.assert_allclose(
        run.position, np.tile(POSITION, (len(run.time), 1)), rtol=0, atol=2e-8
    )
    np.testing.assert_allclose(run.bend, np.tile(BEND, (len(run.time), 1)), rtol=0, atol=2e-10)
    turn = Rotation.from_quat(run.attitude.to_numpy()) * ATTITUDE.inv()
    assert turn.magnitude().max() < 1e-8


def test_it_gets_there_at_the_rate_that_was_asked_for() -> None:
    """A critically damped loop of 3 rad/s leaves (1 + 3 t) exp(-3 t) of the distance."""
    run = held(duration=2.0)
    distance = np.linalg.norm(run.position - POSITION, axis=-1)
    left = (1 + 6.0) * np.exp(-6.0)
    assert distance[-1] / distance[0] == pytest.approx(left, rel=0.1)


def test_without_a_bend_rate_the_arm_hangs_by_its_spring_and_weight() -> None:
    """It swings as on a clamped base, with gravity, and gets no moment."""
    section = {"length": 0.6, "mass_per_length": 0.05, "bending_stiffness": 0.1, "radius": 0.003}
    vehicle = ca.Vehicle(
        name="soft", uav={"mass": 50.0, "inertia": [2.0, 2.0, 3.0]}, arm=section
    ).replace({"arm.disks": [{"position": 0.6, "mass": 0.05}]})
    law = ca.hold(vehicle, [0, 0, 2], rate=30.0, attitude_rate=60.0, bend_rate=0.0)
    start = ca.Scenario("swing", [0, 0, 2, 0, 0, 0, 0.01, 0], controller=law, duration=4.0)
    run = ca.simulate(vehicle, start, sample=2e-3)
    assert (run.command[:, 6:] == 0.0).all()
    bend = run.bend[:, 0].to_numpy()
    tops = np.flatnonzero((bend[1:-1] > bend[:-2]) & (bend[1:-1] >= bend[2:])) + 1
    period = np.diff(run.time[tops]).mean()
    with_gravity, without = (
        2.0 * np.pi / ca.modes(vehicle, base="clamped", gravity=g).frequencies[0]
        for g in (9.81, 0.0)
    )
    assert period == pytest.approx(with_gravity, rel=2e-3)
    assert without > 1.2 * with_gravity


def test_a_blind_controller_flies_on_when_the_points_are_lost() -> None:
    controller = ca.hold(flights.VEHICLE, [5.0, 0.0, 3.0])
    run = ca.simulate(flights.VEHICLE, flights.scenario(controller, duration=4.0))
    assert run.status == 0
    assert run.in_view[-1].sum() == 0
    assert abs(float(run.position[-1, 0]) - 5.0) < 0.01


def test_a_law_at_every_stage_pushes_at_the_end_as_in_a_longer_flight() -> None:
    vehicle = ca.load_vehicle("paper")
    start, law = [0.1, 0, 3, 0, 0, 0, 0.3, 0.2], ca.hold(vehicle, [0, 0, 3])
    scenario = ca.Scenario("hold", start, controller=law, control_period=None)
    short, long = (
        ca.simulate(
            vehicle,
            scenario,
            duration=end,
            method="RK4",
            step=1e-4,
            sample=5e-3,
            variables=["command"],
        )
        for end in (0.05, 0.1)
    )
    np.testing.assert_allclose(short["command"][-1], long["command"][10], rtol=1e-12, atol=1e-12)


LIMITS = {"force": [2.0, 1.0, 60.0], "moment": 0.3, "bend_moment": 1.3}


def limited(**limits: Any) -> tuple[ca.Vehicle, ca.Scenario]:
    """A slender vehicle that is to go 3 m and 2 m to the side, and bend."""
    vehicle = ca.load_vehicle("slender").replace({"arm.damping_ratio": 0.05})
    law = ca.hold(vehicle, [3.0, -2.0, 4.0], bend=[0.2, -0.1], **limits)
    return vehicle, ca.Scenario("limited", [0, 0, 4, 0, 0, 0, 0.5, 0], duration=12, controller=law)


def limited_law(**limits: Any) -> Controller:
    law = limited(**limits)[1].controller
    assert law is not None
    return law


def test_no_push_is_beyond_its_limits_and_the_hold_gets_there_later_and_says_so() -> None:
    with pytest.warns(ContinuairWarning, match="limits: force, .* t = 0 s"):
        slow = ca.simulate(*limited(**LIMITS), sample=0.01)
    free = ca.simulate(*limited(), sample=0.01)
    most = np.array([2.0, 1.0, 60.0, 0.3, 0.3, 0.3, 1.3, 1.3])
    assert (abs(free.command).max("time") > most).any()
    assert (abs(slow.command).max("time") <= most).all()
    assert (slow.command[0, :2] == [2.0, -1.0]).all()
    for run in (slow, free):
        np.testing.assert_allclose(run.position[-1], [3.0, -2.0, 4.0], rtol=0, atol=5e-3)
        np.testing.assert_allclose(run.bend[-1], [0.2, -0.1], rtol=0, atol=5e-3)
    # 3 m at 2 N of a mass m takes longer than sqrt(2 d m / F).
    vehicle, _ = limited()
    least = float(np.sqrt(2.0 * 2.9 * vehicle.mass / 2.0))
    assert float(slow.time[(slow.position[:, 0] > 2.9).argmax("time")]) > least
    assert float(free.time[(free.position[:, 0] > 2.9).argmax("time")]) < least


@pytest.mark.long
def test_pairs_tell_of_the_runs_whose_commands_are_at_their_own_limits() -> None:
    """One run of two, of which the other's limits leave room, as single flights count it."""
    vehicle, slow = limited(**LIMITS)
    _, wide = limited(force=[500.0, 500.0, 500.0])
    laws = stack([limited_law(force=[500.0, 500.0, 500.0]), limited_law(**LIMITS)])
    with pytest.warns(ContinuairWarning, match="limits") as one:
        flown = ca.simulate(vehicle, slow, sample=0.01, duration=2.0)
    share = (abs(flown.command) >= [2.0, 1.0, 60.0, 0.3, 0.3, 0.3, 1.3, 1.3]).any("actuator")
    says = f"1 of 2 runs, .* {100 * float(share.mean()):.3g} %"
    assert f"{100 * float(share.mean()):.3g} %" in str(one[0].message)
    with pytest.warns(ContinuairWarning, match=says):
        ca.run_pairs(
            vehicle, ca.Scenario("both", slow.q, controller=laws), sample=0.01, duration=2.0
        )
    with pytest.warns(ContinuairWarning, match="2 of 2 runs"):
        law = stack([limited_law(**LIMITS)])
        both = ca.Scenario("both", np.stack([slow.q, slow.q]), controller=law)
        ca.run_pairs(vehicle, both, sample=0.01, duration=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ca.run_pairs(vehicle, wide, sample=0.01, duration=2.0)


def test_limits_that_are_not_reached_change_no_bit_and_tell_nothing(
    recwarn: pytest.WarningsRecorder,
) -> None:
    vehicle, free = limited()
    _, wide = limited(force=1e6, moment=1e6, bend_moment=1e6)
    one, two = (
        ca.simulate(vehicle, each, duration=2.0, sample=0.01, variables=["bend", "position"])
        for each in (free, wide)
    )
    one, two = (each.drop_attrs().drop_vars(PROVENANCE) for each in (one, two))
    assert one.identical(two)
    assert not recwarn.list


def test_limits_differ_from_run_to_run_and_are_looked_at_where_the_command_is_not_kept() -> None:
    vehicle, scenario = limited(force=[1.0, 9.0, 60.0])
    laws = ca.stack([limited_law(force=[most, 9.0, 60.0]) for most in (1.0, 2.0)])
    rows = np.tile(np.asarray(scenario.q, float), (2, 1))
    batch = scenario.replace(q=rows, controller=laws)
    with pytest.warns(ContinuairWarning, match="2 of 2 runs: force"):
        run = ca.simulate(vehicle, batch, duration=0.5, sample=0.01, variables=["linear_momentum"])
    assert set(run.data_vars) == {
        *("linear_momentum", "status", "end_time", *COUNTED, PROVENANCE, FLOWN_MODEL)
    }
    gained = run["linear_momentum"][:, -1, 0] - run["linear_momentum"][:, 0, 0]
    np.testing.assert_allclose(gained, [0.5, 1.0], rtol=1e-6)


@pytest.mark.parametrize(
    ("field", "limit"),
    [
        ("force", [5.0, 5.0, 10.0]),
        ("force", -1.0),
        ("moment", [1.0, 2.0]),
        ("moment", 0.0),
        ("bend_moment", 0.0),
        ("bend_moment", 1e-3),
    ],
)
def test_limits_that_hold_nothing_are_refused(field: str, limit: object) -> None:
    with refused(field):
        limited(**{field: limit})


def test_holds_with_and_without_limits_are_told_apart_where_they_cannot_be_stacked() -> None:
    laws = [limited_law(**each) for each in ({}, LIMITS)]
    with refused("controllers"):
        ca.stack(laws)


@pytest.mark.parametrize("bend", [[9.0, 0.0], [-4.6, 4.6]])
def test_a_bend_beyond_a_full_circle_is_refused_in_the_words_of_trim(bend: list[float]) -> None:
    with refused("bend") as held:
        ca.hold(flights.VEHICLE, POSITION, bend=bend)
    with refused("bend") as trimmed:
        ca.trim(flights.VEHICLE, bend=bend)
    assert str(held.value) == str(trimmed.value)


def test_each_section_may_be_held_up_to_its_own_full_circle() -> None:
    vehicle = ca.load_vehicle("two_section")
    tight, wide = (2.0 * np.pi / each.length for each in vehicle.arms[0].section)
    assert ca.hold(vehicle, POSITION, bend=[0.99 * tight, 0, 0, 0.99 * wide]) is not None
    with refused("bend"):
        ca.hold(vehicle, POSITION, bend=[0, 0, 0, 1.01 * wide])
