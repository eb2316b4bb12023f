"""Gains of the paper's law that follow the image of now; kernels/laws/current.py writes the law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.controllers.inertias import camera_inertia
from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle

CAP = (0.5, 0.5)
"""Displacement of the camera from where it is to be beyond which errors pull no harder [m, rad]."""

# Where too few points are in view, the motions that they do not show stay as they are.
_LEAST = 1e-10


@dataclass(frozen=True, eq=False)
class CurrentGains:
    """K_p, K_d and C_d as functions of the image of now, as `design` gives them.

    inertia (6, 6): Λ, what the camera feels, in its axes; floor: ε = μ² s_1² of the desired image;
    cap: displacement [m, rad] beyond which K_p falls, by one factor for all directions.
    """

    inertia: np.ndarray
    bandwidth: float
    damping_ratio: float
    rate_gain: float
    floor: float
    cap: tuple[float, float]

    def fields(self) -> dict[str, Any]:
        """The fields of the law's `Gains` that these give."""
        ω = self.bandwidth
        return {
            "inertia": self.inertia,
            "stiffness": ω**2,
            "damping": 2.0 * self.damping_ratio * ω,
            "rate_gain": self.rate_gain,
            "floor": self.floor,
            "farthest": self.cap[0],
            "widest": self.cap[1],
        }

    def describe(self) -> dict[str, Any]:
        """What provenance keeps of them."""
        names = ("bandwidth", "damping_ratio", "rate_gain", "floor", "cap")
        return {"gains": "current", **{name: getattr(self, name) for name in names}}


def current_gains(
    vehicle: Vehicle, L: np.ndarray, ω: float, ζ: float, μ: float, share: float, cap: Any
) -> CurrentGains:
    """Those of a vehicle; L (2n, 6): at the desired image. The rest is as in `design`."""
    inertia = camera_inertia(vehicle)
    felt, axes = np.linalg.eigh(inertia)
    largest = np.linalg.norm(L @ (axes / np.sqrt(felt)), 2)
    with np.errstate(over="ignore"):
        floor = np.maximum(np.square(μ), _LEAST) * largest**2
        made = np.isfinite([np.square(ω), floor, 2.0 * ζ * ω]).all()
    if not made:
        raise InputError(
            f"bandwidth is {shown(ω)}, which with damping_ratio {shown(ζ)} and conditioning "
            f"{shown(μ)} gives gains that no number holds; give values nearer to 1."
        )
    return CurrentGains(inertia, float(ω), ζ, share, float(floor), _cap(cap))


def _cap(given: Any) -> tuple[float, float]:
    found = checks.finite_array(given)
    if found is None or found.shape != (2,) or not (found > 0.0).all():
        raise InputError(
            f"cap is {shown(given)}; give a distance [m] and an angle [rad], both above 0."
        )
    return float(found[0]), float(found[1])
