"""The vehicles among which the paper's is sought: free parameters, their bounds, and why those."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from continuair.vehicle.section import Section
from continuair.vehicle.uav import Uav
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


@dataclass(frozen=True)
class Parameter:
    """A parameter that the paper leaves open; searched on a logarithmic scale if `log`."""

    name: str
    lower: float
    upper: float
    units: str
    why: str
    log: bool = True

    def at(self, share: Array) -> Array:
        """Values at shares 0 to 1 of the way from the lower to the upper bound."""
        if self.log:
            return self.lower * (self.upper / self.lower) ** share
        return self.lower + (self.upper - self.lower) * share


PARAMETERS = (
    Parameter("uav_mass", 0.8, 5.0, "kg", "the paper sweeps 1 to 3 kg"),
    Parameter(
        "gyration", 0.05, 0.25, "m", "radius of gyration across; frames of such mass have 0.08-0.15"
    ),
    Parameter(
        "yaw_ratio", 1.0, 1.98, "-", "axial over transverse inertia; no body exceeds 2", log=False
    ),
    Parameter("length", 0.3, 1.6, "m", "the paper's longest arm is 1.5 m"),
    Parameter("radius", 0.5e-3, 10e-3, "m", "the paper sweeps 1 to 10 mm"),
    Parameter("density", 1000.0, 8000.0, "kg/m³", "from polymers to steel"),
    Parameter(
        "youngs_modulus", 1e9, 210e9, "Pa", "from polymers to steel; the paper has 40 to 207"
    ),
    Parameter("damping_ratio", 1e-4, 0.3, "-", "of the clamped first mode; 0.3 is rubber"),
    Parameter(
        "tip_mass", 1e-3, 0.3, "kg", "disks and camera; the paper neglects the disks (Assumption 1)"
    ),
    Parameter("mount_z", -0.15, 0.15, "m", "the arm's base on the UAV's axis", log=False),
    Parameter("kappa_s", 1e-4, 5e-2, "1/m", "below the initial bend of 0.1 1/m"),
)
"""The free parameters, in the order of the columns of `vehicles`."""

ACTIVE = 0.01
"""A parameter within this share of its range from a bound is reported as held by it."""


def values(shares: Array) -> dict[str, Array]:
    """Name -> values (runs,) of rows (runs, parameters) of shares in [0, 1]."""
    columns = zip(PARAMETERS, np.transpose(shares), strict=True)
    return {parameter.name: _six_digits(parameter.at(column)) for parameter, column in columns}


def vehicles(shares: Array) -> Vehicle:
    """The batched vehicle of rows (runs, parameters) of shares in [0, 1]."""
    at = values(shares)
    across = _six_digits(at["uav_mass"] * at["gyration"] ** 2)
    axial = _six_digits(at["yaw_ratio"] * across)
    mount = np.zeros((len(across), 3))
    mount[:, 2] = at["mount_z"]
    changes = {
        "uav.mass": at["uav_mass"],
        "uav.inertia": np.stack([across, across, axial], -1)[:, None] * np.eye(3),
        "uav.mount": mount,
        "arm.disks.0.position": at["length"],
        "arm.disks.0.mass": at["tip_mass"],
    }
    names = ("length", "radius", "density", "youngs_modulus", "damping_ratio", "kappa_s")
    changes |= {f"arm.{name}": at[name] for name in names}
    return _template().replace(changes)


def held(share: Array) -> dict[str, str]:
    """Parameters at a bound, and which: {"gyration": "lower"}."""
    found = {}
    for parameter, at in zip(PARAMETERS, share, strict=True):
        if at < ACTIVE or at > 1.0 - ACTIVE:
            found[parameter.name] = "lower" if at < ACTIVE else "upper"
    return found


def _six_digits(numbers: Array) -> Array:
    """Rounded, so that a file of the vehicle is short and yet exactly the vehicle flown."""
    return np.array([float(f"{number:.6g}") for number in numbers])


def _template() -> Vehicle:
    uav = Uav(mass=1.0, inertia=(0.01, 0.01, 0.02))
    arm = Section(
        length=1.0,
        radius=5e-3,
        density=7850.0,
        youngs_modulus=207e9,
        damping_ratio=0.01,
        disks=({"position": 1.0, "mass": 0.0},),
    )
    return Vehicle(name="table1", uav=uav, arm=arm)
