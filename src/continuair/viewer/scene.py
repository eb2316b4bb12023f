"""A flight as geometry over frames, for any way of drawing it: world axes, m, N, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.motion import Motion, evenly, motion_of
from continuair.errors import InputError
from continuair.flight.labels import in_order
from continuair.flight.provenance import model_of
from continuair.flight.reading import scenario_of
from continuair.interfaces.acting import told_of, untold_of, warn_of_lacking
from continuair.kernels.step import OK, STATUS
from continuair.scenario.obstacles import Obstacle, obstacles_of
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.bodies import Bodies, bodies, rotors_of
from continuair.viewer.camera import Aim, CameraView, aim_of, camera_view_of
from continuair.viewer.forces import Force, forces_of, scale_of
from continuair.warning import warn

Array = NDArray[np.float64]

RATE, LEAST = 60.0, 600
"""Frames per second of flight, and of a flight in all where it is short, as far as there are
samples: those are taken as they are, none in between."""

_SMALLEST = 0.05
"""Bend angle at the end of the scale of colours at least [rad]."""

_LONGEST = 0.5
"""Length of the longest arrow over the vehicle's size."""

_NEAR, _FAR = 4.0, 6.0
"""Over the reach: what starts lower has the ground at z = 0 in its picture, and what goes farther
takes the picture along."""


_DRAWN = ("force", "tau", "tip_wrench")
"""Inputs whose forces are drawn."""


@dataclass(frozen=True)
class Scene:
    """Geometry of a flight over its frames, and of another model's beside it.

    times (F,) [s]; forces: by kind; flying (F,): whether none has ended; notes: how they ended if
    that was early; obstacles: what the arms touch.
    """

    vehicle: Vehicle
    model: str
    times: Array
    bodies: Bodies
    ghost: Bodies | None
    ghost_model: str
    camera_view: CameraView | None
    aim: Aim | None
    forces: dict[str, Force]
    flying: NDArray[np.bool_]
    notes: tuple[str, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def reach(self) -> float:
        """Length of the longest arm [m], by which pictures are sized."""
        return float(self.vehicle.reach)

    @property
    def size(self) -> float:
        """Of the UAV or its longest arm, the larger [m], by which arrows are sized."""
        return max(self.reach, 2.0 * rotors_of(self.vehicle).edge)

    @property
    def largest_bend(self) -> float:
        """Bend angle at the end of the scale of colours [rad]."""
        return max(float(self.bodies.largest.max()), _SMALLEST)

    @property
    def scale(self) -> float:
        """Length of the arrows of forces [m/N]."""
        return scale_of(self.forces, _LONGEST * self.size)

    @property
    def far(self) -> bool:
        """Whether the flight goes so far that a picture must go with it."""
        return self.is_far(np.ptp(self.bodies.position, axis=0))

    def is_far(self, gone: Array) -> bool:
        """Return whether a way (3,) [m] is too long for a picture that stays."""
        return bool(np.abs(gone).max() > _FAR * self.reach)

    @property
    def floor(self) -> float:
        """Height of the drawn ground [m]: 0, or below a flight that starts far from it."""
        lines = self.bodies.lines or (self.bodies.tip_position,)
        start = min(float(line[0, :, 2].min()) for line in lines)
        lowest = min(float(line[..., 2].min()) for line in lines)
        near = lowest > 0.0 and start < _NEAR * self.reach
        return 0.0 if near else start - 0.5 * self.reach

    @property
    def apart(self) -> Array:
        """Largest distance of the two models' tips (F,) [m], NaN once one of them has ended."""
        if self.ghost is None:
            return np.full(len(self.times), np.nan)
        between = self.bodies.tip_position - self.ghost.tip_position
        return np.where(self.flying, np.linalg.norm(between, axis=-1).max(axis=-1), np.nan)


def scene(
    flight: xr.Dataset,
    vehicle: Vehicle | None = None,
    ghost: xr.Dataset | None = None,
    scenario: Any = None,
    rate: float = RATE,
) -> Scene:
    """Return the geometry of a flight of one run; raises InputError if it is not one.

    vehicle: by default that of the result's attributes; ghost: the flight of another model, over
    the same times; scenario: of the flight, which contains its functions of time.
    """
    motion = motion_of(flight, vehicle)
    flown, times = motion.vehicle, flight["time"].to_numpy()
    flight = in_order(flight, flown)
    chosen = evenly(times, rate, LEAST)
    placed, flying = _placed(motion, chosen), chosen < len(motion.time)
    others, both, notes = None, flying, [early_end(flight, motion, model_of(flight))]
    if ghost is not None:
        other = motion_of(ghost, flown)
        if not np.array_equal(ghost["time"], times):
            raise InputError(
                "ghost", "has other times than flight", "give flights over equal times"
            )
        others, both = _placed(other, chosen), flying & (chosen < len(other.time))
        notes.append(early_end(ghost, other, model_of(ghost)))
    told, shown = told_of(flight, scenario), flight.isel(time=chosen)
    warn_of_lacking(untold_of(told, flight, flown, _DRAWN), 3, "the picture")
    for note in filter(None, notes):
        warn(note, stacklevel=3)
    return Scene(
        flown,
        model_of(flight),
        times[chosen],
        placed,
        others,
        "" if ghost is None else model_of(ghost),
        camera_view_of(shown, flown, placed),
        aim_of(shown),
        forces_of(shown, flown, placed, told, flying),
        both,
        tuple(filter(None, notes)),
        obstacles_of(scenario_of(flight).get("obstacles", ())),
    )


def early_end(flight: xr.Dataset, motion: Motion, model: str) -> str:
    """Return when and why a flight ended before its last sample, empty where it did not."""
    status = int(flight.get("status", OK))
    last = float(motion.time[-1])
    until = float(flight["end_time"]) if status != OK and "end_time" in flight else last
    if len(motion.time) == flight.sizes["time"] and (status == OK or until > last):
        return ""
    why = "its numbers are not finite from then on" if status == OK else STATUS[status]
    return f"the {model} flight ended at {until:.2f} s: {why}".replace("  ", " ")


def _placed(motion: Motion, chosen: NDArray[np.int64]) -> Bodies:
    """Return the bodies at some samples; after the last of the motion they stay."""
    seen = motion.rows(np.minimum(chosen, len(motion.time) - 1))
    return bodies(motion.vehicle, seen.position, seen.attitude, seen.bend)
