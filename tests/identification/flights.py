"""Recorded flights made by the simulation, with known parameters and known noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from amiri2026 import open_loop_test
from continuair.identification.recording import MEASURED
from continuair.vehicle.layout import ACTUATORS

SAMPLE = 5e-3
NOISE = {"position": 2e-3, "attitude": 2e-3, "bend": 5e-3}


def true_vehicle() -> ca.Vehicle:
    """A vehicle with a soft, damped arm and a tip mass."""
    disk = {"position": 0.8, "mass": 0.05}
    changes = {"arm.length": 0.8, "arm.radius": 0.004, "arm.density": 6450.0}
    changes |= {"arm.youngs_modulus": 40e9, "arm.damping_ratio": 0.03, "uav.mass": 1.6}
    return ca.load_vehicle("paper").replace(changes | {"arm.disks": [disk]})


def held_inputs(time: np.ndarray) -> np.ndarray:
    """Inputs (n, 8): about the weight, pushes from side to side, moments and bend moments."""
    rows = np.zeros((len(time), len(ACTUATORS)))
    rows[:, 2] = 9.81 * true_vehicle().mass
    rows[:, 0] = 8.0 * np.sin(11.0 * time)
    rows[:, 1] = 5.0 * np.sin(7.0 * time + 1.0)
    rows[:, 3:6] = 0.2 * np.sin(np.outer(time, [9.0, 8.0, 6.0]))
    rows[:, 6:8] = 0.5 * np.cos(np.outer(time, [15.0, 19.0]))
    return rows


def held_scenario(time: np.ndarray, inputs: np.ndarray) -> ca.Scenario:
    """Return a flight under inputs (n, 8) that are held from each time (n,) to the next."""

    def held(t: float) -> np.ndarray:
        return np.asarray(inputs[int(np.searchsorted(time, t, side="right")) - 1])

    return ca.Scenario(
        "held",
        (0.3, -0.2, 5.0, 0.05, -0.04, 0.2, 0.4, 0.5),
        (0.2, 0.1, -0.1, 0.3, 0.2, -0.1, 0.5, 0.3),
        force=lambda t: held(t)[:3],
        moment=lambda t: held(t)[3:6],
        bend_moment=lambda t: held(t)[6:],
        jumps=tuple(time[1:-1]),
        duration=float(time[-1]),
    )


def record(
    path: Path,
    *,
    test: str | None = None,
    seed: int | None = None,
    duration: float = 1.0,
    vehicle: ca.Vehicle | None = None,
    step: float = 2e-4,
) -> None:
    """Write a flight with NOISE of a seed, of a vehicle, in a test or under held inputs."""
    time = SAMPLE * np.arange(round(duration / SAMPLE) + 1)
    inputs = held_inputs(time)
    scenario = open_loop_test(test) if test else held_scenario(time, inputs)
    found = ca.simulate(
        vehicle or true_vehicle(),
        scenario,
        sample=SAMPLE,
        method="RK4",
        step=step,
        duration=duration,
    )
    write(path, found, None if test else inputs, (*MEASURED, *ACTUATORS), seed)


def write(
    path: Path,
    found: xr.Dataset,
    inputs: np.ndarray | None,
    headings: tuple[str, ...],
    seed: int | None,
) -> None:
    """Write a flight with NOISE of a seed, and what acted in it."""
    position, attitude, bend = (found[name].to_numpy() for name in NOISE)
    bend = bend.reshape(len(bend), -1)
    if seed is not None:
        rng = np.random.default_rng(seed)
        position = position + NOISE["position"] * rng.normal(size=position.shape)
        turn = Rotation.from_rotvec(NOISE["attitude"] * rng.normal(size=position.shape))
        attitude = (Rotation.from_quat(attitude) * turn).as_quat()
        bend = bend + NOISE["bend"] * rng.normal(size=bend.shape)
    columns = [found["time"].to_numpy()[:, None] + 12.5, position, attitude, bend]
    table = np.hstack(columns if inputs is None else [*columns, inputs])
    lines = [",".join(headings[: table.shape[1]])]
    lines += [",".join(f"{x:.17g}" for x in row) for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
