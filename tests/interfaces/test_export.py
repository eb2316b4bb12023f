"""`continuair export` writes what the suffix says, and tells what cannot be written."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import continuair as ca
from continuair import InputError
from continuair.cli.commands import app
from continuair.identification.recording import MEASURED
from tests.interfaces.flights import flight


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


def run(*words: object) -> tuple[int, str]:
    found = CliRunner().invoke(app, ["export", *map(str, words)])
    return found.exit_code, found.stderr


@pytest.mark.parametrize(
    ("suffix", "start"),
    [("glb", b"glTF"), ("mcap", b"\x89MCAP"), ("csv", b"time,x,y,z"), ("nc", b"\x89HDF")],
)
def test_a_result_becomes_the_file_of_its_suffix(
    suffix: str, start: bytes, result: Path, tmp_path: Path
) -> None:
    to = tmp_path / f"out.{suffix}"
    assert run(result, "--to", to) == (0, f"Wrote {to}.\n")
    assert to.read_bytes().startswith(start)


@pytest.mark.parametrize("source", ["paper", "result"])
def test_a_vehicle_becomes_mjcf_that_of_a_result_too(
    source: str, result: Path, tmp_path: Path
) -> None:
    to = tmp_path / "out.xml"
    assert run(result if source == "result" else source, "--to", to, "--links", 3)[0] == 0
    name = "dual_arm" if source == "result" else "paper"
    assert f'<mujoco model="{name}">' in to.read_text()


def test_of_several_models_one_is_chosen(models: Path, tmp_path: Path) -> None:
    to = tmp_path / "out.nc"
    code, told = run(models, "--to", to)
    assert code == 2 and told == "model is missing; use one of: coupled, decoupled.\n"
    assert run(models, "--to", to, "--model", "decoupld")[1].startswith(
        "model is 'decoupld'; use decoupled"
    )
    assert run(models, "--to", to, "--model", "decoupled")[0] == 0
    found = ca.read_result(to)
    np.testing.assert_array_equal(found.position, 2 * flight("paper").position)
    assert found.attrs["model"] == "decoupled"


def test_of_several_letters_one_is_chosen(models: Path, tmp_path: Path) -> None:
    with xr.open_dataset(models, engine="h5netcdf") as both:
        letters = both.rename(model="letter").assign_coords(letter=["M", "R"])
        letters.to_netcdf(tmp_path / "letters.nc", engine="h5netcdf")
    to = tmp_path / "out.nc"
    code, told = run(tmp_path / "letters.nc", "--to", to)
    assert code == 2 and told == "letter is missing; use one of: M, R.\n"
    assert run(tmp_path / "letters.nc", "--to", to, "--letter", "R")[0] == 0
    np.testing.assert_array_equal(ca.read_result(to).position, 2 * flight("paper").position)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("paper", "--to", "out.glb"), "source is paper, which does not end in .nc"),
        (("paper", "--to", "out.stl"), "to is out.stl; name a file that ends in one of .glb, "),
        (("paper", "--to", "out.xml", "--run", "0"), "run is 0, which .xml has no use for"),
        (
            ("none.nc", "--to", "out.glb"),
            "result is none.nc, but there is no such file; correct the path.",
        ),
        (("none.nc", "--to", "out.csv", "--links", "3"), "links is 3, which .csv has no use for"),
        (("nowhere", "--to", "out.xml"), "vehicle is 'nowhere'"),
    ],
)
def test_what_cannot_be_is_told_in_a_sentence_and_nothing_is_written(
    words: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, found = run(*words)
    assert code == 2 and found.startswith(told) and found.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_there_is_not_replaced(result: Path, tmp_path: Path) -> None:
    to = tmp_path / "out.csv"
    to.write_text("mine")
    assert run(result, "--to", to)[0] == 2
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
    for path, told in (
        (cut, "cannot be read as netCDF"),
        (text, "cannot be read as netCDF"),
        (other, "no flight of continuair"),
        (later, "written by continuair 99.0"),
        (tmp_path, "is a folder"),
    ):
        with pytest.raises(InputError, match=told) as found:
            ca.read_result(path)
        assert len(found.value.errors) == 1


@pytest.mark.parametrize("suffix", ["glb", "mcap", "csv", "nc", "xml"])
def test_a_full_disk_is_told_in_a_sentence(
    suffix: str, result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr("continuair.files.write_new", full)
    code, told = run(result, "--to", tmp_path / f"out.{suffix}")
    assert code == 2
    assert "which cannot be written (No space left on device); name a file in an" in told
