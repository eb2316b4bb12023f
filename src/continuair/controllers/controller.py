"""What a controller is: a law in device code, and the gains that each run gives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import FixedDict, Immutable
from continuair.vehicle.vehicle import Vehicle, check_vehicle

REACHED = 1.0 - 1e-6
"""The share of a limit that counts as reached: float32 rounds what a law cuts off there."""

_TOLD_APART = 16
"""Runs of a batch that provenance tells apart, at most."""


@dataclass(frozen=True, eq=False)
class Controller(Immutable):
    """A control law for `Scenario(controller=…)`.

    law: a function of a `LawCode` (kernels/sensing/sense.py) that returns a namespace with `Gains`,
    a Warp struct, and `control(sense, gains) -> Push`, a Warp function; it is called for every
    flight, and what it gives is compiled once, as long as that stays the same. gains: the value of
    every field of `Gains`, for one run; `stack` makes a batch. looks: whether it needs the camera
    and a target. settings: kept as provenance. period: how often it acts [s], the scenario's
    control_period where it is None. guided: whether its law follows set-points, or where it looks
    the target, as kernels/sensing/guided.py has it; latency: how long after it has sensed what it
    acts on the push of such a law acts [s]. asks: of rotors the rank of the wrench, 4 for a lift
    and moments, 6 for forces in any direction too. integral: rate [1/s] at which the error of the
    image, summed up over time, adds to it, for laws that look. believes: the vehicle that the law
    computes with, the one that flies where it is None; see `believing`. at_limits: tells, of gains
    of one run or (runs, …) and pushes (runs, samples, numbers), which parts of these, by name
    (runs, samples), are at a limit. known: those gains of a vehicle of one run, by name, that say
    what vehicle it is; the law can believe in no other. bandwidths: tells, of gains of one run or
    (runs, …), those of position and attitude (..., 2) [rad/s], for a law that tilts to move.
    """

    name: str
    law: Callable[[Any], SimpleNamespace]
    gains: Mapping[str, Any]
    looks: bool = True
    settings: Mapping[str, Any] = field(default_factory=dict)
    runs: int | None = None
    period: float | None = None
    latency: float = 0.0
    guided: bool = False
    integral: float = 0.0
    asks: int = 4
    believes: Vehicle | None = None
    at_limits: Callable[[Mapping[str, Any], np.ndarray], dict[str, np.ndarray]] | None = None
    known: Callable[[Vehicle], Mapping[str, np.ndarray]] | None = None
    bandwidths: Callable[[Mapping[str, Any]], np.ndarray] | None = None

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise InputError(f"law is {shown(self.law)}; give a function of the device code.")
        if not isinstance(self.gains, Mapping):
            raise InputError(
                f"gains is {shown(self.gains)}; give a value by name for every field of Gains."
            )
        gains = {name: self._gain(name, value) for name, value in self.gains.items()}
        object.__setattr__(self, "gains", FixedDict(gains))
        object.__setattr__(self, "settings", FixedDict(self.settings))
        self._check_timing()

    def _check_timing(self) -> None:
        """Raise InputError for what the law would not heed."""
        if self.period is not None:
            checks.positive("period", self.period, " [s], or None for the scenario's")
        if checks.number("latency", self.latency, least=0.0) and not self.guided:
            raise InputError(
                f"latency is {shown(self.latency)}, but the controller {self.name} is not guided, "
                "and acts at once; give 0, or guided=True and a law with a Memory."
            )
        if self.guided and self.period is None:
            raise InputError(
                f"period is None, but the controller {self.name} is guided; give seconds."
            )
        if checks.number("integral", self.integral, least=0.0) and (self.guided or not self.looks):
            raise InputError(
                f"integral is {shown(self.integral)}, but the controller {self.name} sums up no "
                "error of the image; give 0."
            )

    def _gain(self, name: str, value: Any) -> np.ndarray:
        found = checks.finite_array(value)
        if found is None:
            raise InputError(
                f"{name} of the controller {self.name} is {shown(value)}; give finite gains."
            )
        return checks.frozen(found)

    def believing(self, vehicle: Vehicle) -> Controller:
        """The same law, but computing with this vehicle, whatever flies: with its weight, its
        Jacobians, its camera's mount and intrinsics.

        vehicle: one, or one per run, that `replace` made of the one that flies; with its rotors and
        drag, which no law computes with, or the flight raises InputError. What is measured stays
        true: the state, the depths, and images in pixels, that of the goal among them. Gains are
        those that the controller was made with. Raises InputError, also of a flight controller that
        was made for another mass or inertia, which are among its gains.
        """
        check_vehicle(vehicle)
        if self.known is not None:
            for run in range(max(vehicle.runs or 1, self.runs or 1)):
                self._check_known(vehicle.select(min(run, (vehicle.runs or 1) - 1)), run)
        return replace(self, believes=vehicle)

    def _check_known(self, vehicle: Vehicle, run: int) -> None:
        """Raise InputError where a vehicle of one run is not what the gains of this run say."""
        assert self.known is not None
        for name, value in self.known(vehicle).items():
            gain = self.gains[name]
            gain = gain if self.runs is None else gain[min(run, self.runs - 1)]
            if not np.allclose(gain, value, rtol=1e-6, atol=1e-6 * np.abs(value).max()):
                raise InputError(
                    f"vehicle has {name} {shown(_plain(value))}, but the controller {self.name} "
                    f"was made for {shown(_plain(gain))}, which it keeps; make it for the vehicle "
                    "that it is to believe in."
                )

    def describe(self) -> dict[str, Any]:
        """Name and settings as JSON can hold them."""
        told = {} if self.believes is None else {"believes": self.believes.describe()}
        return {"name": self.name, **{k: _plain(v) for k, v in self.settings.items()}, **told}


def stack(controllers: Sequence[Controller]) -> Controller:
    """One controller for a batch: run i flies with the gains of controllers[i], all of one law."""
    if (
        not isinstance(controllers, (list, tuple))
        or not controllers
        or any(not isinstance(c, Controller) for c in controllers)
    ):
        raise InputError(f"controllers is {shown(controllers)}; give one Controller per run.")
    first = controllers[0]
    for other in controllers:
        if other.runs is not None:
            raise InputError(
                f"controllers holds {other.name} for {other.runs} runs already; give one "
                "Controller per run, each of one run."
            )
        if other.law is not first.law:
            raise InputError(
                f"controllers holds the laws {first.name} and {other.name}; stack controllers of "
                "one law."
            )
        for name in {**first.gains, **other.gains}:
            one, two = (np.shape(c.gains.get(name, ())) for c in (first, other))
            if one != two:
                raise InputError(
                    f"controllers holds gains {name} of shapes {one} and {two}; stack controllers "
                    "for as many points each."
                )
        if other.integral != first.integral:
            raise InputError(
                f"controllers have integral {first.integral:g} and {other.integral:g}; give all of "
                "them the same."
            )
        for name in ("looks", "guided", "asks", "at_limits", "bandwidths"):
            one, two = (getattr(each, name) for each in (first, other))
            if one != two:
                raise InputError(
                    f"controllers have {name} {one} and {two}; give all of them the same."
                )
        if other.believes is not first.believes:
            raise InputError(
                "controllers believe in different vehicles; stack them first, and let the stack "
                "believe in a batch."
            )
        if (other.period, other.latency) != (first.period, first.latency):
            raise InputError(
                f"controllers act every {first.period} s, {first.latency} s late, and every "
                f"{other.period} s, {other.latency} s late; give all of them the same rate and "
                "latency."
            )
    gains = {
        name: np.stack([np.asarray(c.gains[name]) for c in controllers]) for name in first.gains
    }
    few = len(controllers) <= _TOLD_APART
    settings = {"runs": [c.describe() for c in controllers]} if few else {}
    return replace(first, gains=gains, settings=settings, runs=len(controllers))


def over_runs(
    first: Controller, gains: Mapping[str, np.ndarray], settings: Mapping[str, np.ndarray]
) -> Controller:
    """A controller for a batch: the first run's, with gains and settings (runs, …) that differ."""
    runs = len(next(iter(gains.values())))
    found = {
        name: gains.get(name, np.broadcast_to(value, (runs, *np.shape(value))))
        for name, value in first.gains.items()
    }
    told = {}
    if runs <= _TOLD_APART:
        own = [{name: _plain(rows[run]) for name, rows in settings.items()} for run in range(runs)]
        told = {"runs": [first.describe() | each for each in own]}
    return replace(first, gains=found, settings=told, runs=runs)


def gain_matrix(name: str, value: Any, size: int) -> np.ndarray:
    """A (size, size) gain from a scalar, a diagonal (size,) or a matrix; SPD, or InputError."""
    array = checks.finite_array(value)
    if array is None or array.shape not in ((), (size,), (size, size)):
        raise InputError(
            f"{name} is {shown(value)}; give a finite number, {size} of them, or {size} rows of "
            f"{size} (twice the number of feature points)."
        )
    return definite(name, array if array.ndim == 2 else array * np.eye(size))


def definite(name: str, matrices: np.ndarray) -> np.ndarray:
    """Gains (..., size, size) made symmetric to the last bit; SPD, or InputError."""
    turned = matrices.swapaxes(-1, -2)
    off, largest = (np.abs(each).max((-2, -1)) for each in (matrices - turned, matrices))
    if (off > 1e-9 * largest).any():
        raise InputError(f"{name} is not symmetric; give a symmetric positive definite matrix.")
    # Halves first: the sum of large ones may be infinite.
    symmetric: np.ndarray = matrices / 2 + turned / 2
    smallest = np.linalg.eigvalsh(symmetric)[..., :1].ravel()
    if not (smallest > 0.0).all():
        raise InputError(
            f"{name} has the eigenvalue {smallest[~(smallest > 0.0)][0]:.6g}; give a symmetric "
            "positive definite gain."
        )
    return symmetric


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
