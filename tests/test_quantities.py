"""Arrays that mean more than their numbers: with units, which NumPy would drop, and dimensions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.refusals import refused

PAPER = ca.load_vehicle("paper")
START = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.1, 0.0]


class Subclass(np.ndarray):
    """As astropy's quantities: arrays of NumPy that have a unit."""

    unit: Any = None


class Around:
    """As Pint's: around a number or an array, whose methods they have if it does."""

    units = object()

    def __init__(self, magnitude: Any) -> None:
        self.magnitude = magnitude

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["magnitude"], name)

    def __array__(self, *_: Any, **__: Any) -> np.ndarray:
        return np.asarray(self.magnitude)

    def tolist(self) -> Any:
        return self.magnitude.tolist()

    def __repr__(self) -> str:
        return f"{self.magnitude} gram"


def in_kilo(values: Any) -> Subclass:
    found = np.asarray(values, float).view(Subclass)
    found.unit = "k", object()
    return found


KINDS: list[Callable[[Any], Any]] = [in_kilo, lambda values: Around(np.asarray(values, float))]
FORCE = [0.0, 0.0, 0.025]


def flown(**inputs: Any) -> None:
    ca.simulate(PAPER, ca.Scenario("x", START, duration=0.02, **inputs))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("field", "use"),
    [
        ("force", lambda made: flown(force=made(FORCE))),
        ("force", lambda made: flown(force=lambda t: made(FORCE))),
        ("velocity", lambda made: ca.gust(made(FORCE), 0.0, 1.0)),
        ("gravity", lambda made: flown(gravity=made(9.81))),
        ("q", lambda made: ca.Scenario("x", made(START))),
        ("duration", lambda made: ca.Scenario("x", START, duration=made(500.0))),
        ("uav.mass", lambda made: PAPER.replace({"uav.mass": made(1500.0)})),
        ("arm.radius", lambda made: PAPER.replace({"arm.radius": made([0.004, 0.005])})),
        ("uav.mount", lambda made: PAPER.replace({"uav.mount": made([0.0, 0.0, -5.0])})),
        ("uav.mount", lambda made: PAPER.replace({"uav.mount": [0.0, 0.0, made(-5.0)]})),
        ("position", lambda made: ca.hold(PAPER, made([0.0, 0.0, 2.0]))),
        ("position", lambda made: ca.Setpoints(position=made([0.0, 0.0, 2.0]))),
        ("end", lambda made: ca.paths.line([0.0] * 3, made([1.0, 0.0, 0.0]))),
        ("distance", lambda made: ca.Target(ca.paths.hold(), distance=made(200.0))),
        ("times", lambda made: ca.paths.hold()(made([1.0]))),
        (
            "angular_velocity",
            lambda made: ca.accelerations(PAPER, angular_velocity=made([0.0, 0.0, 90.0])),
        ),
    ],
)
def test_a_quantity_with_a_unit_is_refused(
    field: str, use: Callable[[Any], None], kind: Any
) -> None:
    use(lambda values: np.asarray(values, float).tolist())
    with refused(field):
        use(kind)


def test_a_quantity_around_one_number_is_told_as_it_is() -> None:
    with refused("uav.mass"):
        PAPER.replace({"uav.mass": Around(1500.0)})


def test_what_only_notes_a_unit_is_none() -> None:
    """As results do, whose numbers are SI."""
    noted = xr.DataArray(START, attrs={"units": "various"})
    np.testing.assert_array_equal(ca.Scenario("x", noted).q, START)


def test_runs_of_a_labelled_array_are_known_by_their_name() -> None:
    pushes = np.arange(9.0).reshape(3, 3)
    told = xr.DataArray(pushes.T, dims=("axis", "run"))
    pushed = ca.Scenario("x", START, force=told).force
    np.testing.assert_array_equal(np.asarray(pushed), pushes, strict=True)
    position = np.asarray(ca.Setpoints(position=told).position)
    np.testing.assert_array_equal(np.squeeze(position), pushes, strict=True)
    assert PAPER.replace({"uav.mount": told * 0.01}).select(1).uav.mount[1] == 0.04
