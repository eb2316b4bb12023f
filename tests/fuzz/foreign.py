"""Files that others made: small whole ones of every kind that is read, and how each is damaged.

Each is read as a user would read it. None may lead to another file: OUTSIDE, which lies beside
them and which mutations name, must not be in what is read.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import sqlite3
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import continuair as ca
from amiri2026.report.page import page
from continuair.flight.reading import scenario_of, vehicles_of
from continuair.identification import Recording, load_recording
from continuair.identification.recording import MEASURED
from continuair.studies.atlas import summary
from continuair.studies.contents import read
from continuair.studies.results import MARKER
from continuair.sweeps import checksums
from tests.fuzz.mutation import mutated
from tests.fuzz.trial import Wrong
from tests.identification.flights import true_vehicle, write
from tests.interfaces.logged import (
    bag_topics,
    flown,
    px4_estimates,
    rotorcraft,
    write_bag,
    write_ulog,
)
from tests.paper.made_results import write_results

Rng = np.random.Generator

OUTSIDE, SECRET, NUMBER = "outside.bin", "NOBODY-READS-THIS", 1234567.8125
"""A file beside the samples, a text and a number that it holds."""

DESIGN = """chunk = 2
[scenario]
test = "A"
duration = 0.02
[[vary]]
"vehicle.uav.mass" = { from = 1.0, to = 2.0, count = 5 }
"scenario.test" = ["A", "B", "A", "A", "A"]
[set]
"scenario.roll" = 0.1
"""

ODD_JSON: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 2, 10**12, 10**30, -(10**18), 0.5, 1e308, 1e-320, float("nan"),
    float("inf"), "", "x", "\x00", "../" + OUTSIDE, "/dev/zero", "/etc/passwd", "<script>",
    "9" * 5000,
    [], {}, [[]], [1, [2, 3]], {"": {}}, ["a"] * 50, {"a": 1}, "run", "status", "coupled",
)  # fmt: skip

ODD_INTEGERS = (0, 1, 2, 3, 7, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40,
                (1 << 63) - 1, (1 << 64) - 1)  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A kind of files: its name in the folder of samples, how it is read, and its mutations."""

    name: str
    read: Callable[[Path], Any]
    mutations: tuple[Callable[[Path, Rng], None], ...]


def samples(folder: Path) -> None:
    """Write a small whole file of every kind, and OUTSIDE, to an empty folder."""
    found, thrusts = flown(rotorcraft(), duration=0.15)
    time = found["time"].to_numpy()
    write_ulog(
        folder / "flight.ulg",
        {**px4_estimates(found), "actuator_motors": (time, {"control": thrusts / 14.0})},
    )
    write_bag(folder / "bag", bag_topics(found))
    write_bag(folder / "base", bag_topics(found), plugin="SQLITE3")
    shutil.copyfile(next((folder / "bag").glob("*.mcap")), folder / "flight.mcap")
    shutil.copyfile(next((folder / "base").glob("*.db3")), folder / "flight.db3")
    write(folder / "flight.csv", found, None, MEASURED, None)
    (folder / "design.toml").write_text(DESIGN)
    ca.sweep(folder / "design.toml", folder / "store.zarr", threads=1)
    scenario = ca.Scenario("fall", [0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0], duration=0.02)
    ca.simulate(ca.load_vehicle("paper"), scenario, sample=2e-3).to_netcdf(folder / "flight.nc")
    write_results(folder / "results")
    small = xr.Dataset({"error": ("flight", np.arange(5.0)), "n": ((), 3)}, attrs={"version": "0"})
    summary.save(small.assign_coords(flight=np.arange(5)), folder / "atlas.npz")
    numbers = np.full(64, NUMBER).tobytes() + np.full(64, NUMBER, ">f8").tobytes()
    (folder / OUTSIDE).write_bytes(SECRET.encode() * 20 + numbers)


def attempt(kind: Kind, samples: Path, rng: Rng, folder: Path) -> None:
    """Damage a copy of a sample, and read it; raises Wrong for what is of OUTSIDE."""
    at = folder / "copies"
    shutil.rmtree(at, ignore_errors=True)
    at.mkdir()
    shutil.copyfile(samples / OUTSIDE, at / OUTSIDE)
    source, target = samples / kind.name, at / kind.name
    (shutil.copytree if source.is_dir() else shutil.copyfile)(source, target)
    for _ in range(int(rng.integers(1, 4))):
        kind.mutations[rng.integers(len(kind.mutations))](target, rng)
    check_own(kind.read(target))


def check_own(found: Any) -> None:
    """Raise Wrong if what was read holds what is in OUTSIDE."""
    texts: list[Any] = []
    arrays: list[np.ndarray] = []
    if isinstance(found, Recording):
        texts.append(found.name)
        arrays += [each for each in vars(found).values() if isinstance(each, np.ndarray)]
    elif isinstance(found, xr.Dataset):
        texts.append(repr(found.attrs))
        for variable in found.variables.values():
            (texts if variable.dtype.kind in "OSU" else arrays).append(variable.to_numpy())
    else:
        texts.append(found)
    if any(SECRET in str(text) for text in texts):
        raise Wrong("holds a text of another file")
    if any(np.any(each == NUMBER) for each in arrays):
        raise Wrong("holds a number of another file")


# Mutations of bytes


def flip(path: Path, rng: Rng) -> None:
    """A few bits."""
    data = bytearray(_bytes(path))
    for _ in range(int(rng.integers(1, 9)) if data else 0):
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    path.write_bytes(data)


def odd_integer(path: Path, rng: Rng) -> None:
    """An integer of some width that is another, as of a size that is declared."""
    data = bytearray(_bytes(path))
    width = int(rng.choice([1, 2, 4, 8]))
    if len(data) <= width:
        return
    value = int(rng.choice(np.array(ODD_INTEGERS, dtype=object))) & ((1 << 8 * width) - 1)
    # Sizes stand at the beginning of records, many of them near that of the file.
    top = len(data) - width if rng.random() < 0.5 else min(400, len(data) - width)
    at = int(rng.integers(top + 1))
    data[at : at + width] = value.to_bytes(width, str(rng.choice(["little", "big"])))  # type: ignore[arg-type]
    path.write_bytes(data)


def cut(path: Path, rng: Rng) -> None:
    """Its beginning alone."""
    data = _bytes(path)
    path.write_bytes(data[: int(rng.integers(len(data) + 1))])


def leave_out(path: Path, rng: Rng) -> None:
    """A piece of it missing."""
    data = _bytes(path)
    at, size = int(rng.integers(len(data) + 1)), int(rng.integers(1, 200))
    path.write_bytes(data[:at] + data[at + size :])


def repeat(path: Path, rng: Rng) -> None:
    """A piece of it twice, or where it does not belong."""
    data = _bytes(path)
    at, other = (int(rng.integers(len(data) + 1)) for _ in range(2))
    piece = data[at : at + int(rng.integers(1, 400))]
    path.write_bytes(data[:other] + piece + data[other:])


def odd_text(path: Path, rng: Rng) -> None:
    """As people damage texts."""
    path.write_text(mutated(_bytes(path).decode("utf-8", "replace"), rng), "utf-8", "replace")


BYTES = (flip, odd_integer, odd_integer, cut, leave_out, repeat)


def inside(*names: str, changes: tuple[Callable[[Path, Rng], None], ...] = BYTES) -> Any:
    """Mutations of a file in a folder, by patterns."""

    def mutation(path: Path, rng: Rng) -> None:
        found = sorted(each for name in names for each in path.glob(name) if each.is_file())
        if found:
            changes[rng.integers(len(changes))](found[rng.integers(len(found))], rng)

    return mutation


def replaced(path: Path, rng: Rng) -> None:
    """A link, a pipe, a folder or nothing in the place of a file in a folder."""
    found = sorted(each for each in path.rglob("*") if each.is_file() or each.is_symlink())
    if not found:
        return
    file = found[rng.integers(len(found))]
    file.unlink()
    depth = len(file.relative_to(path).parts)
    match int(rng.integers(5)):
        case 0:
            file.symlink_to(Path(*[".."] * depth) / OUTSIDE)
        case 1:
            file.symlink_to("/dev/zero")
        case 2:
            os.mkfifo(file)
        case 3:
            file.mkdir()


# Mutations of JSON


def odd_json(path: Path, rng: Rng) -> None:
    """A value, or the name of one, that is another."""
    try:
        content = json.loads(_bytes(path))
    except ValueError:
        return
    path.write_text(json.dumps(changed(content, rng)))


def changed(content: Any, rng: Rng) -> Any:
    """JSON in which something is another."""
    if isinstance(content, dict) and content and rng.random() < 0.9:
        name = list(content)[rng.integers(len(content))]
        match rng.random():
            case chance if chance < 0.04:
                return {each: value for each, value in content.items() if each != name}
            case chance if chance < 0.08:
                return {str(_odd(rng)) if k == name else k: v for k, v in content.items()}
        return content | {name: changed(content[name], rng)}
    if isinstance(content, list) and content and rng.random() < 0.9:
        at = int(rng.integers(len(content)))
        match rng.random():
            case chance if chance < 0.1:
                return content[:at] + content[at + 1 :]
            case chance if chance < 0.2:
                return [*content, content[at]]
        return [*content[:at], changed(content[at], rng), *content[at + 1 :]]
    return _odd(rng)


def _odd(rng: Rng) -> Any:
    return ODD_JSON[rng.integers(len(ODD_JSON))]


def sealed_store(path: Path, rng: Rng) -> None:
    """The attributes of a store, and checksums that belong to them."""
    try:
        group = json.loads(_bytes(path / "zarr.json"))
        attributes = group["attributes"]
        group["attributes"] = changed(attributes, rng)
        names = [name for name in attributes["files"] if (path / name).is_file()]
        if rng.random() < 0.8:
            group = checksums.sealed(group, path, names)
        else:
            group["attributes"]["checksum"] = checksums._of_group(group)
    except (ValueError, TypeError, KeyError, AttributeError, OSError):
        return
    (path / "zarr.json").write_text(json.dumps(group))


def odd_array_of_store(path: Path, rng: Rng) -> None:
    """The metadata of an array, and checksums that belong to them."""
    inside("design/*/zarr.json", changes=(odd_json,))(path, rng)
    sealed_store(path, np.random.default_rng(1))


def odd_marker(path: Path, rng: Rng) -> None:
    """What a folder of results says that it holds."""
    odd_json(path / MARKER, rng)


# Mutations of what has a structure of its own


def odd_row(path: Path, rng: Rng) -> None:
    """A value of a database."""
    base = sqlite3.connect(path)
    try:
        with base:
            listed = base.execute("SELECT name FROM sqlite_master WHERE type='table'")
            table = str(rng.choice([name for (name,) in listed]))
            columns = [row[1] for row in base.execute(f"PRAGMA table_info({table})")]
            odd = [None, -1, 2**62, "", "x", b"", bytes(100), "../" + OUTSIDE, "[" * 3000]
            value, column = odd[rng.integers(len(odd))], str(rng.choice(columns))
            where = "" if rng.random() < 0.5 else " WHERE rowid = 1"
            base.execute(f"UPDATE OR IGNORE {table} SET {column} = ?{where}", (value,))
    except (sqlite3.Error, ValueError):
        pass
    finally:
        base.close()


def odd_npz(path: Path, rng: Rng) -> None:
    """An array of an archive whose header, or content, says something else."""
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
    except (zipfile.BadZipFile, ValueError, OSError, EOFError, zlib.error, NotImplementedError):
        return
    name = sorted(members)[rng.integers(len(members))] if members else ""
    data = bytearray(members.get(name, b""))
    if rng.random() < 0.5:
        kinds = ["<f8", "|O", "<U1000000", "|V9", "<M8[s]", "<c16"]
        shapes = ["()", "(5,)", "(1000000000000,)", "(0,)", "(-1,)", "(2, 3)"]
        kind, shape = rng.choice(kinds), rng.choice(shapes)
        header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
        text = header.encode().ljust(117) + b"\n"
        data[:128] = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text
    elif name == "header.npy" and rng.random() < 0.8:
        try:
            content = json.loads(str(np.load(io.BytesIO(bytes(data)), allow_pickle=False)))
        except (ValueError, OSError, EOFError):
            return
        out = io.BytesIO()
        np.save(out, np.array(json.dumps(changed(content, rng))))
        data = bytearray(out.getvalue())
    else:
        data = bytearray(data[: rng.integers(len(data) + 1)])
    with zipfile.ZipFile(path, "w") as archive:
        for each, content in members.items():
            archive.writestr(each, bytes(data) if each == name else content)


def odd_netcdf(path: Path, rng: Rng) -> None:
    """A netCDF file with other attributes, or values that are elsewhere."""
    import h5py

    try:
        with h5py.File(path, "r+") as file:
            names = sorted(file)
            name = str(rng.choice(names))
            match int(rng.integers(6)):
                case 0:
                    del file[name]
                    file[name] = h5py.ExternalLink(str(path.parent / OUTSIDE), "/x")
                case 1:
                    del file[name]
                    outside = [(str(path.parent / OUTSIDE), 0, 64 * 8)]
                    file.create_dataset(name, shape=(11,), dtype="f8", external=outside)
                case 2:
                    del file[name]
                    file.create_dataset(name, shape=(10**11,), dtype="f8", chunks=(1024,))
                case 3:
                    attribute = str(rng.choice(sorted(file.attrs)))
                    said = file.attrs[attribute]
                    if isinstance(said, str) and said.startswith(("{", "[")):
                        file.attrs[attribute] = json.dumps(changed(json.loads(said), rng))
                    else:
                        odd = _odd(rng)
                        file.attrs[attribute] = odd if isinstance(odd, str | int | float) else "x"
                case 4:
                    file[f"{name}_again"] = h5py.SoftLink(f"/{name}")
                case 5:
                    of = sorted(file[name].attrs) if hasattr(file[name], "attrs") else []
                    if of:
                        file[name].attrs[str(rng.choice(of))] = "seconds since 1e99"
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, OverflowError, AttributeError):
        pass


# Readers


def _ulog(path: Path) -> Recording:
    named = {
        "bend": "debug_array:data[0],data[1]",
        "rotors": "actuator_motors:control[0],control[1],control[2],control[3]*14",
    }
    return ca.read_ulog(path, _QUAD, named)


def _bag(path: Path) -> Recording:
    return ca.read_rosbag(path, _ALONE, {"pose": "/uav/pose", "bend": "/arm/bend"})


def _netcdf(path: Path) -> xr.Dataset:
    found = ca.read_result(path)
    vehicles_of(found)
    scenario_of(found)
    return found


def _paper(path: Path) -> str:
    return page(read(path))


_QUAD, _ALONE = rotorcraft(), true_vehicle()

KINDS = (
    Kind("flight.ulg", _ulog, BYTES),
    Kind("flight.mcap", _bag, BYTES),
    Kind("flight.db3", _bag, (*BYTES, odd_row, odd_row, odd_row, odd_row)),
    Kind("bag", _bag, (inside("metadata.yaml", changes=(odd_text,)), inside("*.mcap"), replaced)),
    Kind("flight.csv", load_recording, (odd_text, odd_text, *BYTES)),
    Kind(
        "store.zarr",
        lambda path: ca.open_sweep(path),
        (*[sealed_store] * 6, odd_array_of_store, inside("**/*"), replaced),
    ),
    Kind("flight.nc", _netcdf, (*[odd_netcdf] * 6, *BYTES)),
    Kind(
        "results",
        _paper,
        (inside("paper.json", changes=(odd_json,)), inside("paper.json", changes=(odd_json,)),
         odd_marker, inside("table.md", changes=(odd_text,)), inside("*"), replaced),
    ),
    Kind("atlas.npz", lambda path: summary.load(path), (odd_npz, odd_npz, *BYTES)),
)  # fmt: skip


def _bytes(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() and not path.is_symlink() else b""
