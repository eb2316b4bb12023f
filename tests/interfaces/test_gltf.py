"""A glTF file shows what flew, where it was: read here by the rules of glTF alone."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from tests.interfaces.flights import flight
from tests.refusals import refused

PRESETS = ("paper", "two_section", "dual_arm")
DTYPES = {5126: "<f4", 5121: "<u1", 5123: "<u2"}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Read:
    """A .glb file."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        magic, version, length = struct.unpack("<4sII", content[:12])
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack("<I4s", content[12:20])
        assert kind == b"JSON" and size % 4 == 0
        self.document = json.loads(content[20 : 20 + size])
        self.data = content[28 + size :]

    def array(self, index: int) -> Any:
        accessor = self.document["accessors"][index]
        view = self.document["bufferViews"][accessor["bufferView"]]
        start = view["byteOffset"]
        rows = np.frombuffer(
            self.data[start : start + view["byteLength"]], DTYPES[accessor["componentType"]]
        )
        rows = rows.reshape(accessor["count"], WIDTHS[accessor["type"]])
        np.testing.assert_array_equal(accessor["min"], rows.min(axis=0))
        np.testing.assert_array_equal(accessor["max"], rows.max(axis=0))
        return rows

    def poses(self, frame: int) -> dict[int, Any]:
        """Matrices of all nodes in the scene's axes at a keyframe."""
        nodes = [dict(node) for node in self.document["nodes"]]
        animation = self.document["animations"][0]
        for channel in animation["channels"]:
            target, sampler = channel["target"], animation["samplers"][channel["sampler"]]
            nodes[target["node"]][target["path"]] = self.array(sampler["output"])[frame]
        found: dict[int, Any] = {}

        def place(index: int, above: Any) -> None:
            node, own = nodes[index], np.eye(4)
            scale = np.diag(node.get("scale", [1.0, 1.0, 1.0]))
            own[:3, :3] = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix() @ scale
            own[:3, 3] = node.get("translation", [0.0, 0.0, 0.0])
            found[index] = above @ own
            for child in node.get("children", []):
                place(child, found[index])

        for root in self.document["scenes"][0]["nodes"]:
            place(root, np.eye(4))
        return found

    def named(self, name: str) -> int:
        return [node["name"] for node in self.document["nodes"]].index(name)

    @property
    def times(self) -> Any:
        return self.array(self.document["animations"][0]["samplers"][0]["input"])[:, 0]


def written(dataset: xr.Dataset, folder: Path) -> Read:
    ca.to_gltf(dataset, folder / "flight.glb")
    return Read(folder / "flight.glb")


def y_up(point: Any) -> Any:
    return np.array([point[0], point[2], -point[1]])


@pytest.mark.parametrize("name", PRESETS)
def test_tips_and_bodies_are_where_the_flight_has_them(name: str, tmp_path: Path) -> None:
    dataset, vehicle = flight(name), ca.load_vehicle(name)
    read = written(dataset, tmp_path)
    tips = dataset.tip_position.to_numpy().reshape(len(dataset.time), -1, 3)
    attitudes = dataset.tip_attitude.to_numpy().reshape(len(dataset.time), -1, 4)
    turn = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    for frame in (0, len(read.times) // 2, len(read.times) - 1):
        at = np.abs(dataset.time.to_numpy() - read.times[frame]).argmin()
        poses = read.poses(frame)
        uav = poses[read.named("uav")]
        np.testing.assert_allclose(uav[:3, 3], y_up(dataset.position.to_numpy()[at]), atol=1e-5)
        for index, arm in enumerate(vehicle.arms):
            tip = poses[read.named(f"{arm.name}.tip")]
            np.testing.assert_allclose(tip[:3, 3], y_up(tips[at, index]), atol=1e-5)
            expected = (turn * Rotation.from_quat(attitudes[at, index])).as_matrix()
            np.testing.assert_allclose(tip[:3, :3], expected, atol=1e-5)


def test_the_camera_sees_as_wide_and_as_high_as_ours(tmp_path: Path) -> None:
    lens = {"camera.focal_length": (400.0, 800.0), "camera.image_size": (1000, 800)}
    vehicle = ca.load_vehicle("paper").replace(lens)
    scenario = ca.Scenario("still", [0, 0, 3, 0, 0, 0, 0.1, 0], duration=0.1)
    seen = written(ca.simulate(vehicle, scenario, sample=0.05), tmp_path).document["cameras"][0]
    high = np.tan(seen["perspective"]["yfov"] / 2.0)
    assert high == pytest.approx(400.0 / 800.0)
    assert high * seen["perspective"]["aspectRatio"] == pytest.approx(500.0 / 400.0)


@pytest.mark.parametrize("name", PRESETS)
def test_the_skin_of_an_arm_is_around_it_from_end_to_end(name: str, tmp_path: Path) -> None:
    vehicle, read = ca.load_vehicle(name), written(flight(name), tmp_path)
    poses = read.poses(len(read.times) - 1)
    for arm in vehicle.arms:
        node = read.document["nodes"][read.named(f"{arm.name}.tube")]
        skin = read.document["skins"][node["skin"]]
        shape = read.document["meshes"][node["mesh"]]["primitives"][0]["attributes"]
        inverse = read.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        bones = np.stack([poses[each] for each in skin["joints"]]) @ inverse
        joints, vertices = read.array(shape["JOINTS_0"])[:, 0], read.array(shape["POSITION"])
        assert (read.array(shape["WEIGHTS_0"]) == [1, 0, 0, 0]).all()
        skinned = (
            np.einsum("nij,nj->ni", bones[joints][:, :3, :3], vertices) + bones[joints][:, :3, 3]
        )
        for end, frame in ((0, arm.name), (joints.max(), f"{arm.name}.tip")):
            ring = skinned[joints == end]
            where = poses[read.named(frame)][:3, 3]
            np.testing.assert_allclose(ring.mean(axis=0), where, atol=1e-5)
            radius = np.linalg.norm(ring - where, axis=1)
            section = arm.section[0 if end == 0 else -1]
            np.testing.assert_allclose(radius, section.radius, rtol=1e-2)


def test_keyframes_are_samples_at_sixty_a_second_at_most_and_the_last(tmp_path: Path) -> None:
    dataset = flight("paper")
    read = written(dataset, tmp_path)
    times = dataset.time.to_numpy()
    assert read.times[-1] == pytest.approx(times[-1])
    assert all(np.abs(times - each).min() < 1e-6 for each in read.times)
    assert len(read.times) <= 60 * times[-1] + 2


def test_a_quaternion_never_flips_from_one_keyframe_to_the_next(tmp_path: Path) -> None:
    read = written(flight("paper"), tmp_path)
    for channel in read.document["animations"][0]["channels"]:
        if channel["target"]["path"] == "rotation":
            sampler = read.document["animations"][0]["samplers"][channel["sampler"]]
            values = read.array(sampler["output"])
            assert ((values[1:] * values[:-1]).sum(axis=1) > 0.0).all()


def test_another_program_loads_it_as_a_closed_surface_that_looks_outwards(tmp_path: Path) -> None:
    written(flight("dual_arm"), tmp_path)
    scene = trimesh.load(tmp_path / "flight.glb", process=False)
    for shape in scene.geometry.values():
        shape.merge_vertices(merge_norm=True)
        assert shape.is_watertight and shape.volume > 0.0


def test_a_flight_that_ended_early_stops_where_it_ended(tmp_path: Path) -> None:
    whole = flight("paper")
    ended = whole.where(whole.time < 0.1)
    ended.attrs = whole.attrs
    assert written(ended, tmp_path).times[-1] == pytest.approx(0.09)


def test_what_is_no_single_flight_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path, one = tmp_path / "flight.glb", flight("paper")
    both = xr.concat([one, one], "run")
    for wrong in (both, one.drop_vars("bend"), one.drop_attrs(), 3):
        with refused("flight"):
            ca.to_gltf(wrong, path)  # type: ignore[arg-type]
    with refused("path"):
        ca.to_gltf(one, tmp_path / "flight.gltf")
    with refused("flight"):
        ca.to_gltf(one, path, vehicle=ca.load_vehicle("two_section"))
    assert not list(tmp_path.iterdir())
