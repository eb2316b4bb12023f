"""First calls from many threads, and a kernel cache that is damaged, full or nowhere."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import continuair.errors

SOURCE = Path(continuair.errors.__file__).parents[1]

FIRST_CALLS = """
import sys, threading
import amiri2026
import continuair as ca
test = amiri2026.open_loop_test("A").replace(duration=0.01)
vehicle, failed = ca.load_vehicle("paper"), []
def fly(number):
    try:
        if number % 2:
            ca.simulate(vehicle, test, model=("coupled", "decoupled")[number // 2 % 2])
        else:
            ca.run_pairs(vehicle, test, ["decoupled"])
    except BaseException as error:
        failed.append(repr(error))
threads = [threading.Thread(target=fly, args=(number,)) for number in range(8)]
for thread in threads: thread.start()
print("said meanwhile", file=sys.stderr, flush=True)
for thread in threads: thread.join()
print("said at the end", file=sys.stderr, flush=True)
sys.exit("\\n".join(failed) or 0)
"""
UNSET = """
import os
for name in ("WARP_CACHE_PATH", "XDG_CACHE_HOME"): os.environ.pop(name, None)
"""
ONE_CALL = """
import amiri2026
import continuair as ca
test = amiri2026.open_loop_test("A").replace(duration=0.01)
print(float(ca.simulate(ca.load_vehicle("paper"), test)["tip_position"].sum()))
"""


def run(code: str, **changed: Any) -> subprocess.CompletedProcess[str]:
    limit = changed.pop("limit", None)
    environment = {**os.environ, "PYTHONPATH": str(SOURCE), **changed}
    return subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True,
        preexec_fn=limit, timeout=300,
    )  # fmt: skip


def said(done: subprocess.CompletedProcess[str]) -> str:
    """Return what a process wrote on stderr, without the lines that tell of compiling."""
    lines = done.stderr.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("Compiling a kernel"))


@pytest.fixture(scope="module")
def caches(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a cache of kernels in it, and what a flight of them ends at."""
    folder = tmp_path_factory.mktemp("caches")
    done = run(ONE_CALL, WARP_CACHE_PATH=str(folder))
    assert done.returncode == 0, done.stderr
    (folder / "result").write_text(done.stdout)
    return folder


def flies_as_before(caches: Path) -> subprocess.CompletedProcess[str]:
    done = run(ONE_CALL, WARP_CACHE_PATH=str(caches))
    assert done.returncode == 0, done.stderr
    assert done.stdout == (caches / "result").read_text()
    return done


@pytest.mark.slow
def test_first_calls_from_many_threads_all_fly_and_lose_no_word() -> None:
    done = run(FIRST_CALLS)
    assert done.returncode == 0, done.stderr
    assert said(done) == "said meanwhile\nsaid at the end\n"


@pytest.mark.slow
def test_stderr_is_not_needed(tmp_path: Path) -> None:
    done = run(ONE_CALL, limit=lambda: os.close(2))
    assert done.returncode == 0 and float(done.stdout)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "damage"),
    [
        (".o", "flipped"),
        (".meta", "emptied"),
        pytest.param(".o", "cut", marks=pytest.mark.soak),
        pytest.param(".meta", "a folder", marks=pytest.mark.soak),
    ],
)
def test_what_is_damaged_in_the_cache_is_built_anew(caches: Path, suffix: str, damage: str) -> None:
    files = [path for path in caches.rglob(f"*{suffix}") if path.is_file()]
    before = {path: path.read_bytes() for path in files}
    for path, content in before.items():
        path.write_bytes(content[: len(content) // 2] if damage == "cut" else b"")
        if damage == "flipped":
            middle = len(content) // 2
            path.write_bytes(
                content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
            )
        if damage == "a folder":
            path.unlink()
            path.mkdir()
    assert files
    assert said(flies_as_before(caches)) == ""
    for path, content in before.items():
        assert path.stat().st_size == len(content)


@pytest.mark.slow
def test_an_object_that_was_cut_shows_even_without_its_sum(caches: Path) -> None:
    for path in caches.rglob("*.sum"):
        path.unlink()
    for path in caches.rglob("*.o"):
        path.write_bytes(path.read_bytes()[:-1])
    assert said(flies_as_before(caches)) == ""


@pytest.mark.slow
def test_a_cache_that_cannot_be_used_is_replaced_by_a_temporary_one(
    caches: Path, tmp_path: Path
) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    (tmp_path / "file").touch()
    for where in ({"WARP_CACHE_PATH": str(tmp_path / "file")}, {"HOME": str(tmp_path / "file")}):
        unset = UNSET if "HOME" in where else ""
        done = run(unset + ONE_CALL, TMPDIR=str(temporary), **where)
        assert done.returncode == 0, done.stderr
        assert done.stdout == (caches / "result").read_text()
        assert "the kernel cache" in done.stderr and "set WARP_CACHE_PATH" in done.stderr
        assert not list(temporary.iterdir()), "the temporary cache is removed at the end"


@pytest.mark.slow
def test_where_nothing_can_be_written_one_sentence_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code = "from continuair.__main__ import main; main()"
    changed = {"WARP_CACHE_PATH": str(tmp_path / "file"), "PYTHONPATH": str(SOURCE)}
    nothing = (0, 0)
    done = subprocess.run(
        [sys.executable, "-c", code, "check", "paper"],
        env={**os.environ, **changed}, capture_output=True, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, nothing),
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "WARP_CACHE_PATH" in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("mode", [0o777, 0o757])
def test_a_cache_that_every_user_may_write_to_is_refused(tmp_path: Path, mode: int) -> None:
    tmp_path.chmod(mode)
    code = "import continuair as ca; ca.linearize(ca.load_vehicle('paper'), [0.0] * 8)"
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path), "PYTHONPATH": str(SOURCE)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert done.returncode and "InputError: WARP_CACHE_PATH is" in done.stderr
    assert not list(tmp_path.rglob("*.o"))
