"""How true the limits of a rule are that is made of controlled vehicles.

Half of the vehicles are fitted, the other half judges. Which are which is drawn: every other point
of a Sobol sequence lies in one half of the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from continuair.analysis.decoupling_rule import allowed, crossing
from continuair.progress import Progress
from continuair.studies.atlas.controlled import (
    CONTROLLED,
    CONTROLLED_RANGES,
    LOADS,
    attitude_bandwidth,
    controlled_vehicle,
    errors_at,
)
from continuair.studies.atlas.explaining import BESIDES, TWO, explained
from continuair.studies.atlas.rule import ENDS, NUMBERS, fit
from continuair.vehicle.runs import take

Array = np.ndarray

TOLERANCES = (0.02, 0.05)
"""Tolerances of errors; the first is the default of `advise`."""

KINDS = {
    "soft, fast": ((0.2, 2.0), (2.0, 4.0)),
    "soft, slow": ((0.2, 2.0), (0.2, 0.7)),
    "stiff, fast": ((0.002, 0.05), (2.0, 4.0)),
    "stiff, slow": ((0.002, 0.05), (0.2, 0.7)),
}
"""Vehicles with a soft or a stiff arm and a fast or a slow loop: ends of their gravity number and
bandwidth."""

SPREAD = (0.1, 0.25, 0.5, 0.75, 0.9)
"""Quantiles over vehicles of the limits that were flown."""

STANDS = ("answered", "unsafe", "fine", "kept")
"""Results of `against` for a rule."""

_BATCH = 256


def halves(flights: xr.Dataset) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the vehicles with a stable loop, in two halves: for the fit and for the test."""
    count = flights.sizes["vehicle"]
    drawn = np.random.default_rng(count).permutation(count)
    fitted, judges = (flights.isel(vehicle=np.sort(each)) for each in np.array_split(drawn, 2))
    return (
        fitted.isel(vehicle=fitted["stable"].to_numpy()),
        judges.isel(vehicle=judges["stable"].to_numpy()),
    )


def limits(flights: xr.Dataset, loop: str, tolerance: float) -> Array:
    """Return frequencies (excitation, vehicle) at which simulated errors first exceed tolerance."""
    frequencies = flights["frequency"].to_numpy()
    errors = flights["error"].sel(loop=loop).to_numpy()
    return np.stack([crossing(frequencies, each, tolerance) for each in errors])


def against(ruled: Array, flown: Array, frequencies: Array) -> dict[str, Array]:
    """Compare a rule's limits (excitation, vehicle) with the simulated ones.

    answered: share of vehicles to which the rule allows any frequency; unsafe: share of these with
    a limit below the rule's; fine: share of all runs, vehicle by frequency, within tolerance when
    decoupled; kept: share of those that the rule allows.
    """
    last = float(np.max(frequencies))
    says, most = ~np.isnan(ruled), np.nan_to_num(flown, nan=0.0)
    unsafe = says & (most < np.minimum(ruled, last))
    allowed = np.nan_to_num(ruled, nan=0.0)
    fine = frequencies[:, None, None] <= most
    kept = fine & (frequencies[:, None, None] <= allowed)
    return {
        "answered": says.mean(axis=1),
        "unsafe": unsafe.sum(axis=1) / np.maximum(says.sum(axis=1), 1),
        "fine": fine.mean(axis=(0, 2)),
        "kept": kept.sum(axis=(0, 2)) / np.maximum(fine.sum(axis=(0, 2)), 1),
    }


def refuted(
    judges: xr.Dataset, ruled: Array, tolerance: float, progress: Progress | None = None
) -> Array:
    """Return which limits (excitation, vehicle) of a rule simulations refute, at or below them.

    ruled: its limits. Every vehicle is simulated at its own limit, in its position loop; the
    frequencies below have been simulated already.
    """
    frequencies = judges["frequency"].to_numpy()
    scanned = judges["error"].sel(loop="position").to_numpy()
    below = frequencies[None, :, None] <= np.nan_to_num(ruled, nan=0.0)[:, None, :]
    found = np.any(below & ~(scanned <= tolerance), axis=1)
    groups = {name: judges[name].to_numpy() for name in CONTROLLED_RANGES}
    vehicle, bandwidths = controlled_vehicle(groups), attitude_bandwidth(groups)
    for i, load in enumerate(LOADS):
        flown = np.flatnonzero(np.isfinite(ruled[i]))
        # Slow flights last longest: they fly with one another.
        flown = flown[np.argsort(ruled[i, flown])]
        for first in range(0, len(flown), _BATCH):
            if progress:
                progress(i * len(flown) + first, len(LOADS) * len(flown), f"{load} at the limits")
            at = flown[first : first + _BATCH]
            errors = errors_at(take(vehicle, at), bandwidths[at], load, ruled[i, at])
            found[i, at] |= ~(errors <= tolerance)
    return found


def judge(flights: xr.Dataset, progress: Progress | None = None) -> xr.Dataset:
    """Fit the rules on one half of the vehicles and test them on the other.

    flights: as `fly_vehicles` returns them. Returns the rule, as `allowed` takes it; explained
    (loop, besides, excitation); STANDS (loop, numbers, excitation, accepted) of the rule and of
    that of two numbers; and limit_spread (loop, accepted, excitation, quantile). Of the position
    loop it returns refuted, answers (excitation, accepted): counts, and ruled_limit and flown_limit
    (excitation, judge) at the first tolerance. By KINDS of vehicles, it returns how many there are
    (kind) and kind_limit (kind, loop, excitation), the median simulated limit at that tolerance.
    """
    fitted, judges = halves(flights)
    rules = {loop: rule_of(fitted, loop, NUMBERS[loop]) for loop in CONTROLLED}
    stands, spread = [], []
    for loop in CONTROLLED:
        both = rule_of(fitted, loop, TWO), rules[loop]
        stands.append([_stands(rule, judges, loop) for rule in both])
        spread.append([_spread(limits(judges, loop, each)) for each in TOLERANCES])
    dims = ("loop", "numbers", "stand", "excitation", "accepted")
    standing = xr.DataArray(stands, dims=dims).transpose("stand", ...)
    shares = [[explained(fitted, judges, loop, (*TWO, *each)) for each in BESIDES]
              for loop in CONTROLLED]  # fmt: skip
    rule = xr.concat(
        [rules[loop] for loop in CONTROLLED],
        "loop",
        data_vars="minimal",
        coords="minimal",
        compat="equals",
        join="outer",
        fill_value=0.0,
    )
    summary = rule.assign(
        {name: standing[place] for place, name in enumerate(STANDS)}
        | {
            "explained": (("loop", "besides", "excitation"), shares),
            "limit_spread": (("loop", "accepted", "excitation", "quantile"), spread),
            "unstable": 1.0 - float(flights["stable"].mean()),
        }
    ).assign_coords(
        accepted=list(TOLERANCES),
        numbers=["two", "all"],
        quantile=list(SPREAD),
        besides=[" ".join(each) for each in BESIDES],
    )
    return xr.merge([summary, kinds(flights), _at_the_limits(summary, judges, progress)])


def kinds(flights: xr.Dataset) -> xr.Dataset:
    """Return the count of vehicles of each of KINDS with a stable loop, and their median limits."""
    stable = flights.isel(vehicle=flights["stable"].to_numpy())
    found = {loop: limits(stable, loop, TOLERANCES[0]) for loop in CONTROLLED}
    gravity, bandwidth = (stable[name].to_numpy() for name in ("gravity_number", "bandwidth"))
    chosen = [
        (low <= gravity) & (gravity <= high) & (slow <= bandwidth) & (bandwidth <= fast)
        for (low, high), (slow, fast) in KINDS.values()
    ]
    medians = [[_spread(found[loop][:, some], (0.5,))[:, 0] for loop in CONTROLLED]
               for some in chosen]  # fmt: skip
    return xr.Dataset(
        {
            "kind_limit": (("kind", "loop", "excitation"), medians),
            "vehicles": ("kind", [int(some.sum()) for some in chosen]),
        },
        {"kind": list(KINDS), "loop": list(CONTROLLED), "excitation": list(LOADS)},
    )


def rule_of(fitted: xr.Dataset, loop: str, names: Sequence[str]) -> xr.Dataset:
    """Return the rule of one loop that uses some numbers, as `allowed` takes it."""
    found = fit(fitted, names, loop)
    kept = NUMBERS["position"]
    return xr.Dataset(
        {
            "coefficients": (("loop", "excitation", "frequency", "term"), found[None]),
            "known": (("loop", "number"), [[name in names for name in kept]]),
            "ends": (("number", "end"), [ENDS[name] for name in kept]),
        },
        {
            "loop": [loop],
            "excitation": list(LOADS),
            "frequency": fitted["frequency"].to_numpy(),
            "number": list(kept),
            "term": np.arange(found.shape[-1]),
        },
    )


def _stands(rule: xr.Dataset, judges: xr.Dataset, loop: str) -> Array:
    """Return the results of `against` for a rule (stand, excitation, accepted)."""
    groups = {str(name): judges[str(name)].to_numpy() for name in rule["number"].to_numpy()}
    frequencies = judges["frequency"].to_numpy()
    found = [
        against(allowed(rule, loop, groups, each), limits(judges, loop, each), frequencies)
        for each in TOLERANCES
    ]
    return np.array([[each[name] for each in found] for name in STANDS]).swapaxes(1, 2)


def _spread(flown: Array, shares: Sequence[float] = SPREAD) -> Array:
    """Quantiles (excitation, quantile) of limits; none is 0, all is infinite, none known NaN."""
    ranked = np.sort(np.nan_to_num(flown, nan=0.0, posinf=np.inf), axis=1)
    if not ranked.shape[1]:
        return np.full((len(ranked), len(shares)), np.nan)
    places = (np.array(shares) * (ranked.shape[1] - 1)).round().astype(int)
    return ranked[:, places]


def _at_the_limits(
    summary: xr.Dataset, judges: xr.Dataset, progress: Progress | None
) -> xr.Dataset:
    """Return the results of simulations at the rule's limits, in the position loop."""
    groups: dict[str, Any] = {name: judges[name].to_numpy() for name in NUMBERS["position"]}
    wrong, answers, kept = [], [], dict[str, Array]()
    for tolerance in TOLERANCES:
        ruled = allowed(summary, "position", groups, tolerance)
        wrong.append(refuted(judges, ruled, tolerance, progress).sum(axis=1))
        answers.append((~np.isnan(ruled)).sum(axis=1))
        kept.setdefault("ruled_limit", ruled)
        kept.setdefault("flown_limit", limits(judges, "position", tolerance))
    data: dict[str, Any] = {
        name: (("excitation", "judge"), values.astype(np.float32)) for name, values in kept.items()
    }
    dims = ("excitation", "accepted")
    data["refuted"] = (dims, np.stack(wrong, axis=-1))
    data["answers"] = (dims, np.stack(answers, axis=-1))
    return xr.Dataset(data)
