"""`continuair view` reads, flies and writes, and refuses in one sentence what it cannot."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from typer.testing import CliRunner

import continuair as ca
from amiri2026 import open_loop_test
from continuair.cli.commands import app
from continuair.viewer import flying, video
from continuair.viewer.drawing import Picture
from continuair.viewer.export import write_page
from continuair.viewer.flying import fly
from continuair.viewer.reading import chosen, recorded
from continuair.viewer.scene import scene
from tests.refusals import assert_refused, refused
from tests.viewer.flights import PAPER, swing, watching

pytest.importorskip("viser")


def run(*words: str) -> Any:
    return CliRunner().invoke(app, ["view", *words])


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flight") / "swing.nc"
    swing(duration=0.2).to_netcdf(path, engine="h5netcdf")
    return path


def spoilt(file: Path, at: Path, what: str) -> Path:
    """A file that something is wrong with."""
    path = at / "spoilt.nc"
    flight = swing(duration=0.2)
    if what == "not ours":
        xr.Dataset({"wind": ("time", np.ones(3))}).to_netcdf(path, engine="h5netcdf")
    elif what == "text":
        path.write_text("time,x\n0,1\n")
    elif what == "truncated":
        path.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    elif what == "newer":
        versions = json.dumps({"continuair": "99.1"})
        flight.assign_attrs(versions=versions).to_netcdf(path, engine="h5netcdf")
    elif what == "no vehicle":
        flight.attrs.pop("vehicle")
        flight.to_netcdf(path, engine="h5netcdf")
    elif what == "odd vehicle":
        flight.assign_attrs(vehicle='{"name": 3}').to_netcdf(path, engine="h5netcdf")
    elif what == "no bend":
        flight.drop_vars("bend").to_netcdf(path, engine="h5netcdf")
    return path


@pytest.mark.parametrize(
    ("what", "field", "fact"),
    [
        ("not ours", "result", ""),
        ("text", "result", ""),
        ("truncated", "result", ""),
        ("newer", "result", "continuair 99.1"),
        ("no vehicle", "result", "vehicle"),
        ("odd vehicle", "flight", "vehicle"),
        ("no bend", "result", "bend"),
        ("absent", "result", ""),
    ],
)
def test_a_result_that_cannot_be_shown_is_told_in_one_sentence(
    file: Path, tmp_path: Path, what: str, field: str, fact: str
) -> None:
    assert_refused(run(str(spoilt(file, tmp_path, what))), field, fact)


def test_a_port_that_is_taken_is_told(file: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        assert_refused(run(str(file), "--port", str(port)), "port", str(port))


@pytest.mark.parametrize(
    ("words", "field", "fact"),
    [
        (["--port", "70000"], "port", "70000"),
        (["--export", "page.html"], "viser", "continuair[view]"),
    ],
)
def test_what_cannot_be_served_or_written_is_told_before_a_vehicle_flies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], field: str, fact: str
) -> None:
    monkeypatch.chdir(tmp_path)
    if "--export" in words:
        monkeypatch.setitem(sys.modules, "viser", None)

    def never(_vehicle: object) -> None:
        raise AssertionError("it flies")

    monkeypatch.setattr(flying, "fly", never)
    assert_refused(run("paper", *words), field, fact)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
@pytest.mark.filterwarnings("default::continuair.errors.ContinuairWarning")
def test_a_flight_that_ended_early_is_told_when_and_why(tmp_path: Path) -> None:
    start = [0, 0, 3, 0, 0, 0, 6.0, 0.0, 0, 0]
    push = np.array([1.0, 0.0, 0.0, 0.0])
    scenario = ca.Scenario("bent", start, bend_moment=push, duration=0.2)
    vehicle = ca.load_vehicle("two_section")
    flight = ca.simulate(vehicle, scenario, sample=0.01, method="RK4", step=2e-4)
    assert int(flight["status"]) == 2
    flight.to_netcdf(tmp_path / "bent.nc", engine="h5netcdf")
    words = f"coupled flight ended at {float(flight['end_time']):.2f} s: bent"
    told = run(str(tmp_path / "bent.nc"), "--export", str(tmp_path / "page.html"))
    assert told.exit_code == 0
    assert told.output.count(words) == 1
    assert words in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_forces_that_a_result_does_not_tell_are_told_and_drawn_of_its_scenario() -> None:
    test = open_loop_test("D")
    flight = ca.simulate(PAPER, test, sample=0.1)
    with pytest.warns(ca.ContinuairWarning, match="tip_wrench"):
        assert "tip force" not in scene(flight).forces
    acted = scene(flight, scenario=test).forces["tip force"]
    np.testing.assert_allclose(acted.force[0, 0], [-10 / np.sqrt(2), 0.0, -25.0], atol=1e-12)


def test_an_interrupted_video_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(picture: Picture, frame: int) -> None:
        if frame > 0:
            raise KeyboardInterrupt

    path = tmp_path / "swing.gif"
    with monkeypatch.context() as patch:
        patch.setattr(Picture, "show", interrupted)
        with pytest.raises(KeyboardInterrupt):
            ca.animate(swing(duration=0.2), path)
    assert not list(tmp_path.iterdir())


def test_a_missing_package_is_named(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    assert_refused(run(str(file)), "viser", "pip install 'continuair[view]'")


def test_without_ffmpeg_a_gif_is_offered(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    told = run(str(file), "--video", str(tmp_path / "flight.mp4"))
    assert_refused(told, "video", "pip install 'continuair[video]'", ".gif")


def test_a_store_of_a_sweep_is_told_to_hold_no_flights(tmp_path: Path) -> None:
    (tmp_path / "zarr.json").write_text("{}")
    assert_refused(run(str(tmp_path)), "result", "sweep")


@pytest.mark.parametrize("ends", ["exit 1", "cat > /dev/null; exit 1"])
def test_an_ffmpeg_that_fails_is_told_in_a_sentence_and_leaves_nothing(
    ends: str, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "bin" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text(f"#!/bin/sh\n{ends}\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(broken.parent), os.environ["PATH"]]))
    told = run(str(file), "--video", str(tmp_path / "flight.mp4"))
    assert_refused(told, "video", "ffmpeg")
    assert not list(tmp_path.glob("flight*.mp4"))


@pytest.mark.parametrize("option", ["--export", "--video"])
@pytest.mark.parametrize("name", ["mine", "nowhere/flight", "flight.txt"])
def test_nothing_is_written_where_something_is_or_cannot_be(
    file: Path, tmp_path: Path, option: str, name: str
) -> None:
    suffix = ".html" if option == "--export" else ".gif"
    path = tmp_path / (name if name.endswith(".txt") else f"{name}{suffix}")
    if name == "mine":
        path.write_text("mine")
    assert_refused(run(str(file), option, str(path)), option.removeprefix("--"), str(path))
    assert not path.exists() or path.read_text() == "mine"


def test_a_vehicle_flies_one_flight(tmp_path: Path) -> None:
    told = run("paper", "--flight", "B", "--export", str(tmp_path / "page.html"))
    assert_refused(told, "flight", "paper")
    assert_refused(run("papr"), "vehicle", "papr")


def study(at: Path) -> Path:
    """A folder as a study leaves it, with flights of two models in two files."""
    at.mkdir()
    for name, far in (("A", 0.0), ("B", 1.0)):
        models = [swing(duration=0.2), swing(duration=0.2, model="decoupled")]
        models[1]["position"] = models[1]["position"] + far
        both = xr.concat(models, xr.Variable("model", ["coupled", "decoupled"]))
        both.attrs.pop("model")
        both.to_netcdf(at / f"open_loop_{name}.nc", engine="h5netcdf")
    content = {"study": "open_loop", "version": "0.1.0", "files": [], "parts": []}
    (at / ".continuair").write_text(json.dumps(content))
    (at / "table.md").write_text("")
    return at


def test_a_study_shows_the_flight_that_is_named_beside_the_decoupled_one(tmp_path: Path) -> None:
    flights = recorded(study(tmp_path / "study"))
    assert [each.name for each in flights] == ["A", "B"]
    assert chosen(flights, None).name == "A"
    vehicle, flown, ghost = chosen(flights, "B").load()
    assert vehicle == PAPER and ghost is not None
    apart = scene(flown, vehicle, ghost)
    assert (apart.model, apart.ghost_model) == ("coupled", "decoupled")
    assert apart.ghost is not None
    moved = apart.ghost.position - apart.bodies.position
    np.testing.assert_allclose(moved, 1.0, rtol=1e-14)
    assert_refused(run(str(tmp_path / "study"), "--flight", "C"), "flight", "C")


@pytest.mark.long
def test_a_run_of_a_batch_has_the_vehicle_of_its_own(tmp_path: Path) -> None:
    lengths = np.array([0.5, 1.0, 1.5])
    vehicles = PAPER.replace({"arm.length": lengths})
    bent = ca.Scenario("bent", [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.5, 0.0], duration=0.05)
    ca.simulate(vehicles, bent, sample=0.01).to_netcdf(tmp_path / "batch.nc", engine="h5netcdf")
    for run_, length in enumerate(lengths):
        vehicle, flown, _ = recorded(tmp_path / "batch.nc")[run_].load()
        assert vehicle.reach == length
        chord = np.diff(ca.backbone(vehicle, flown, points=201).isel(time=3), axis=0)
        assert np.linalg.norm(chord, axis=1).sum() == pytest.approx(length, rel=1e-5)


def test_a_page_needs_nothing_else_and_is_small(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    write_page(scene(watching(duration=10.0)), path, "a <flight>")
    page = path.read_text(encoding="utf-8")
    assert path.stat().st_size < 10e6
    assert "<title>a &lt;flight&gt;</title>" in page
    assert "Content-Security-Policy" in page and "default-src 'unsafe-inline'" in page
    assert 'src="http' not in page and 'href="http' not in page


def test_a_gif_lasts_as_long_as_the_flight(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "swing.gif"
    told = run(str(file), "--video", str(path))
    assert told.exit_code == 0, told.output
    with Image.open(path) as film:
        assert getattr(film, "n_frames", 1) == 5  # 0.2 s at 20 a second, and both ends
        first = np.asarray(film.convert("RGB"))
        film.seek(4)
        assert (np.asarray(film.convert("RGB")) != first).any()


@pytest.mark.slow
def test_an_mp4_is_written_from_python(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "swing.mp4"
    ca.animate(watching(duration=0.2), path)
    assert path.read_bytes()[4:8] == b"ftyp"
    with refused("video"):
        video.animate(watching(duration=0.2), path)


def test_the_view_of_a_simulation_is_on_this_machine_alone_and_follows_its_steps() -> None:
    vehicle = PAPER.replace({"uav.mount": (0.1, 0.0, -0.2)})
    simulation = ca.Simulation(vehicle, ca.Scenario("fall", [0, 0, 5, 0, 0, 0, 0.1, 0]))
    shown = ca.view(simulation, port=0)
    try:
        assert shown.url.startswith("http://127.0.0.1:")
        for _ in range(20):
            simulation.step(force=[100.0, 0.0, 0.0])
        end = time.monotonic() + 60.0
        while shown.scene.times[0] != simulation.time:
            assert time.monotonic() < end
            time.sleep(0.01)
        tip = simulation.trajectory()["tip_position"][-1]
        np.testing.assert_allclose(shown.scene.bodies.tip_position[0, 0], tip, rtol=1e-13)
        assert not shown.follows
        while simulation.state[0] < 8.0:
            simulation.step(force=[100.0, 0.0, 0.0])
        while not shown.follows:
            assert time.monotonic() < end
            time.sleep(0.01)
    finally:
        shown.stop()
    with refused("vehicle"):
        ca.view(simulation, vehicle, port=0)


@pytest.mark.slow
def test_ctrl_c_ends_a_view_quietly(file: Path) -> None:
    command = [sys.executable, "-m", "continuair", "view", str(file), "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith("The flight is at http://127.0.0.1:")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        assert process.stderr.read() == ""
    assert process.returncode == 0


@pytest.mark.slow
def test_a_vehicle_with_rotors_hovers_while_its_arms_move() -> None:
    rotors = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.2, 12.0],
              "torque_per_thrust": 0.016, "lag": 0.04}  # fmt: skip
    vehicle = ca.load_vehicle("slender").replace({"uav.rotors": rotors})
    scenario, coupled, decoupled = fly(vehicle)
    assert scenario.controller is not None
    assert int(coupled["status"]) == int(decoupled["status"]) == 0
    assert float(abs(coupled["position"] - [0.0, 0.0, 1.6 * float(vehicle.reach)]).max()) < 1.0
    assert float(abs(coupled["bend"]).max()) > 0.5


def test_a_view_answers_pages_of_its_own_address_alone(file: Path) -> None:
    """Neither a page of another site in the same browser, nor one bound to this machine later."""
    view = ca.view(ca.read_result(file), port=0)
    try:
        port = int(view.url.rpartition(":")[2].strip("/"))
        own = f"127.0.0.1:{port}"
        asked = [
            (own, None, 200),
            (f"localhost:{port}", f"http://localhost:{port}", 200),
            (f"evil.example:{port}", None, 403),
            (own, "http://evil.example", 403),
        ]
        for host, origin, expected in asked:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
            headers = {"Host": host} | ({} if origin is None else {"Origin": origin})
            connection.request("GET", "/", headers=headers)
            assert connection.getresponse().status == expected, (host, origin)
            upgrade = {"Upgrade": "websocket", "Connection": "Upgrade"}
            upgrade |= {
                "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
                "Sec-WebSocket-Version": "13",
            }
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
            connection.request("GET", "/", headers=headers | upgrade)
            assert connection.getresponse().status == (101 if expected == 200 else 403)
    finally:
        view.stop()
