"""An MCAP log holds the flight as Foxglove's schemas have it; read back by the mcap package."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from amiri2026 import open_loop_test
from continuair import ContinuairWarning
from tests.interfaces.flights import flight

pytest.importorskip("mcap")
from mcap.reader import make_reader  # noqa: E402

from tests.refusals import refused

PRESETS = ("paper", "two_section", "dual_arm")


def read(path: Path) -> tuple[dict[str, list[tuple[int, Any]]], dict[str, Any]]:
    """Messages by topic, each with its time [ns], and schemas by topic."""
    messages: dict[str, list[tuple[int, Any]]] = {}
    schemas = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            assert channel.message_encoding == "json" and schema is not None
            schemas[channel.topic] = (schema.name, json.loads(schema.data))
            found = messages.setdefault(channel.topic, [])
            found.append((message.log_time, json.loads(message.data)))
    return messages, schemas


def vector(message: dict[str, float]) -> np.ndarray:
    return np.array([message[axis] for axis in "xyzw" if axis in message])


@pytest.mark.parametrize("name", PRESETS)
def test_frames_are_where_the_flight_has_them(name: str, tmp_path: Path) -> None:
    dataset, vehicle = flight(name), ca.load_vehicle(name)
    ca.to_mcap(dataset, tmp_path / "flight.mcap")
    messages, schemas = read(tmp_path / "flight.mcap")
    assert schemas["/tf"][0] == "foxglove.FrameTransforms"
    assert [at for at, _ in messages["/tf"]] == [round(1e9 * t) for t in dataset.time.to_numpy()]
    tips = dataset.tip_position.to_numpy().reshape(len(dataset.time), -1, 3)
    attitudes = dataset.tip_attitude.to_numpy().reshape(len(dataset.time), -1, 4)
    for i in (0, 13, 25):
        frames = {each["child_frame_id"]: each for each in messages["/tf"][i][1]["transforms"]}
        uav = frames["uav"]
        turn = Rotation.from_quat(vector(uav["rotation"]))
        np.testing.assert_array_equal(vector(uav["translation"]), dataset.position[i])
        for index, arm in enumerate(vehicle.arms):
            tip = frames[f"{arm.name}.tip"]
            assert (uav["parent_frame_id"], tip["parent_frame_id"]) == ("world", "uav")
            found = vector(uav["translation"]) + turn.apply(vector(tip["translation"]))
            np.testing.assert_allclose(found, tips[i, index], rtol=0, atol=1e-12)
            turned = turn * Rotation.from_quat(vector(tip["rotation"]))
            apart = turned.inv() * Rotation.from_quat(attitudes[i, index])
            assert apart.magnitude() < 1e-12


def test_the_scene_draws_arms_from_mount_to_tip_at_a_rate_that_is_seen(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("dual_arm")
    ca.to_mcap(flight("dual_arm"), tmp_path / "flight.mcap")
    messages, schemas = read(tmp_path / "flight.mcap")
    assert schemas["/scene"][0] == "foxglove.SceneUpdate"
    entities = {each["id"]: each for each in messages["/scene"][0][1]["entities"]}
    assert entities["uav"]["cubes"][0]["size"]["z"] > 0.0
    for index, arm in enumerate(vehicle.arms):
        points = entities[f"{arm.name}.arm"]["lines"][0]["points"]
        np.testing.assert_allclose(vector(points[0]), arm.mount)
        tip = messages["/tf"][0][1]["transforms"][1 + index]["translation"]
        np.testing.assert_allclose(vector(points[-1]), vector(tip), rtol=0, atol=1e-12)
    assert 2 < len(messages["/scene"]) <= 0.25 * 60 + 2


def test_numbers_are_those_that_were_logged_with_their_units(tmp_path: Path) -> None:
    dataset = flight("dual_arm")
    ca.to_mcap(dataset, tmp_path / "flight.mcap")
    messages, schemas = read(tmp_path / "flight.mcap")
    last = messages["/flight"][-1][1]
    assert last["tip_velocity"]["right"]["y"] == dataset.tip_velocity[-1, 1, 1]
    assert last["bend"]["left_0"]["x"] == dataset.bend[-1, 0, 0]
    assert last["kinetic_energy"] == dataset.kinetic_energy[-1]
    told = schemas["/flight"][1]["properties"]
    assert told["tip_velocity"]["properties"]["right"]["properties"]["y"]["description"] == "m/s"


def test_inputs_are_what_acted_wrenches_on_tips_among_them(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("dual_arm")
    wrench = np.arange(1.0, 13.0) / 10
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1, 0.0]
    scenario = ca.Scenario("held", start, tip_wrench=wrench, duration=0.05, tip_wrench_sign=-1)
    dataset = ca.simulate(vehicle, scenario, sample=0.01)
    ca.to_mcap(dataset, tmp_path / "flight.mcap")
    messages, schemas = read(tmp_path / "flight.mcap")
    found = messages["/inputs"][-1][1]["tip_wrench"]
    assert found["left"]["force_x"] == -0.1 and found["right"]["moment_z"] == -1.2
    told = schemas["/inputs"][1]["properties"]["tip_wrench"]["properties"]["left"]["properties"]
    assert (told["force_x"]["description"], told["moment_x"]["description"]) == ("N", "N m")


def test_a_function_of_time_is_sampled_from_the_scenario_and_missed_without_it(
    tmp_path: Path,
) -> None:
    vehicle = ca.load_vehicle("paper")
    scenario = open_loop_test("D")
    dataset = ca.simulate(vehicle, scenario, duration=0.05, sample=0.01)
    ca.to_mcap(dataset, tmp_path / "whole.mcap", scenario=scenario)
    messages, _ = read(tmp_path / "whole.mcap")
    wrench = messages["/inputs"][3][1]["tip_wrench"]["arm"]
    given: Any = scenario.tip_wrench
    assert wrench["force_x"] == pytest.approx(-given(0.03)[0])
    with pytest.warns(ContinuairWarning, match="tip_wrench"):
        ca.to_mcap(dataset, tmp_path / "less.mcap")
    assert "/inputs" not in read(tmp_path / "less.mcap")[0]


def test_what_is_not_a_number_is_null_and_messages_follow_in_time(tmp_path: Path) -> None:
    dataset = flight("paper").copy()
    dataset["tip_velocity"] = dataset.tip_velocity.where(dataset.time < 0.1)
    ca.to_mcap(dataset, tmp_path / "flight.mcap")
    messages, _ = read(tmp_path / "flight.mcap")
    assert messages["/flight"][-1][1]["tip_velocity"]["x"] is None
    with (tmp_path / "flight.mcap").open("rb") as stream:
        found = make_reader(stream)
        times = [each.log_time for *_, each in found.iter_messages(log_time_order=False)]
        metadata = {each.name: each.metadata for each in found.iter_metadata()}
    assert times == sorted(times)
    assert json.loads(metadata["continuair"]["vehicle"])["name"] == "paper"


def test_the_metadata_tell_the_vehicle_of_the_run(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.mass": [2.0, 2.5]})
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    flights = ca.simulate(vehicle, ca.Scenario("fall", start, duration=0.02), sample=0.01)
    ca.to_mcap(flights.isel(run=1), tmp_path / "flight.mcap")
    with (tmp_path / "flight.mcap").open("rb") as stream:
        (told,) = (each.metadata for each in make_reader(stream).iter_metadata())
    assert json.loads(told["vehicle"])["uav"]["mass"] == 2.5


def test_a_batch_is_refused(tmp_path: Path) -> None:
    both = xr.concat([flight("paper")] * 2, "run")
    with refused("flight"):
        ca.to_mcap(both, tmp_path / "flight.mcap")
