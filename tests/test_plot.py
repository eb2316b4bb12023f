"""Figures of `continuair.plot` show the numbers of the flight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.flight.labels import flat_labels
from tests.refusals import refused
from tests.sections.strains import flying, rod
from tests.viewer.flights import PAPER, swing, watching

DUAL = ca.load_vehicle("dual_arm")


def curves(axes: Any) -> list[Any]:
    """Of vehicles and flights, without the scale and the ground of snapshots."""
    lines = [line for line in axes.get_lines() if line.get_gid() not in ("scale", "ground")]
    return [line.get_xydata() for line in lines]


@pytest.mark.parametrize("vehicle", [PAPER.replace({"uav.mount": (0.2, 0.0, -0.3)}), DUAL])
def test_snapshots_draw_every_arm_from_its_mount_to_its_tip(vehicle: ca.Vehicle) -> None:
    flight = swing(vehicle)
    drawn = curves(ca.plot.snapshots(flight, [0.5]).axes[0])
    points = ca.backbone(vehicle, flight).sel(time=0.5).to_numpy().reshape(len(vehicle.arms), -1, 3)
    for ends in (points - flight["position"].sel(time=0.5).to_numpy())[:, [0, -1]]:
        assert any(
            len(line) > 2 and np.allclose(line[[0, -1]], ends[:, [0, 2]], rtol=0, atol=1e-12)
            for line in drawn
        )


def test_snapshots_take_the_order_of_axes_from_their_labels() -> None:
    flight = swing().assign_coords(quaternion=list("xyzw"))
    orders = {"axis": list("zyx"), "quaternion": list("wxyz"), "bend_axis": ["y", "x"]}
    expected, found = (
        curves(ca.plot.snapshots(each, [0.5]).axes[0]) for each in (flight, flight.sel(orders))
    )
    for one, other in zip(expected, found, strict=True):
        np.testing.assert_array_equal(other, one)


def test_snapshots_take_dimensions_in_any_order_and_positions_from_coordinates() -> None:
    two = swing(DUAL)
    turned = two.transpose("bend_axis", "section", "quaternion", "axis", ...)
    scenario = ca.Scenario("bent", (0.5, 0, 3, 0.2, 0, 0, 1.0, 0.3), duration=0.5)
    names = ["q", "position", "attitude", "bend"]
    one = ca.simulate(PAPER, scenario, sample=0.01, variables=names)
    for flight, other in ((two, turned), (one, one.drop_vars("position"))):
        drawn = (curves(ca.plot.snapshots(each, [0.5]).axes[0]) for each in (flight, other))
        for line, same in zip(*drawn, strict=True):
            np.testing.assert_allclose(same, line, rtol=0, atol=1e-12)


@pytest.mark.parametrize("times", [[], [0.0, 99.0], [-1.0], [np.nan], ["a"], 0.5])
def test_snapshots_are_of_times_within_the_flight(times: Any) -> None:
    with refused("times"):
        ca.plot.snapshots(swing(), times)


def test_snapshots_may_come_in_any_order_and_at_the_same_sample() -> None:
    flight = swing()
    end = float(flight.time[-1])
    for times in ([0.7 * end, 0.2 * end], [0.5 * end, 0.5 * end + 1e-9]):
        assert len(ca.plot.snapshots(flight, times).axes) == 1


def test_snapshots_of_an_arm_to_the_side_do_not_meet() -> None:
    vehicle = PAPER.replace({"uav.mount": (0.2, 0.0, -0.3)})
    flight = swing(vehicle)
    turned = flight.assign(attitude=flight["attitude"] * 0.0 + np.sqrt([0.0, 0.5, 0.0, 0.5]))
    lines = curves(ca.plot.snapshots(turned, [0.0, 0.5]).axes[0])[1:]
    first, second = lines[: len(lines) // 2], lines[len(lines) // 2 :]
    ends = [np.concatenate(each)[:, 0] for each in (first, second)]
    assert ends[0].max() < ends[1].min()


def test_models_without_names_are_told() -> None:
    both = xr.concat([swing(), swing()], "model")
    with refused("flight"):
        ca.plot.bend(both)


def test_the_tip_path_the_bend_and_the_wrench_are_those_of_the_flight() -> None:
    flight = swing(DUAL)
    flight["tip_position"] = ca.backbone(DUAL, flight).isel(point=-1).drop_vars("arc_length")
    flight = flight.assign_coords(arm=["left", "right"], section=["left.0", "right.0"])
    path = ca.plot.tip_path(flight)
    np.testing.assert_array_equal(
        curves(path.axes[3])[0], flight["tip_position"].sel(arm="right", axis=["x", "z"])
    )
    bend = curves(ca.plot.bend(flight).axes[3])[0]
    np.testing.assert_array_equal(bend[:, 1], flight["bend"].sel(section="right.0", bend_axis="y"))
    flight["base_moment"] = 2.0 * flight["base_force"]
    wrench = ca.plot.base_wrench(flight)
    assert len(wrench.axes) == 12
    np.testing.assert_array_equal(
        curves(wrench.axes[-1])[0][:, 1], 2.0 * flight["base_force"].sel(arm="right", axis="z")
    )


def test_a_batch_is_shown_by_its_median_and_nine_tenths_of_its_runs() -> None:
    """Runs scale with their number, so that their order at every time is that of the runs."""
    flight = swing(DUAL)
    flight["tip_position"] = ca.backbone(DUAL, flight).isel(point=-1).drop_vars("arc_length")
    scale = xr.DataArray(np.linspace(0.0, 2.0, 41), dims="run")
    batch = flight.assign({name: scale * flight[name] for name in ("bend", "tip_position")})
    axes = ca.plot.bend(batch).axes[3]
    (line,), (band,) = curves(axes), axes.collections
    expected = flight["bend"].isel(section=1, bend_axis=1).to_numpy()
    np.testing.assert_allclose(line[:, 1], expected, rtol=1e-12)
    edges = np.asarray(band.get_paths()[0].vertices)[:, 1]
    np.testing.assert_allclose(
        [edges.min(), edges.max()],
        [min(0.1 * expected.min(), 1.9 * expected.min()), 1.9 * expected.max()],
    )
    paths = curves(ca.plot.tip_path(batch).axes[0])
    assert len(paths) == 42
    np.testing.assert_allclose(paths[-1][:, 0], flight["tip_position"].isel(arm=0).sel(axis="x"))


def test_strains_have_a_row_for_each_section_and_a_panel_for_each_coordinate() -> None:
    """A panel shows the coordinate that its label names, whatever the order of coordinates."""
    vehicle = flying(rod(bending=1, stretch=0, name="long"), rod(name="short"))
    names = [*flat_labels(vehicle)]
    time = np.linspace(0.0, 1.0, 5)
    values = xr.DataArray(
        np.outer(time, np.arange(1.0, 8.0)), [("time", time), ("strain_coordinate", names)]
    )
    flight = xr.Dataset(
        {"strain": values, "status": 0, "end_time": 1.0}, attrs={"model": "coupled"}
    )
    figure = ca.plot.bend(flight.isel(strain_coordinate=slice(None, None, -1)))
    axes = {each.get_ylabel(): curves(each)[0][:, 1] for each in figure.axes}
    assert len(axes) == 7
    np.testing.assert_array_equal(axes["0.long\nbend_x_1 [1/m]"], 2.0 * time)
    np.testing.assert_array_equal(axes["0.long\nstretch_0 [-]"], 5.0 * time)
    np.testing.assert_array_equal(axes["0.short\nbend_y_0 [1/m]"], 7.0 * time)


def test_the_image_shows_the_feature_points() -> None:
    flight = watching()
    axes = ca.plot.image(flight).axes[0]
    np.testing.assert_array_equal(curves(axes)[0], flight["features"][:, :2])


def test_what_is_missing_is_told() -> None:
    with refused("flight"):
        ca.plot.tip_path(swing())
    with refused("flight"):
        ca.plot.snapshots(swing().expand_dims(run=[0, 1]), [0.0])
    for draw in (ca.plot.bend, lambda flight: ca.plot.snapshots(flight, [0.0])):
        with refused("flight"):
            draw(swing().isel(time=0))
