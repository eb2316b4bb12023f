"""Points along the arms are where the flown model has them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import continuair as ca
from continuair.analysis.backbone import along
from continuair.analysis.motion import motion_of
from continuair.equations import position
from continuair.viewer.scene import scene
from tests.refusals import refused
from tests.viewer.flights import PAPER, swing

Array = NDArray[np.float64]

TURNED = {"uav.mount": (0.1, -0.05, -0.2)}
STARTS = {
    "paper": [0.4, -0.3, 2.0, 0.3, -0.5, 1.1, 2.5, 0.7],
    "dual_arm": [0.1, 0.2, 3.0, 0.3, -0.4, 0.5, 3.0, 0.3, 0.0, -0.4],
    "two_section": [0.1, 0.2, 3.0, -0.2, 0.4, 0.5, 4.0, 0.3, 6.0, -2.0],
}


@pytest.mark.long
@pytest.mark.parametrize("name", STARTS)
def test_the_last_point_is_the_tip_of_the_flight(name: str) -> None:
    vehicle = ca.load_vehicle(name)
    if name == "paper":
        vehicle = vehicle.replace(TURNED)
    flight = ca.simulate(vehicle, ca.Scenario("bent", STARTS[name], duration=0.02), sample=0.01)
    points = ca.backbone(vehicle, flight, points=20)
    assert points.dims == (*flight["tip_position"].dims[:-1], "point", "axis")
    # Both are sums of a few numbers of some metres.
    np.testing.assert_allclose(points.isel(point=-1), flight["tip_position"], rtol=0, atol=1e-14)


def test_points_are_those_of_the_papers_equations() -> None:
    vehicle = ca.load_vehicle("paper").replace(TURNED)
    q = np.array(STARTS["paper"])
    flight = ca.simulate(vehicle, ca.Scenario("bent", q, duration=0.01), sample=0.01)
    points = ca.backbone(vehicle, flight, points=11).isel(time=0)
    expected = position(vehicle, q, np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(points, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", ["dual_arm", "two_section"])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, 6.0])
def test_an_arm_follows_its_tangent_at_unit_speed_through_all_sections(
    name: str, angle: float
) -> None:
    for arm in ca.load_vehicle(name).arms:
        lengths = np.array([section.length for section in arm.section])
        bend = angle / lengths[:, None] * np.array([0.6, -0.8])
        points, frames = along(arm, bend.ravel(), 9)
        stations = np.linspace(0.0, lengths.sum(), 9)
        walked = walk(lengths, bend, np.asarray(arm.mount), frames[0], stations)
        # A step of 1e-2 of a section may cross its end, and errs by bend times its square.
        np.testing.assert_allclose(points, walked, rtol=0, atol=3e-4)


def walk(lengths: Array, bend: Array, at: Array, axes: Array, stations: Array) -> Array:
    """Points of an arm from what curvature is: the frame turns by k along the way, dr/ds = -z."""
    ends = np.cumsum(lengths)

    def slope(s: float, y: Array) -> Array:
        now = y[3:].reshape(3, 3)
        kx, ky = bend[min(int(np.searchsorted(ends, s)), len(ends) - 1)]
        turn = np.array([[0.0, 0.0, -kx], [0.0, 0.0, -ky], [kx, ky, 0.0]])
        return np.concatenate([-now[:, 2], (now @ turn).ravel()])

    start, step = np.concatenate([at, axes.ravel()]), lengths.min() / 100
    found = solve_ivp(
        slope, (0.0, stations[-1]), start, t_eval=stations, rtol=1e-10, atol=1e-12, max_step=step
    )
    return np.asarray(found.y[:3].T)


def test_points_are_missing_where_a_flight_has_ended() -> None:
    flight = swing()
    flight["bend"][60:] = np.nan
    points = ca.backbone(ca.load_vehicle("paper"), flight)
    assert np.isfinite(points[:60]).all() and np.isnan(points[60:, 1:]).all()


def test_the_papers_coordinates_tell_the_position_too() -> None:
    vehicle = ca.load_vehicle("paper")
    scenario = ca.Scenario("bent", STARTS["paper"], duration=0.02)
    names = ["q", "position", "attitude", "bend"]
    flight = ca.simulate(vehicle, scenario, sample=0.01, variables=names)
    expected = ca.backbone(vehicle, flight, points=5)
    bare = flight.drop_vars("position")
    for each in (bare, bare.sortby("coordinate"), bare.isel(coordinate=slice(None, None, -1))):
        found = ca.backbone(vehicle, each, points=5)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_models_and_runs_keep_their_dimensions() -> None:
    flight = swing().expand_dims(model=["coupled", "decoupled"])
    points = ca.backbone(ca.load_vehicle("paper"), flight, points=5)
    assert points.dims == ("model", "time", "point", "axis")
    assert points["arc_length"].to_numpy().tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_a_flight_of_another_vehicle_is_told() -> None:
    with refused("flight"):
        ca.backbone(ca.load_vehicle("two_section"), swing())
    with refused("flight"):
        ca.backbone(ca.load_vehicle("paper"), swing().drop_vars("bend"))


def test_another_vehicle_than_flew_is_told_by_its_tips() -> None:
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.3]
    flight = ca.simulate(PAPER, ca.Scenario("bent", start, duration=0.02), sample=0.01)
    other = PAPER.replace({"arm.length": 1.1})
    for use in (lambda: ca.backbone(other, flight), lambda: scene(flight, other)):
        with refused("vehicle"):
            use()
    ca.backbone(PAPER, flight.astype(np.float32))


def test_another_vehicle_than_flew_is_told_without_tips() -> None:
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.3]
    scenario = ca.Scenario("bent", start, duration=0.02)
    several = PAPER.replace({"arm.length": np.array([1.0, 1.1])})
    kept = ("position", "attitude", "bend")
    batch = ca.simulate(several, scenario, sample=0.01, variables=kept)
    for flight, wrong in [(batch, PAPER), (batch.isel(run=1), PAPER)]:
        with refused("vehicle"):
            ca.backbone(wrong, flight)
    stiff = PAPER.replace({"arm.youngs_modulus": 1e11})
    ca.backbone(stiff, batch.isel(run=0))
    moved = PAPER.replace({"uav.mount": [0.0, 0.05, 0.0]})
    with refused("vehicle"):
        ca.backbone(moved, batch.isel(run=[0]))
    ca.backbone(moved, batch.isel(run=[0]).drop_attrs())


@pytest.mark.parametrize("times", [[0.0, 0.02, 0.01], [0.0, 0.01, 0.01], [0.0, np.nan, 0.02]])
def test_times_that_do_not_go_on_are_told(times: list[float]) -> None:
    flight = swing().isel(time=slice(3)).assign_coords(time=times)
    for use in (
        lambda: ca.backbone(PAPER, flight),
        lambda: scene(flight),
        lambda: motion_of(flight),
    ):
        with refused("time"):
            use()


def test_a_quaternion_that_is_no_turn_is_told() -> None:
    flight = swing()
    flight["attitude"][3] *= 1.01
    with refused("attitude"):
        ca.backbone(PAPER, flight)
    flight["attitude"][3] /= 1.01
    flight["attitude"][4:] = np.nan
    assert len(motion_of(flight).time) == 4
