"""Thrusts of rotors from the signals of their motors, by a thrust curve."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.files import printed, user_path
from continuair.identification.csv_rows import numbers_of, rows_of
from continuair.interfaces.log_signals import Signal
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

_COLUMNS = ("signal", "thrust")
_BEYOND = 0.02
"""Signal beyond the curve's range, over that range, at which the curve still holds its end."""


def thrust_curve(given: Any) -> Array | None:
    """Return a thrust curve (n, 2), signals and thrusts [N], or None.

    Parameters
    ----------
    given : array_like, shape (n, 2), path-like or None
        The curve, or a CSV file with the columns ``signal`` and ``thrust``.

    Returns
    -------
    ndarray or None
        Rows in ascending order of the signals.

    Raises
    ------
    InputError
        If there are fewer than two rows, or signals or thrusts do not ascend.
    """
    if given is None:
        return None
    if isinstance(given, str | os.PathLike):
        file = user_path("thrust_curve", given)
        headings, rows = rows_of("thrust_curve", file)
        given = numbers_of(printed(file), headings, rows, _COLUMNS)
    found = checks.finite_array(given)
    if found is None or found.ndim != 2 or found.shape[1] != 2 or len(found) < 2:
        raise InputError(
            "thrust_curve",
            f"is {shown(given)}",
            "give two or more rows of a signal and its thrust [N]",
        )
    found = found[np.argsort(found[:, 0])]
    if np.diff(found[:, 0]).min() <= 0.0 or np.diff(found[:, 1]).min() < 0.0:
        raise InputError(
            "thrust_curve",
            "has a signal twice, or a thrust that falls as the signal rises",
            "give one rising thrust for each signal [N]",
        )
    return found


def with_rotors(
    vehicle: Vehicle, signals: Mapping[str, Signal], curve: Array | None
) -> dict[str, Signal]:
    """Return signals by role with those of `motors` turned into `rotors`, thrusts [N].

    By the curve (n, 2), or without one by the vehicle's `thrust_model_factor` and greatest thrusts.
    Raises InputError for a curve without motors, and for signals beyond it.
    """
    found = dict(signals)
    if "motors" not in found:
        if curve is not None:
            raise InputError(
                "thrust_curve", "is given without signals of motors", "name a topic for motors"
            )
        return found
    motors, rotors = found.pop("motors"), vehicle.uav.rotors
    assert rotors is not None
    if motors.values.shape[1] != rotors.count:
        raise InputError(
            str(motors.topic),
            f"holds {motors.values.shape[1]} numbers, but the vehicle has {rotors.count} rotors",
            f"name {rotors.count} of its fields",
        )
    least, most = (0.0, 1.0) if curve is None else (curve[0, 0], curve[-1, 0])
    margin = _BEYOND * (most - least)
    seen = motors.values[np.isfinite(motors.values)]
    wrong = seen[(seen < least - margin) | (seen > most + margin)]
    if wrong.size:
        raise InputError(
            str(motors.topic),
            f"holds {wrong[0]:.4g}, but the thrust curve is known from {least:g} to {most:g}",
            f"scale it, as in motors={motors.topic.name}*NUMBER, or give another thrust curve",
        )

    def thrusts(values: Array) -> Array:
        within = np.clip(values, least, most)
        if curve is None:
            return np.asarray(rotors.thrusts_of(within))
        return np.asarray(np.interp(within, *curve.T))

    return found | {"rotors": motors.mapped(thrusts)}


def px4_signals(values: Array, factor: float) -> Array:
    """Return the signals (n, motors) that PX4 sends for normalised thrusts, by its THR_MDL_FAC.

    PX4 takes thrust = f u² + (1 - f) u for the signal u, and sends the thrust itself with f = 0.
    """
    if not 0.0 < factor <= 1.0:
        return values
    half = 0.5 * (1.0 - factor) / factor
    return np.asarray(np.sign(values) * (np.sqrt(half**2 + np.abs(values) / factor) - half))
