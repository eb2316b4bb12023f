"""What a sweep cannot do it says in one sentence, and it writes nothing."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.sweeps import checksums, cluster
from continuair.sweeps.design import load_design
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import assert_refused, refused

pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")

SMALL = '[scenario]\ntest = "A"\nduration = 0.02\n[[vary]]\n"vehicle.uav.mass" = [1.0, 2.0]\n'

COUNTED = "{ from = 1, to = 2, count = 1000000000000 }"
FAST = 'excitation = "sine"\nfrequency = 1e308'
LOOP = "[controller]\n[target]\n"


def run(folder: Path, text: str, *options: str, out: str = "store.zarr") -> Any:
    design = folder / "design.toml"
    design.write_text(text)
    arguments = ["sweep", str(design), "--out", str(folder / out), *options]
    return CliRunner().invoke(cli.app, arguments)


@pytest.mark.parametrize(
    ("text", "field", "fact"),
    [
        (SMALL.replace("uav.mass", "uav.mas"), "vehicle.uav.mas", "use uav.mass"),
        (SMALL.replace("vehicle.uav.mass", "scenario.kapa"), "scenario.kapa", "use scenario.kappa"),
        (SMALL.replace("vehicle.uav.mass", "scenery.kappa"), "scenery.kappa", "vehicle"),
        (SMALL.replace("vehicle.uav.mass", "model"), "model", "models"),
        (SMALL.replace("vehicle.uav.mass", "target.height"), "target.height", "[target]"),
        (SMALL.replace("test =", "tset ="), "scenario.tset", "use scenario.test"),
        (SMALL.replace('"A"', '"E"'), "scenario.test", "'E'"),
        ("modles = []\n" + SMALL, "modles", "use models"),
        (SMALL + '"scenario.roll" = [0.1]\n', "vary", "has 2"),
        (SMALL + '[[vary]]\n"scenario.roll" = [1]\ndimension = "mass"\n', "dimension", "'mass'"),
        (SMALL + '[[vary]]\n"vehicle.uav.mass" = [1]\ndimension = "m"\n', "vehicle.uav.mass", ""),
        (SMALL + '[[vary]]\n"scenario.roll" = [1]\ndimension = "run"\n', "dimension", "'run'"),
        (SMALL.replace("[1.0, 2.0]", "[]"), "vehicle.uav.mass", "[]"),
        (SMALL.replace("[1.0, 2.0]", "[-1.0, 2.0]"), "vehicle.uav.mass", "-1.0"),
        (SMALL.replace("[1.0, 2.0]", "{ from = 1, too = 2 }"), "vehicle.uav.mass.too", "use to"),
        (SMALL + 'sampling = "sobel"\ncount = 2\n', "sampling", "use sobol"),
        ("step = 0\n" + SMALL, "step", "0"),
        ("chunk = 1.5\n" + SMALL, "chunk", "1.5"),
        ("[controller]\n" + SMALL, "target", ""),
        ('vehicle = "papre"\n' + SMALL, "vehicle", "use paper"),
        (SMALL + "[", "file", ""),
        (SMALL.replace("[1.0,", "[true,"), "vehicle.uav.mass", "[True, 2.0]"),
        (SMALL + "dimension = []\n", "dimension", "[]"),
        ("seed = -1\n" + SMALL, "seed", "-1"),
        (SMALL.replace("[1.0, 2.0]", COUNTED), "vehicle.uav.mass.count", "10,000,000"),
        (SMALL + 'sampling = "sobol"\ncount = 1000000000000\n', "count", "1000000000000"),
        (
            SMALL.replace("[1.0, 2.0]", "{ from = -1e308, to = 1e308, count = 3 }"),
            "vehicle.uav.mass",
            "",
        ),
        (LOOP + 'letter = "Q"\n' + SMALL, "target.letter", "M, R, A, L"),
        ("x = " + "[" * 2000 + "]" * 2000 + "\n" + SMALL, "file", "30"),
        (SMALL + "[" + ".".join("a" * 2000) + "]\n", "file", "30"),
        ("seed = " + "1" * 5000 + "\n" + SMALL, "file", ""),
        # None of these has a run that can be flown, though the start of one could.
        ("settle = 0.02\n" + SMALL, "settle", "0.02"),
        ("sample = 1e-10\n" + SMALL, "duration", "1e-10"),
        ("sample = 0.1\n" + SMALL, "sample", "0.1"),
        (SMALL.replace('"A"', '"D"\namplitude = 1e308'), "tip_wrench", "[inf"),
        pytest.param(SMALL.replace('test = "A"', FAST), "force", "", marks=pytest.mark.long),
        (SMALL.replace("0.02", "1e6"), "duration", "1e+07"),
        (SMALL.replace("0.02", "5e-324"), "sample", "0.002"),
    ],
)
def test_a_design_that_cannot_be_used(tmp_path: Path, text: str, field: str, fact: str) -> None:
    assert_refused(run(tmp_path, text), field, fact)
    assert [path.name for path in tmp_path.iterdir()] == ["design.toml"]


SINE = 'excitation = "sine"\n'
CONSTANT = 'excitation = "constant"\n'
CLASSIC = 'law = "classic"\n'


@pytest.mark.parametrize(
    ("chosen", "field", "values", "reader"),
    [
        ("", "scenario.amplitude", [1.0, 2.0], "scenario.test 'A' or 'C' or 'D' or"),
        ('test = "B"\n', "scenario.amplitude", [1.0, 2.0], "scenario.test 'A' or 'C' or 'D' or"),
        ("", "scenario.on", ["force_x", "force_y"], "scenario.excitation 'constant' or 'sine'"),
        ('test = "C"\n', "scenario.frequency", [1.0, 2.0], "scenario.excitation 'sine'"),
        (CONSTANT, "scenario.frequency", [1.0, 2.0], "scenario.excitation 'sine' or 'chirp'"),
        (SINE, "scenario.end_frequency", [1.0, 9.0], "scenario.excitation 'chirp'"),
        ('test = "A"\n', "scenario.f1", [1.0, 9.0], "scenario.test 'D'"),
        ('test = "D"\n', "scenario.phase", [0.5, 1.0], "scenario.excitation 'sine' or 'chirp'"),
        ("", "controller.rate", [0.4, 1.0], "controller.law 'classic'"),
        (CLASSIC, "controller.bandwidth", [1.0, 3.0], "controller.law 'servoing'"),
        (CLASSIC, "controller.integral", [0.1, 0.5], "controller.law 'servoing'"),
        (CLASSIC, "controller.gains", ["constant", "current"], "controller.law 'servoing'"),
    ],
)
def test_a_field_that_no_run_reads_is_refused_varied_or_fixed(
    tmp_path: Path, chosen: str, field: str, values: list[Any], reader: str
) -> None:
    table, _, name = field.partition(".")
    rest = "[target]\n" if table == "controller" else ""
    varied = f"[{table}]\n{chosen}{rest}[[vary]]\n'{field}' = {values}\n"
    fixed = f"[{table}]\n{chosen}{name} = {values[0]!r}\n{rest}"
    for text in (varied, fixed):
        assert_refused(run(tmp_path, text), field, reader, place=tmp_path / "design.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["design.toml"]


def test_a_camera_that_no_controller_looks_through_is_refused_but_for_its_arm() -> None:
    for given in (0.5, ("noise", [0.5, 1.0])):
        with refused("vehicle.camera.noise"):
            load_design(xr.Dataset({"vehicle.camera.noise": given}))
    # Of its tip metrics are.
    arms = {"vehicle.camera.arm": ("arm", ["left", "right"])}
    assert load_design(xr.Dataset(arms, attrs={"vehicle": "dual_arm"})).runs == 2


def test_a_field_that_some_runs_read_may_vary() -> None:
    choices = {"scenario.excitation": ("kind", ["none", "sine"])}
    vary = {"scenario.frequency": ("f", [1.0, 2.0]), "scenario.amplitude": ("a", [1.0, 2.0])}
    assert load_design(xr.Dataset(choices | vary)).runs == 8


@pytest.mark.parametrize(
    ("option", "given"),
    [
        ("metrics", "nrmse_x"),
        ("metrics", "rms_px"),
        ("device", "cuda:7"),
        ("shard", "3/2"),
        ("shard", "a"),
    ],
)
def test_options_that_cannot_be_used(tmp_path: Path, option: str, given: str) -> None:
    assert_refused(run(tmp_path, SMALL, f"--{option}", given), option)
    assert [path.name for path in tmp_path.iterdir()] == ["design.toml"]


def test_a_scheduler_that_does_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="the extra 'cluster' installs Dask")
    monkeypatch.setattr(cluster, "_ANSWER_WITHIN", 0.5)
    for address, fact in (("tcp://127.0.0.1:9", "answer"), ("tls://127.0.0.1:9", "certificate")):
        result = run(tmp_path, SMALL, "--scheduler", address)
        assert_refused(result, "scheduler", address, fact)
    assert [path.name for path in tmp_path.iterdir()] == ["design.toml"]


def test_a_grid_larger_than_the_disk_is_refused_with_its_size(tmp_path: Path) -> None:
    axis = '[[vary]]\n"{}" = {{ from = 0.1, to = 0.2, count = 100000 }}\n'
    fields = ("scenario.roll", "scenario.pitch", "scenario.yaw")
    text = SMALL + "".join(axis.format(field) for field in fields)
    # 2e15 runs of 2 models with 11 numbers of 8 bytes.
    assert_refused(run(tmp_path, text), "out", "2,000,000,000,000,000 runs", "PB")
    assert [path.name for path in tmp_path.iterdir()] == ["design.toml"]


def test_a_store_of_another_design_version_or_device_is_left_alone(tmp_path: Path) -> None:
    assert run(tmp_path, SMALL).exit_code == 0
    store = tmp_path / "store.zarr"

    def refused(text: str, *parts: str) -> None:
        before = {path: path.read_bytes() for path in store.rglob("*") if path.is_file()}
        assert_refused(run(tmp_path, text), "out", *parts)
        assert {path: path.read_bytes() for path in store.rglob("*") if path.is_file()} == before

    refused(SMALL.replace("0.02", "0.03"), "design")
    refused("seed = 1\n" + SMALL, "design")
    metadata = store / "zarr.json"
    content = json.loads(metadata.read_text())

    def write() -> None:
        files = content["attributes"]["files"]
        metadata.write_text(json.dumps(checksums.sealed(content, store, files)))

    content["attributes"]["versions"]["numpy"] = "1.0"
    write()
    refused(SMALL, "numpy 1.0")
    content["attributes"]["versions"]["numpy"] = __import__("numpy").__version__
    content["attributes"]["device"] = "cuda"
    write()
    refused(SMALL, "device cuda", "device is cpu")


def test_a_folder_that_holds_other_things_is_left_alone(tmp_path: Path) -> None:
    for name, content in (("notes", "notes.txt"), ("group", "zarr.json")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / content).write_text('{"zarr_format": 3, "node_type": "group"}')
        assert_refused(run(tmp_path, SMALL, out=name), "out", str(folder))
        assert [path.name for path in folder.iterdir()] == [content]
    assert_refused(run(tmp_path, SMALL, out="notes/notes.txt"), "out", "notes.txt")


@pytest.mark.parametrize("threads", [float("nan"), 0, 1.5, True])
def test_threads_that_are_no_number_of_them_are_refused(tmp_path: Path, threads: Any) -> None:
    (tmp_path / "design.toml").write_text(SMALL)
    with refused("threads"):
        ca.sweep(tmp_path / "design.toml", tmp_path / "store.zarr", threads=threads)
    assert not (tmp_path / "store.zarr").exists()


def test_what_is_no_path_is_refused() -> None:
    with refused("out"):
        ca.open_sweep(3)  # type: ignore[arg-type]


def test_an_unwritten_store_cannot_be_opened(tmp_path: Path) -> None:
    with refused("out"):
        ca.open_sweep(tmp_path / "none.zarr")


def test_the_beginning_of_another_sweep_is_not_taken_over(tmp_path: Path) -> None:
    assert run(tmp_path, SMALL).exit_code == 0
    store = tmp_path / "store.zarr"
    # As a process leaves it that is killed before its last step.
    (store / "zarr.json").unlink()
    shutil.rmtree(store / "results" / "c")
    shutil.rmtree(store / "done" / "c")
    assert_refused(run(tmp_path, SMALL.replace("[1.0, 2.0]", "[1.0]")), "out")
    assert run(tmp_path, SMALL).exit_code == 0
    assert ca.open_sweep(store).attrs["done"] == 2


def test_a_shard_does_its_part_and_the_command_says_what_is_left(tmp_path: Path) -> None:
    text = "chunk = 1\n" + SMALL.replace("[1.0, 2.0]", "[1.0, 1.5, 2.0]")
    first = run(tmp_path, text, "--shard", "1/2", "--metrics", "angle_rad")
    assert first.exit_code == 0 and "2 of 3 runs are done" in first.stdout
    found = ca.open_sweep(tmp_path / "store.zarr")
    assert found["angle_rad"].isnull().all("model").values.tolist() == [False, True, False]
    assert "nrmse_t" not in found
    row = next(line.split() for line in first.stdout.splitlines() if "angle_rad" in line)
    assert row[-1] == "2"  # of the runs that are done
    rest = run(tmp_path, text, "--shard", "2/2", "--metrics", "angle_rad")
    assert "3 of 3 runs are done" in rest.stdout
    assert isinstance(found, xr.Dataset)


@pytest.mark.long
def test_the_command_tells_runs_that_were_refused_from_those_that_ended_early(
    tmp_path: Path,
) -> None:
    """On a short lever no rotor can hold an arm that is bent; 1000 1/(m s) bend it to a circle."""
    rotors = {"layout": "quad_x", "lever": 0.04, "thrust_limits": [0, 40]}
    rotors["torque_per_thrust"] = 0.016
    vehicle = ca.load_vehicle("paper").replace({"uav.rotors": rotors})
    (tmp_path / "quad.toml").write_text(as_toml(vehicle))
    text = f"vehicle = '{tmp_path / 'quad.toml'}'\n[scenario]\nduration = 0.1\n"
    text += '[[vary]]\n"scenario.kappa" = [0.01, 1.0]\n'
    said = "could not be flown, as parameters were refused (see status)"
    assert f"2 of 2 runs are done, 1 of them {said}" in run(tmp_path, text).stdout
    text += '[[vary]]\n"scenario.kappa_rate" = [0.0, 1000.0]\n'
    shown = run(tmp_path, text, out="other.zarr").stdout
    assert f"4 of 4 runs are done, 1 of them ended early and 2 of them {said}" in shown


def test_of_runs_that_all_ended_early_the_command_shows_no_spread(tmp_path: Path) -> None:
    text = "[scenario]\nduration = 0.1\nkappa_rate = 1000.0\n"
    found = run(tmp_path, text + '[[vary]]\n"vehicle.uav.mass" = [1.5, 2.0]\n')
    row = next(line.split() for line in found.stdout.splitlines() if "angle_rad" in line)
    assert row[-4:] == ["-", "-", "-", "0"]
    assert "RuntimeWarning" not in found.stderr and "2 of them ended early" in found.stdout


@pytest.mark.parametrize(
    ("metrics", "field"),
    [(3, "metrics"), ("rmse_t_m", "metrics"), ([3], "metrics.0"), (float("nan"), "metrics")],
)
def test_metrics_that_are_no_list_of_names_are_refused(
    metrics: Any, field: str, tmp_path: Path
) -> None:
    design = xr.Dataset({"scenario.kappa": ("k", [0.1])}, attrs={"scenario": {"duration": 0.1}})
    with refused(field):
        ca.sweep(design, tmp_path / "store.zarr", metrics=metrics)
    assert not (tmp_path / "store.zarr").exists()
