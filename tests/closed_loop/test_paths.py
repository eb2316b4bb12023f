"""Paths of a target: position, velocity and acceleration agree, and are bounded."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.scenario import paths
from continuair.scenario.paths import Path
from tests.closed_loop.flights import VEHICLE, designed, scenario
from tests.refusals import refused

ZIGZAG = [[0.0, 0.0, 0.0], [0.5, 0.2, 0.1], [0.3, 0.6, 0.1], [0.9, 0.6, -0.2]]
PATHS: dict[str, Path] = {
    "M": paths.letter("M"),
    "R": paths.letter("R"),
    "A": paths.letter("A"),
    "L": paths.letter("L"),
    "fast R": paths.letter("R", duration=10.0),
    "word": paths.word("MRAL", duration=100.0),
    "hold": paths.hold([0.1, 0.2, 0.3]),
    "line": paths.line([0.0, 0.0, 0.0], [0.4, -0.2, 0.3]),
    "circle": paths.circle(),
    "lissajous": paths.lissajous((0.4, 0.2), (2, 3), (0.1, 0.2)),
    "polyline": paths.polyline(ZIGZAG, duration=8.0),
    "tight polyline": paths.polyline(ZIGZAG, duration=8.0, smoothing=0.6),
    "function": paths.from_function(lambda t: [np.sin(t), np.cos(2 * t), 0.1 * t], 10.0),
}


def samples(path: Path, count: int = 40_001) -> tuple[np.ndarray, ...]:
    t = np.linspace(0.0, path.duration, count)
    return (t, *path(t))


@pytest.mark.parametrize("name", PATHS)
def test_velocity_and_acceleration_are_the_slopes_of_the_position(name: str) -> None:
    t, position, velocity, acceleration = samples(PATHS[name])
    h = t[1] - t[0]
    speed, strength = np.abs(velocity).max(), np.abs(acceleration).max()
    # Simpson's rule on pairs of intervals: what is summed from a slope is what was passed.
    for value, rate, size in ((position, velocity, speed), (velocity, acceleration, strength)):
        passed = value[2::2] - value[:-2:2]
        summed = h / 3 * (rate[:-2:2] + 4 * rate[1:-1:2] + rate[2::2])
        # Where its slope jumps, at a knot of the spline, an acceleration's sum errs by some of its
        # change in a step: 3e-7, and 2e-5 for the spline through a function, of many more knots.
        tolerance = 2e-4 if name == "function" else 3e-6
        assert np.abs(passed - summed).max() < tolerance * size * h + 1e-15


def test_beyond_its_duration_a_path_from_rest_to_rest_stays_and_a_formula_goes_on() -> None:
    for name, path in PATHS.items():
        position, velocity, acceleration = path([path.duration, 1.3 * path.duration])
        stays = name not in ("circle", "lissajous", "function")
        assert np.allclose(position[1], position[0], rtol=0.0, atol=1e-12) == stays, name
        assert (np.abs([velocity[1], acceleration[1]]).max() < 1e-12) == stays, name


def test_a_motion_that_changes_its_times_in_place_leaves_those_of_the_flight() -> None:
    def late(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t -= 0.5
        along = np.array([0.1, 0.0, 0.0])
        return np.outer(t, along), np.outer(t**0, along), np.outer(t, np.zeros(3))

    vehicle, start = ca.load_vehicle("paper"), [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    law = ca.hold(vehicle, [0.0, 0.0, 3.0])
    scenario = ca.Scenario("late", start, controller=law, duration=0.1)
    flight = ca.simulate(vehicle, scenario.replace(target=ca.Target(Path("late", 1.0, late))))
    np.testing.assert_allclose(flight.time, np.arange(101) * 1e-3, rtol=1e-14)
    where = 0.1 * (flight.time.to_numpy() - 0.5)
    np.testing.assert_allclose(flight.target_position[:, 0], where, rtol=0, atol=1e-15)


@pytest.mark.long
@pytest.mark.parametrize("name", PATHS)
def test_the_bounds_hold_however_finely_a_path_is_sampled(name: str) -> None:
    """A jump would grow slopes without end; here they settle."""
    largest = []
    for count in (10_001, 50_001):
        t, _, velocity, acceleration = samples(PATHS[name], count)
        h = t[1] - t[0]
        largest.append([np.abs(np.diff(x, axis=0)).max() / h for x in (velocity, acceleration)])
    coarse, fine = np.array(largest)
    np.testing.assert_allclose(fine, coarse, rtol=0.05, atol=1e-3)


@pytest.mark.parametrize("name", "MRAL")
def test_a_letter_is_written_80_cm_high_around_its_centre_in_its_time(name: str) -> None:
    path = paths.letter(name, centre=[1.0, 2.0, 0.5])
    t, position, velocity, _ = samples(path)
    assert path.duration == 50.0 and path.name == name
    height = np.ptp(position[:, 1])
    # Rounding takes a few millimetres off corners that turn by less than half a turn.
    assert 0.77 < height <= 0.8 + 1e-12
    np.testing.assert_allclose(position[:, 2], 0.5, rtol=0, atol=1e-14)
    middle = (position.min(axis=0) + position.max(axis=0)) / 2
    np.testing.assert_allclose(middle, [1.0, 2.0, 0.5], rtol=0, atol=0.02)
    for end in (0, -1):
        np.testing.assert_allclose(velocity[end], 0.0, rtol=0, atol=1e-14)
    after, still, _ = path([50.0, 60.0])
    np.testing.assert_allclose(after[1], after[0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(still, 0.0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", "MRAL")
def test_a_letter_is_as_fast_as_its_length_over_its_time_and_no_faster(name: str) -> None:
    _, position, velocity, acceleration = samples(paths.letter(name))
    speed = np.linalg.norm(velocity, axis=1)
    length = np.linalg.norm(np.diff(position, axis=0), axis=1).sum()
    # It takes half a corner's time to start and to stop, and corners are cut.
    assert length / 48.0 <= np.median(speed) < 1.06 * length / 48.0
    assert speed.max() < 1.001 * np.median(speed)
    # A turn by π in 2 s of a quadratic B-spline: at most 2 v times its peak, 9/4 over 2 s.
    assert np.linalg.norm(acceleration, axis=1).max() <= 2 * speed.max() * 9 / 4 / 2.0


def test_letters_have_straight_inclined_and_curved_pieces() -> None:
    _, _, velocity, acceleration = samples(paths.letter("R"))
    curving = np.linalg.norm(np.cross(velocity, acceleration), axis=1) > 1e-6
    angle = np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0]))[~curving]
    assert np.isclose(angle, 90.0, atol=0.1).sum() > 1000
    assert np.isclose(angle, np.degrees(np.arctan2(-0.5, 0.4)), atol=0.1).sum() > 1000
    assert curving.mean() > 0.2


def test_a_word_is_its_letters_in_a_row() -> None:
    def extent(text: str) -> np.ndarray:
        return np.ptp(paths.word(text, smoothing=1e-3)(np.linspace(0, 50, 20_001))[0], axis=0)

    separate = [extent(name)[0] for name in "RAL"]
    gap = 0.25 * 0.8
    np.testing.assert_allclose(extent("RAL")[0], sum(separate) + 2 * gap, rtol=0, atol=5e-3)
    assert paths.word("mral").name == "MRAL"


def test_a_circle_keeps_its_radius_and_its_period() -> None:
    t, position, velocity, _ = samples(paths.circle(0.3, period=10.0, centre=[1.0, 0.0, 0.0]))
    np.testing.assert_allclose(
        np.hypot(position[:, 0] - 1.0, position[:, 1]), 0.3, rtol=0, atol=1e-14
    )
    np.testing.assert_allclose(
        np.linalg.norm(velocity, axis=1), 0.3 * 2 * np.pi / 10, rtol=0, atol=1e-14
    )
    np.testing.assert_allclose(position[0], [1.3, 0, 0], rtol=0, atol=1e-14)
    assert velocity[0, 1] > 0.0


def test_times_need_no_order() -> None:
    path = paths.letter("R")
    t = np.random.default_rng(2).uniform(0, 50, 100)
    one_by_one = np.array([[*(part[0] for part in path(x))] for x in t])
    np.testing.assert_allclose(np.stack(path(t), axis=1), one_by_one, rtol=0, atol=1e-14)


def corner(t: float) -> list[float]:
    return [abs(t - 3.3), 0.0, 0.0]


def jump(t: float) -> list[float]:
    return [float(t > 3.3), 0.0, 0.0]


def steep(t: float) -> list[float]:
    return [abs(t - 3.3) ** 1.5, 0.0, 0.0]


def eased(t: float) -> list[float]:
    """From rest to rest over 1 m in 3 s."""
    u = min(t / 3.0, 1.0)
    return [10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, 0.0, 1.0]


REFUSED: dict[str, tuple[Any, str]] = {
    "unknown letter": (lambda: paths.letter("Q"), "letter"),
    "two letters": (lambda: paths.letter("MR"), "letter"),
    "no letter": (lambda: paths.letter(""), "letter"),
    "letter number": (lambda: paths.letter(3), "letter"),  # type: ignore[arg-type]
    "unknown in word": (lambda: paths.word("MARS"), "text"),
    "height": (lambda: paths.letter("M", height=0.0), "height"),
    "duration": (lambda: paths.letter("M", duration=-1.0), "duration"),
    "duration nan": (lambda: paths.hold(duration=np.nan), "duration"),
    "duration text": (
        lambda: paths.circle(duration="long"),  # type: ignore[arg-type]
        "duration",
    ),
    "centre": (lambda: paths.letter("M", centre=[0, 0]), "centre"),
    "sharp corners": (
        lambda: paths.polyline(ZIGZAG, smoothing=0.0),
        "smoothing",
    ),
    "all smoothing": (lambda: paths.letter("M", smoothing=1.0), "smoothing"),
    "one point": (lambda: paths.polyline([[0, 0]]), "points"),
    "ragged": (lambda: paths.polyline([[0, 0], [1]]), "points"),
    "repeated": (lambda: paths.line([1, 1, 1], [1, 1, 1]), "points"),
    "radius": (lambda: paths.circle(radius=-0.1), "radius"),
    "period": (lambda: paths.lissajous(period=0), "period"),
    "amplitudes": (lambda: paths.lissajous(3.0), "amplitudes"),
    "position": (lambda: paths.hold("here"), "position"),
    "corner": (
        lambda: paths.from_function(corner, 10.0),
        "position",
    ),
    "jump": (
        lambda: paths.from_function(jump, 10.0),
        "position",
    ),
    "steep": (
        lambda: paths.from_function(steep, 10.0),
        "position",
    ),
    "single precision": (
        lambda: paths.from_function(lambda t: np.array([np.sin(t), 0.0, t], np.float32), 10.0),
        "position",
    ),
    "single precision and rest": (
        lambda: paths.from_function(lambda t: np.array(eased(t), np.float32), 10.0),
        "position",
    ),
    "masked times": (
        lambda: paths.circle()(np.ma.array([0.0, 1.0], mask=[False, True])),
        "times",
    ),
    "no function": (lambda: paths.from_function(3, 1.0), "position"),  # type: ignore[arg-type]
    "function of two": (
        lambda: paths.from_function(lambda t: [t, t], 1.0),
        "position",
    ),
    "function that raises": (
        lambda: paths.from_function(lambda t: [1 / 0, 0, 0], 1.0),
        "position",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_an_unusable_path_is_refused_in_one_sentence(case: str) -> None:
    act, field = REFUSED[case]
    with refused(field):
        act()


def test_a_path_that_rests_after_its_motion_is_no_rounding() -> None:
    assert paths.from_function(eased, 10.0)([3.0, 9.0])[0].tolist() == [eased(3.0), eased(9.0)]


def inside(t: float) -> float:
    return float(np.sqrt(t * (2.0 - t) + 1.0)) if 0.0 <= t <= 2.0 else np.nan


@pytest.mark.parametrize("far", [0.0, 1e4])
def test_an_acceleration_that_jumps_is_no_rounding(far: float) -> None:
    """A start of 1 m/s² that ends at 1 s."""
    path = paths.from_function(
        lambda t: [far + (0.5 * t**2 if t < 1.0 else t - 0.5), far, 2.0], 3.0
    )
    t, _, velocity, acceleration = samples(path, 1001)
    np.testing.assert_allclose(velocity[:, 0], np.minimum(t, 1.0), rtol=0, atol=1e-4)
    apart = abs(t - 1.0) > 1e-3
    np.testing.assert_allclose(acceleration[apart, 0], t[apart] < 1.0, rtol=0, atol=2e-3)


def test_a_function_is_asked_inside_its_duration_only() -> None:
    path = paths.from_function(lambda t: [inside(t)] * 3, 2.0)
    t, position, velocity, acceleration = samples(path, 1001)
    assert np.isfinite(np.hstack([position, velocity, acceleration])).all()
    expected = (1.0 - t) / np.sqrt(t * (2.0 - t) + 1.0)
    np.testing.assert_allclose(velocity[:, 0], expected, rtol=0, atol=1e-6)


def test_a_path_that_jumps_beyond_its_duration_is_refused_where_it_is_followed_so_far() -> None:
    late = paths.from_function(lambda t: [0.1 * np.sin(t), 0.0, 0.1 * (t > 0.35)], 0.2, "late")
    flown = scenario(designed(), target=ca.Target(late))
    ca.simulate(VEHICLE, flown, duration=0.3)
    with refused("path"):
        ca.simulate(VEHICLE, flown, duration=0.5)


@pytest.mark.long
def test_a_fast_motion_is_no_jump_however_far_beyond_its_duration_it_is_followed() -> None:
    ca.Target(paths.circle(0.4, period=0.5, duration=1.0)).check_until(100.0)
    # Nor many periods within it.
    ca.Target(paths.circle(0.4, period=0.5, duration=5000.0))
    leaping = paths.from_function(
        lambda t: [np.sin(9.0 * t), 0.0, 0.1 * (t > 300)], 500.0, "leaping"
    )
    with refused("path"):
        ca.Target(leaping)


def test_a_motion_that_adds_up_over_the_times_it_is_asked_for_is_refused() -> None:
    """It is right on even times alone, and a flight asks for others."""

    def summed(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        velocity = np.ones((len(t), 3))
        return np.cumsum(velocity, axis=0) * 2.0 / len(t), velocity, np.zeros((len(t), 3))

    with refused("path summed"):
        ca.Target(paths.Path("summed", 2.0, summed))


@pytest.mark.long
@pytest.mark.parametrize("size", [1.0, 1e-5])
def test_a_velocity_that_is_not_the_positions_is_refused_however_small_the_path(
    size: float,
) -> None:
    def still(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        along = np.outer(np.sin(t), [size, 0.0, 0.0])
        return along, np.zeros_like(along), np.zeros_like(along)

    with refused("path"):
        ca.Target(paths.Path("still", 2.0, still))
