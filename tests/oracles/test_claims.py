"""The recorder of claims, and the page made of them."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]

SAMPLE = '''"""Sample claims."""
import pytest

def test_agrees(claim):
    claim("agrees", "Engine 1", 1e-3, 0.7501, 0.75)

def test_misses(claim):
    claim("misses", "Engine 1", 1e-3, 0.5)
    claim("is made all the same", "Engine 1", 1.0, 0.5)

def test_misses_as_known(claim):
    claim("misses as known", "Engine 1", 1e-3, 0.5, miss="Engine 1 rounds")

def test_no_longer_misses(claim):
    claim("no longer misses", "Engine 1", 1.0, 0.5, miss="Engine 1 rounds")

def test_distance(claim):
    claim("distance", "Engine 1", None, 0.1234, unit="m")

def test_breaks(claim):
    raise RuntimeError("it broke")

def test_is_skipped():
    pytest.importorskip("no_such_engine", reason="no such engine here")
'''


def run_sample(folder: Path) -> tuple[subprocess.CompletedProcess[str], dict[str, Any]]:
    sample, out = folder / "test_sample.py", folder / "verify.json"
    sample.write_text(SAMPLE, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-p", "tests.oracles.conftest", str(sample)]
    command += ["--verify", str(out), "-p", "no:cacheprovider", f"--rootdir={folder}"]
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "src")])}
    ran = subprocess.run(command, cwd=folder, env=paths, capture_output=True, text=True)
    return ran, {entry["claim"]: entry for entry in json.loads(out.read_text(encoding="utf-8"))}


@pytest.mark.slow
def test_claims_are_recorded_whatever_they_reach_and_only_unexplained_misses_fail(
    tmp_path: Path,
) -> None:
    ran, claims = run_sample(tmp_path)
    assert "3 failed, 3 passed, 1 skipped" in ran.stdout
    assert claims["agrees"]["pass"] is True
    assert claims["misses"]["pass"] is False
    assert claims["is made all the same"]["pass"] is True
    assert claims["misses as known"]["pass"] is False
    assert claims["distance"]["pass"] is None
    assert "no longer misses: 0.5, tolerance 1" in ran.stdout
    broken = next(entry for name, entry in claims.items() if "breaks" in name)
    assert broken["pass"] is False and "it broke" in broken["note"]
    skipped = next(entry for name, entry in claims.items() if "is skipped" in name)
    assert skipped["pass"] is None and "no such engine here" in skipped["note"]


@pytest.mark.slow
def test_page_shows_every_verdict(tmp_path: Path) -> None:
    _, claims = run_sample(tmp_path)
    for folder in ("images", "explanation"):
        (tmp_path / folder).mkdir()
    script = [sys.executable, str(ROOT / "docs" / "make_trust.py")]
    subprocess.run([*script, str(tmp_path / "verify.json"), str(tmp_path)], check=True)
    page = (tmp_path / "explanation" / "trust_claims.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    assert sum(row.endswith("| **miss** |") for row in rows) == 3  # two claims, and what broke
    assert "| agrees | `agrees` | 0.7500 ± 0.001 | 0.7501 | pass |" in rows
    assert any(row.endswith("| 0.123 m | measured |") for row in rows)
    assert any(row.endswith("| not run |") for row in rows)
    assert "1. Engine 1 rounds." in page and "no such engine here." in page
