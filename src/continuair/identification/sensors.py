"""Predicted measurements of an inertial measurement unit along simulated flights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from continuair.engine.engine import Drive, Engine, Start
from continuair.typing import Array
from continuair.vehicle.coordinates import branches_in

_ROWS_AT_ONCE = 1 << 14
"""Most states whose rates are computed at once, as each has a copy of its vehicle's data."""

_UP = np.array([0.0, 0.0, 1.0])


def specific_force(
    attitude: Array,
    acceleration: Array,
    angular_velocity: Array,
    angular_acceleration: Array,
    place: Array,
    gravity: float,
) -> Array:
    """Return what an ideal accelerometer measures (n, 3), in body axes [m/s²].

    attitude (n, 4): x y z w, body to world; acceleration (n, 3): dv/dt of B's origin in world axes;
    the angular ones (n, 3) and place (3,), that of the accelerometer, in body axes. At rest it is
    gravity along the world's z axis.
    """
    origin = Rotation.from_quat(attitude).inv().apply(acceleration + gravity * _UP)
    centripetal = np.cross(angular_velocity, np.cross(angular_velocity, place))
    felt: Array = origin + np.cross(angular_acceleration, place) + centripetal
    return felt


def accelerometer(engine: Engine, log: Array, at_samples: Drive, place: Array) -> Array:
    """Return accelerometer values (runs, samples, 3) along logged rows (runs, samples, log).

    The state's rates are those of the engine's model, under the inputs at the samples. NaN where
    the log is.
    """
    felt = np.full((*log.shape[:2], 3), np.nan)
    size = max(1, _ROWS_AT_ONCE // log.shape[1])
    for first in range(0, len(log), size):
        part = slice(first, first + size)
        felt[part] = _of_runs(engine, first, log[part], at_samples, place)
    return felt


def _of_runs(engine: Engine, first: int, log: Array, at_samples: Drive, place: Array) -> Array:
    """Return accelerometer values (runs, samples, 3) of runs from the first, all rows at once."""
    layout, (runs, samples) = engine.layout, log.shape[:2]
    rows = log.reshape(-1, log.shape[-1])
    flown = np.isfinite(rows).all(axis=1)
    states = rows[:, : layout.state]
    start = Start(states, branches_in(rows, layout))
    drive = _for_each_row(at_samples, runs, samples)
    vehicles = np.repeat(np.arange(first, first + runs), samples)
    rates = engine.derivative(start, drive, vehicles, compiled=True)
    found = np.full((len(rows), 3), np.nan)
    found[flown] = specific_force(
        states[flown, layout.attitude],
        rates[flown, layout.velocity],
        states[flown, layout.angular_velocity],
        rates[flown, layout.angular_velocity],
        place,
        drive.gravity,
    )
    return found.reshape(runs, samples, 3)


def _for_each_row(drive: Drive, runs: int, samples: int) -> Drive:
    """Return inputs at samples, the same for all runs, as constant ones of runs * samples runs."""
    table = np.broadcast_to(drive.table, (samples, 1, drive.table.shape[-1]))
    return replace(drive, table=np.tile(table[:, 0], (runs, 1))[None], timed=False)
