"""Time per RK4 step: the three models, MuJoCo on as many degrees of freedom, and a batch.

Run with `make bench`; extra_info of each benchmark holds microseconds per step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca

STEP = 1e-4
DURATION = 20.0
BATCH = 4096
BATCH_STEPS = 1000
MODELS = ("coupled", "decoupled", "independent")

# A floating body, and a link on two crossed hinges: 6 + 2 degrees of freedom, nothing that touches.
CHAIN = f"""
<mujoco>
  <option timestep="{STEP}" integrator="RK4"><flag contact="disable" constraint="disable"/></option>
  <worldbody>
    <body pos="0 0 5">
      <freejoint/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.024 0.024 0.047"/>
      <body>
        <joint type="hinge" axis="1 0 0" stiffness="100"/>
        <joint type="hinge" axis="0 1 0" stiffness="100" ref="5"/>
        <inertial pos="0 0 -0.5" mass="0.6" diaginertia="0.05 0.05 1e-4"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def free_flight(vehicle: ca.Vehicle, duration: float) -> ca.Scenario:
    """Slightly bent, turning slowly, and held up against gravity: all terms are at work."""
    weight = (0.0, 0.0, 9.81 * vehicle.mass)
    q = (0, 0, 5, 0, 0, 0, 0.1, 0)
    qd = (0, 0, 0, 0.1, 0.1, 0.1, 0, 0)
    return ca.Scenario("free flight", q, qd, force=weight, duration=duration)


def one_flight(model: str) -> xr.Dataset:
    vehicle = ca.load_vehicle("paper")
    flight = ca.simulate(
        vehicle,
        free_flight(vehicle, DURATION),
        model=model,
        method="RK4",
        step=STEP,
        sample=DURATION,
        duration=DURATION,
        variables=("tip_position",),
    )
    assert int(flight["status"]) == 0
    return flight


def per_step(benchmark: Any, call: Callable[[], object], steps: float) -> float:
    """Measure a call that takes so many steps; return the median per step [µs]."""
    benchmark.pedantic(call, rounds=7, warmup_rounds=1)
    median = 1e6 * benchmark.stats.stats.median / steps
    benchmark.extra_info["us_per_step"] = round(median, 4)
    return median


@pytest.fixture(scope="module")
def mujoco_per_step() -> float:
    """Median of RK4 steps of the chain [µs], measured in this run."""
    from time import perf_counter

    advance = mujoco_flight()
    advance()
    times = []
    for _ in range(7):
        start = perf_counter()
        advance()
        times.append(perf_counter() - start)
    return 1e6 * float(np.median(times)) / round(DURATION / STEP)


def mujoco_flight() -> Callable[[], None]:
    """A call that takes DURATION / STEP steps inside the engine, from the same start each time."""
    mujoco = pytest.importorskip("mujoco", reason="the extra 'oracles' installs MuJoCo")
    model = mujoco.MjModel.from_xml_string(CHAIN)
    data = mujoco.MjData(model)
    assert model.nv == 8

    def advance() -> None:
        mujoco.mj_resetData(model, data)
        data.qvel[3:6] = 0.1
        mujoco.mj_step(model, data, nstep=round(DURATION / STEP))
        assert np.isfinite(data.qpos).all()

    return advance


@pytest.mark.parametrize("model", MODELS)
def test_one_run(benchmark: Any, mujoco_per_step: float, model: str) -> None:
    ours = per_step(benchmark, lambda: one_flight(model), round(DURATION / STEP))
    benchmark.extra_info["mujoco_us_per_step"] = round(mujoco_per_step, 4)
    benchmark.extra_info["ratio_to_mujoco"] = round(mujoco_per_step / ours, 3)


def test_mujoco_chain(benchmark: Any) -> None:
    per_step(benchmark, mujoco_flight(), round(DURATION / STEP))


@pytest.mark.parametrize("threads", (1, 2))
@pytest.mark.parametrize("model", ("coupled", "decoupled"))
def test_batch(benchmark: Any, model: str, threads: int) -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.mass": np.linspace(1.0, 3.0, BATCH)})
    duration = BATCH_STEPS * STEP
    still = ca.Scenario("fall", (0, 0, 5, 0, 0, 0, 0.1, 0), (0, 0, 0, 0.1, 0.1, 0.1, 0, 0))

    def fly() -> None:
        flights = ca.simulate(
            vehicle,
            still,
            model=model,
            method="RK4",
            step=STEP,
            sample=duration,
            duration=duration,
            variables=("tip_position",),
            threads=threads,
        )
        assert not flights["status"].any()

    per_step(benchmark, fly, BATCH * BATCH_STEPS)
