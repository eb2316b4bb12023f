"""Roll-outs at every place against double precision on the CPU, which other tests compare.

Tolerances are on the largest difference over 0.1 s, relative to a variable's largest value. Reached
on the CPU in float32: 2e-5 in open loop, 5e-5 in the closed one, for which 1e-4 is demanded;
float64 leaves a card room for other roundings of the same operations (fused ones, sines).
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import warp as wp
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.controllers.classic import classic
from continuair.engine import engine
from continuair.scenario import paths
from continuair.typing import Model
from tests.kernels.conftest import Place
from tests.refusals import refused

VEHICLES = ca.load_vehicle("paper").replace(
    {"uav.mass": np.linspace(1.0, 3.0, 8), "arm.damping_ratio": 0.03, "uav.mount": [0.02, 0, -0.03]}
)
REFERENCE: dict[str, Any] = {"device": "cpu", "dtype": "float64"}


def here(place: Place) -> dict[str, Any]:
    return {"device": place.device, "dtype": place.dtype}


def worst(found: xr.Dataset, expected: xr.Dataset) -> float:
    """Largest difference of a variable over its own largest value."""
    errors = []
    for name in expected.data_vars:
        if expected[name].dtype.kind != "f" or "time" not in expected[name].dims:
            continue
        difference = np.abs(found[name].to_numpy() - expected[name].to_numpy())
        errors.append(float(difference.max() / np.abs(expected[name].to_numpy()).max()))
    assert errors
    return max(errors)


@pytest.mark.long
@pytest.mark.parametrize("model", ["coupled", "decoupled", "independent"])
def test_a_batch_in_open_loop(model: Model, place: Place) -> None:
    """Forces, Euler torques, a bend moment and a tip wrench at once; everything that is logged."""
    scenario = ca.Scenario(
        "all at once",
        (0, 0, 1, 0.1, 0.2, 0.3, 0.7, 0.4),
        (0.1, 0.2, 0.3, 0.5, -0.4, 0.3, 1.0, 0.2),
        force=(1.0, 2.0, 20.0),
        tau=(0.1, 0.2, 0.1, 0.3, 0.1, 0.05, 1.0, 0.1),
        tip_wrench=(0.5, -0.3, 0.2, 0.01, 0.02, 0.03),
        duration=0.1,
    )
    runs = [
        ca.simulate(VEHICLES, scenario, model=model, method="RK4", step=1e-4, sample=0.02, **where)
        for where in (here(place), REFERENCE)
    ]
    assert worst(*runs) < (1e-10 if place.exact else 1e-4)


@pytest.mark.long
def test_a_closed_loop(place: Place) -> None:
    """Camera, image-based law and vehicles, sampled every millisecond."""
    single = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.05})
    scenario = ca.Scenario(
        "servoing",
        (0.1, 0, 3.1, 0, 0, 0, 0.1, 0),
        duration=0.1,
        controller=classic(single, 0.5, 6.0),
        control_period=1e-3,
        target=ca.Target(paths.circle(radius=0.2, period=10.0)),
    )
    runs = [
        ca.simulate(single, scenario, method="RK4", step=1e-4, sample=0.02, **where)
        for where in (here(place), REFERENCE)
    ]
    assert worst(*runs) < (1e-9 if place.exact else 1e-4)


@pytest.mark.parametrize("place", [Place("cuda", "float64")], ids=str, indirect=True)
def test_pairs_and_their_deviations(place: Place) -> None:
    """The tips' roll-out, and how far those of two models part; pairs fly in float64 only."""
    flown = [
        ca.run_pairs(
            VEHICLES, open_loop_test("A"), method="RK4", step=1e-3, duration=0.2, device=device
        )
        for device in (place.device, "cpu")
    ]
    for name in flown[1].data_vars:
        if flown[1][name].dtype.kind == "f":
            np.testing.assert_allclose(flown[0][name], flown[1][name], rtol=1e-7, atol=1e-12)


def test_a_card_can_be_named_with_and_without_its_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wp, "get_cuda_devices", lambda: [SimpleNamespace(alias="cuda:0")])
    engine.check_device("cuda")
    engine.check_device("cuda:0")
    with refused("device"):
        engine.check_device("cuda:1")
