"""How much of a controlled vehicle's error its numbers explain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from continuair.studies.atlas.controlled import CONTROLLED_RANGES, LOADS
from continuair.studies.atlas.rule import logarithm, products

Array = np.ndarray

TWO = ("coupling",)
"""Variables of the rule of two numbers besides the frequency."""

BESIDES = (
    (),
    *((name,) for name in CONTROLLED_RANGES),
    ("gravity_number", "bandwidth"),
    ("gravity_number", "bandwidth", "mass_ratio"),
)
"""Numbers that are tried besides frequency and coupling."""

DECIDES = 0.75
"""Share of the variance of the error's logarithm that numbers which decide explain, at the least,
under every load."""


def explained(fitted: xr.Dataset, judges: xr.Dataset, loop: str, names: Sequence[str]) -> Array:
    """Return the share (excitation,) of the log error's variance that some numbers explain.

    The numbers include the frequency. Vehicles are ones that were not used in the fit.
    """
    known, seen = (products(each, names) for each in (fitted, judges))
    shares = []
    for load in LOADS:
        one, other = (
            logarithm(each["error"].sel(loop=loop, excitation=load).to_numpy())
            for each in (fitted, judges)
        )
        coefficients = np.linalg.lstsq(known, one.T, rcond=None)[0]
        left = np.sum((other.T - seen @ coefficients) ** 2)
        shares.append(1.0 - left / np.sum((other - other.mean()) ** 2))
    return np.array(shares)
