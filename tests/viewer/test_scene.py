"""What is drawn is where the flight has it, sized and pointed as the forces are."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.analysis.backbone import placed
from continuair.equations import project
from continuair.viewer.bodies import rotors_of
from continuair.viewer.camera import in_image
from continuair.viewer.drawing import _outline
from continuair.viewer.forces import scale_of
from continuair.viewer.panel import readings
from continuair.viewer.player import Player
from continuair.viewer.scene import scene
from tests.refusals import refused
from tests.viewer.flights import swing, watching

DUAL = ca.load_vehicle("dual_arm")


def test_segments_lie_along_the_backbone_and_their_frames_along_its_tangent() -> None:
    flight = swing(DUAL)
    drawn = scene(flight).bodies
    points = ca.backbone(DUAL, flight, points=65).to_numpy()
    middle = drawn.middle.reshape(len(drawn.middle), 2, -1, 3)
    np.testing.assert_allclose(middle, points[:, :, 1::2], rtol=0, atol=1e-14)
    z = Rotation.from_quat(drawn.turn.reshape(-1, 4)).apply([0.0, 0.0, 1.0])
    chord = (points[:, :, 2::2] - points[:, :, :-2:2]).reshape(-1, 3)
    # A chord is parallel to the tangent at the middle of its arc.
    np.testing.assert_allclose(np.cross(z, chord), 0.0, atol=1e-14)
    assert (np.einsum("ni,ni->n", z, chord) > 0.0).all()


@pytest.mark.long
def test_the_largest_bend_is_also_that_of_a_section_too_short_to_be_drawn() -> None:
    """A wrist of 5 mm at the end of half a metre lies between the middles of two segments."""
    sections = [
        {"length": 0.5, "mass_per_length": 0.1, "bending_stiffness": 5.0, "damping_ratio": 0.1},
        {"length": 0.005, "mass_per_length": 0.1, "bending_stiffness": 2e-3, "damping_ratio": 0.1},
    ]
    uav = {"mass": 2.0, "inertia": [0.03, 0.03, 0.05]}
    tip = {"mass": 0.05, "centre": [0.0, 0.0, 0.03], "inertia": [2e-5, 2e-5, 1e-5]}
    vehicle = ca.Vehicle(
        name="wrist", uav=uav, arm=[{"name": "a", "section": sections, "tip": tip}]
    )
    start = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.2 / 0.005, 0.0]
    flight = ca.simulate(
        vehicle, ca.Scenario("bent wrist", start, gravity=0.0, duration=0.02), sample=0.01
    )
    shown = scene(flight)
    assert f"{np.degrees(1.2):.1f}°" in readings(shown, 0)
    assert shown.largest_bend == pytest.approx(1.2, rel=1e-12)


def test_the_drawn_tip_frame_is_that_of_the_flight() -> None:
    start = [0.1, 0.2, 3.0, -0.2, 0.4, 0.5, 4.0, 0.3, 6.0, -2.0]
    vehicle = ca.load_vehicle("two_section")
    flight = ca.simulate(vehicle, ca.Scenario("bent", start, duration=0.02), sample=0.01)
    drawn = Rotation.from_quat(scene(flight).bodies.tip_attitude[:, 0])
    flown = Rotation.from_quat(flight["tip_attitude"].to_numpy()[:, 0])
    assert (drawn * flown.inv()).magnitude().max() < 1e-14


def test_forces_act_where_they_act_and_are_as_long_as_they_are_large() -> None:
    flight = swing(DUAL)
    drawn = scene(flight)
    mounts = ca.backbone(DUAL, flight).isel(point=0).to_numpy()
    reaction = drawn.forces["base reaction"]
    np.testing.assert_allclose(reaction.at, mounts, rtol=0, atol=1e-14)
    attitude = Rotation.from_quat(flight["attitude"].to_numpy())
    expected = attitude.apply(flight["base_force"].to_numpy()[:, 1])
    np.testing.assert_allclose(reaction.force[:, 1], expected, rtol=1e-13)
    push = drawn.forces["push"]
    np.testing.assert_array_equal(push.force[7], [[3.0, 0.0, 0.0]])
    scale = scale_of(drawn.forces, 0.5)
    arrow = reaction.arrows(scale)
    lengths = np.linalg.norm(arrow[..., 1, :] - arrow[..., 0, :], axis=-1)
    np.testing.assert_allclose(lengths, scale * np.sqrt(17.0), rtol=1e-13)
    assert lengths.max() == pytest.approx(0.5)


REVERSED = {"axis": list("zyx"), "quaternion": list("wzyx"), "bend_axis": ["y", "x"]}


@pytest.mark.parametrize("flight", [swing(DUAL), watching()], ids=["arms", "camera"])
def test_labels_in_another_order_change_nothing_that_is_drawn(flight: xr.Dataset) -> None:
    of_arms = {"arm": ["left", "right"], "section": ["left.0", "right.0"]}
    orders = dict(REVERSED)
    if "arm" in flight.dims:
        flight = flight.assign_coords(of_arms)
        orders |= {name: labels[::-1] for name, labels in of_arms.items()}
    flight = flight.assign_coords(quaternion=list("xyzw"))
    expected, found = (numbers_of(scene(each)) for each in (flight, flight.sel(orders)))
    assert len(expected) > 10
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)


def test_a_flight_without_some_of_its_labels_is_refused() -> None:
    flight = swing(DUAL).assign_coords(arm=["left", "right"], section=["left.0", "right.0"])
    for part in ({"axis": [0, 1]}, {"arm": [1]}, {"section": [0]}):
        with refused("flight"):
            scene(flight.isel(part))
        with refused("flight"):
            ca.plot.snapshots(flight.isel(part), [0.5])
    with refused("flight"):
        ca.plot.tip_path(flight.assign(tip_position=flight["position"]).isel(axis=[0, 1]))


def numbers_of(drawn: Any, name: str = "scene") -> dict[str, np.ndarray]:
    """All arrays within what is drawn, by where they are."""
    if isinstance(drawn, np.ndarray):
        return {name: drawn}
    parts: Any = {}
    if is_dataclass(drawn) and not isinstance(drawn, ca.Vehicle):
        parts = {each.name: getattr(drawn, each.name) for each in fields(drawn)}
    elif isinstance(drawn, dict):
        parts = drawn
    elif isinstance(drawn, (list, tuple)):
        parts = dict(enumerate(drawn))
    found: dict[str, np.ndarray] = {}
    for key, part in parts.items():
        found |= numbers_of(part, f"{name}.{key}")
    return found


def test_of_a_batch_the_push_is_that_of_the_run_that_is_shown() -> None:
    forces = [[3.0, 0.0, 0.0], [5.0, 0.0, 0.0]]
    pushed = ca.Scenario("pushed", np.zeros(8), force=forces, duration=0.05)
    flight = ca.simulate(ca.load_vehicle("paper"), pushed, sample=0.01)
    push = scene(flight.isel(run=1)).forces["push"]
    np.testing.assert_array_equal(push.force[:, 0], [[5.0, 0.0, 0.0]] * len(push.force))


def test_thrusts_stand_on_their_rotors() -> None:
    rotors = {"layout": "hex_tilted", "lever": 0.3, "tilt": 0.3, "thrust_limits": [0.0, 20.0],
              "torque_per_thrust": 0.02}  # fmt: skip
    vehicle = ca.load_vehicle("slender").replace({"uav.rotors": rotors})
    thrust = np.arange(1.0, 7.0)
    flight = swing(vehicle)
    flight["rotor_thrust"] = ("time", "rotor"), np.tile(thrust, (flight.sizes["time"], 1))
    found = scene(flight).forces["rotor thrusts"]
    assert vehicle.uav.rotors is not None
    body = Rotation.from_quat(flight["attitude"].to_numpy()).inv()
    wrench = vehicle.uav.rotors.allocation @ thrust
    np.testing.assert_allclose(body.apply(found.force.sum(axis=1))[3], wrench[:3], atol=1e-12)


def test_the_image_plane_shows_a_point_on_the_way_to_it() -> None:
    flight = watching()
    view = scene(flight).camera_view
    assert view is not None
    ahead = np.array([0.2, -0.1, 1.7])
    turn = Rotation.from_quat(view.attitude)
    seen = np.asarray(view.camera.principal_point) + 800.0 * np.ravel(project(ahead[None]))
    image = np.tile(seen, (len(view.position), 1, 1))
    shown = in_image(replace(view, image=image), 0.3)[:, 0] - view.position
    np.testing.assert_allclose(shown, 0.3 / 1.7 * turn.apply(ahead), rtol=0, atol=1e-13)


@pytest.mark.slow
def test_a_camera_in_a_frenet_frame_is_where_the_flight_has_it() -> None:
    camera = {"camera.tip_frame": "frenet", "camera.position": [0.05, 0.02, 0.01]}
    vehicle = ca.load_vehicle("slender").replace(camera)
    law = ca.classic(vehicle)
    watched = ca.Target(ca.paths.hold([0.0, 0.0, 0.0]))
    start = ca.Scenario("look", [0, 0, 4.0, 0, 0, 0, 0.1, 1.2], controller=law, target=watched)
    flight = ca.simulate(vehicle, start, duration=0.1, sample=0.02)
    view = scene(flight).camera_view
    assert view is not None
    np.testing.assert_allclose(view.position, flight["camera_position"], atol=1e-12)


def test_a_flight_that_ends_early_stays_where_it_ended() -> None:
    flight = swing()
    flight["position"][50:] = np.nan
    with pytest.warns(ca.ContinuairWarning, match="coupled .* 0.49 s"):
        found = scene(flight, ghost=swing(model="decoupled"))
    assert np.isfinite(found.apart[:50]).all() and np.isnan(found.apart[50:]).all()
    push = found.forces["push"].arrows(1.0)
    assert (push[:50, :, 1] != push[:50, :, 0]).any(-1).all()
    np.testing.assert_array_equal(push[50:, :, 1], push[50:, :, 0])
    drawn = found.bodies
    assert np.isfinite(drawn.position).all()
    np.testing.assert_array_equal(drawn.position[-1], flight["position"][49])


def test_frames_are_samples_of_the_flight_and_end_with_its_last() -> None:
    flight = swing(duration=50.0)
    times = scene(flight).times
    assert np.isin(times, flight["time"]).all()
    assert times[0] == 0.0 and times[-1] == 50.0
    assert len(times) == 3001  # 60 a second


def test_a_run_of_50_s_is_shown_30_times_a_second_and_more() -> None:
    times = scene(swing(duration=50.0)).times
    shown: list[int] = []
    player = Player(times, shown.append)
    player.playing, player.loop = True, False
    for _ in range(1500):
        player.advance(1.0 / 30.0)
    assert len(shown) >= 1500 and shown == sorted(set(shown))
    assert shown[-1] == len(times) - 1


def test_a_player_loops_slows_and_seeks() -> None:
    shown: list[int] = []
    player = Player(np.linspace(0.0, 1.0, 101), shown.append)
    player.playing, player.speed = True, 0.5
    player.advance(1.0)
    assert shown == [50]
    player.seek(0.2)
    assert shown[-1] == 20
    player.speed = 1.0
    player.advance(0.9)
    assert shown[-1] == 0 and player.playing
    player.loop = False
    player.advance(1.5)
    assert shown[-1] == 100 and not player.playing


def test_what_is_no_single_flight_is_told() -> None:
    flight = swing()
    with refused("flight"):
        scene(flight.expand_dims(run=[0, 1]))
    with refused("flight"):
        scene(flight.drop_attrs())
    with refused("ghost"):
        scene(flight, ghost=swing(duration=2.0))
    later = flight.assign_coords(time=flight["time"] + 0.5)
    with refused("ghost"):
        scene(flight, ghost=later)


@pytest.mark.parametrize("layout", ["quad_x", "hex_plus", "octo_x", "coaxial_x8"])
def test_disks_of_rotors_without_a_radius_leave_each_other_room_but_for_coaxial_ones(
    layout: str,
) -> None:
    rotors = {"layout": layout, "lever": 0.3, "thrust_limits": [0.0, 20.0],
              "torque_per_thrust": 0.02}  # fmt: skip
    drawn = rotors_of(ca.load_vehicle("slender").replace({"uav.rotors": rotors}))
    apart = np.linalg.norm(drawn.hubs[:, None, :2] - drawn.hubs[:, :2], axis=-1)
    assert 0.2 * 0.3 < drawn.radius < 0.5 * apart[apart > 1e-6].min()


def test_what_hangs_on_the_uav_is_where_it_is_in_the_world() -> None:
    flight = swing(DUAL)
    drawn, frame = scene(flight).bodies, 70
    own = drawn.in_body(frame, drawn.middle[frame])
    world = placed(drawn.position[frame], drawn.attitude[frame], own)
    np.testing.assert_allclose(world, drawn.middle[frame], rtol=0, atol=1e-14)
    turned = Rotation.from_quat(drawn.turned_in_body(frame, drawn.turn[frame]))
    back = Rotation.from_quat(drawn.attitude[frame]) * turned
    assert (back.inv() * Rotation.from_quat(drawn.turn[frame])).magnitude().max() < 1e-14


def test_readings_have_no_minus_zero_and_no_distance_to_a_flight_that_has_ended() -> None:
    flight, ghost = swing(), swing(model="decoupled")
    flight["position"][:, 0] = -1e-4
    ghost["bend"][50:] = np.nan
    with pytest.warns(ca.ContinuairWarning, match="decoupled .* 0.49 s"):
        both = scene(flight, ghost=ghost)
    assert "-0.00" not in readings(both, 0) and " mm" in readings(both, 0)
    assert "ended" in readings(both, 80) and " mm" not in readings(both, 80)


@pytest.mark.long
def test_rims_of_rotors_lie_across_their_axes_wherever_these_point() -> None:
    places = [[0.2, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.2, -0.2, 0.0]]
    given: list[dict[str, Any]] = [
        {"position": place, "spin": (-1) ** i} for i, place in enumerate(places)
    ]
    for axis in ([0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]):
        given.append({"position": [0.0, 0.1, 0.0], "axis": axis, "spin": 1})
    rotors = {"rotor": given, "thrust_limits": [0.0, 15.0], "torque_per_thrust": 0.016}
    vehicle = ca.load_vehicle("slender").replace({"uav.rotors": rotors | {"radius": 0.1}})
    hover = ca.Scenario("hover", [0, 0, 2, 0, 0, 0, 0.1, 0], rotor_command=[3.0] * 8, duration=0.02)
    rims = _outline(scene(ca.simulate(vehicle, hover, sample=0.01)))[-8:]
    for rim, rotor in zip(rims, given, strict=True):
        off = rim - np.array(rotor["position"])
        np.testing.assert_allclose(np.linalg.norm(off, axis=1), 0.1, rtol=1e-12)
        assert np.abs(off @ np.array(rotor.get("axis", [0.0, 0.0, 1.0]))).max() < 1e-15
