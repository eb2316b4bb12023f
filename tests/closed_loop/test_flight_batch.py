"""A batch of controlled flights is the single flights, for every model, shape and precision."""

from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.engine import engine as engines
from continuair.typing import Model

NAMES = ("position", "attitude", "bend", "command")
NOISE = {"position": 0.01, "velocity": 0.02, "attitude": 0.003, "gyro": 0.02}
RUNS = 5


def scenario(vehicle: ca.Vehicle, chosen: list[int], **choices: Any) -> ca.Scenario:
    """Runs that differ in start, seed, gains and set-points."""
    rng, n = np.random.default_rng(5), 6 + 2 * vehicle.sections
    q = rng.uniform(-0.2, 0.2, (RUNS, n))
    goal = rng.uniform(-0.3, 0.3, (RUNS, 3))
    bend = rng.uniform(-0.2, 0.2, (RUNS, 2 * vehicle.sections))
    laws = [
        ca.flight_controller(vehicle, attitude_bandwidth=8.0 + run, rate=200.0, latency=0.003,
                             noise=NOISE, **choices)
        for run in range(RUNS)
    ]  # fmt: skip
    return ca.Scenario(
        "batch",
        q[chosen],
        duration=0.2,
        controller=ca.stack([laws[run] for run in chosen]),
        seed=[11 + run for run in chosen],
        setpoints=ca.Setpoints(
            position=lambda t: goal[chosen] * np.cos(3 * t),
            yaw=np.linspace(0.0, 1.0, RUNS)[chosen],
            bend=bend[chosen],
        ),
    )


def flown(
    vehicle: ca.Vehicle,
    chosen: list[int],
    model: Model,
    dtype: Literal["float64", "float32"],
    **ways: Any,
) -> xr.Dataset:
    return ca.simulate(
        vehicle, scenario(vehicle, chosen, **ways), model=model, dtype=dtype, sample=0.01,
        variables=NAMES, threads=1,
    )  # fmt: skip


CASES = [
    ("paper", "coupled", "float64", "weight"),
]
OTHERS = [
    ("paper", "decoupled", "float32", "none"),
    ("two_section", "coupled", "float64", "reaction"),
    ("dual_arm", "coupled", "float64", "weight"),
    ("paper", "independent", "float64", "reaction"),
]


@pytest.mark.long
@pytest.mark.parametrize(
    ("vehicle", "model", "dtype", "feedforward"),
    [*CASES, *(pytest.param(*case, marks=pytest.mark.soak) for case in OTHERS)],
)
def test_a_controlled_run_is_the_same_in_any_batch_and_alone(
    vehicle: str,
    model: Model,
    dtype: Literal["float64", "float32"],
    feedforward: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one = ca.load_vehicle(vehicle)
    batch = flown(one, list(range(RUNS)), model, dtype, feedforward=feedforward)
    assert (batch.status == 0).all()
    part = flown(one, [3, 1], model, dtype, feedforward=feedforward)
    for name in NAMES:
        np.testing.assert_array_equal(part[name], batch[name][[3, 1]])
    monkeypatch.setattr(engines, "lanes_of", lambda *_: 1)
    alone = flown(one, [3], model, dtype, feedforward=feedforward)
    room = 1e-9 if dtype == "float64" else 1e-3
    for name in NAMES:
        size = max(1.0, float(np.abs(alone[name]).max()))
        np.testing.assert_allclose(alone[name][0], batch[name][3], rtol=0, atol=room * size)
    assert np.abs(batch.position[0] - batch.position[1]).max() > 0.01
