"""A payload that a tip picks up and releases in flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.typing import ArrayLike


@dataclass(frozen=True, kw_only=True)
class Payload(Immutable):
    """A body that a tip carries for a part of the flight.

    Parameters
    ----------
    mass : float or array_like, shape (runs,)
        Its mass [kg].
    attach : float, optional
        Time at which it is picked up [s]. Default: at `place`, or else carried from the start.
    release : float, optional
        Time at which it is released [s].
    place : array_like, shape (3,), optional
        Where it waits, in world axes [m]: the tip picks it up within `reach` of there.
    reach : float, default 0.02
        Distance of the tip from `place` at which it is picked up [m].
    velocity : array_like, shape (3,), default (0, 0, 0)
        Velocity at which it waits, in world axes [m/s].
    centre : array_like, shape (3,), default (0, 0, 0)
        Its centre of mass from the tip, in axes of `tip_attitude`, z out of the tip [m].
    inertia : array_like, shape (3,) or (3, 3), default (0, 0, 0)
        Its inertia about its centre of mass, in the same axes [kg m²].
    arm : int or str, default 0
        Index or name of the arm.

    Raises
    ------
    InputError
        If a field cannot be used.
    """

    mass: ArrayLike
    attach: float | None = None
    release: float | None = None
    place: ArrayLike | None = None
    reach: float = 0.02
    velocity: ArrayLike = (0.0, 0.0, 0.0)
    centre: ArrayLike = (0.0, 0.0, 0.0)
    inertia: ArrayLike = (0.0, 0.0, 0.0)
    arm: int | str = 0

    def __post_init__(self) -> None:
        mass = checks.finite_array(self.mass)
        if mass is None or mass.ndim > 1 or not mass.size or not (mass > 0.0).all():
            raise InputError(
                "payload.mass", f"is {shown(self.mass)}", "give a mass above 0, or one per run [kg]"
            )
        found: dict[str, Any] = {"mass": float(mass) if mass.ndim == 0 else checks.frozen(mass)}
        for name in ("attach", "release"):
            value = getattr(self, name)
            if value is not None:
                found[name] = checks.number(f"payload.{name}", value, least=0.0, otherwise=" [s]")
        found["reach"] = checks.positive("payload.reach", self.reach, " [m]")
        for name in ("velocity", "centre"):
            found[name] = tuple(checks.vector(f"payload.{name}", getattr(self, name), 3).tolist())
        if self.place is not None:
            found["place"] = tuple(checks.vector("payload.place", self.place, 3).tolist())
            if self.attach is not None:
                raise InputError(
                    "payload.place",
                    "and attach are both given",
                    "give the time of the pick-up, or the place at which the tip touches it",
                )
        found["inertia"] = _inertia(self.inertia)
        for name, value in found.items():
            object.__setattr__(self, name, value)
        if self.release is not None and self.release <= (self.attach or 0.0):
            raise InputError(
                "payload.release",
                f"is {self.release:g} s, not after the pick-up at {self.attach or 0.0:g} s",
                "give a later time",
            )

    @property
    def runs(self) -> int | None:
        """Return the number of runs of a batch of masses, else None."""
        return len(self.mass) if isinstance(self.mass, np.ndarray) else None

    @property
    def at_start(self) -> bool:
        """Return whether it is carried from the start."""
        return self.place is None and not self.attach

    def within(self, jumps: tuple[float, ...], duration: float) -> tuple[float, ...]:
        """Return the jumps of a flight, with the times of pick-up and release.

        Parameters
        ----------
        jumps : tuple of float
            Times at which inputs jump [s].
        duration : float
            Duration of the flight [s].

        Returns
        -------
        tuple of float
            Times inside the flight, in order [s].
        """
        own = {time for time in (self.attach, self.release) if time and time < duration}
        return tuple(sorted({*jumps, *own}))

    def describe(self) -> dict[str, object]:
        """Return all fields.

        Returns
        -------
        dict of str to object
            Values for JSON.
        """
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(self).items()
        }


def _inertia(value: Any) -> tuple[float, ...]:
    """Return an inertia as nine numbers, or raise InputError."""
    found = checks.finite_array(value)
    if found is not None and found.shape == (3,):
        found = np.diag(found)
    elif found is not None and found.shape == (9,):
        # As a payload keeps it.
        found = found.reshape(3, 3)
    fits = found is not None and found.shape == (3, 3) and np.allclose(found, found.T)
    if not fits or found is None or np.linalg.eigvalsh(found)[0] < 0.0:
        raise InputError(
            "payload.inertia",
            f"is {shown(value)}",
            "give 3 moments of 0 or more, or a symmetric matrix of them [kg m²]",
        )
    return tuple(found.ravel().tolist())
