"""The examples run as they are printed, and do what they say."""

import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def example(name: str) -> dict[str, Any]:
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


SLOW = ("mpc_transfer",)
PATHS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem in SLOW else [])
    for path in sorted(EXAMPLES.glob("*.py"))
]


@pytest.mark.long
@pytest.mark.parametrize("path", PATHS)
def test_an_example_runs_on_its_own(path: Path, tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, str(path)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(EXAMPLES.parent / "src")},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_device_controller_brakes_the_bend_and_keeps_its_place() -> None:
    fly = example("device_controller")["fly"]
    free, braked = fly(0.0), fly(0.3)
    assert np.abs(braked.bend[200:]).max() < 0.1 * np.abs(free.bend[200:]).max()
    np.testing.assert_allclose(braked.position[-1], [0, 0, 3], rtol=0, atol=0.02)


@pytest.mark.long
def test_the_numpy_controller_brings_the_target_to_the_middle_of_the_image() -> None:
    error = np.abs(example("numpy_controller")["fly"](3.0).feature_error.to_numpy()).max(axis=1)
    assert error[0] > 100.0
    # A critically damped loop of 1.5 rad/s leaves (1 + 4.5) exp(-4.5) = 6 % in 3 s.
    assert error[-1] < 0.07 * error[0]


@pytest.mark.long
def test_a_shaped_transfer_leaves_the_arm_at_rest_where_a_rigid_plan_leaves_it_ringing() -> None:
    found = example("quiet_transfer")
    ringing, rigid = found["ringing"], found["RIGID"]
    before, after = ringing(rigid), ringing(found["shaped"]())
    assert before > 0.02
    # L-BFGS ends where the squared miss is beyond its tolerance of 1e-12.
    assert after < 1e-6 * before


@pytest.mark.slow
def test_a_transfer_planned_on_the_coupled_model_ends_where_and_as_it_was_planned() -> None:
    pytest.importorskip("casadi")
    found = example("mpc_transfer")
    states, inputs = found["planned"]()
    flight = found["flown"](inputs)
    bend = flight.bend.sel(bend_axis="x")
    at_knots = np.interp(found["KNOTS"], flight.time, bend)
    # RK4 of the plan turns the fastest mode, 48 rad/s, by 0.24 rad a step: 7e-6 of it, 300 times.
    np.testing.assert_allclose(at_knots, states[3], rtol=0, atol=3e-3 * np.abs(states[3]).max())
    off = flight.position.sel(time=found["TIME"]) - [found["DISTANCE"], 0, found["HEIGHT"]]
    assert np.abs(off).max() < 1e-6
    assert np.abs(bend.sel(time=slice(found["TIME"], None))).max() < 3e-3 * np.abs(bend).max()
