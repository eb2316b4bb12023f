"""How the shape of an arm was measured on a bench: the frame of the markers, and their places."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.typing import Array, ArrayLike
from continuair.vehicle.vehicle import BENCH, Vehicle, read_table

_UP = {
    "x": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "y": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    "z": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "-x": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
    "-y": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    "-z": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
}
"""Body axes of the UAV in axes of the recording, a row each, by the axis that points up."""


@dataclass(frozen=True, kw_only=True)
class Bench(Immutable):
    """Where an arm hung while it was measured, on a base that did not move.

    Parameters
    ----------
    markers : array_like, shape (markers,)
        Distances of the markers along the arm from its base, ascending [m].
    base : array_like, shape (3,), default (0, 0, 0)
        Base of the arm in axes of the recording [m].
    up : {"x", "y", "z", "-x", "-y", "-z"}, default "z"
        Axis of the recording that points up. The body's x is the recording's x, or its y (z) where
        x (-x) is up.
    payload_centre : array_like, shape (3,), default (0, 0, 0)
        Centre of mass of what the tip carries, from the tip, z out of the tip [m].

    Raises
    ------
    InputError
        If a field cannot be used.
    """

    markers: ArrayLike
    base: ArrayLike = (0.0, 0.0, 0.0)
    up: str = "z"
    payload_centre: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        found: dict[str, Any] = {}
        for name in ("base", "payload_centre"):
            found[name] = tuple(checks.vector(f"bench.{name}", getattr(self, name), 3).tolist())
        markers = checks.finite_array(self.markers)
        if (
            markers is None
            or markers.ndim != 1
            or not markers.size
            or not ((np.diff(markers, prepend=0.0) > 0.0).all())
        ):
            raise InputError(
                "bench.markers",
                f"is {shown(self.markers)}",
                "give ascending distances above 0 along the arm from its base [m]",
            )
        found["markers"] = tuple(markers.tolist())
        checks.choice("bench.up", self.up, _UP)
        for name, value in found.items():
            object.__setattr__(self, name, value)

    def in_body(self, positions: Array, mount: ArrayLike) -> Array:
        """Return positions (..., 3) of the recording in body axes of a UAV, the arm at its mount.

        Parameters
        ----------
        positions : ndarray, shape (..., 3)
            Positions in axes of the recording [m].
        mount : array_like, shape (3,)
            Base of the arm in body axes [m].

        Returns
        -------
        ndarray, shape (..., 3)
            Positions in body axes [m].
        """
        turned: Array = (positions - np.asarray(self.base)) @ np.array(_UP[self.up], float).T
        return turned + np.asarray(mount)

    def describe(self) -> dict[str, object]:
        """Return the fields, for a file.

        Returns
        -------
        dict
            All fields by name.
        """
        return {
            "markers": list(np.asarray(self.markers).tolist()),
            "base": list(np.asarray(self.base).tolist()),
            "up": self.up,
            "payload_centre": list(np.asarray(self.payload_centre).tolist()),
        }


def load_bench(path: str | os.PathLike[str]) -> Bench:
    """Return the `[bench]` table of a vehicle's file.

    Parameters
    ----------
    path : str or path-like
        As for `load_vehicle`: a .toml file with a table `[bench]` of the fields of `Bench`.

    Returns
    -------
    Bench
        How its arm was measured.

    Raises
    ------
    InputError
        If there is no such file or table, or a field cannot be used.
    """
    fields, file = read_table(path, BENCH)
    if not isinstance(fields, Mapping) or not all(isinstance(name, str) for name in fields):
        raise InputError(
            "[bench]", "is missing", "name base, up and markers of the measured arm in it"
        ).located(file)
    try:
        return Bench(**fields)
    except TypeError:
        names = ", ".join(Bench.__dataclass_fields__)
        raise InputError(
            "[bench]", f"has {', '.join(fields)}", f"give {names}, of which only markers is needed"
        ).located(file) from None
    except InputError as error:
        raise error.located(file) from None


def markers_of(vehicle: Vehicle, bench: Bench) -> Array:
    """Return the distances (markers,) [m]; raise InputError unless they lie on the only arm."""
    if len(vehicle.arms) != 1:
        raise InputError(
            "vehicle",
            f"has {len(vehicle.arms)} arms",
            "describe the one that was measured",
        )
    markers, reach = np.asarray(bench.markers), float(np.max(vehicle.reach))
    if markers[-1] > reach * (1.0 + 1e-9):
        raise InputError(
            "bench.markers",
            f"has one at {markers[-1]:g} m, but the arm is {reach:g} m long",
            "give distances from the arm's base [m]",
        )
    return markers
