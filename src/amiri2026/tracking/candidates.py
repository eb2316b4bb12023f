"""Flights of candidate gains: how far off they are, and why those that are lost are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from continuair import Gains, Vehicle, stack
from continuair.analysis import TRANSIENT, feature_rms, fly_twice
from continuair.kernels import STATUS
from continuair.scenario import SETTINGS, equipped, task
from continuair.typing import Model

Array = np.ndarray

HORIZON = 20.0
"""How much of a letter candidates fly at most [s]; a 50 s M has its first corner after 15 s."""

LOST = 1e6
"""RMS errors that a run which ends early, or where rounding sends it, counts as [px, mm]: losing
one outweighs everything."""

_VARIABLES = ("camera_position", "target_position", "command")


@dataclass(frozen=True)
class Outcomes:
    """Results of candidates (rows) on letters (columns) in one setting on one plant.

    pixels, millimetres: RMS errors of the image and of the tip, at most LOST, the value of failed
    flights; effort: RMS force beyond the weight, as a share of it, 0 of failed flights; why: the
    failure, or "".
    """

    pixels: Array
    millimetres: Array
    effort: Array
    why: Array

    @property
    def held(self) -> Array:
        """Whether no letter of a candidate (rows,) is lost."""
        return np.asarray((self.why == "").all(axis=1))

    @property
    def cost(self) -> Array:
        """Return the objective, a mean over the letters (rows,)."""
        costs = np.log(self.pixels) + np.log(self.millimetres) + np.log1p(self.effort)
        return np.asarray(costs.mean(axis=1))

    def row(self, index: int) -> Outcomes:
        """Return the outcomes of one candidate."""
        one = slice(index, index + 1)
        return Outcomes(self.pixels[one], self.millimetres[one], self.effort[one], self.why[one])


def fly(
    vehicle: Vehicle,
    rows: Sequence[dict[str, Any]],
    letters: Sequence[str],
    setting: str,
    plant: Model,
) -> Outcomes:
    """Fly candidates, settings of `Gains` that make one kind of gains each or all together.

    Of letters that last longer the first `HORIZON`, of which errors count when DS is judged.
    """
    kinds = [row.get("gains", "constant") for row in rows]
    parts, places = [], []
    for kind in dict.fromkeys(kinds):
        at = [place for place, other in enumerate(kinds) if other == kind]
        some = [rows[place] for place in at]
        parts.append(_fly(some, vehicle, letters, setting, plant, HORIZON, TRANSIENT))
        places += at
    order = np.argsort(places)
    return Outcomes(*(np.concatenate(columns)[order] for columns in zip(*parts, strict=True)))


def fly_whole(
    vehicle: Vehicle, row: dict[str, Any], letters: Sequence[str], setting: str, plant: Model
) -> Outcomes:
    """Fly one candidate over whole letters; errors count when those of `tracking` do."""
    settled = SETTINGS[setting].settled
    return Outcomes(*_fly([row], vehicle, letters, setting, plant, np.inf, settled))


def _fly(
    rows: Sequence[dict[str, Any]],
    vehicle: Vehicle,
    letters: Sequence[str],
    setting: str,
    plant: Model,
    horizon: float,
    since: float,
) -> tuple[Array, ...]:
    """Return the columns of `Outcomes` for candidates of one law, flown so long at most [s]."""
    flown = equipped(vehicle, SETTINGS[setting])
    gains = stack([Gains("candidate", row).controller(flown) for row in rows])
    found = []
    for letter in letters:
        scenario = task(flown, [letter], gains, SETTINGS[setting].duration)
        lasts = min(scenario.duration, horizon)
        data, held = fly_twice(
            flown, scenario, _VARIABLES, model=plant, duration=lasts, sample=2e-2
        )
        found.append(_columns(data, held.to_numpy(), 9.81 * float(flown.mass), since))
    return tuple(np.stack(columns, axis=1) for columns in zip(*found, strict=True))


def _columns(data: xr.Dataset, held: Array, weight: float, since: float) -> tuple[Array, ...]:
    """Pixels, millimetres, effort and why (rows,) of one letter; errors count since a time [s]."""
    force = data["command"].isel(actuator=slice(3)) - [0.0, 0.0, weight]
    effort = _root((force**2).sum("actuator").mean("time")) / weight
    late = data.sel(time=slice(since, None))
    off = (late["camera_position"] - late["target_position"]).isel(axis=slice(2))
    metres = _root((off**2).sum("axis", skipna=False).mean("time", skipna=False))
    errors = (feature_rms(late), 1e3 * metres.to_numpy())
    counted = [np.where(held, np.minimum(error, LOST), LOST) for error in errors]
    status, ended = data["status"].to_numpy(), data["end_time"].to_numpy()
    why = [
        "" if kept else _reason(int(code), float(end))
        for kept, code, end in zip(held, status, ended, strict=True)
    ]
    return *counted, np.where(held, effort, 0.0), np.array(why, dtype=object)


def _reason(status: int, ended: float) -> str:
    if status:
        return f"{STATUS[status]} at {ended:.3g} s"
    return "chatters: where it goes hangs on rounding"


def _root(squares: xr.DataArray) -> xr.DataArray:
    return squares**0.5
