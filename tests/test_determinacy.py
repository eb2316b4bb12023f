"""A loop that hangs on rounding is told, and no result of a search or a map stands on one."""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import continuair as ca
import continuair.errors
from continuair.analysis.determinacy import determined, nudged
from continuair.controllers.gain_files import Gains, load_gains
from continuair.scenario.tracking_task import SETTINGS, equipped, task

SOURCE = Path(continuair.errors.__file__).parents[1]
HOLDING = load_gains("paper")
CHATTERING = Gains(
    "chattering",
    {"bandwidth": 13.5, "damping_ratio": 1.17, "conditioning": 1.9e-3, "sliding": 8e-3}
    | {"sigma": 1.8e-4},
)
"""A sliding term that saturates at a tenth of a pixel, held for a millisecond."""

EVERYWHERE = """
import json
import numpy as np
import continuair as ca
from continuair.studies.atlas.loops import LOOP_ERRORS, fly_loops, sample_loops
from amiri2026.tracking.candidates import fly
from amiri2026.tracking.tuning import RANGES
from continuair.sweeps.sampling import sobol_box

vehicle = ca.load_vehicle("paper")
box = sobol_box(RANGES, 32, [0, 0])
rows = [dict(zip(box, map(float, values))) for values in zip(*box.values())]
flown = fly(vehicle, rows, ["M"], "fast", "decoupled")
found = {"candidates": np.array([flown.pixels, flown.millimetres, flown.effort])}
loops = fly_loops(sample_loops(128, 0))
found |= {name: loops[name].to_numpy() for name in LOOP_ERRORS}
found |= {name: np.array(value) for name, value in ca.design(vehicle, 8.0).items()}
modes = ca.modes(vehicle.replace({"uav.mount": [0.1, 0.1, 0.0]}), [0, 0, 0, 0.1, 0.2, 0.3, 0, 0])
found |= {"frequencies": modes.frequencies, "shapes": modes.shapes}
print(json.dumps({name: value.tolist() for name, value in found.items()}))
"""


@pytest.mark.parametrize(("gains", "expected"), [(HOLDING, True), (CHATTERING, False)])
def test_a_loop_that_holds_is_determined_and_one_that_chatters_is_not(
    gains: Gains, expected: bool
) -> None:
    vehicle = equipped(ca.load_vehicle("paper"), SETTINGS["nominal"])
    scenario = task(vehicle, ["M"], gains.controller(vehicle), 50.0)
    flights = [
        ca.simulate(vehicle, each, duration=4.0, sample=2e-2, variables=["feature_error"])
        for each in (scenario, nudged(scenario))
    ]
    assert all((flight["status"] == 0).all() for flight in flights)
    assert bool(determined(*flights).all()) is expected


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="names processors of x86")
def test_what_is_found_is_the_same_on_every_processor() -> None:
    """Candidates of a search, loops of the atlas, gains and modes, with AVX2 and as it comes.

    A loop may multiply a nanometre by 30, and so the rounding of metres to 1e-13; reached: 1e-10.
    """
    found = []
    for processor in ({}, {"CONTINUAIR_CPU_TARGET": "x86-64-v3", "OPENBLAS_CORETYPE": "Haswell"}):
        environment = os.environ | {"PYTHONPATH": str(SOURCE)} | processor
        output = subprocess.check_output([sys.executable, "-c", EVERYWHERE], env=environment)
        found.append(json.loads(output))
    for name, values in found[0].items():
        np.testing.assert_allclose(found[1][name], values, rtol=1e-8, atol=1e-13, err_msg=name)
