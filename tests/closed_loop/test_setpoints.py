"""Set-points: numbers, functions of time and arrays over time, for one run or each."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.errors import ContinuairWarning
from tests.closed_loop.test_flight_controller import HOME, PAPER, RIGID, fly
from tests.refusals import refused

TIMES = np.array([0.0, 1.0, 2.5, 3.0])
TWO = ca.load_vehicle("two_section")


@pytest.mark.long
def test_an_array_over_time_is_the_function_of_its_straight_lines() -> None:
    path, yaw = np.array([[0, 0, 3], [0.4, 0, 3], [0.4, 0.5, 3.3], [0, 0, 3.0]]), 0.3 * TIMES
    bend = np.array([[0, 0], [0.1, 0], [0.1, -0.2], [0, 0]])

    def line(rows: np.ndarray) -> Any:
        return lambda t: [np.interp(t, TIMES, column) for column in rows.T]

    arrays = ca.Setpoints(times=TIMES, position=path, yaw=yaw, bend=bend)
    functions = ca.Setpoints(
        position=line(path), yaw=lambda t: np.interp(t, TIMES, yaw), bend=line(bend)
    )
    law = ca.flight_controller(PAPER)
    one, other = (fly(PAPER, law, setpoints=each) for each in (arrays, functions))
    np.testing.assert_array_equal(one.command, other.command)
    assert np.abs(one.position.sel(axis="y")).max() > 0.3


def test_what_is_not_given_stays_as_the_flight_starts_and_a_velocity_alone_is_kept() -> None:
    law = ca.flight_controller(PAPER)
    start = np.array([[1, 2, 3, 0, 0, 0.5, 0.3, 1.0], [0, 0, 5, 0, 0, -2.0, 0, 0]])
    still = fly(PAPER, law, start)
    np.testing.assert_allclose(still.q.to_numpy()[:, -1, :6], start[:, :6], atol=5e-3)
    assert still.q.to_numpy()[0, -1, 6] == pytest.approx(0.3, abs=2e-3)
    moving = fly(PAPER, law, start, duration=8.0, setpoints=ca.Setpoints(velocity=[0.5, 0, 0.1]))
    gone = moving.position.to_numpy()[:, -1] - moving.position.to_numpy()[:, -101]
    np.testing.assert_allclose(gone, np.tile([0.5, 0, 0.1], (2, 1)), atol=5e-3)
    np.testing.assert_allclose(moving.q.to_numpy()[:, -1, 5], start[:, 5], atol=5e-3)


def test_a_velocity_beside_a_moving_position_takes_the_lag_away() -> None:
    law, k_p = ca.flight_controller(RIGID, integral_share=0.0), 0.0
    k_p = law.settings["position"][0]

    def line(t: float) -> list[float]:
        return [0.3 * t, 0.0, 3.0]

    for velocity, lag in ((None, 0.3 / k_p), ([0.3, 0, 0], 0.0)):
        run = fly(RIGID, law, duration=10.0,
                  setpoints=ca.Setpoints(position=line, velocity=velocity))  # fmt: skip
        assert float(3.0 - run.position[-1, 0]) == pytest.approx(lag, abs=2e-3)


BAD: dict[str, tuple[Any, str]] = {
    "position": (lambda: ca.Setpoints(position=[1.0, 2.0]), "position"),
    "yaw": (lambda: ca.Setpoints(yaw=np.nan), "yaw"),
    "odd bend": (lambda: ca.Setpoints(bend=[1.0]), "bend"),
    "times": (lambda: ca.Setpoints(times=[1.0, 0.0], yaw=[0.0, 0.0]), "times"),
    "times of functions": (lambda: ca.Setpoints(times=[0, 1], yaw=lambda t: t), "times"),
    "times alone": (lambda: ca.Setpoints(times=[0.0, 1.0]), "times"),
    "times of a constant": (lambda: ca.Setpoints(times=[0.0, 1.0], yaw=0.5), "yaw"),
    "misspelt": (lambda: ca.Setpoints(positon=[0, 0, 3]), "positon"),  # type: ignore[call-arg]
    "too many": (lambda: ca.Setpoints(*range(7)), "the setpoints"),
    "length": (lambda: ca.Setpoints(times=[0.0, 1.0], yaw=[0.0, 0.0, 0.0]), "yaw"),
    "turning": (lambda: ca.Setpoints(yaw_rate=0.5), "yaw_rate"),
    "raises": (lambda: ca.Setpoints(yaw=lambda t: 1 / t), "yaw"),
    "sections": (
        lambda: fly(PAPER, ca.flight_controller(PAPER), setpoints=ca.Setpoints(bend=[0.0] * 4)),
        "bend",
    ),
    "another law": (
        lambda: fly(PAPER, ca.hold(PAPER, [0, 0, 3]), setpoints=ca.Setpoints(yaw=0.0)),
        "controller",
    ),
    "a law that goes by its camera": (
        lambda: ca.Scenario(
            "both", HOME, controller=ca.twist_servoing(PAPER), duration=1.0,
            target=ca.Target(ca.paths.hold()), setpoints=ca.Setpoints(yaw=0.0),
        ),
        "controller",
    ),
    "bend that is left free": (
        lambda: fly(
            PAPER, ca.flight_controller(PAPER, bend_bandwidth=0.0),
            setpoints=ca.Setpoints(bend=[0.1, 0.0]),
        ),
        "setpoints",
    ),
    "bend of one section that is left free": (
        lambda: fly(
            TWO, ca.flight_controller(TWO, bend_bandwidth=[5.0, 0.0]), np.zeros(10),
            setpoints=ca.Setpoints(bend=lambda t: [0.1, 0.0, t, 0.0]),
        ),
        "setpoints",
    ),
    "kind": (
        lambda: fly(PAPER, ca.flight_controller(PAPER), setpoints=[0, 0, 3]),
        "setpoints",
    ),
    "runs": (
        lambda: fly(
            PAPER, ca.flight_controller(PAPER), np.tile(HOME, (3, 1)),
            setpoints=ca.Setpoints(yaw=[0.0, 1.0]),
        ),
        "scenario.setpoints",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_set_point_that_cannot_be_followed_is_refused_in_one_sentence(name: str) -> None:
    make, field = BAD[name]
    with refused(field):
        make()


def test_rates_that_go_with_what_stays_are_0_before_the_first_and_after_the_last_time() -> None:
    """A velocity alone goes on; beside a position, which stays, it would lead away from it."""
    times, instants = [1.0, 2.0], np.array([0.5, 1.0, 1.5, 2.0, 3.0])
    line: dict[str, Any] = {"velocity": [[0.5, 0, 0], [0.5, 0, 0]], "times": times}
    both = ca.Setpoints(position=[[0, 0, 3], [1, 0, 3]], **line)
    found = both.at("velocity", instants)
    assert found is not None
    np.testing.assert_array_equal(found[0, :, 0], [0.0, 0.5, 0.5, 0.5, 0.0])
    alone = ca.Setpoints(**line).at("velocity", instants)
    assert alone is not None
    np.testing.assert_array_equal(alone[0, :, 0], [0.5] * 5)


@pytest.mark.parametrize("array", ["what moves", "its rate"])
def test_rates_are_0_beyond_the_times_of_an_array_beside_a_function_too(array: str) -> None:
    instants, still = np.array([0.5, 1.0, 2.0, 3.0]), [0.0, 0.5, 0.5, 0.0]
    if array == "what moves":
        given: dict[str, Any] = {
            "position": [[0, 0, 3], [0.5, 0, 3]],
            "yaw": [0.0, 0.5],
            "velocity": lambda t: (0.5, 0, 0),
            "yaw_rate": lambda t: 0.5,
        }
    else:
        given = {
            "position": lambda t: (0.5 * t, 0, 3),
            "yaw": lambda t: 0.5 * t,
            "velocity": [[0.5, 0, 0], [0.5, 0, 0]],
            "yaw_rate": [0.5, 0.5],
        }
    found = ca.Setpoints(times=[1.0, 2.0], **given)
    for rate in ("velocity", "yaw_rate"):
        rows = found.at(rate, instants)
        assert rows is not None
        np.testing.assert_array_equal(rows[0, :, 0], still)


def test_functions_keep_their_rates_beyond_the_times_of_another_array() -> None:
    moving = ca.Setpoints(position=lambda t: (0.5 * t, 0, 3), velocity=lambda t: (0.5, 0, 0),
                          bend=[[0.0, 0.0], [0.1, 0.0]], times=[1.0, 2.0])  # fmt: skip
    rows = moving.at("velocity", np.array([0.5, 3.0]))
    assert rows is not None
    np.testing.assert_array_equal(rows[0, :, 0], [0.5, 0.5])


def test_a_vehicle_stays_where_its_positions_end_whatever_its_velocity_is_given_as() -> None:
    line: dict[str, Any] = {"position": [[0, 0, 3], [0.5, 0, 3]], "times": [0.0, 1.0]}
    law = ca.flight_controller(RIGID, integral_share=0.0)
    array, function = (
        fly(RIGID, law, setpoints=ca.Setpoints(velocity=each, **line), duration=6.0)
        for each in ([[0.5, 0, 0], [0.5, 0, 0]], lambda t: (0.5, 0, 0))
    )
    np.testing.assert_array_equal(function.position, array.position)
    assert float(function.position[-1, 0]) == pytest.approx(0.5, abs=2e-3)


def test_set_points_are_made_again_of_what_they_hold() -> None:
    """As `dataclasses.replace` does."""
    constant = ca.Setpoints(position=[1.0, 2.0, 3.0], yaw=[0.1, 0.2], bend=[0.3, 0.4])
    over_time = ca.Setpoints(yaw=np.zeros((4, 3)) + np.arange(3.0), times=[0.0, 1.0, 2.0])
    for made, name, value in ((constant, "yaw", [[[0.1]] * 2, [[0.2]] * 2]), (over_time, "yaw", 0)):
        again = dataclasses.replace(made)
        found = again.at(name, np.array([0.0, 0.5]))
        assert again.runs == made.runs
        np.testing.assert_array_equal(found, made.at(name, np.array([0.0, 0.5])))
        np.testing.assert_array_equal(found, value if value else [[[0.0], [0.5]]] * 4)


def test_setpoints_that_draw_noise_or_keep_a_state_are_refused() -> None:
    rng, vehicle = np.random.default_rng(1), ca.load_vehicle("paper")
    scenario = ca.Scenario(
        "noisy", [0, 0, 3, 0, 0, 0, 0, 0], controller=ca.flight_controller(vehicle), duration=0.1
    )
    noisy = ca.Setpoints(position=lambda t: rng.normal(size=3))
    with refused("position of the setpoints"):
        ca.simulate(vehicle, scenario.replace(setpoints=noisy))


def test_a_yaw_that_wraps_is_told_of_where_it_is_given() -> None:
    """As an arctangent gives it, it runs from π to -π through 0 between two times."""
    times = np.linspace(0.0, 4.0, 9)
    turning = 2.0 + 0.8 * times
    wrapped = np.arctan2(np.sin(turning), np.cos(turning))
    with pytest.warns(ContinuairWarning, match="yaw .* 1 to 1.5 s.* np.unwrap") as told:
        ca.Setpoints(yaw=wrapped, times=times)
    assert [each.filename for each in told] == [__file__]
    ca.Setpoints(yaw=np.unwrap(wrapped), times=times)
    # Of a batch too.
    with pytest.warns(ContinuairWarning, match="np.unwrap"):
        ca.Setpoints(yaw=np.array([turning, wrapped]), times=times)


def test_a_constant_beside_arrays_is_told_to_be_a_function() -> None:
    with refused("position"):
        ca.Setpoints(position=[0, 0, 3], yaw=[0.0, 1.0], times=[0.0, 1.0])
