"""A flight as geometry over frames, for any way of drawing it: world axes, m, N, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.motion import Motion, evenly, motion_of
from continuair.errors import InputError
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.bodies import Bodies, bodies
from continuair.viewer.forces import Force, forces_of, scale_of
from continuair.viewer.sight import Aim, Eye, aim_of, eye_of

Array = NDArray[np.float64]

RATE, LEAST = 60.0, 600
"""Frames per second of flight, and of a flight in all where it is short, as far as there are
samples: those are taken as they are, none in between."""

_SMALLEST = 0.05
"""Bend angle at the end of the scale of colours at least [rad]."""

_LONGEST = 0.5
"""Length of the longest arrow over the arm's."""


@dataclass(frozen=True)
class Scene:
    """What is drawn of a flight, over its frames, and of another model's beside it.

    times (F,) [s]; forces: by what they are; floor: height of the ground that is drawn [m].
    """

    vehicle: Vehicle
    model: str
    times: Array
    bodies: Bodies
    ghost: Bodies | None
    ghost_model: str
    eye: Eye | None
    aim: Aim | None
    forces: dict[str, Force]

    @property
    def reach(self) -> float:
        """Length of the longest arm [m], by which all else is sized."""
        return float(self.vehicle.reach)

    @property
    def largest_bend(self) -> float:
        """Bend angle at the end of the scale of colours [rad]."""
        return max(float(self.bodies.angle.max()), _SMALLEST)

    @property
    def scale(self) -> float:
        """Length of the arrows of forces [m/N]."""
        return scale_of(self.forces, _LONGEST * self.reach)

    @property
    def far(self) -> bool:
        """Whether the flight goes so far that a picture must go with it."""
        return bool(np.ptp(self.bodies.position, axis=0).max() > 6.0 * self.reach)

    @property
    def floor(self) -> float:
        """Height of the ground that is drawn [m]: 0, or below what starts far above or below it."""
        start = min(float(line[0, :, 2].min()) for line in self.bodies.lines)
        lowest = min(float(line[..., 2].min()) for line in self.bodies.lines)
        near = lowest > 0.0 and start < 4.0 * self.reach
        return 0.0 if near else start - 0.5 * self.reach


def scene(
    flight: xr.Dataset,
    vehicle: Vehicle | None = None,
    ghost: xr.Dataset | None = None,
    scenario: Any = None,
    rate: float = RATE,
) -> Scene:
    """Return the geometry of a flight of one run; raises InputError for what is none.

    vehicle: that of the result's attributes by default; ghost: the flight of another model, over
    the same times; scenario: of the flight, from which inputs that are functions of time are known.
    """
    motion = motion_of(flight, vehicle)
    flown, times = motion.vehicle, flight["time"].to_numpy()
    chosen = evenly(times, rate, LEAST)
    placed = _placed(motion, chosen)
    others = None
    if ghost is not None:
        if ghost.sizes.get("time") != len(times):
            raise InputError("ghost has other samples than flight; give flights over equal times.")
        others = _placed(motion_of(ghost, flown), chosen)
    shown = flight.isel(time=chosen)
    return Scene(
        flown,
        _model(flight),
        times[chosen],
        placed,
        others,
        "" if ghost is None else _model(ghost),
        eye_of(shown, flown, placed),
        aim_of(shown),
        forces_of(shown, flown, placed, scenario),
    )


def _model(flight: xr.Dataset) -> str:
    if "model" in flight.coords:
        return str(flight["model"].item())
    return str(flight.attrs.get("model", ""))


def _placed(motion: Motion, chosen: NDArray[np.int64]) -> Bodies:
    """The bodies at some samples; after the last of the motion they stay."""
    seen = motion.rows(np.minimum(chosen, len(motion.time) - 1))
    return bodies(motion.vehicle, seen.position, seen.attitude, seen.bend)
