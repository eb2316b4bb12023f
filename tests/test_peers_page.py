"""The page of benchmarks/compare.py: a faster peer, a missed aim and an absent peer are told."""

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
peers_page = pytest.importorskip("peers_page")


def case(seconds: list[float]) -> dict[str, Any]:
    rounds = [{"cpu": s, "wall": 2 * s} for s in seconds]
    described = {"unit": "RK4 step", "what": "a flight", "dtype": "float64", "integrator": "RK4"}
    return {**described, "work": 1000, "step": 1e-4, "runs": 1, "rounds": rounds}


def result(mujoco: list[float]) -> dict[str, Any]:
    start = {"seconds": 1.0, "import": 0.5}
    measured = {
        "ours": {"versions": {"continuair": "1"}, "cases": {"coupled": case([1.0, 4.0, 1.0])}},
        "mujoco_chain": {"versions": {"mujoco": "3"}, "cases": {"8-DoF chain": case(mujoco)}},
    }
    up = {"cold": start, "warm": start, "case": "coupled", "memory_mib": 10.0}
    return {
        "when": "today",
        "machine": "a machine",
        "rounds": 3,
        "not_measured": {"rotorpy_rigid": "it could not be installed"},
        "start_up": {"ours": up},
        "measured": {"1": measured},
    }


def page(mujoco: list[float], folder: Path) -> str:
    for name in ("images", "explanation"):
        (folder / name).mkdir()
    peers_page.write(result(mujoco), folder)
    assert (folder / "images" / "peers.png").stat().st_size > 1000
    return (folder / "explanation" / "peers.md").read_text("utf-8")


def test_ratios_are_taken_within_rounds(tmp_path: Path) -> None:
    """All were slower in the second round, by other work; the ratio is 12 throughout."""
    text = page([12.0, 48.0, 12.0], tmp_path)
    assert "| 12 | pass |" in text
    assert "faster than ours" not in text
    assert "* RotorPy: " in text


def test_a_faster_peer_and_a_miss_are_told(tmp_path: Path) -> None:
    text = page([0.5, 2.0, 0.5], tmp_path)
    assert "| 0.5 | **miss** |" in text
    assert "0.5 **(faster than ours)**" in text
    assert "MuJoCo: 8-DoF chain (2 times)" in text
