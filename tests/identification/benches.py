"""Recordings of an arm on a bench made by the simulation, with known parameters and noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import continuair as ca
from continuair.identification import Bench, Releases
from continuair.identification.clamped import Clamped

BENCH = Bench(markers=(0.1, 0.15, 0.22, 0.3), base=(0.2, -0.3, 1.1), up="y")
FIELDS = (
    "arm.limb.section.base.bending_stiffness",
    "arm.limb.section.tip.bending_stiffness",
    "arm.limb.section.base.damping",
    "arm.limb.section.tip.damping",
    "arm.limb.section.base.mass_per_length",
)
TRUE = np.array([0.02, 0.008, 8e-4, 3e-4, 0.4])
FRAME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Body axes in axes of the recording, a row each, where y points up."""


def bench_vehicle(**changes: Any) -> ca.Vehicle:
    """Return a vehicle with a limp arm of two arcs, mounted off the centre of mass."""
    values = dict(zip(FIELDS, TRUE, strict=True))
    sections = [
        {
            "name": name,
            "length": 0.15,
            "bending_stiffness": values[f"arm.limb.section.{name}.bending_stiffness"],
            "damping": values[f"arm.limb.section.{name}.damping"],
            "mass_per_length": mass,
        }
        for name, mass in (("base", 0.4), ("tip", 0.2))
    ]
    arm = {"name": "limb", "mount": [0.03, -0.02, -0.05], "section": sections} | changes
    return ca.Vehicle(name="bench", uav={"mass": 1.5, "inertia": [0.02, 0.02, 0.04]}, arm=[arm])


def start_vehicle() -> ca.Vehicle:
    """Return the vehicle where fits start, 10 to 30 % off."""
    factors = np.array([1.2, 0.8, 0.7, 1.3, 1.1])
    return bench_vehicle().replace(dict(zip(FIELDS, (TRUE * factors).tolist(), strict=True)))


def noise(shape: tuple[int, ...], spread: float, kept: float, rng: np.random.Generator) -> Any:
    """Return noise (releases, samples, ...) [m], of which a share is kept from sample to sample."""
    found = rng.normal(0.0, spread, shape)
    for sample in range(1, shape[1]):
        fresh = np.sqrt(1.0 - kept**2) * found[:, sample]
        found[:, sample] = kept * found[:, sample - 1] + fresh
    return found


def released(
    seed: int,
    *,
    vehicle: ca.Vehicle | None = None,
    releases: int = 4,
    samples: int = 80,
    payload: float = 0.0,
    spread: float = 5e-4,
    kept: float = 0.0,
) -> Releases:
    """Return releases from random shapes, with noise of a spread [m]."""
    vehicle = bench_vehicle() if vehicle is None else vehicle
    rng = np.random.default_rng(seed)
    bend = rng.normal(0.0, 2.0, (releases, vehicle.layout.bends))
    blank = tuple(np.zeros((samples, 4, 3)) for _ in range(releases))
    clamped = Clamped(blank, BENCH, 100.0, payload, False, {})
    found = clamped.markers_from(vehicle, np.hstack([bend, 0.0 * bend]))
    mount = np.asarray(vehicle.arms[0].mount)
    placed = (found - mount) @ FRAME + np.asarray(BENCH.base)
    motions = tuple(placed + noise(placed.shape, spread, kept, rng))
    return Releases(
        name=f"carrying {payload:g} kg, seed {seed}", motions=motions, bench=BENCH, payload=payload
    )


def written(path: Path, releases: Releases, *, still: int = 0) -> Path:
    """Write releases to a CSV file; each first rests for some samples where it starts."""
    count = len(np.asarray(releases.bench.markers))
    names = [f"{axis}{marker + 1}" for marker in range(count) for axis in "xyz"]
    lines = [",".join(["ID", *names])]
    for number, motion in enumerate(releases.motions, start=1):
        rows = np.concatenate([np.repeat(motion[:1], still, axis=0), motion])
        for row in rows.reshape(len(rows), 3 * count):
            lines.append(",".join([f"{number}", *(f"{value:.7f}" for value in row)]))
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path
