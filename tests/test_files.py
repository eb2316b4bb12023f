"""Nothing is replaced that continuair did not write, and a full disk is told in one sentence."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import amiri2026.open_loop.study as study
import continuair as ca
import continuair.cli as cli
from amiri2026.tracking import tuning
from continuair import files, identification
from continuair.figures.style import pictures_only
from continuair.studies.results import UNFINISHED, ResultFolder
from continuair.vehicle.vehicle_file import write_vehicle
from tests.identification.flights import record, true_vehicle
from tests.refusals import assert_refused, refused
from tests.synthetic import flight

SOURCE = Path(ca.__file__).parents[1]
ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def empty_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(study, "simulate", flight)
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, list(arguments))


def never(*_: Any, **__: Any) -> Any:
    raise AssertionError("this should have been refused before any work")


def full(*_: Any, **__: Any) -> Any:
    raise OSError(28, "No space left on device")


# A fitted vehicle


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    record(Path("flight.csv"))
    write_vehicle(true_vehicle(), "start.toml")
    Path("start.toml").write_text(Path("start.toml").read_text().partition("\n")[2])
    return ["identify", "--data", "flight.csv", "--vehicle", "start.toml", "--test", "D"]


def test_a_fit_replaces_no_file_that_is_there(
    start: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identification, "fit", never)
    Path("notes").write_text("notes")
    Path("empty.toml").touch()
    Path("link.toml").symlink_to("notes")
    Path("loose.toml").symlink_to("nothing")
    write_vehicle(true_vehicle(), "fitted.toml")
    before = {path: path.read_bytes() for path in Path().iterdir() if path.exists()}
    assert_refused(run(*start, "--out", "fitted.toml"), "out", "fitted.toml", "--force")
    for name in ("flight.csv", "start.toml", "notes", "link.toml", "loose.toml", "empty.toml", "."):
        assert_refused(run(*start, "--out", name), "out", f" {name}")
        assert_refused(run(*start, "--out", name, "--force"), "out", f" {name}")
    assert {path: path.read_bytes() for path in Path().iterdir() if path.exists()} == before
    assert Path("link.toml").is_symlink() and not Path("nothing").exists()


def test_force_replaces_a_vehicle_of_continuair_and_not_its_other_name() -> None:
    write_vehicle(true_vehicle(), "fitted.toml")
    os.link("fitted.toml", "kept.toml")
    kept = Path("kept.toml").read_text()
    with refused("out"):
        write_vehicle(true_vehicle().replace({"uav.mass": 3.0}), "fitted.toml")
    write_vehicle(true_vehicle().replace({"uav.mass": 3.0}), "fitted.toml", force=True)
    assert ca.load_vehicle("fitted.toml").uav.mass == 3.0
    assert Path("kept.toml").read_text() == kept
    assert {path.name for path in Path().iterdir()} == {"fitted.toml", "kept.toml"}


# JSON


@pytest.mark.parametrize(
    "content", ['[["study", "x"]]', '"study"', "[" * 100_000, '{"studies": 1}', "study"]
)
def test_json_takes_no_file_for_its_own_that_is_not(
    monkeypatch: pytest.MonkeyPatch, content: str
) -> None:
    monkeypatch.setattr(study, "simulate", never)
    Path("mine.json").write_text(content)
    assert_refused(run("open-loop", "--json", "mine.json"), "json", "mine.json")
    assert Path("mine.json").read_text() == content


@pytest.mark.parametrize("name", ["loose.json", "/proc/x.json", "notes/x.json"])
def test_json_that_cannot_be_written_is_refused_before_work(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(study, "simulate", never)
    Path("notes").write_text("")
    Path("loose.json").symlink_to("target.json")
    assert_refused(run("open-loop", "--json", name, "--out", "out"), "json", name)
    assert {path.name for path in Path().iterdir()} == {"notes", "loose.json"}


def test_json_that_can_no_longer_be_written_goes_to_standard_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Path, "write_text", full)
    result = run("open-loop", "--tests", "B", "--json", "new.json")
    last = result.stderr.splitlines()[-1]
    assert result.exit_code == 2 and last.startswith("json ") and "No space left" in last
    assert json.loads(result.stdout)["study"] == "open_loop"


# Gains


def test_gains_that_cannot_be_written_are_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    gains = {"gains": {"bandwidth": 3.0}}
    monkeypatch.setattr(tuning, "tune", lambda *_, **__: gains)
    monkeypatch.setattr(tuning, "as_toml", lambda found: f"found = {len(found)}\n")
    monkeypatch.setattr(files, "write_new", full)
    result = run("tune", "--out", "gains.toml")
    facts = ("gains.toml", "No space left on device")
    assert_refused(result, "out", *facts, stdout="found = 1\n")
    assert not list(Path().iterdir())


# Result folders


def crafted(folder: Path, **links: str) -> None:
    """A result folder of a study, with links in it to what is outside."""
    folder.mkdir()
    listed = {"study": "open_loop", "files": sorted({*links} - {".continuair"})}
    if ".continuair" not in links:
        (folder / ".continuair").write_text(json.dumps(listed))
    for name, target in links.items():
        (folder / name).symlink_to(target)


@pytest.mark.parametrize(
    "name", [".continuair", UNFINISHED, "table.md", "open_loop.json", "open_loop_B.nc"]
)
@pytest.mark.parametrize("exists", [True, False])
def test_no_link_in_a_result_folder_is_followed(
    monkeypatch: pytest.MonkeyPatch, name: str, exists: bool
) -> None:
    monkeypatch.setattr(study, "simulate", never)
    if exists:
        Path("victim").write_text(json.dumps({"study": "open_loop", "files": []}))
    before = {path.name: path.read_text() for path in Path().iterdir()}
    crafted(Path("out"), **{name: "../victim"})
    assert_refused(run("open-loop", "--out", "out"), "out", name)
    assert {path.name: path.read_text() for path in Path().iterdir() if path.is_file()} == before
    assert os.readlink(f"out/{name}") == "../victim"


def test_an_unlisted_link_for_the_word_of_incompleteness_is_refused_before_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(study, "simulate", never)
    crafted(Path("out"))
    Path("out", UNFINISHED).symlink_to("../victim")
    assert_refused(run("open-loop", "--out", "out"), "out", UNFINISHED)
    assert not Path("victim").exists()


@pytest.mark.long
def test_what_has_another_name_elsewhere_is_not_written_through(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(study, "simulate", flight)
    with pictures_only():
        assert run("open-loop", "--tests", "B", "--out", "out").exit_code == 0
        victims = {}
        for path in [*Path("out").iterdir()]:
            os.link(path, f"victim{path.name}")
            victims[path.name] = path.read_bytes()
        assert run("open-loop", "--tests", "B", "--out", "out").exit_code == 0
    assert {name: Path(f"victim{name}").read_bytes() for name in victims} == victims
    assert all(os.stat(f"victim{name}").st_nlink == 1 for name in victims)


def test_a_folder_that_cannot_be_claimed_or_filled_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("continuair.studies.results.replace", full)
    assert_refused(run("open-loop", "--out", "a/b"), "out", "No space left on device")
    monkeypatch.undo()
    monkeypatch.setattr(study, "simulate", flight)
    with refused("out"), ResultFolder("a/c", "x") as folder:
        monkeypatch.setattr(Path, "write_text", full)
        folder.write_text("table.md", "")
    assert not Path("a").exists()


def limited(bytes_: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_, bytes_))


@pytest.mark.long
def test_a_full_disk_under_netcdf_is_one_sentence_and_no_crash() -> None:
    """A limit on the size of files refuses what a full disk refuses, but by another number."""
    code = """
import amiri2026.open_loop.study as study
from continuair.__main__ import main
from tests.synthetic import flight
study.simulate = flight
main()
"""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(SOURCE), str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "-c", code, "open-loop", "--tests", "B", "--out", "out"],
        env=environment, capture_output=True, text=True, preexec_fn=limited(50_000),
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("out ") and "(File too large)" in done.stderr
    assert done.stderr.strip().count("\n") == 0
    assert {"open_loop_B.nc", UNFINISHED} <= {path.name for path in Path("out").iterdir()}
