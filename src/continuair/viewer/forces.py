"""Forces on a vehicle over frames: external forces, rotors, base reactions, tip wrenches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.backbone import placed, turned
from continuair.interfaces.acting import sampled
from continuair.vehicle.vehicle import Vehicle
from continuair.viewer.bodies import Bodies, rotors_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Force:
    """Forces over frames in world axes: origins of arrows (F, n, 3) [m], and values [N]."""

    at: Array
    force: Array

    def arrows(self, scale: float) -> Array:
        """Return their ends (F, n, 2, 3) [m] at a scale [m/N]."""
        force = np.nan_to_num(self.force)
        return np.stack([self.at, self.at + scale * force], axis=-2)


def forces_of(
    flight: xr.Dataset, vehicle: Vehicle, bodies: Bodies, told: dict[str, Any], flying: Any
) -> dict[str, Force]:
    """Return the forces that a result records, by kind; NaN when it is not flying (F,).

    told: fields of its scenario.
    """
    found = {
        "push": _push(flight, vehicle, told, bodies),
        "command": _command(flight, bodies),
        "rotor thrusts": _thrusts(flight, vehicle, bodies),
        "base reaction": _base(flight, bodies),
        "tip force": _tip(flight, vehicle, told, bodies),
        "contact": _contact(flight, bodies),
    }
    acting = {
        name: Force(each.at, np.where(flying[:, None, None], each.force, np.nan))
        for name, each in found.items()
        if each is not None
    }
    return {name: force for name, force in acting.items() if np.nan_to_num(force.force).any()}


def scale_of(forces: dict[str, Force], longest: float) -> float:
    """Return the scale [m/N] with which the largest of all forces is as long as that [m]."""
    sizes = [np.nanmax(np.linalg.norm(each.force, axis=-1)) for each in forces.values()]
    return longest / float(max(sizes)) if sizes else 1.0


def _push(flight: xr.Dataset, vehicle: Vehicle, told: dict[str, Any], bodies: Bodies) -> Force:
    """Return inputs on the UAV, whose arrows begin outside of it."""
    total = np.zeros((flight.sizes["time"], 3))
    for name in ("force", "tau"):
        given = _given(told, name, flight, vehicle)
        total += 0.0 if given is None else given[:, :3]
    size = np.linalg.norm(total, axis=1, keepdims=True)
    # Nothing of the UAV hides the arrow.
    edge = rotors_of(vehicle).edge / np.where(size > 0.0, size, np.inf)
    return Force((bodies.position + edge * total)[:, None], total[:, None])


def _command(flight: xr.Dataset, bodies: Bodies) -> Force | None:
    """Return the force commanded by a controller, if no rotors produce it."""
    if "command" not in flight or "rotor_thrust" in flight:
        return None
    asked = flight["command"].transpose("time", "actuator").to_numpy()[:, :3]
    return Force(bodies.position[:, None], asked[:, None])


def _thrusts(flight: xr.Dataset, vehicle: Vehicle, bodies: Bodies) -> Force | None:
    if "rotor_thrust" not in flight:
        return None
    rotors = rotors_of(vehicle)
    thrust = flight["rotor_thrust"].transpose("time", "rotor").to_numpy()
    at = placed(bodies.position, bodies.attitude, rotors.hubs)
    return Force(at, thrust[..., None] * turned(bodies.attitude, rotors.axes))


def _base(flight: xr.Dataset, bodies: Bodies) -> Force | None:
    if "base_force" not in flight:
        return None
    force = flight["base_force"]
    force = force if "arm" in force.dims else force.expand_dims("arm")
    values = force.transpose("time", "arm", "axis").to_numpy()
    mounts = np.stack([line[:, 0] for line in bodies.lines], axis=1)
    return Force(mounts, turned(bodies.attitude, values))


def _tip(
    flight: xr.Dataset, vehicle: Vehicle, told: dict[str, Any], bodies: Bodies
) -> Force | None:
    given = _given(told, "tip_wrench", flight, vehicle)
    if given is None:
        return None
    wrench = float(told.get("tip_wrench_sign", 1)) * given.reshape(len(given), -1, 6)
    return Force(bodies.tip_position, wrench[..., :3])


def _contact(flight: xr.Dataset, bodies: Bodies) -> Force | None:
    """Return the forces of obstacles on the arms, which begin at their tips."""
    if "contact_force" not in flight:
        return None
    force = flight["contact_force"]
    force = force if "arm" in force.dims else force.expand_dims("arm")
    return Force(bodies.tip_position, force.transpose("time", "arm", "axis").to_numpy())


def _given(told: dict[str, Any], field: str, flight: xr.Dataset, vehicle: Vehicle) -> Array | None:
    """Return an input (F, n), or None if it is absent or not known."""
    value = told.get(field)
    known = value is not None and not isinstance(value, str)
    return sampled(field, value, flight, vehicle) if known else None
