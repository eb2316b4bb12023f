"""Models of an arm compared by what they predict of releases that they were not fitted to."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.identification import HeldOut, Marker, StaticPoses, fit_jointly, held_out_errors
from continuair.identification.joint import Measurement
from tests.identification.benches import FIELDS, bench_vehicle, released
from tests.refusals import refused


def one_arc() -> ca.Vehicle:
    """Return an arm of one arc with the true weight."""
    whole = {"name": "whole", "length": 0.3, "bending_stiffness": 0.012, "damping": 6e-4}
    return bench_vehicle(section=[whole | {"mass_per_length": 0.3}])


def fitting(
    start: ca.Vehicle, fields: Sequence[str]
) -> Callable[[Sequence[Measurement]], ca.Vehicle]:
    return lambda parts: fit_jointly(start, parts, fields).vehicle


def test_the_model_that_moved_predicts_what_it_was_not_fitted_to_best() -> None:
    """Up to the noise in its starts; one arc misses more, and what cannot be fitted is told."""
    recordings = [released(1, releases=2, samples=40), released(2, releases=2, samples=40)]
    found = held_out_errors(
        {
            "two arcs": fitting(bench_vehicle(), FIELDS[:2]),
            "with their mass": fitting(bench_vehicle(), [*FIELDS[:2], FIELDS[4]]),
            "one arc": fitting(one_arc(), ["arm.limb.section.whole.bending_stiffness"]),
            "none": fitting(one_arc(), FIELDS[:1]),
        },
        recordings,
        folds=2,
    )
    assert list(found.refused) == ["none"]
    assert all(len(errors) == 4 for errors in found.errors.values())
    noise = np.sqrt(3.0) * 5e-4
    assert 0.9 * noise < found.rms(found.best) < 2.0 * noise
    assert "one arc" not in found.as_good
    assert found.best in found.as_good
    assert found.rms("one arc") > 3.0 * found.rms("two arcs")


def test_what_a_model_says_of_a_pose_does_not_depend_on_that_pose() -> None:
    """A pose that is moved changes its own error alone, by as much, if each is left out in turn."""
    vehicle = ca.load_vehicle("tentacle")
    tensions = np.zeros((3, 2))
    tensions[:, 0] = 0.2, 0.4, 0.6
    blank = StaticPoses("poses", tensions, np.zeros((3, 1, 3)), [Marker("tip")])
    points = blank.predict(vehicle)[0]
    seen: list[list[str]] = []

    def fit(parts: Sequence[Measurement]) -> ca.Vehicle:
        seen.append([f"{part.measured(vehicle)}" for part in parts])
        return vehicle

    points[1, 0, 2] += 0.003
    moved = StaticPoses("poses", tensions, points, [Marker("tip")])
    found = held_out_errors({"true": fit}, [moved], folds=3)
    np.testing.assert_allclose(found.errors["true"], [0.0, 0.003, 0.0], atol=1e-9)
    assert [f"{points[1]}" in str(each) for each in seen] == [True, False, True]
    with refused("folds"):
        held_out_errors({"true": fit}, [moved], folds=4)
    whole: Any = lambda parts: "a fit"  # noqa: E731
    with refused("models"):
        held_out_errors({"a fit, not its vehicle": whole}, [moved], folds=3)


@pytest.mark.parametrize(
    ("errors", "as_good"),
    [
        ({"a": [1.0, np.nan], "b": [2.0, np.nan]}, ["a", "b"]),
        ({"a": [1.0, 1.0], "b": [np.inf, 1.0]}, ["a"]),
        ({"a": [np.inf, 1.0], "b": [np.inf, 2.0]}, ["a"]),
        ({"a": [1.0, 1.1, 0.9], "b": [2.0, 2.1, 1.9]}, ["a"]),
        ({"a": [1.0, 1.2, 0.9], "b": [1.1, 1.0, 1.0]}, ["a", "b"]),
    ],
)
def test_the_best_model_is_as_good_as_itself_and_one_that_stops_is_not(
    errors: dict[str, list[float]], as_good: list[str]
) -> None:
    """A single group, here the first, tells no models apart."""
    found = HeldOut({name: np.array(each) for name, each in errors.items()}, {})
    assert found.as_good == as_good
