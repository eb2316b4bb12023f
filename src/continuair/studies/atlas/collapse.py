"""Curves that show the collapse: vehicles with the same groups, or coupling, err alike."""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair.analysis.groups import PERIOD, coupling, vehicle_of
from continuair.studies.atlas.flights import fly, run_errors

Array = np.ndarray

FREQUENCIES = np.geomspace(0.1, 4.0, 25)
COUPLING = 0.4
_OTHERS = (0.05, 0.15, 0.3, 0.5, 0.65, 0.8)
_MASS_RATIOS = (0.02, 0.2, 0.45)
_SIZES = ((0.01, 1e-5), (0.5, 1.0), (20.0, 1e3))
"""Clamped periods over the atlas's and masses of the UAV [kg]; lengths follow with the period."""

_SAME = {
    "mass_ratio": 0.3,
    "gravity_number": 0.01,
    "slenderness": 0.005,
    "damping_ratio": 0.02,
    "bend": 0.2,
    "load": 0.2,
}


def curves() -> xr.Dataset:
    """Return the decoupled NRMSE of an actuated arm over the frequency (vehicle, frequency).

    same_groups: vehicles of very different length, mass and period; same_coupling: of different
    mass and inertia ratio; others: of other couplings.
    """
    same = _SAME | {"inertia_ratio": 3.0}
    alike, lengths = [], []
    for stretch, mass in _SIZES:
        groups = _over_frequency(same)
        vehicle = vehicle_of(groups, PERIOD * np.sqrt(stretch), mass)
        lengths.append(float(np.max(vehicle.arm.length)))
        alike.append(run_errors("bend", vehicle, groups)[0, :, 0])
    ratios = [inertia_for(COUPLING, mass) for mass in _MASS_RATIOS]
    coupled = [
        _curve(_SAME | {"mass_ratio": mass, "inertia_ratio": ratio})
        for mass, ratio in zip(_MASS_RATIOS, ratios, strict=True)
    ]
    others = [
        _curve(_SAME | {"mass_ratio": 0.05, "inertia_ratio": inertia_for(c, 0.05)}) for c in _OTHERS
    ]
    return xr.Dataset(
        {
            "same_groups": (("vehicle", "frequency"), np.array(alike)),
            "same_coupling": (("vehicle", "frequency"), np.array(coupled)),
            "others": (("other", "frequency"), np.array(others)),
            "length": ("vehicle", lengths),
            "mass_ratio": ("vehicle", list(_MASS_RATIOS)),
            "inertia_ratio": ("vehicle", ratios),
            "coupling": COUPLING,
        },
        {"frequency": FREQUENCIES},
    )


def inertia_for(strength: float, mass_ratio: float) -> float:
    """Return the inertia ratio of the vehicles of a mass ratio that have a coupling."""
    low, high = 1e-4, 1e3
    for _ in range(60):
        middle = np.sqrt(low * high)
        shape = _SAME | {"mass_ratio": mass_ratio, "inertia_ratio": middle}
        found = coupling(vehicle_of({name: np.array([v]) for name, v in shape.items()}))[0]
        low, high = (middle, high) if found < strength else (low, middle)
    return float(middle)


def _curve(groups: dict[str, float]) -> Array:
    found: Array = fly("bend", _over_frequency(groups))["nrmse"].to_numpy()[:, 0]
    return found


def _over_frequency(groups: dict[str, float]) -> dict[str, Array]:
    rows = {name: np.full(len(FREQUENCIES), value) for name, value in groups.items()}
    return rows | {"frequency": FREQUENCIES}
