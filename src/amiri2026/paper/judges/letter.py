"""Letter M again: with another tolerance or control period, and the coupling along it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from amiri2026.paper.evidence import Evidence
from amiri2026.tracking.study import SAMPLE
from continuair import Vehicle, accelerations, load_gains, simulate
from continuair.analysis import bending_frequencies, mass_distribution, samples
from continuair.equations import interaction_matrix, to_normalised
from continuair.scenario import SETTINGS, equipped, task
from continuair.typing import Model

Array = np.ndarray

NOMINAL = SETTINGS["nominal"]

_LONGEST, _PER_SWING = 1e-3, 20
"""Time between samples whose slopes are taken [s], at most, and samples per swing of the arm, of
which central differences twice lose 3 %, at least."""


def flown(evidence: Evidence, model: str) -> xr.Dataset:
    """Return letter M of the study, over time."""
    return evidence.letter.datasets["nominal"].sel(letter="M", model=model)


def fly(
    evidence: Evidence, model: Model, period: float = 1e-3, sample: float = SAMPLE, **options: Any
) -> xr.Dataset:
    """Return letter M of the study again; period: of control [s]; options: those of `simulate`."""
    vehicle = equipped(evidence.vehicle, NOMINAL)
    controller = load_gains("paper").controller(vehicle)
    scenario = task(vehicle, ["M"], controller, NOMINAL.duration).replace(control_period=period)
    found = simulate(vehicle, scenario, model=model, sample=sample, **options)
    return found.isel(run=0)


def finer(evidence: Evidence, model: Model, *names: str) -> xr.Dataset:
    """Return letter M within a tenth of the study's tolerance, with at least two steps per update.

    names: of the variables to keep.
    """
    return fly(evidence, model, rtol=1e-5, max_step=5e-4, variables=names)


def first_acceleration(vehicle: Vehicle, start: xr.Dataset, plant: Model) -> Array:
    """Return the acceleration of a plant's UAV under the first command, at rest (3,) [m/s²]."""
    attitude, bend, command = (start[name].to_numpy() for name in ("attitude", "bend", "command"))
    force, moment, bend_moment = np.split(command, [3, 6])
    return accelerations(
        vehicle,
        attitude=attitude,
        bend=bend.reshape(1, 2),
        force=force,
        moment=moment,
        bend_moment=bend_moment.reshape(1, 2),
        model=plant,
    )[0]


def image_slopes(flight: xr.Dataset, vehicle: Vehicle) -> Array:
    """Return J_L's columns of the UAV's translation (time, 2n, 3) [1/m].

    They are the image's rate per speed; NaN after the end of a flight.
    """
    attitude = samples(flight, "camera_attitude", "quaternion")
    flying = np.linalg.norm(attitude, axis=-1) > 0.0
    seen = to_normalised(vehicle.camera, samples(flight, "features", "pixel")[flying])
    L = interaction_matrix(seen, samples(flight, "depth", "point")[flying])
    axes = Rotation.from_quat(attitude[flying]).as_matrix()
    slopes: Array = np.full((len(attitude), L.shape[-2], 3), np.nan)
    slopes[flying] = L[..., :3] @ np.swapaxes(axes, -1, -2)
    return slopes


def forces_on_uav(evidence: Evidence) -> tuple[Array, Array]:
    """Coupling force and own force in the UAV's rows [N], (time,) each, at the study's samples.

    The own rows of M q̈ + C q̇ are those of a rigid vehicle whose centre of mass c moves at ċ:
    m (a + ω̇×c + ω×(ω×c) + ω×ċ). The blocks that decoupling zeroes add m (c̈ + ω×ċ).
    """
    names = ("velocity", "angular_velocity", "bend")
    every = _finer(evidence.vehicle)
    fine = SAMPLE / every
    flight = fly(evidence, "coupled", sample=fine, variables=names)
    v, w = (samples(flight, name, "axis") for name in names[:2])
    bend = samples(flight, "bend", "bend_axis")
    c = mass_distribution(evidence.vehicle, bend[None])[0][0]
    moved, turned, slowing = (np.gradient(each, fine, axis=0) for each in (c, w, v))
    a = slowing + np.cross(w, v)
    drift = np.cross(w, moved)
    coupling = np.gradient(moved, fine, axis=0) + drift
    own = a + np.cross(turned, c) + np.cross(w, np.cross(w, c)) + drift
    mass = float(evidence.vehicle.mass)
    first, second = (mass * np.linalg.norm(x, axis=1)[::every] for x in (coupling, own))
    return first, second


def _finer(vehicle: Vehicle) -> int:
    """Return the factor on the study's samples at which they resolve the swings of the arm."""
    swing = 2.0 * np.pi / max(bending_frequencies(vehicle))
    return int(np.ceil(SAMPLE / min(_LONGEST, swing / _PER_SWING) - 1e-9))
