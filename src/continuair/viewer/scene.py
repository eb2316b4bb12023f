"""A flight as geometry over frames, for any way of drawing it: world axes, m, N, s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.backbone import motion_of
from continuair.errors import InputError
from continuair.flight.reading import vehicle_of
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle
from continuair.viewer.bodies import Bodies, bodies
from continuair.viewer.forces import Force, forces_of
from continuair.viewer.sight import Aim, Eye, aim_of, eye_of

Array = NDArray[np.float64]

RATE, LEAST = 60.0, 600
"""Frames per second of flight, and of a flight in all where it is short, as far as there are
samples: those are taken as they are, none in between."""


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
    flown = vehicle_of(flight) if vehicle is None else check_single_vehicle(vehicle)
    check_one_run(flight)
    chosen = frames(flight, rate)
    placed = _placed(flight, flown, chosen)
    others = None
    if ghost is not None:
        check_one_run(ghost)
        if ghost.sizes["time"] != flight.sizes["time"]:
            raise InputError("ghost has other samples than flight; give flights over equal times.")
        others = _placed(ghost, flown, chosen)
    shown = flight.isel(time=chosen)
    return Scene(
        flown,
        _model(flight),
        flight["time"].to_numpy()[chosen],
        placed,
        others,
        "" if ghost is None else _model(ghost),
        eye_of(shown, flown, placed),
        aim_of(shown),
        forces_of(shown, flown, placed, scenario),
    )


def check_one_run(flight: xr.Dataset) -> None:
    """Raise InputError unless a dataset is of one run of one model."""
    extra = [str(dim) for dim in flight.get("bend", flight).dims]
    extra = [dim for dim in extra if dim not in ("time", "section", "bend_axis")]
    if "bend" in flight and extra:
        count = " and ".join(f"{flight.sizes[dim]} by {dim}" for dim in extra)
        given = ", ".join(f"{dim}=0" for dim in extra)
        raise InputError(f"flight holds many: {count}; choose one, as in flight.isel({given}).")


def frames(flight: xr.Dataset, rate: float) -> NDArray[np.int64]:
    """Return indices of the samples that are drawn, the last among them; raises InputError if
    there is nothing to draw."""
    if "time" not in flight.dims or flight.sizes["time"] == 0:
        raise InputError("flight has no samples over time; give a result of continuair.simulate.")
    times = flight["time"].to_numpy()
    count = max(int(np.ceil((times[-1] - times[0]) * rate)) + 1, LEAST)
    if count >= len(times):
        return np.arange(len(times))
    wanted = np.linspace(times[0], times[-1], count)
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    earlier = wanted - times[after - 1] < times[after] - wanted
    return np.unique(after - earlier).astype(np.int64)


def _model(flight: xr.Dataset) -> str:
    if "model" in flight.coords:
        return str(flight["model"].item())
    return str(flight.attrs.get("model", ""))


def _placed(flight: xr.Dataset, vehicle: Vehicle, chosen: NDArray[np.int64]) -> Bodies:
    """The bodies at some samples; after the last finite one they stay."""
    motion = motion_of(flight, vehicle)
    flown = np.all([np.isfinite(x).reshape(len(x), -1).all(-1) for x in motion], axis=0)
    if not flown[0]:
        raise InputError("flight begins with numbers that are not finite; simulate it anew.")
    last = len(flown) - 1 if flown.all() else int(np.argmin(flown)) - 1
    return bodies(vehicle, *(each[np.minimum(chosen, last)] for each in motion))
