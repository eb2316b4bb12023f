"""Whatever happens to a store's files is found, named in one sentence, and mended on request."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from tests.refusals import assert_refused, refused

pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")

RUNS, UNITS = 11, 6
DESIGN = f"""
chunk = 2
[scenario]
test = "A"
duration = 0.02
[[vary]]
"vehicle.uav.mass" = {{ from = 1.0, to = 2.0, count = {RUNS} }}
"scenario.test" = {["A", "B", *["A"] * 9]}
[set]
"scenario.roll" = 0.1
"""

Damage = Callable[[Path, random.Random], None]


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("damage") / "design.toml"
    path.write_text(DESIGN)
    ca.sweep(path, path.parent / "whole.zarr")
    return path


@pytest.fixture
def store(design: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(design.parent / "whole.zarr", tmp_path / "store.zarr"))


def contents(store: Path) -> dict[str, bytes]:
    return {str(p.relative_to(store)): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def command(design: Path, store: Path, *options: str) -> Any:
    return CliRunner().invoke(cli.app, ["sweep", str(design), "--out", str(store), *options])


def chunk(store: Path, chance: random.Random) -> Path:
    return store / f"results/c/{chance.randrange(UNITS)}/0/0"


def flag(store: Path, chance: random.Random) -> Path:
    return store / f"done/c/{chance.randrange(UNITS)}"


def flip(path: Path, chance: random.Random) -> None:
    content = bytearray(path.read_bytes())
    content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    path.write_bytes(content)


def cut(path: Path, chance: random.Random) -> None:
    path.write_bytes(path.read_bytes()[: chance.randrange(path.stat().st_size)])


def of_chunk(change: Callable[[Path, random.Random], None]) -> Damage:
    return lambda store, chance: change(chunk(store, chance), chance)


def of_flag(change: Callable[[Path, random.Random], None]) -> Damage:
    return lambda store, chance: change(flag(store, chance), chance)


def remove(path: Path, _: random.Random) -> None:
    path.unlink()


def lengthen(path: Path, _: random.Random) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def zero(path: Path, _: random.Random) -> None:
    path.write_bytes(bytes(path.stat().st_size))


def become_folder(path: Path, _: random.Random) -> None:
    path.unlink()
    path.mkdir()


def swap_chunks(store: Path, chance: random.Random) -> None:
    one, other = chance.sample(range(UNITS), 2)
    first, second = (store / f"results/c/{unit}/0/0" for unit in (one, other))
    (content, rest) = (first.read_bytes(), second.read_bytes())
    first.write_bytes(rest)
    second.write_bytes(content)


def copy_unit(store: Path, chance: random.Random) -> None:
    one, other = chance.sample(range(UNITS), 2)
    for name in ("results/c/{}/0/0", "done/c/{}"):
        shutil.copyfile(store / name.format(one), store / name.format(other))


def old_flag(store: Path, chance: random.Random) -> None:
    flag(store, chance).write_bytes(b"\1")


def flag_without_data(store: Path, chance: random.Random) -> None:
    unit = chance.randrange(UNITS)
    shutil.rmtree(store / f"results/c/{unit}")
    (store / f"done/c/{unit}").write_bytes(b"\1" + bytes(7))


UNIT_DAMAGES: dict[str, Damage] = {
    "missing chunk": of_chunk(remove),
    "flipped bit in a chunk": of_chunk(flip),
    "truncated chunk": of_chunk(cut),
    "longer chunk": of_chunk(lengthen),
    "zeroed chunk": of_chunk(zero),
    "folder for a chunk": of_chunk(become_folder),
    "swapped chunks": swap_chunks,
    "a unit copied over another": copy_unit,
    "flipped bit in a flag": of_flag(flip),
    "truncated flag": of_flag(cut),
    "longer flag": of_flag(lengthen),
    "zeroed flag": of_flag(zero),
    "folder for a flag": of_flag(become_folder),
    "a flag as of format 1": old_flag,
    "flag without data": flag_without_data,
}
ROUNDS = {"flipped bit in a chunk": 8, "flipped bit in a flag": 4, "truncated chunk": 4}

DESCRIPTION = ["zarr.json", "results/zarr.json", "done/zarr.json", "design/zarr.json"]
DESCRIPTION += ["design/vehicle.uav.mass/zarr.json", "design/vehicle.uav.mass/c/0"]


def edited(old: str, new: str, name: str = "zarr.json") -> Damage:
    def edit(store: Path, _: random.Random) -> None:
        text = (store / name).read_text()
        assert old in text
        (store / name).write_text(text.replace(old, new, 1))

    return edit


def holds(content: bytes, name: str = "zarr.json") -> Damage:
    def write(store: Path, _: random.Random) -> None:
        (store / name).write_bytes(content)

    return write


FILE_DAMAGES: dict[str, Damage] = {
    "edited unit size": edited('"unit_size": 2', '"unit_size": 3'),
    "unit size that is text": edited('"unit_size": 2', '"unit_size": "two"'),
    "edited seed": edited('"seed": 0', '"seed": 1'),
    "edited device": edited('"device": "cpu"', '"device": "cuda"'),
    "edited versions": edited('"numpy": "', '"numpy": "9'),
    "edited design": edited('"duration": 0.02', '"duration": 0.03'),
    "edited quantities": edited('"nrmse_t"', '"nrmse_r"'),
    "edited checksum": edited('"checksum": "', '"checksum": "0'),
    "edited shape": edited(str(RUNS), str(RUNS + 1), "results/zarr.json"),
    "edited chunk shape": edited("2", "3", "results/zarr.json"),
    "no attributes": holds(b'{"zarr_format": 3, "node_type": "group"}'),
    "attributes that are a list": holds(b'{"attributes": [1]}'),
    "metadata that is a list": holds(b"[]"),
    "metadata that is null": holds(b"null"),
    "metadata that is no JSON": holds(b"{"),
    "metadata that is no text": holds(b"\xff\xfe\x00"),
    "metadata that is deep": holds(b"[" * 100_000),
    "empty metadata": holds(b""),
    "missing results/zarr.json": lambda store, _: (store / "results/zarr.json").unlink(),
    "missing design": lambda store, _: shutil.rmtree(store / "design"),
}
PLACES = [f"{damage} {name}" for damage in ("flipped bit in", "truncated") for name in DESCRIPTION]
"""Damages to each file of the description, tried by the long tests; the short ones try chunks."""
for _name in DESCRIPTION:
    FILE_DAMAGES[f"flipped bit in {_name}"] = lambda s, c, name=_name: flip(s / name, c)  # type: ignore[misc]
    FILE_DAMAGES[f"truncated {_name}"] = lambda s, c, name=_name: cut(s / name, c)  # type: ignore[misc]

CASES = [
    pytest.param(
        damage,
        turn,
        name in UNIT_DAMAGES,
        marks=[pytest.mark.long] if turn or name in PLACES else [],
        id=f"{name} {turn}",
    )
    for name, damage in {**UNIT_DAMAGES, **FILE_DAMAGES}.items()
    for turn in range(ROUNDS.get(name, 1))
]
assert len(CASES) >= 60


@pytest.mark.parametrize(("damage", "turn", "of_unit"), CASES)
def test_damage_is_found_on_opening_and_on_resuming_and_mended_on_request(
    design: Path, store: Path, damage: Damage, turn: int, of_unit: bool
) -> None:
    whole = contents(store)
    damage(store, random.Random(turn))
    hurt = contents(store)
    with refused("out"):
        ca.open_sweep(store)
    assert_refused(command(design, store), "out", "--repair" if of_unit else "")
    assert contents(store) == hurt, "a refusal changes nothing"
    mended = command(design, store, "--repair")
    assert mended.exit_code == 0, mended.output
    assert contents(store) == whole


def test_units_that_are_damaged_are_named_and_no_other_is_computed_again(
    design: Path, store: Path
) -> None:
    for unit in (1, 4):
        flip(store / f"results/c/{unit}/0/0", random.Random(unit))
    before = {path: path.stat().st_ino for path in (store / "done" / "c").iterdir()}
    with refused("out"):
        ca.open_sweep(store)
    assert ca.sweep(design, store, repair=True).attrs["done"] == RUNS
    after = {path: path.stat().st_ino for path in (store / "done" / "c").iterdir()}
    assert {path.name for path in after if after[path] != before[path]} <= {"1", "4"}


def test_a_flag_that_is_lost_makes_a_unit_that_is_left(design: Path, store: Path) -> None:
    whole = contents(store)
    (store / "done" / "c" / "2").unlink()
    found = ca.open_sweep(store)
    assert found.attrs["done"] == RUNS - 2 and int(found["status"].isnull().any("model").sum()) == 2
    assert command(design, store).exit_code == 0
    assert contents(store) == whole


def test_a_store_whose_metadata_is_lost_goes_on_with_the_units_that_are_whole(
    design: Path, store: Path
) -> None:
    whole = contents(store)
    (store / "zarr.json").unlink()
    assert command(design, store).exit_code == 0
    assert contents(store) == whole


def test_a_store_of_the_format_without_checksums_is_refused(design: Path, store: Path) -> None:
    edited('"continuair_sweep": 3', '"continuair_sweep": 1')(store, random.Random(0))
    for options in ((), ("--repair",)):
        assert_refused(command(design, store, *options), "out", "another version")


def test_repair_takes_over_no_store_of_another_design(design: Path, store: Path) -> None:
    other = store.parent / "other.toml"
    other.write_text(DESIGN.replace('"scenario.roll" = 0.1', '"scenario.roll" = 0.2'))
    (store / "zarr.json").write_bytes(b"{")
    hurt = contents(store)
    assert_refused(command(other, store, "--repair"), "out")
    assert contents(store) == hurt


def test_only_what_zarr_and_the_sweep_have_left_is_cleaned_up(design: Path, store: Path) -> None:
    kept = [store / "notes.partial", store / "results" / "c" / "notes.partial"]
    left = [
        store / "results/c/1/0" / f"0.{'a' * 32}.partial",
        store / "done/c" / f"3.{'b' * 32}.partial",
    ]
    for path in [*kept, *left]:
        path.write_text("")
    assert command(design, store).exit_code == 0
    assert all(map(os.path.exists, kept)) and not any(map(os.path.exists, left))


def test_zarr_reads_the_store_as_open_sweep_does(store: Path) -> None:
    import zarr

    group = zarr.open_group(store, mode="r")
    found = ca.open_sweep(store)
    column = list(group.attrs["quantities"]).index("tip_x_m")
    assert (group["results"][:, :, column] == found["tip_x_m"].to_numpy()).all()
    assert (group["done"][:] != 0).all()
    assert json.loads(found.attrs["design"])["base"]["chunk"] == 2


def test_the_estimate_of_the_disk_is_what_the_disk_shows(design: Path, store: Path) -> None:
    from continuair.sweeps.design import load_design
    from continuair.sweeps.making import bytes_needed

    shown = 512 * sum(path.lstat().st_blocks for path in [store, *store.rglob("*")])
    needed = bytes_needed(load_design(design), 2)
    assert shown <= needed
    folders = sum(4096 for path in [store, *store.rglob("*")] if path.is_dir())
    files = sum(-(-p.stat().st_size // 4096) * 4096 for p in store.rglob("*") if p.is_file())
    assert needed < 1.1 * (folders + files) + 65_536, (
        "of a file system that keeps folders in blocks"
    )


@pytest.mark.parametrize("cleans", [False, True])
def test_a_process_that_comes_second_joins_the_store_and_says_nothing(
    design: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cleans: bool
) -> None:
    from continuair.sweeps import making
    from continuair.sweeps.design import load_design
    from continuair.sweeps.store import open_store

    path, found = tmp_path / "store.zarr", load_design(design)
    fill = making._fill

    def overtaken(new: Path, *rest: Any) -> None:
        """Another process makes the store, writes a unit and cleans up while this one begins."""
        fill(new, *rest)
        with monkeypatch.context() as other:
            other.setattr(making, "_fill", fill)
            making.create(path, found, "cpu")
        store = open_store(path, "cpu", found)
        store.write(0, np.zeros((2, *store.shape[1:])))
        if cleans:
            store.clean()

    monkeypatch.setattr(making, "_fill", overtaken)
    making.create(path, found, "cpu")
    assert open_store(path, "cpu", found).done().tolist() == [True] + 5 * [False]
    making.check_new(path, found, 2)  # whose look came before the other was through
    assert not list(path.glob(".new-*"))
