"""Rotors of a multirotor, and the drag of its frame."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, field_validator, model_validator

from continuair import checks
from continuair.errors import InputError, shown
from continuair.vehicle.allocation import (
    RANK,
    LayoutName,
    layout_geometry,
    pseudo_inverse,
    wrenches,
)
from continuair.vehicle.fields import (
    Finite,
    NotNegative,
    NotNegativePair,
    NotNegativeVector,
    Part,
    Positive,
    Vector,
)

Array = np.ndarray

AIR_DENSITY = 1.225
"""Density of the standard atmosphere at sea level [kg/m³]."""

WASH_EDGE = 0.5
"""Width of the edge of a rotor's downwash on either side, as a share of the disk's area across the
disk and of its radius along the axis. A discontinuous force would reduce the integrator's order."""

_DEAREST = 40.0
"""Largest thrust per side force, relative to the thrust per lift, at which side forces count as
available; that of six rotors that alternately lean by 3 degrees."""

MOST_ROTORS = 16
"""Most rotors of a vehicle. Kernels are compiled for each number."""


def _at_most_one(value: object) -> float:
    if not checks.is_number(value) or not 0.0 <= value <= 1.0:
        raise ValueError("must be a number from 0 to 1")
    return float(value)


Share = Annotated[float, BeforeValidator(_at_most_one)]


def _spin(value: object) -> int:
    if not checks.is_number(value) or value not in (1, -1):
        raise ValueError("must be 1 or -1")
    return int(value)


def _ascending(limits: tuple[float, float] | None) -> tuple[float, float] | None:
    if limits is not None and not limits[0] < limits[1]:
        raise ValueError("must ascend")
    return limits


class Rotor(Part):
    """Rotor of a list."""

    position: Vector
    """the position of the rotor's hub in body axes, as 3 numbers [m]"""

    axis: Vector = (0.0, 0.0, 1.0)
    """the direction of the thrust in body axes, as 3 numbers [-]"""

    spin: Annotated[int, BeforeValidator(_spin)]
    """1 for a rotor that turns counter-clockwise about its axis, -1 for one that turns clockwise"""

    thrust_limits: NotNegativePair | None = None
    """the minimum and the maximum thrust of this rotor, as 2 numbers, in place of those of
    uav.rotors [N]"""

    @field_validator("thrust_limits")
    @classmethod
    def _ascending(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        return _ascending(value)

    @field_validator("axis")
    @classmethod
    def _unit_length(cls, value: tuple[float, float, float]) -> tuple[float, ...]:
        size = math.sqrt(sum(entry * entry for entry in value))
        if not size > 0.0:
            raise ValueError("must have a length above 0")
        return value if abs(size - 1.0) < RANK else tuple(entry / size for entry in value)


_UNFELT = 1e-6
"""Largest side force that counts as rounding, as a share of the thrusts."""


class Rotors(Part):
    """Rotors that are equal but for their thrust limits, in a named layout or listed one by one.

    Thrusts f produce the force Σ f z and the moment Σ (r × z - s c z) f about B's origin.
    """

    layout: LayoutName | None = None
    """the name of a layout; leave it out to list the rotors"""

    lever: Positive | None = None
    """the distance of each rotor's axis from B's origin, in a layout [m]"""

    height: Finite = 0.0
    """the height of a layout's rotor plane above B's origin [m]"""

    tilt: Finite = 0.0
    """the angle of each rotor about its boom in hex_tilted, with alternating sign [rad]"""

    thrust_limits: NotNegativePair | None = None
    """the minimum and the maximum thrust of one rotor, as 2 numbers; required unless each rotor of
    a list has its own [N]"""

    torque_per_thrust: NotNegative
    """the drag torque of a rotor over its thrust [m]"""

    lag: NotNegative = 0.0
    """the time constant of a rotor's speed, a first-order lag; 0 for none [s]"""

    lag_down: NotNegative | None = None
    """the same of a rotor that slows down; as lag by default [s]"""

    thrust_model_factor: Share = 1.0
    """f of thrust over the greatest = f u² + (1 - f) u, u what follows the command with the lag,
    from 0 to 1: PX4's THR_MDL_FAC; with 1 u is the speed over the greatest [-]"""

    hub_drag: NotNegativePair = (0.0, 0.0)
    """the drag of each rotor at its own greatest speed over its hub's velocity through the air,
    across and along its axis, as 2 numbers: RotorPy's k_d and k_z times that speed in rad/s
    [N s/m]"""

    translational_lift: NotNegative = 0.0
    """the lift of one rotor over the square of its hub's velocity through the air across its axis:
    RotorPy's k_h [N s²/m²]"""

    radius: Positive | None = None
    """the radius of a rotor's disk, from which power and downwash are computed [m]"""

    rotor: tuple[Rotor, ...] | None = None
    """the rotors, a list of tables ([[uav.rotors.rotor]])"""

    @field_validator("thrust_limits")
    @classmethod
    def _ascending(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        return _ascending(value)

    @field_validator("rotor", mode="before")
    @classmethod
    def _rotors(cls, value: object) -> tuple[Rotor, ...] | None:
        if value is None:
            return None
        if not isinstance(value, (list, tuple)) or not 0 < len(value) <= MOST_ROTORS:
            raise ValueError(f"must be a list of 1 to {MOST_ROTORS} rotors")
        found = []
        for index, entry in enumerate(value):
            try:
                found.append(Rotor(**entry) if isinstance(entry, Mapping) else entry)
            except InputError as error:
                raise error.within(f"{index}.") from None
            if not isinstance(found[-1], Rotor):
                raise ValueError(f"must hold tables of fields (entry {index} is not one)")
        return tuple(found)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.layout is None) == (self.rotor is None):
            given = "both given" if self.rotor else "both missing"
            raise InputError("layout", f"and rotor are {given}", "give one of the two")
        if self.thrust_limits is None and any(each is None for each in self._limits):
            raise InputError(
                "thrust_limits",
                "is missing",
                "give the minimum and the maximum thrust of one rotor, as 2 numbers [N]",
            )
        if self.layout is None:
            self._check_list()
        else:
            self._check_layout()
        if self.lag_down is not None and (self.lag == 0.0) != (self.lag_down == 0.0):
            raise InputError(
                "lag",
                f"is {self.lag:g} and lag_down {self.lag_down:g}",
                "give both above 0, or both 0",
            )
        if self.rank < 4:
            raise InputError(
                "torque_per_thrust",
                (
                    f"is {self.torque_per_thrust:g}; with these rotors, lift, roll, pitch "
                    "and yaw are not independent"
                ),
                "give 4 or more, not in line, of both spins",
            )
        return self

    def _check_layout(self) -> None:
        if self.lever is None:
            raise InputError(
                "lever", "is missing", "give the distance of the rotors from B's origin"
            )
        if (self.layout == "hex_tilted") == (self.tilt == 0.0):
            needed = "a tilt other than 0" if self.tilt == 0.0 else "a tilt of 0, or hex_tilted"
            raise InputError("tilt", f"is {self.tilt:g}, but the layout is {self.layout}", needed)

    def _check_list(self) -> None:
        for name, default in (("lever", None), ("height", 0.0), ("tilt", 0.0)):
            value = getattr(self, name)
            if value != default:
                raise InputError(
                    name,
                    f"is {shown(value)}, but belongs to a layout, and the rotors are a list",
                    "leave it out",
                )

    @property
    def count(self) -> int:
        """Return the number of rotors."""
        return self.allocation.shape[-1]

    @property
    def allocation(self) -> Array:
        """Return the allocation matrix (6, rotors), or (runs, 6, rotors) if the geometry varies.

        It maps thrusts [N] to force [N] and moment about B's origin [N m], in body axes.
        """
        return wrenches(*self._geometry(), self.torque_per_thrust)

    @property
    def hubs(self) -> Array:
        """Return the positions of the rotors in body axes (rotors, 3), or (runs, rotors, 3) [m]."""
        return self._geometry()[0]

    @property
    def longest_lever(self) -> Any:
        """Return the largest distance of a hub from the origin [m], an array in a batch."""
        return np.linalg.norm(self.hubs, axis=-1).max(axis=-1)

    @property
    def axes(self) -> Array:
        """Return the directions of the thrusts in body axes (rotors, 3), or (runs, rotors, 3)."""
        return self._geometry()[1]

    @property
    def inverse(self) -> Array:
        """Return the matrix (rotors, 6), or (runs, rotors, 6), from wrenches to thrusts.

        It is the pseudo-inverse of the allocation. If side forces are not available, it is that of
        the rows for lift and moments, which commanded side forces would disturb otherwise.
        """
        whole, upright, free = self._inverses
        return np.where(free[..., None, None], whole, upright)

    @property
    def _inverses(self) -> tuple[Array, Array, Array]:
        """Return both matrices of `inverse`, and whether side forces are available, per run.

        Rotors that lean by little, or whose side forces follow from drag torques alone, need many
        times their lift for a side force, and as much to cancel one.
        """
        allocation = self.allocation
        whole, values = pseudo_inverse(allocation)
        upright = np.zeros_like(whole)
        upright[..., 2:] = pseudo_inverse(allocation[..., 2:, :])[0]
        cost = np.abs(whole[..., :2]).max(axis=(-2, -1))
        cheap = cost <= _DEAREST * np.abs(upright[..., 2]).max(axis=-1)
        return whole, upright, (_ranks(values) == values.shape[-1]) & cheap

    def thrusts_for(self, wrench: Array) -> Array:
        """Return thrusts (..., rotors) [N] for a wrench (..., 6) about B's origin, without limits.

        wrench: force [N] and moment [N m] in body axes. Terms are summed in order, which gives the
        same bits on every processor.
        """
        inverse = self.inverse
        return np.asarray(sum(inverse[..., j] * wrench[..., j, None] for j in range(6)))

    def sideways(self, thrusts: Array) -> Array:
        """Return the force (...) normal to the body's z axis [N]; 0 if it is rounding."""
        found = np.linalg.norm((self.allocation[..., :2, :] @ thrusts[..., None])[..., 0], axis=-1)
        felt = _UNFELT * np.maximum(thrusts.sum(axis=-1), _UNFELT * self.highest.max(axis=-1))
        return np.where(found > felt, found, 0.0)

    @property
    def rank(self) -> int:
        """Return how many of lift, moments and side forces are independent, the least of all runs.

        It is 0 if lift and the three moments are not independent.
        """
        whole, vertical = self.allocation, self.allocation[..., 2:, :]
        ranks = [int(_ranks(pseudo_inverse(each)[1]).min()) for each in (whole, vertical)]
        most = 6 if self._inverses[2].all() else 5
        return min(ranks[0], most) if ranks[1] == 4 else 0

    @property
    def _limits(self) -> list[Any]:
        """Return the limits of each rotor, or one None for those of a layout."""
        return (
            [self.thrust_limits]
            if self.rotor is None
            else [
                self.thrust_limits if each.thrust_limits is None else each.thrust_limits
                for each in self.rotor
            ]
        )

    @property
    def limits(self) -> Array:
        """Return the minimum and maximum thrust of each rotor (rotors, 2) [N].

        They are (runs, rotors, 2) if the limits of a rotor vary.
        """
        each = [np.asarray(limits, float) for limits in self._limits]
        found = np.stack(np.broadcast_arrays(*each), axis=-2)
        return np.broadcast_to(found, (*found.shape[:-2], self.count, 2))

    @property
    def highest(self) -> Array:
        """Return the maximum thrust of each rotor (rotors,), or (runs, rotors) if it varies [N]."""
        return self.limits[..., 1]

    @property
    def greatest_lift(self) -> Array:
        """Return the force of all rotors at their limits along the body's z, () or (runs,) [N]."""
        lift: Array = (self.allocation[..., 2, :] * self.highest).sum(axis=-1)
        return lift

    def limits_field(self, rotor: int) -> str:
        """Return the path of the field that holds the thrust limits of a rotor, by its index."""
        own = self.rotor is not None and self.rotor[rotor].thrust_limits is not None
        return f"uav.rotors.{f'rotor.{rotor}.' if own else ''}thrust_limits"

    @property
    def lags(self) -> tuple[Array, Array]:
        """The time in which a speed follows its command up and down, each (...) [s]."""
        up = np.asarray(self.lag, float)
        return up, up if self.lag_down is None else np.asarray(self.lag_down, float)

    @property
    def moved_by_air(self) -> bool:
        """Whether drag or lift follows from a hub's velocity through the air."""
        return bool(np.any(self.hub_drag) or np.any(self.translational_lift))

    def speeds_of(self, thrusts: Array) -> Array:
        """Speeds over each rotor's greatest (..., rotors) that give thrusts (..., rotors) [N]; what
        follows commands where thrust_model_factor is not 1. Of negative thrusts, negative ones."""
        thrusts = np.asarray(thrusts, float)
        share = thrusts / self.highest
        size, curve = np.abs(share), np.asarray(self.thrust_model_factor, float)[..., None]
        below = (1.0 - curve) + np.sqrt((1.0 - curve) ** 2 + 4.0 * curve * size)
        curved = np.divide(2.0 * size, below, out=np.zeros(below.shape), where=below > 0.0)
        return np.asarray(np.sign(share) * np.where(curve == 1.0, np.sqrt(size), curved))

    def thrusts_of(self, speeds: Array) -> Array:
        """Thrusts (..., rotors) [N] of speeds over the greatest, as `speeds_of`."""
        size, curve = np.abs(speeds), np.asarray(self.thrust_model_factor, float)[..., None]
        share = np.sign(speeds) * size * (curve * size + (1.0 - curve))
        return np.asarray(self.highest * share)

    def power(self, thrust: Array) -> Array:
        """Return the induced power [W] of thrusts [N]; in a batch the first dimension is runs.

        Momentum theory in hover: f^1.5 / √(2 ρ A). The rotors must have a radius.
        """
        area = np.pi * np.square(np.asarray(self.radius, float))
        per_run = np.sqrt(2.0 * AIR_DENSITY * area).reshape(-1, *(1,) * (thrust.ndim - 1))
        return np.asarray(thrust * np.sqrt(thrust) / per_run)

    def _geometry(self) -> tuple[Array, Array, Array]:
        if self.layout is not None:
            assert self.lever is not None
            return layout_geometry(self.layout, self.lever, self.height, self.tilt)
        assert self.rotor is not None
        columns = [
            np.stack(
                np.broadcast_arrays(*(np.asarray(getattr(r, name), float) for r in self.rotor))
            )
            for name in ("position", "axis", "spin")
        ]
        positions, axes = (np.moveaxis(each, 0, -2) for each in columns[:2])
        return positions, axes, np.moveaxis(columns[2], 0, -1)


def _ranks(values: Array) -> Array:
    """Return the ranks (...) of matrices from their singular values (..., rows)."""
    return np.asarray((values > RANK * values.max(axis=-1, keepdims=True)).sum(axis=-1))


class Drag(Part):
    """Drag of frame and rotors, -D v - |v| D₂ v, with v the airspeed vector in body axes."""

    linear: NotNegativeVector = (0.0, 0.0, 0.0)
    """the drag per velocity along the body axes, as 3 numbers [N s/m]"""

    quadratic: NotNegativeVector = (0.0, 0.0, 0.0)
    """the drag per velocity and speed along the body axes, as 3 numbers [N s²/m²]"""
