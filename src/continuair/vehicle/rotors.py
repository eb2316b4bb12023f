"""The rotors of a multirotor, and the drag of its frame."""

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
"""Of the standard atmosphere at sea level [kg/m³]."""

WASH_EDGE = 0.5
"""Part of a disk's radius, and of its area, over which the wash begins on either side of its edge:
air shears there, and a force that jumped would cost the steps their order."""

_DEAREST = 40.0
"""Thrust that a side force may cost, in that of as much lift: of six rotors that lean by 3 degrees
in turn. From there on it counts as none that they give."""

MOST_ROTORS = 16
"""Rotors of a vehicle at most: device code is compiled for each number."""


def _at_most_one(value: object) -> float:
    if not checks.is_number(value) or not 0.0 <= value <= 1.0:
        raise ValueError("must be a number from 0 to 1")
    return float(value)


Share = Annotated[float, BeforeValidator(_at_most_one)]


def _spin(value: object) -> int:
    if not checks.is_number(value) or value not in (1, -1):
        raise ValueError("must be 1 or -1")
    return int(value)


class Rotor(Part):
    """One rotor of a list."""

    position: Vector
    """the position of the rotor's hub in body axes, as 3 numbers [m]"""

    axis: Vector = (0.0, 0.0, 1.0)
    """the direction of its thrust in body axes, as 3 numbers [-]"""

    spin: Annotated[int, BeforeValidator(_spin)]
    """1 for a rotor that turns counter-clockwise about its axis, -1 for one that turns clockwise"""

    @field_validator("axis")
    @classmethod
    def _unit_length(cls, value: tuple[float, float, float]) -> tuple[float, ...]:
        size = math.sqrt(sum(entry * entry for entry in value))
        if not size > 0.0:
            raise ValueError("must have a length above 0")
        return value if abs(size - 1.0) < RANK else tuple(entry / size for entry in value)


_UNFELT = 1e-6
"""Share of the thrusts that a force to the side may have by rounding."""


class Rotors(Part):
    """Equal rotors, in a layout by its name or listed one by one.

    Thrusts f make the force Σ f z and the moment Σ (r × z - s c z) f about B's origin.
    """

    layout: LayoutName | None = None
    """the name of a layout, or leave it out and list the rotors"""

    lever: Positive | None = None
    """the distance of each rotor's axis from B's origin, of a layout [m]"""

    height: Finite = 0.0
    """the height of a layout's rotor plane above B's origin [m]"""

    tilt: Finite = 0.0
    """the angle by which hex_tilted turns each rotor about its boom, with alternating sign [rad]"""

    thrust_limits: NotNegativePair
    """the least and the greatest thrust of one rotor, as 2 numbers [N]"""

    torque_per_thrust: NotNegative
    """the drag torque of a rotor over its thrust [m]"""

    lag: NotNegative = 0.0
    """the time in which a rotor's speed follows its command, of first order; 0 for at once [s]"""

    lag_down: NotNegative | None = None
    """the same of a rotor that slows down; as lag by default [s]"""

    thrust_model_factor: Share = 1.0
    """f of thrust over the greatest = f u² + (1 - f) u, u what follows the command with the lag,
    from 0 to 1: PX4's THR_MDL_FAC; with 1 u is the speed over the greatest [-]"""

    hub_drag: NotNegativePair = (0.0, 0.0)
    """the drag of one rotor at its greatest speed over its hub's velocity through the air, across
    and along its axis, as 2 numbers: RotorPy's k_d and k_z times that speed in rad/s [N s/m]"""

    translational_lift: NotNegative = 0.0
    """the lift of one rotor over the square of its hub's velocity through the air across its axis:
    RotorPy's k_h [N s²/m²]"""

    radius: Positive | None = None
    """the radius of a rotor's disk, from which its power and its wash follow [m]"""

    rotor: tuple[Rotor, ...] | None = None
    """the rotors, a list of tables ([[uav.rotors.rotor]])"""

    @field_validator("thrust_limits")
    @classmethod
    def _ascending(cls, value: tuple[float, float]) -> tuple[float, float]:
        if not value[0] < value[1]:
            raise ValueError("must ascend")
        return value

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
                raise ValueError(f"must hold tables of fields, and its entry {index} is none")
        return tuple(found)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.layout is None) == (self.rotor is None):
            given = "both given" if self.rotor else "both missing"
            raise InputError(f"layout and rotor are {given}; give one of the two.")
        if self.layout is None:
            self._check_list()
        else:
            self._check_layout()
        if self.lag_down is not None and (self.lag == 0.0) != (self.lag_down == 0.0):
            raise InputError(
                f"lag is {self.lag:g} and lag_down {self.lag_down:g}; give both above 0, or both 0."
            )
        if self.rank < 4:
            raise InputError(
                f"torque_per_thrust is {self.torque_per_thrust:g} and the rotors are where they "
                "are, so that lift and the moments of roll, pitch and yaw are not free of each "
                "other; give 4 rotors or more that are not in one line, of both spins, and a "
                "torque_per_thrust above 0."
            )
        return self

    def _check_layout(self) -> None:
        if self.lever is None:
            raise InputError("lever is missing; give the distance of the rotors from B's origin.")
        if (self.layout == "hex_tilted") == (self.tilt == 0.0):
            needed = "a tilt other than 0" if self.tilt == 0.0 else "a tilt of 0, or hex_tilted"
            raise InputError(f"tilt is {self.tilt:g}, but the layout is {self.layout}; {needed}.")

    def _check_list(self) -> None:
        for name, default in (("lever", None), ("height", 0.0), ("tilt", 0.0)):
            value = getattr(self, name)
            if value != default:
                raise InputError(
                    f"{name} is {shown(value)}, but is of a layout, and the rotors are a list; "
                    "leave it out."
                )

    @property
    def count(self) -> int:
        """The number of rotors."""
        return self.allocation.shape[-1]

    @property
    def allocation(self) -> Array:
        """Thrusts [N] to force [N] and moment about B's origin [N m], body axes, (6, rotors); of a
        batch whose geometry varies (runs, 6, rotors)."""
        return wrenches(*self._geometry(), self.torque_per_thrust)

    @property
    def hubs(self) -> Array:
        """Positions of the rotors in body axes (rotors, 3), or (runs, rotors, 3) [m]."""
        return self._geometry()[0]

    @property
    def longest_lever(self) -> Any:
        """The largest distance of a hub from the origin [m]; an array in a batched vehicle."""
        return np.linalg.norm(self.hubs, axis=-1).max(axis=-1)

    @property
    def axes(self) -> Array:
        """Directions of the thrusts in body axes (rotors, 3), or (runs, rotors, 3)."""
        return self._geometry()[1]

    @property
    def inverse(self) -> Array:
        """Wrenches to thrusts (rotors, 6), or (runs, rotors, 6): the pseudo-inverse of the
        allocation, or where side forces are not to be had that of its rows for lift and moments,
        which they would spoil else."""
        whole, upright, free = self._inverses
        return np.where(free[..., None, None], whole, upright)

    @property
    def _inverses(self) -> tuple[Array, Array, Array]:
        """The two of `inverse`, and whether side forces are to be had, of all runs.

        Rotors that lean by little, or whose side forces rest on their drag torques alone, would
        spend many times their lift on them, and as much on having none.
        """
        allocation = self.allocation
        whole, values = pseudo_inverse(allocation)
        upright = np.zeros_like(whole)
        upright[..., 2:] = pseudo_inverse(allocation[..., 2:, :])[0]
        cost = np.abs(whole[..., :2]).max(axis=(-2, -1))
        cheap = cost <= _DEAREST * np.abs(upright[..., 2]).max(axis=-1)
        return whole, upright, (_ranks(values) == values.shape[-1]) & cheap

    def thrusts_for(self, wrench: Array) -> Array:
        """Thrusts (..., rotors) [N] that make a force [N] and a moment about B's origin [N m], body
        axes (..., 6), whatever their limits. Summed in order: the same bits on every processor."""
        inverse = self.inverse
        return np.asarray(sum(inverse[..., j] * wrench[..., j, None] for j in range(6)))

    def sideways(self, thrusts: Array) -> Array:
        """The force (...) across the body's z axis of thrusts (..., rotors) [N]; 0 if rounding."""
        found = np.linalg.norm((self.allocation[..., :2, :] @ thrusts[..., None])[..., 0], axis=-1)
        felt = _UNFELT * np.maximum(thrusts.sum(axis=-1), _UNFELT * np.asarray(self.highest))
        return np.where(found > felt, found, 0.0)

    @property
    def rank(self) -> int:
        """How many of lift, the moments and the side forces are to be had, each by itself, the
        fewest of all runs; 0 where lift and the three moments are not."""
        whole, vertical = self.allocation, self.allocation[..., 2:, :]
        ranks = [int(_ranks(pseudo_inverse(each)[1]).min()) for each in (whole, vertical)]
        most = 6 if self._inverses[2].all() else 5
        return min(ranks[0], most) if ranks[1] == 4 else 0

    @property
    def highest(self) -> Any:
        """The greatest thrust of one rotor [N]; an array in a batched vehicle."""
        return np.transpose(self.thrust_limits)[1]

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
        """Speeds over the greatest (..., rotors) that give thrusts (..., rotors) [N]; what follows
        commands where thrust_model_factor is not 1. Those of negative thrusts are negative."""
        thrusts = np.asarray(thrusts, float)
        share = thrusts / np.asarray(self.highest)[..., None]
        size, curve = np.abs(share), np.asarray(self.thrust_model_factor, float)[..., None]
        below = (1.0 - curve) + np.sqrt((1.0 - curve) ** 2 + 4.0 * curve * size)
        curved = np.divide(2.0 * size, below, out=np.zeros(below.shape), where=below > 0.0)
        return np.asarray(np.sign(share) * np.where(curve == 1.0, np.sqrt(size), curved))

    def thrusts_of(self, speeds: Array) -> Array:
        """Thrusts (..., rotors) [N] of speeds over the greatest, as `speeds_of`."""
        size, curve = np.abs(speeds), np.asarray(self.thrust_model_factor, float)[..., None]
        share = np.sign(speeds) * size * (curve * size + (1.0 - curve))
        return np.asarray(np.asarray(self.highest)[..., None] * share)

    def power(self, thrust: Array) -> Array:
        """Induced power [W] of thrusts [N], those of runs with a leading dimension for them.

        Momentum theory in hover: f^1.5 / √(2 ρ A). radius must be given.
        """
        area = np.pi * np.square(np.asarray(self.radius, float))
        per_run = np.sqrt(2.0 * AIR_DENSITY * area).reshape(-1, *(1,) * (thrust.ndim - 1))
        return np.asarray(thrust * np.sqrt(thrust) / per_run)

    def _geometry(self) -> tuple[Array, Array, Array]:
        if self.layout is not None:
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
    """Ranks (...) of matrices by their singular values (..., rows)."""
    return np.asarray((values > RANK * values.max(axis=-1, keepdims=True)).sum(axis=-1))


class Drag(Part):
    """Drag of frame and rotors: -D v - |v| D₂ v, v the velocity through the air, body axes."""

    linear: NotNegativeVector = (0.0, 0.0, 0.0)
    """the drag per velocity along the body axes, as 3 numbers [N s/m]"""

    quadratic: NotNegativeVector = (0.0, 0.0, 0.0)
    """the drag per velocity and speed along the body axes, as 3 numbers [N s²/m²]"""
