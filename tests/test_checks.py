"""Arguments are checked alike everywhere: NumPy's numbers count, truth values and text do not."""

import copy
import json
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import checks
from continuair.errors import shown
from continuair.vehicle import runs
from tests.refusals import refused

VEHICLE = ca.load_vehicle("paper")
HERE = ca.paths.hold()
LAW: Any = len

NUMBERS: dict[str, Any] = {
    "radius": lambda value: ca.paths.circle(radius=value),
    "side": lambda value: ca.square(value),
    "distance": lambda value: ca.Target(ca.paths.hold(), distance=value),
    "Kp": lambda value: ca.servoing(value, 1.0),
    "rate": lambda value: ca.hold(VEHICLE, [0, 0, 3], rate=value),
    "bandwidth": lambda value: ca.design(VEHICLE, value),
    "duration": lambda value: ca.Scenario("s", np.zeros(8), duration=value),
    "uav.mass": lambda value: VEHICLE.replace({"uav.mass": value}),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_may_be_of_python_or_numpy(name: str) -> None:
    for value in (2, 2.0, np.float64(2), np.float32(2), np.int64(2), np.uint8(2)):
        NUMBERS[name](value)


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_finite_number_is_refused_by_value(name: str) -> None:
    for value in (True, np.True_, "2", None, 2j, np.nan, -np.inf, 10**400):
        with refused(name) as caught:
            NUMBERS[name](value)
        assert shown(value) in caught.value.problem


ARRAYS: dict[str, Any] = {
    "q": lambda row: ca.Scenario("s", [*row, 0, 0, 0, 0, 0]),
    "q of runs": lambda row: ca.Scenario("s", [[*row, 0, 0, 0, 0, 0], [0.0] * 8]),
    "force": lambda row: ca.Scenario("s", np.zeros(8), force=row),
    "force over time": lambda row: ca.Scenario("s", np.zeros(8), force=lambda t: row),
    "points": lambda row: ca.Target(ca.paths.hold(), [row, [1, 0, 0], [0, 1, 0]]),
    "position": lambda row: ca.hold(VEHICLE, row),
    "position of a path": lambda row: ca.paths.hold(row),
    "Kp": lambda row: ca.servoing([*row, 1, 1, 1], 1.0, points=3),
    "k": lambda row: ca.Controller("c", LAW, {"k": row}),
    "uav.mount": lambda row: VEHICLE.replace({"uav.mount": row}),
    "arm.radius": lambda row: VEHICLE.replace({"arm.radius": row}),
}
NO_NUMBERS = {
    "a truth value": [True, 0.1, 0.1],
    "a truth value of NumPy": [0.1, np.True_, 0.1],
    "a truth value in an array": [0.1, np.array(True), 0.1],
    "a truth value in a row": [[0.1], [True], [0.1]],
    "a huge whole number": [10**400, 0.1, 0.1],
    "a whole number that Python does not print": [10**5000, 0.1, 0.1],
    "a number that only long doubles hold": [np.longdouble("1e400"), 0.1, 0.1],
}


@pytest.mark.parametrize("numbers", NO_NUMBERS)
@pytest.mark.parametrize("name", ARRAYS)
def test_a_list_is_refused_if_an_entry_is_no_number_of_its_own(name: str, numbers: str) -> None:
    with refused(name.split()[0]):
        ARRAYS[name](NO_NUMBERS[numbers])


MASKED = np.ma.array([0.1, 0.1, 0.1], mask=[False, True, False])


# A list into which others unpack the array has no mask.
@pytest.mark.parametrize("name", sorted(ARRAYS.keys() - {"q", "q of runs", "Kp"}))
def test_what_a_mask_hides_is_no_number(name: str) -> None:
    with refused(name.split()[0]):
        ARRAYS[name](MASKED)
    ARRAYS[name](np.ma.array([0.1, 0.1, 0.1]))


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy])
def test_copies_of_what_was_checked_cannot_be_changed_either(copied: Callable[[Any], Any]) -> None:
    batch = copied(VEHICLE.replace({"arm.radius": [0.005, 0.004]}))
    controller = ca.Controller("c", LAW, {"k": np.eye(2)})
    made = ca.Scenario("s", np.zeros(8), controller=controller, target=[ca.Target(HERE)])
    scenario = copied(made)
    law = copied(scenario.controller)
    points, wind = copied(scenario.targets[0]).points, copied(ca.dryden(5.0, 10.0, 2.0)).knots
    for array in (batch.arm.radius, scenario.q, law.gains["k"], points, wind):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = -1.0
    assert pickle.loads(pickle.dumps(law.gains)).keys() == {"k"}


def test_copies_of_models_change_nothing_that_would_go_unchecked() -> None:
    assert VEHICLE.model_copy(deep=True) == VEHICLE
    with refused("model_copy"):
        VEHICLE.uav.model_copy(update={"mass": -3.0})


def test_checked_arrays_can_no_longer_be_changed_nor_by_what_they_were_made_of() -> None:
    radii, points, gain, targets = np.full(2, 0.005), ca.square(), np.eye(2), [ca.Target(HERE)]
    controller = ca.Controller("c", LAW, {"k": gain})
    batch = VEHICLE.replace({"arm.radius": radii})
    scenario = ca.Scenario("s", np.zeros(8), force=[0, 0, 1.0], target=targets)
    arrays = [
        batch.arm.radius,
        runs.take(batch, np.array([1])).arm.radius,
        controller.gains["k"],
        ca.stack([controller]).gains["k"],
        ca.Target(HERE, points).points,
        scenario.q,
        scenario.force,
    ]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = -1.0
    with refused("k"):
        controller.gains["k"] = np.zeros((2, 2))  # type: ignore[index]
    for given in (radii, points, gain):
        given[...] = -1.0
    targets.clear()
    assert len(scenario.targets) == 1
    assert all((np.asarray(array) >= -0.5).all() for array in arrays)


def test_numbers_of_numpy_become_those_of_python_for_provenance() -> None:
    one: Any = np.int64(1)
    true: Any = np.True_
    two: Any = np.float32(2)
    jumps: Any = np.array([1.0])
    target = ca.Target(ca.paths.hold(duration=two), distance=two)
    scenario = ca.Scenario(
        "s", np.zeros(8), duration=two, gravity=two, tip_wrench_sign=one, target=target,
        control_period=two, seed=one, jumps=jumps, force=np.zeros(3, np.float32),
        controller=ca.Controller("c", LAW, {"k": two}, settings={"k": two, "n": one}),
    )  # fmt: skip
    json.dumps(scenario.describe())
    json.dumps(ca.hold(VEHICLE, np.zeros(3, np.float32), rate=two).describe())
    json.dumps(ca.classic(VEHICLE, two, two, feed_forward=true).describe())


def test_a_whole_number_may_be_of_numpy_and_has_no_fraction() -> None:
    three: Any = np.int64(3)
    assert ca.servoing(1.0, 1.0, points=three).gains["Kp"].shape == (6, 6)
    assert type(ca.Scenario("s", np.zeros(8), seed=three).seed) is int
    assert VEHICLE.replace({"uav.mass": [1.0, 2.0]}).select(three - 2).uav.mass == 2.0
    for value in (3.0, "3", True, 2):
        with refused("points"):
            ca.servoing(1.0, 1.0, points=value)  # type: ignore[arg-type]


def test_settings_of_a_law_are_plain_numbers_for_provenance() -> None:
    two: Any = np.float32(2)
    assert type(ca.hold(VEHICLE, [0, 0, 3], rate=two).settings["rate"]) is float


def test_a_truth_value_is_not_guessed_from_text() -> None:
    with refused("feed_forward"):
        ca.classic(VEHICLE, feed_forward="no")  # type: ignore[arg-type]


def test_names_are_told_by_the_nearest_or_the_list_and_kept_once_each() -> None:
    assert checks.choices("letters", ["B", "A", "B"], "ABC") == ["B", "A"]
    with refused("model"):
        checks.choices("model", "copled", ca.MODELS)
    with refused("tests"):
        checks.choices("tests", [], "AB")
