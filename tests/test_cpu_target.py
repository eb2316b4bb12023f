"""CONTINUAIR_CPU_TARGET: what it compiles for, and what it says of what it cannot use."""

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import continuair.errors

SOURCE = Path(continuair.errors.__file__).parents[1]
START = "from continuair.engine.compiling import start_warp; start_warp()"
COMMAND = "from continuair.__main__ import main; main()"


def run(target: str, code: str, *arguments: str, cache: Path) -> subprocess.CompletedProcess[str]:
    changed = {"CONTINUAIR_CPU_TARGET": target, "WARP_CACHE_PATH": str(cache)}
    environment = os.environ | changed | {"PYTHONPATH": str(SOURCE)}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True)


@pytest.mark.slow
@pytest.mark.parametrize("target", ["pentium-9", "x86-64-v3 -O0"])
def test_what_names_no_processor_is_told_in_one_sentence(target: str, tmp_path: Path) -> None:
    done = run(target, COMMAND, "check", "paper", cache=tmp_path)
    assert done.returncode == 2 and done.stdout.strip() == ""
    assert done.stderr.startswith(f"CONTINUAIR_CPU_TARGET is '{target}'")
    assert "x86-64-v3" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names processors of x86")
def test_kernels_for_two_targets_lie_beside_each_other(tmp_path: Path) -> None:
    """A machine of a shared cache must not load what was compiled for a newer one."""
    for target, objects in (("x86-64", 1), ("x86-64-v2", 2), ("x86-64", 2)):
        done = run(target, START, cache=tmp_path)
        assert done.returncode == 0, done.stderr
        assert len(list(tmp_path.rglob("*.o"))) == objects
