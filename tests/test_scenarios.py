"""Scenarios: the paper's tests as it prints them, and what an unusable field is told."""

import functools
import json
import math
import pickle
from typing import Any

import numpy as np
import pytest

from amiri2026.open_loop_tests import open_loop_test
from continuair import load_vehicle, simulate
from continuair.scenario.scenarios import Scenario
from tests.refusals import refused

Q = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0)


def a_function_of_two(t: float, other: float) -> list[float]:
    return [t, other]


@pytest.mark.parametrize("letter", "ABCD")
def test_every_open_loop_test_starts_at_rest_bent_by_a_tenth_and_lasts_a_second(
    letter: str,
) -> None:
    scenario = open_loop_test(letter)
    np.testing.assert_array_equal(scenario.q, Q)
    np.testing.assert_array_equal(scenario.qd, np.zeros(8))
    assert (scenario.duration, scenario.jumps, scenario.gravity) == (1.0, (), 9.81)
    assert scenario.force is scenario.moment is scenario.bend_moment is None


def test_only_the_tip_wrench_of_test_d_acts_reversed() -> None:
    signs = [open_loop_test(letter).tip_wrench_sign for letter in "ABCD"]
    assert signs == [1, 1, 1, -1]


def test_test_a_pushes_along_world_x_and_test_b_does_not_push() -> None:
    a, b = open_loop_test("A"), open_loop_test("b")
    np.testing.assert_array_equal(a.tau, [100, 0, 0, 0, 0, 0, 0, 0])
    assert a.tip_wrench is b.tip_wrench is b.tau is None


def test_test_c_drives_bend_and_direction_at_20_radians_per_second() -> None:
    tau: Any = open_loop_test("C").tau
    np.testing.assert_allclose(tau(0.0), [0] * 6 + [0.1 * math.sqrt(0.5), 0.1], rtol=1e-14)
    # Half a period later both have the opposite sign; 1e-15 is their rounding.
    np.testing.assert_allclose(tau(math.pi / 20), -np.array(tau(0.0)), rtol=0, atol=1e-14)


def test_test_d_as_printed_repeats_every_second_and_with_f1_is_a_chirp() -> None:
    wrench: Any = open_loop_test("D").tip_wrench
    np.testing.assert_allclose(wrench(0.0), [10 * math.sqrt(0.5), 0, 25, 0, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(wrench(0.25)[1], 10, rtol=1e-14)
    np.testing.assert_allclose(wrench(1.3), wrench(0.3), rtol=0, atol=1e-13)
    chirp: Any = open_loop_test("D", f1=3.0).tip_wrench
    # The phase after 1 s is 2 pi (1 + (3 - 1) / (2 * 10)).
    np.testing.assert_allclose(chirp(1.0)[1], 10 * math.sin(2 * math.pi * 1.1), rtol=1e-14)


@pytest.mark.parametrize("letter", ["E", "", "AB", None, 1, np.array(["A", "B"])])
def test_there_are_no_other_open_loop_tests(letter: Any) -> None:
    with refused("test"):
        open_loop_test(letter)


UNUSABLE: list[tuple[dict[str, Any], str]] = [
    ({"name": ""}, "name"),
    ({"name": "a\nb"}, "name"),
    ({"q": [0.0] * 5}, "q"),
    ({"q": [[]]}, "q"),
    ({"q": "abc"}, "q"),
    ({"q": [True] * 8}, "q"),
    ({"qd": [math.nan] * 8}, "qd"),
    ({"q": [Q, Q], "qd": np.zeros((3, 8))}, "q"),
    ({"q": [Q, Q], "force": np.zeros((3, 3))}, "q"),
    ({"tau": [1.0]}, "tau"),
    ({"force": [0, 0, math.inf]}, "force"),
    ({"moment": "up"}, "moment"),
    ({"bend_moment": lambda t: [t]}, "bend_moment"),
    ({"bend_moment": lambda t: [1 / t, 0]}, "bend_moment"),
    ({"bend_moment": a_function_of_two}, "bend_moment"),
    ({"tip_wrench": [0, 0, 1]}, "tip_wrench"),
    ({"tip_wrench_sign": 0}, "tip_wrench_sign"),
    ({"tip_wrench_sign": True}, "tip_wrench_sign"),
    ({"tip_wrench_sign": np.array([1, -1])}, "tip_wrench_sign"),
    ({"gravity": np.array([1, 2])}, "gravity"),
    ({"duration": np.array([1, 2])}, "duration"),
    ({"duration": 0}, "duration"),
    ({"duration": math.inf}, "duration"),
    ({"duration": "1 s"}, "duration"),
    ({"jumps": (0.0,)}, "jumps"),
    ({"jumps": (1.0,)}, "jumps"),
    ({"jumps": 0.5}, "jumps"),
    ({"jumps": [[0.5]]}, "jumps"),
    ({"gravity": -9.81}, "gravity"),
]


@pytest.mark.parametrize(("changes", "field"), UNUSABLE, ids=lambda value: str(value)[:40])
def test_unusable_field_is_refused_in_one_sentence_with_value_and_remedy(
    changes: dict[str, Any], field: str
) -> None:
    with refused(field):
        Scenario("test", Q).replace(**changes)


def test_unknown_field_is_refused_and_the_nearest_named() -> None:
    with refused("durations"):
        Scenario("test", Q).replace(durations=3)
    with refused("durations"):
        Scenario("test", Q, durations=3)  # type: ignore[call-arg]


@pytest.mark.parametrize("values", [(), ("test",), ("test", Q, *range(30))])
def test_a_scenario_with_too_few_or_too_many_values_is_refused(values: Any) -> None:
    with refused("a scenario"):
        Scenario(*values)


def test_a_scenario_survives_pickling() -> None:
    assert pickle.loads(pickle.dumps(Scenario("test", Q, duration=3.0))).duration == 3.0


def test_constants_are_immutable_copies_and_jumps_are_sorted() -> None:
    force = np.array([1.0, 2.0, 3.0])
    scenario = Scenario("test", Q, force=force, jumps=(0.75, 0.25, 0.75))
    force[0] = 9.0
    held: Any = scenario.force
    assert held[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        held[0] = 2.0
    assert scenario.jumps == (0.25, 0.75)


def test_rows_of_states_or_inputs_are_runs() -> None:
    assert Scenario("test", Q).runs is None
    assert Scenario("test", [Q, Q, Q]).runs == 3
    assert Scenario("test", Q, force=np.zeros((4, 3))).runs == 4


def test_replace_leaves_the_original_and_checks_the_copy() -> None:
    scenario = open_loop_test("B")
    longer = scenario.replace(duration=2.0, jumps=(1.5,))
    assert (scenario.duration, longer.duration) == (1.0, 2.0)
    with refused("jumps"):
        longer.replace(duration=1.0)


def test_description_is_json_and_names_functions() -> None:
    described = json.loads(json.dumps(open_loop_test("D", f1=2.0).describe()))
    assert described["tip_wrench"] == "tip_chirp(f1=2.0)"
    assert described["q"] == list(Q)
    assert described["tau"] is None
    assert open_loop_test("C").describe()["tau"] == "bend_torques"
    nested = functools.partial(a_function_of_two, other=1.0)
    assert Scenario("x", Q, bend_moment=nested).describe()["bend_moment"] == (
        "a_function_of_two(other=1.0)"
    )


@pytest.mark.parametrize("kind", ["array", "list"])
def test_a_function_may_return_the_same_object_each_time(kind: str) -> None:
    """Code that fills a buffer and returns it is usual: every time keeps its own values."""
    buffer: Any = np.zeros(3) if kind == "array" else [0.0, 0.0, 0.0]

    def reusing(t: float) -> Any:
        buffer[0] = 30.0 * math.sin(9.0 * t)
        return buffer

    def anew(t: float) -> Any:
        return [30.0 * math.sin(9.0 * t), 0.0, 0.0]

    vehicle = load_vehicle("paper")
    tips = [
        simulate(vehicle, Scenario("push", np.zeros(8), force=force, duration=0.2), sample=0.01)[
            "tip_position"
        ]
        for force in (reusing, anew)
    ]
    np.testing.assert_array_equal(tips[0], tips[1])


def test_a_tip_wrench_of_negative_sign_acts_reversed() -> None:
    wrench = np.array([2.0, -1.0, 0.5, 0.1, 0.2, 0.0])
    push = Scenario("push", np.zeros(8), tip_wrench=wrench, tip_wrench_sign=-1, duration=0.1)
    pulled = Scenario("pull", np.zeros(8), tip_wrench=-wrench, duration=0.1)
    vehicle = load_vehicle("paper")
    tips = [simulate(vehicle, each, sample=0.01)["tip_position"] for each in (push, pulled)]
    np.testing.assert_array_equal(tips[0], tips[1])
    straight_down = np.array([0.0, 0.0, -vehicle.arm.length])
    assert float(np.linalg.norm(tips[0][-1] - straight_down)) > 0.04
