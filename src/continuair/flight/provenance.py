"""Provenance of flights as variables of a result.

xarray joins variables, but keeps the attributes of the first flight, or none. So each flight has a
digest of the vehicle and the scenario in its attributes, and the number of its model.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from continuair.kernels.dynamics import MODELS

PROVENANCE, FLOWN_MODEL = "provenance", "flown_model"

_BITS = 52
"""Bits of a digest, which a float holds: xarray converts numbers beside missing ones."""

_OF_DIGEST = {"units": "1", "long_name": "digest of the attributes vehicle and scenario"}
_OF_MODEL = {
    "units": "1",
    "long_name": "model that flew",
    "flag_values": np.arange(len(MODELS), dtype=np.int8),
    "flag_meanings": " ".join(MODELS),
}


def provenance_of(attributes: Mapping[Any, Any], runs: int) -> dict[str, Any]:
    """Return variables (runs,) with the digest of vehicle and scenario, and the model."""
    name = attributes["model"]
    # Models with a coupling removed have no name here.
    model = np.full(runs, MODELS.index(name) if name in MODELS else -1, np.int8)
    return {
        PROVENANCE: (("run",), np.full(runs, _digest_of(attributes)), _OF_DIGEST),
        FLOWN_MODEL: (("run",), model, _OF_MODEL),
    }


def _digest_of(attributes: Mapping[Any, Any]) -> int:
    """Return the digest of the vehicle and the scenario in a result's attributes."""
    told = "\n".join(str(attributes.get(name)) for name in ("vehicle", "scenario"))
    return int.from_bytes(
        hashlib.sha256(told.encode("utf-8", "surrogatepass")).digest()[:8], "big"
    ) >> (64 - _BITS)


def is_joined(flight: xr.Dataset) -> bool:
    """Return whether the attributes of a result are not those of all its flights."""
    return PROVENANCE in flight and _held(flight[PROVENANCE]) != {_digest_of(flight.attrs)}


def model_of(flight: xr.Dataset) -> str:
    """Return the name of the simulated model; empty if a result has none, or several."""
    if "model" in flight.coords and flight["model"].ndim == 0:
        return str(flight["model"].item())
    if FLOWN_MODEL not in flight:
        return str(flight.attrs.get("model", ""))
    held = _held(flight[FLOWN_MODEL])
    return MODELS[int(held.pop())] if len(held) == 1 and held <= set(range(len(MODELS))) else ""


def _held(numbers: xr.DataArray) -> set[float]:
    """Return the distinct numbers that are not missing."""
    values = np.ravel(numbers.to_numpy())
    return set(values[np.isfinite(values)].tolist())
