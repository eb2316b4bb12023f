"""Arguments are checked alike everywhere: NumPy's numbers count, truth values and text do not."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import checks
from continuair.errors import shown

VEHICLE = ca.load_vehicle("paper")

NUMBERS: dict[str, Any] = {
    "a radius of a path": lambda value: ca.paths.circle(radius=value),
    "a side of a target": lambda value: ca.square(value),
    "a distance of a target": lambda value: ca.Target(ca.paths.hold(), distance=value),
    "a gain": lambda value: ca.servoing(value, 1.0),
    "a setting of a law": lambda value: ca.hold(VEHICLE, [0, 0, 3], rate=value),
    "a bandwidth": lambda value: ca.design(VEHICLE, value),
    "a duration": lambda value: ca.Scenario("s", np.zeros(8), duration=value),
    "a field of a vehicle": lambda value: VEHICLE.replace({"uav.mass": value}),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_may_be_of_python_or_numpy(name: str) -> None:
    for value in (2, 2.0, np.float64(2), np.float32(2), np.int64(2), np.uint8(2)):
        NUMBERS[name](value)


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_finite_number_is_refused_by_value(name: str) -> None:
    for value in (True, np.True_, "2", None, 2j, np.nan, -np.inf, 10**400):
        with pytest.raises(ca.InputError) as caught:
            NUMBERS[name](value)
        assert shown(value) in str(caught.value)


def test_a_whole_number_may_be_of_numpy_and_has_no_fraction() -> None:
    three: Any = np.int64(3)
    assert ca.servoing(1.0, 1.0, points=three).gains["Kp"].shape == (6, 6)
    assert type(ca.Scenario("s", np.zeros(8), seed=three).seed) is int
    assert VEHICLE.replace({"uav.mass": [1.0, 2.0]}).select(three - 2).uav.mass == 2.0
    for value in (3.0, "3", True, 2):
        with pytest.raises(ca.InputError, match="points is .*; give a whole number, 3 or more[.]"):
            ca.servoing(1.0, 1.0, points=value)  # type: ignore[arg-type]


def test_settings_of_a_law_are_plain_numbers_for_provenance() -> None:
    two: Any = np.float32(2)
    assert type(ca.hold(VEHICLE, [0, 0, 3], rate=two).settings["rate"]) is float


def test_a_truth_value_is_not_guessed_from_text() -> None:
    with pytest.raises(ca.InputError, match="feed_forward is 'no'; give True or False[.]"):
        ca.classic(VEHICLE, feed_forward="no")  # type: ignore[arg-type]


def test_names_are_told_by_the_nearest_or_the_list_and_kept_once_each() -> None:
    assert checks.choices("letters", ["B", "A", "B"], "ABC") == ["B", "A"]
    with pytest.raises(ca.InputError, match="model holds 'copled'; use coupled"):
        checks.choices("model", "copled", ca.MODELS)
    with pytest.raises(ca.InputError, match="tests is empty; name one or more of A, B"):
        checks.choices("tests", [], "AB")
