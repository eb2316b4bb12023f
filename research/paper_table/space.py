"""The vehicles among which Table I is searched: materials, free parameters, bounds and reasons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


@dataclass(frozen=True)
class Material:
    """Density [kg/m³] and the least and greatest Young's modulus [Pa] of a backbone."""

    density: float
    softest: float
    stiffest: float


MATERIALS: Mapping[str, Material] = {
    "Nitinol": Material(6450.0, 28e9, 83e9),
    "titanium": Material(4430.0, 100e9, 125e9),
    "steel": Material(7850.0, 190e9, 215e9),
}
"""What rods of this size are made of. Nitinol: from martensite to austenite."""


@dataclass(frozen=True)
class Parameter:
    """A number that the paper leaves open; on a logarithmic scale if `log`."""

    name: str
    lower: float
    upper: float
    units: str
    why: str
    log: bool = True

    def at(self, share: float) -> float:
        """Return the value at a share 0 to 1 of the way from the lower to the upper bound.

        Six digits, so that a short file holds exactly the vehicle that was flown.
        """
        if self.log:
            return _six_digits(self.lower * (self.upper / self.lower) ** share)
        return _six_digits(self.lower + (self.upper - self.lower) * share)


PARAMETERS = (
    Parameter("uav_mass", 1.0, 5.0, "kg", "the paper sweeps 1 to 3 kg"),
    Parameter("gyration", 0.05, 0.25, "m", "frames of this mass have 0.08 to 0.15 m"),
    Parameter("yaw_ratio", 1.0, 1.98, "-", "axial over transverse inertia, below 2", log=False),
    Parameter("length", 0.3, 1.6, "m", "the longest arm of the paper is 1.5 m"),
    Parameter("radius", 0.5e-3, 10e-3, "m", "the paper sweeps 1 to 10 mm"),
    Parameter("modulus", 0.0, 1.0, "-", "within the range of the material", log=False),
    Parameter("damping_ratio", 1e-4, 0.3, "-", "of the first clamped mode; 0.3 is rubber"),
    Parameter("kappa_s", 1e-4, 5e-2, "1/m", "below the initial curvature of 0.1 1/m"),
)
"""The free parameters, in the order of the shares of a `Design`."""

_AT_BOUND = 0.01


@dataclass(frozen=True)
class Design:
    """A vehicle as shares (8,) in [0, 1] of the bounds of PARAMETERS, and a name in MATERIALS.

    The arm begins at the UAV's centre of mass and has no disks.
    """

    shares: Array
    material: str

    @cached_property
    def vehicle(self) -> Vehicle:
        """The vehicle itself."""
        at = self.describe()
        across = _six_digits(at["uav_mass"] * at["gyration"] ** 2)
        return Vehicle(
            name="found",
            uav=Uav(
                mass=at["uav_mass"],
                inertia=(across, across, _six_digits(at["yaw_ratio"] * across)),
            ),
            arm=Section(
                length=at["length"],
                radius=at["radius"],
                density=MATERIALS[self.material].density,
                youngs_modulus=at["youngs_modulus"],
                damping_ratio=at["damping_ratio"],
                kappa_s=at["kappa_s"],
            ),
        )

    def describe(self) -> dict[str, Any]:
        """Return the material and the values of the parameters by name, as JSON holds them."""
        found: dict[str, Any] = {"material": self.material}
        pairs = zip(PARAMETERS, self.shares, strict=True)
        found |= {parameter.name: parameter.at(float(share)) for parameter, share in pairs}
        stuff = MATERIALS[self.material]
        modulus = stuff.softest + (stuff.stiffest - stuff.softest) * found.pop("modulus")
        return found | {"youngs_modulus": _six_digits(modulus)}

    def held(self) -> dict[str, str]:
        """Return the parameters at a bound, and which one: {"gyration": "lower"}."""
        pairs = [(p.name, s) for p, s in zip(PARAMETERS, self.shares, strict=True)]
        low = {name: "lower" for name, share in pairs if share < _AT_BOUND}
        return low | {name: "upper" for name, share in pairs if share > 1.0 - _AT_BOUND}


def drawn(rng: np.random.Generator) -> Design:
    """Return a vehicle drawn uniformly from materials and shares."""
    shares = rng.random(len(PARAMETERS))
    return Design(shares, list(MATERIALS)[rng.integers(len(MATERIALS))])


def _six_digits(value: float) -> float:
    return float(f"{value:.6g}")
