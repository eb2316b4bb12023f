"""Stores that another has made to do harm: each is refused in a sentence, and nothing else is read.

Their checksums are right, as who writes a store can write them.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca

pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")

from continuair.sweeps import checksums  # noqa: E402
from continuair.sweeps.contained import read_within  # noqa: E402
from tests.refusals import refused

DESIGN = """
chunk = 2
[scenario]
test = "A"
duration = 0.02
[[vary]]
"vehicle.uav.mass" = { from = 1.0, to = 2.0, count = 5 }
"scenario.test" = ["A", "B", "A", "A", "A"]
[set]
"scenario.roll" = 0.1
"""
MASS = "design/vehicle.uav.mass"

Change = Callable[[dict[str, Any]], Any]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("crafted")
    (path / "design.toml").write_text(DESIGN)
    ca.sweep(path / "design.toml", path / "whole.zarr")
    return path / "whole.zarr"


@pytest.fixture
def store(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "store.zarr"))


@contextmanager
def soon(seconds: int = 10) -> Iterator[None]:
    def late(*_: Any) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def craft(store: Path, change: Change, *, seal: bool = True) -> None:
    """Change attributes, and write the checksums that belong to them."""
    group = json.loads((store / "zarr.json").read_bytes())
    change(group["attributes"])
    if seal:
        files = group["attributes"].get("files")
        names = [name for name in files if (store / name).is_file()] if files else []
        group = checksums.sealed(group, store, names)
    else:
        group["attributes"]["checksum"] = checksums._of_group(group)
    (store / "zarr.json").write_text(json.dumps(group))


def refuses(store: Path) -> None:
    with soon(), refused("out") as error:
        ca.open_sweep(store)
    assert len(str(error.value)) < 700
    with soon(30), refused("out"):
        ca.sweep(store.parent / "design.toml", store)


def setting(name: str, value: Any) -> Change:
    return lambda attributes: attributes.update({name: value})


def within(name: str, **values: Any) -> Change:
    return lambda attributes: attributes[name].update(values)


def without(name: str) -> Change:
    return lambda attributes: attributes.pop(name)


CRAFTED: dict[str, Change] = {
    "sizes as text": setting("sizes", "mass"),
    "a size as text": within("sizes", mass="5"),
    "a size of 1e12": within("sizes", mass=10**12),
    "a size of 1e300": within("sizes", mass=10**300),
    "a size that is no whole number": within("sizes", mass=5.5),
    "a size that is true": within("sizes", mass=True),
    "a size below 1": within("sizes", mass=-5),
    "a dimension that nothing varies along": within("sizes", other=10**9),
    "a dimension that results have": within("sizes", run=1),
    "no models": setting("models", []),
    "models of another design": setting("models", ["coupled", "independent"]),
    "models of numbers": setting("models", [1, 2]),
    "models as text": setting("models", "coupled"),
    "one model twice": setting("models", ["coupled", "coupled"]),
    "no quantities": setting("quantities", []),
    "unknown quantities": lambda a: a["quantities"].append("no such"),
    "a quantity of another name": lambda a: a["quantities"].__setitem__(0, "coupled"),
    "quantities without a status": lambda a: a["quantities"].remove("status"),
    "units of 1e12": setting("unit_size", 10**12),
    "units of nothing": setting("unit_size", 0),
    "variables as text": setting("variables", "scenario.roll"),
    "a variable outside": lambda a: a["variables"].append("../../etc.passwd"),
    "a variable that is absent": lambda a: a["variables"].append("vehicle.uav.drag"),
    "a listed variable of lists": within("listed", **{"scenario.roll": [[], [[1], [2, 3]]]}),
    "a listed variable of tables": within("listed", **{"scenario.roll": [[], {"a": 1}]}),
    "a listed variable of another size": within("listed", **{"scenario.test": [["mass"], ["A"]]}),
    "a listed variable of a long name": within("listed", **{"9" * 5000: [[], 1]}),
    "listed as a list": setting("listed", [1]),
    "labels of another size": setting("labels", {"mass": [1, 2]}),
    "labels of no dimension": setting("labels", {"other": [1, 2]}),
    "labels of tables": setting("labels", {"mass": [{}] * 5}),
    "a design that is a list": setting("design", []),
    "a design of nothing": setting("design", {"base": {}, "vehicle": {}}),
    "a vehicle of text": within("design", vehicle={"name": "x", "uav": "heavy"}),
    "a base of unknown fields": within("design", base={"no such": 1}),
    "a base of lists": within("design", base={"scenario": [1]}),
    "versions as a list": setting("versions", []),
    "no versions": setting("versions", {}),
    "a device that is a table": setting("device", {}),
    "a seed as text": setting("seed", "0"),
    **{
        f"without {name}": without(name)
        for name in ("design", "design_hash", "sizes", "listed", "variables", "machine", "device")
    },
}


@pytest.mark.parametrize("change", CRAFTED.values(), ids=CRAFTED)
def test_attributes_that_no_sweep_writes_are_refused(store: Path, change: Change) -> None:
    (store.parent / "design.toml").write_text(DESIGN)
    craft(store, change)
    refuses(store)


def array(**changes: Any) -> Callable[[Path], None]:
    """The metadata of the array of masses, changed."""

    def change(store: Path) -> None:
        path = store / MASS / "zarr.json"
        path.write_text(json.dumps(json.loads(path.read_bytes()) | changes))

    return change


def written(text: str) -> Callable[[Path], None]:
    def change(store: Path) -> None:
        (store / MASS / "zarr.json").write_text(text)

    return change


def link(name: str, target: str) -> Callable[[Path], None]:
    def change(store: Path) -> None:
        path = store / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
        path.symlink_to(target)

    return change


def pipe(name: str) -> Callable[[Path], None]:
    def change(store: Path) -> None:
        (store / name).unlink()
        os.mkfifo(store / name)

    return change


def sparse(name: str) -> Callable[[Path], None]:
    def change(store: Path) -> None:
        os.truncate(store / name, 10**12)

    return change


FILES: dict[str, Callable[[Path], None]] = {
    "an array of 1e12 masses": array(shape=[10**12]),
    "an array of text": array(data_type="string"),
    "an array of no shape": array(shape="5"),
    "an array along another dimension": array(dimension_names=["other"]),
    "an array that is a list": written("[]"),
    "an array that is missing": lambda store: shutil.rmtree(store / MASS),
    "a pipe as a flag": pipe("done/c/0"),
    "a pipe as results": pipe("results/c/0/0/0"),
    "a pipe as masses": pipe(f"{MASS}/c/0"),
    "a pipe as metadata": pipe(f"{MASS}/zarr.json"),
    "a device as a flag": link("done/c/0", "/dev/zero"),
    "a device as results": link("results/c/0/0/0", "/dev/zero"),
    "a device as masses": link(f"{MASS}/c/0", "/dev/zero"),
    "results of 1 TB": sparse("results/c/0/0/0"),
    "a flag of 1 TB": sparse("done/c/0"),
    "masses of 1 TB": sparse(f"{MASS}/c/0"),
    "masses elsewhere": link(f"{MASS}/c/0", "../../../../outside"),
    "the design elsewhere": link("design", "../elsewhere"),
    "results elsewhere": link("results/c/0", "../../../elsewhere"),
}


@pytest.mark.parametrize("change", FILES.values(), ids=FILES)
def test_files_that_no_sweep_writes_are_refused(store: Path, change: Callable[..., None]) -> None:
    (store.parent / "design.toml").write_text(DESIGN)
    (store.parent / "outside").write_bytes(np.arange(5.0).tobytes())
    shutil.copytree(store / "results/c/0", store.parent / "elsewhere")
    change(store)
    craft(store, lambda _: None)
    refuses(store)


@pytest.mark.parametrize("name", ["/dev/zero", "../outside", "done/../../outside", "", "design"])
def test_checksums_are_of_files_in_the_store(store: Path, name: str) -> None:
    (store.parent / "design.toml").write_text(DESIGN)
    content = b"nobody else's"
    (store.parent / "outside").write_bytes(content)
    seen = {name: checksums._brief(content).hex()}
    craft(store, lambda attributes: attributes.update(files=seen), seal=False)
    refuses(store)


def test_a_store_that_is_a_pipe_or_a_device_is_none(store: Path) -> None:
    (store / "zarr.json").unlink()
    os.mkfifo(store / "zarr.json")
    for path in (store, "/dev/zero"):
        with soon(), refused("out"):
            ca.open_sweep(path)


def test_units_are_not_written_through_links(store: Path) -> None:
    (store.parent / "design.toml").write_text(DESIGN)
    outside = store.parent / "foreign"
    (outside / "0").mkdir(parents=True)
    shutil.rmtree(store / "results/c/1")
    (store / "results/c/1").symlink_to(outside)
    (store / "done/c/1").unlink()
    ca.sweep(store.parent / "design.toml", store)
    assert not list((outside / "0").iterdir())
    assert ca.open_sweep(store).attrs["done"] == 5


def test_a_file_is_read_where_it_is_and_no_further_than_it_may(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a/b").write_bytes(b"12345")
    (tmp_path / "c").symlink_to("a")
    assert read_within(tmp_path, "a/b", 5) == b"12345"
    for name, most in (("a/b", 4), ("c/b", 5), ("a/../a/b", 5), ("a", 5), ("a/b/c", 5), ("d", 5)):
        assert read_within(tmp_path, name, most) is None
