"""The count of operations of docs/explanation/roofline.md computes what the kernel computes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import continuair as ca
from continuair.typing import Model

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "counting.py"


@pytest.mark.long
@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
def test_counted_source_computes_the_kernels_flight(model: Model) -> None:
    """Position, attitude and bend after three steps; the script itself checks hand counts."""
    count = json.loads(subprocess.check_output([sys.executable, str(SCRIPT), model]))
    vehicle = ca.load_vehicle("paper")
    scenario = ca.Scenario(
        "free flight",
        (0, 0, 5, 0, 0, 0, 0.1, 0),
        (0, 0, 0, 0.1, 0.1, 0.1, 0, 0),
        force=(0.0, 0.0, 9.81 * vehicle.mass),
        duration=3e-4,
    )
    flight = ca.simulate(vehicle, scenario, model=model, method="RK4", step=1e-4, sample=3e-4)
    names = ("position", "attitude", "bend")
    flown = np.concatenate([flight[name].to_numpy()[-1].ravel() for name in names])
    # The CPU flies packs, which fuse products and sums; the counted source rounds both, to 1e-16 of
    # rates up to 1, so that a step of 1e-4 adds to small components what is off by some 1e-20.
    np.testing.assert_allclose(count["state_after_3_steps"][:9], flown, rtol=1e-14, atol=1e-18)
    # A Horner loop of 16 terms with derivatives, four times per step, over the functions that a
    # model needs; of β, arms on a fixed base need the derivative alone, which lacks the last term.
    functions, unread = (4, 1) if model == "independent" else (10, 0)
    assert count["distinct"]["mul"] > 4 * 16 * 2 * functions
    assert count["loads"] == 4 * (16 * functions - unread) + 1  # the step's length
    assert count["flops"] <= count["flops_written"]
