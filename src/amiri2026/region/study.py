"""The region of operation: from which starts a law brings the image to where it belongs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.ladder import climbed
from amiri2026.region.flights import (
    DURATION,
    TARGET,
    Case,
    batches,
    fly,
    kept_of,
)
from amiri2026.region.starts import BENDS, DIRECTIONS, RANDOM, starts
from amiri2026.standard_laws import LAWS, check_gains, law_of
from continuair import MODELS, Gains, Vehicle, checks
from continuair.errors import InputError, shown
from continuair.flight import RESOLVED, is_beyond_limits
from continuair.kernels import OK, PLANTS, STATUS
from continuair.progress import Progress, Steps
from continuair.scenario import SETTINGS, damping_notes, equipped, noise_notes
from continuair.vehicle import COORDINATES, check_one_section

Array = np.ndarray

WELL = 1.0
"""Feature error at the end below which a flight has ended well [px]."""

_FASTEST, _MOST = 1e6, 1_000_000


@dataclass(frozen=True)
class Region:
    """Results of the study.

    results: JSON-able; results["cases"] holds a case per law, model and control rate, with its
    reach in each of its "directions" and the number of its "random" starts that end well. flights:
    every start and how its flights ended, over (law, model, rate, start).
    """

    results: dict[str, Any]
    flights: xr.Dataset


def region(
    vehicle: Vehicle,
    laws: Iterable[str] = tuple(LAWS),
    models: Iterable[str] = PLANTS,
    rates: Iterable[float] = (1000.0,),
    runs: int = 1000,
    seed: int = 0,
    gains: Gains | None = None,
    *,
    progress: Progress | None = None,
) -> Region:
    """Simulate every law from starts off in each direction and at random.

    rates: of control [Hz]; runs, seed: of the random starts; gains: of `load_gains`, instead of the
    preset of their law. progress: called with (done, total, what) before each batch. Raises
    InputError.
    """
    check_one_section(vehicle)
    names, plants = checks.choices("laws", laws, LAWS), checks.choices("models", models, MODELS)
    hertz = _checked_rates(rates)
    checks.whole("runs", runs, 1, _MOST)
    checks.whole("seed", seed, 0)
    flown = equipped(vehicle, SETTINGS["nominal"])
    check_gains(gains, names)
    controllers = {name: law_of(name, flown, gains) for name in names}
    begun = starts(flown, TARGET, runs, seed)
    cases = [Case(*each) for each in product(names, plants, hertz)]
    seen = begun["visible"].to_numpy()
    q = begun["q"].to_numpy()[seen]
    steps = Steps(progress, len(cases) * len(batches(len(q))))
    kept = kept_of(flown)
    flown_all = np.full((len(kept), len(cases), len(seen)), np.nan)
    for place, case in enumerate(cases):
        flown_all[:, place, seen] = fly(flown, case, controllers[case.law], q, steps)
    flights = begun.assign_coords(law=names, model=plants, rate=hertz)
    shape = (len(names), len(plants), len(hertz), len(seen))
    for name, values in zip(kept, flown_all, strict=True):
        flights[name] = (("law", "model", "rate", "start"), values.reshape(shape))
    flights["well"] = (flights["status"] == OK) & (flights["error"] < WELL)
    results = {
        "study": "region",
        "vehicle": vehicle.describe(),
        "notes": [*damping_notes(vehicle), *noise_notes(vehicle)],
        "laws": {name: controllers[name].describe() for name in names},
        "duration_s": DURATION,
        "well_px": WELL,
        "seed": seed,
        "cases": [_found(case, flights) for case in cases],
    }
    return Region(results, flights)


def _checked_rates(rates: Any) -> list[float]:
    found = list(dict.fromkeys(rates))
    if not found:
        raise InputError("rates", "is empty", "give one or more control rates [Hz]")
    for rate in found:
        if not checks.is_number(rate) or not 0.0 < rate <= _FASTEST:
            raise InputError(
                "rates",
                f"holds {shown(rate)}",
                f"give control rates above 0 and up to {_FASTEST:g} [Hz]",
            )
    if len({f"{rate:g}" for rate in found}) < len(found):
        raise InputError(
            "rates",
            f"holds {shown(found)}, of which some are written alike",
            "give control rates that differ in six digits",
        )
    return [float(rate) for rate in found]


def _found(case: Case, flights: xr.Dataset) -> dict[str, Any]:
    """Return the reach of a case."""
    own = flights.sel(law=case.law, model=case.model, rate=case.rate)
    drawn = own.isel(start=np.flatnonzero(own["direction"] == RANDOM))
    well = drawn["well"].to_numpy()
    return {
        "law": case.law,
        "model": case.model,
        "rate_hz": case.rate,
        **_saturated(own),
        "directions": [
            {"direction": name, "bend_1_m": bend, **_reach(own, name, bend)}
            for name in DIRECTIONS
            for bend in BENDS
        ],
        "random": {
            "runs": well.size,
            "well": int(well.sum()),
            "share": float(well.mean()),
            "unresolved": int((drawn["error_estimate"] > RESOLVED).sum()),
            "failures": [_failure(drawn.isel(start=run)) for run in np.flatnonzero(~well)],
        },
    }


def _saturated(own: xr.Dataset) -> dict[str, int]:
    """Return the number of a case's flights in which rotors, if any, saturate."""
    if "largest_saturation" not in own:
        return {}
    return {"saturated": int(is_beyond_limits(own["largest_saturation"].to_numpy()).sum())}


def _reach(own: xr.Dataset, direction: str, bend: float) -> dict[str, Any]:
    """Return largest value up to which all flights end well, the next one, and why that does not;
    and how many of these flights are not resolved."""
    along = (own["direction"] == direction) & (own["start_bend"] == bend)
    ladder = own.isel(start=np.flatnonzero(along))
    good = (ladder["well"] & ladder["visible"]).to_numpy()
    count = climbed(good.tolist())
    values = ladder["off_by"].to_numpy()
    coarse = (ladder["error_estimate"] > RESOLVED).to_numpy()
    found: dict[str, Any] = {
        "unit": DIRECTIONS[direction].unit,
        "reached": float(values[count - 1]) if count else 0.0,
        "unresolved": int(coarse[: count + 1].sum()),
        "failed_at": None,
        "in_view": True,
        "reason": "",
    }
    if count < len(values):
        failed = ladder.isel(start=count)
        found["failed_at"] = float(values[count])
        found["in_view"] = bool(failed["visible"])
        found["reason"] = reason(failed) if found["in_view"] else "points out of view at the start"
    return found


def reason(flight: xr.Dataset) -> str:
    """Return why a flight did not end well."""
    status = int(flight["status"])
    if status != OK:
        return f"{STATUS[status]} at {float(flight['end_time']):.3g} s"
    return f"still up to {float(flight['error']):.3g} px off in the last second"


def _failure(flight: xr.Dataset) -> dict[str, Any]:
    """Return a random start from which a flight did not end well, and why."""
    q = dict(zip(COORDINATES, flight["q"].to_numpy().tolist(), strict=True))
    return {**q, "end_time_s": float(flight["end_time"]), "reason": reason(flight)}
