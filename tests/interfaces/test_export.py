"""`continuair export` writes what the suffix says, and tells what cannot be written."""

import errno
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import continuair as ca
from continuair.cli.commands import app
from continuair.identification.recording import MEASURED
from tests.interfaces.flights import flight
from tests.refusals import assert_refused, refused


@pytest.fixture
def result(tmp_path: Path) -> Path:
    path = tmp_path / "flight.nc"
    flight("dual_arm").to_netcdf(path, engine="h5netcdf")
    return path


@pytest.fixture
def models(tmp_path: Path) -> Path:
    one = flight("paper")
    moved = {name: one[name] + one["position"] for name in ("position", "tip_position")}
    both = xr.concat([one, one.assign(moved)], "model", combine_attrs="override")
    both = both.assign_coords(model=["coupled", "decoupled"])
    both.attrs = flight("paper").attrs
    both.to_netcdf(tmp_path / "both.nc", engine="h5netcdf")
    return tmp_path / "both.nc"


def run(*words: object) -> Any:
    return CliRunner().invoke(app, ["export", *map(str, words)])


@pytest.mark.parametrize(
    ("suffix", "start"),
    [("glb", b"glTF"), ("mcap", b"\x89MCAP"), ("csv", b"time,x,y,z"), ("nc", b"\x89HDF")],
)
def test_a_result_becomes_the_file_of_its_suffix(
    suffix: str, start: bytes, result: Path, tmp_path: Path
) -> None:
    to = tmp_path / f"out.{suffix}"
    done = run(result, "--to", to)
    assert done.exit_code == 0 and str(to) in done.stderr
    assert to.read_bytes().startswith(start)


@pytest.mark.parametrize("source", ["paper", "result"])
def test_a_vehicle_becomes_mjcf_that_of_a_result_too(
    source: str, result: Path, tmp_path: Path
) -> None:
    to = tmp_path / "out.xml"
    assert run(result if source == "result" else source, "--to", to, "--links", 3).exit_code == 0
    name = "dual_arm" if source == "result" else "paper"
    assert f'<mujoco model="{name}">' in to.read_text()


@pytest.mark.long
def test_of_several_models_one_is_chosen(models: Path, tmp_path: Path) -> None:
    to = tmp_path / "out.nc"
    assert_refused(run(models, "--to", to), "model", "coupled, decoupled")
    assert_refused(run(models, "--to", to, "--model", "decoupld"), "model", "use decoupled")
    assert run(models, "--to", to, "--model", "decoupled").exit_code == 0
    found = ca.read_result(to)
    np.testing.assert_array_equal(found.position, 2 * flight("paper").position)
    assert found.attrs["model"] == "decoupled"


@pytest.mark.long
def test_of_several_letters_one_is_chosen(models: Path, tmp_path: Path) -> None:
    with xr.open_dataset(models, engine="h5netcdf") as both:
        letters = both.rename(model="letter").assign_coords(letter=["M", "R"])
        letters.to_netcdf(tmp_path / "letters.nc", engine="h5netcdf")
    to = tmp_path / "out.nc"
    assert_refused(run(tmp_path / "letters.nc", "--to", to), "letter", "M, R")
    assert run(tmp_path / "letters.nc", "--to", to, "--letter", "R").exit_code == 0
    np.testing.assert_array_equal(ca.read_result(to).position, 2 * flight("paper").position)


@pytest.mark.parametrize(
    ("words", "field", "fact"),
    [
        (("paper", "--to", "out.glb"), "source", ".nc"),
        (("paper", "--to", "out.stl"), "to", ".glb, "),
        (("paper", "--to", "out.xml", "--run", "0"), "run", ".xml"),
        (("none.nc", "--to", "out.glb"), "result", "none.nc"),
        (("none.nc", "--to", "out.csv", "--links", "3"), "links", ".csv"),
        (("nowhere", "--to", "out.xml"), "vehicle", "'nowhere'"),
    ],
)
def test_what_cannot_be_is_told_in_a_sentence_and_nothing_is_written(
    words: tuple[str, ...], field: str, fact: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert_refused(run(*words), field, fact)
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_there_is_not_replaced(result: Path, tmp_path: Path) -> None:
    to = tmp_path / "out.csv"
    to.write_text("mine")
    assert_refused(run(result, "--to", to), "to", str(to))
    assert to.read_text() == "mine"


def test_a_result_reads_back_as_it_was(result: Path) -> None:
    xr.testing.assert_identical(ca.read_result(result), flight("dual_arm"))


def test_results_that_are_damaged_or_not_ours_or_later_are_told_so(
    result: Path, tmp_path: Path
) -> None:
    cut, other, later = (tmp_path / f"{name}.nc" for name in ("cut", "other", "later"))
    cut.write_bytes(result.read_bytes()[:5000])
    flight("paper").drop_attrs().to_netcdf(other, engine="h5netcdf")
    versions = json.dumps({"continuair": "99.0"})
    flight("paper").assign_attrs(versions=versions).to_netcdf(later, engine="h5netcdf")
    text = tmp_path / "text.nc"
    text.write_text(",".join(MEASURED))
    for path, fact in ((cut, ""), (text, ""), (other, ""), (later, "99.0"), (tmp_path, "folder")):
        with refused("result") as found:
            ca.read_result(path)
        assert str(path) in found.value.problem and fact in found.value.problem


@pytest.mark.long
@pytest.mark.parametrize("suffix", ["glb", "mcap", "csv", "nc", "xml"])
def test_a_full_disk_is_told_in_a_sentence(
    suffix: str, result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr("continuair.files.write_new", full)
    to = tmp_path / f"out.{suffix}"
    assert_refused(run(result, "--to", to), "path", str(to), "No space left on device")
