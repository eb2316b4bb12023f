"""The count of operations behind docs/roofline.md: it computes what the kernel computes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import continuair as ca

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "counting.py"


@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
def test_counted_source_computes_the_kernels_flight(model: str) -> None:
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
    flight = ca.simulate(vehicle, scenario, model=model, step=1e-4, sample=3e-4)
    names = ("position", "attitude", "bend")
    flown = np.concatenate([flight[name].to_numpy()[-1].ravel() for name in names])
    np.testing.assert_allclose(count["state_after_3_steps"][:9], flown, rtol=1e-14, atol=1e-18)
    # A Horner loop of 16 terms with derivatives over a row of ten: four times per step.
    assert count["distinct"]["mul"] > 4 * 16 * 20
    assert count["flops"] <= count["flops_written"]
