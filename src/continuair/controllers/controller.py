"""Controllers: a law in device code, and the gains of each run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import FixedDict, Immutable
from continuair.typing import ArrayLike
from continuair.vehicle.vehicle import Vehicle, check_vehicle

if TYPE_CHECKING:
    from continuair.kernels.sensing.sense import LawCode

Values: TypeAlias = Mapping[str, Any]
"""Gains or settings by name: numbers, words or arrays."""

REACHED = 1.0 - 1e-6
"""Share of a limit that counts as reached, as float32 rounds a saturated value."""

_RECORDED_RUNS = 16
"""Largest batch whose runs are recorded one by one in provenance."""


@dataclass(frozen=True, eq=False)
class Controller(Immutable):
    """A control law for `Scenario(controller=…)`.

    Parameters
    ----------
    name : str
        Name in results and errors.
    law : callable
        Function of a `LawCode` (kernels/sensing/sense.py) that returns a namespace with `Gains`, a
        Warp struct, and `control(sense, gains) -> Push`, a Warp function. It is called for every
        run; its result is compiled once, as long as it stays the same.
    gains : mapping of str to array_like
        Value of every field of `Gains`, for one run; `stack` makes a batch.
    looks : bool, default True
        Whether the law needs the camera and a target.
    settings : mapping, optional
        Settings recorded as provenance.
    runs : int, optional
        Number of runs of a batch; None for one run.
    period : float, optional
        Sampling period [s]. Default: the scenario's control_period.
    latency : float, default 0.0
        Delay from sensing to actuation [s], for guided laws only.
    guided : bool, default False
        Whether the law follows set-points, or the target if `looks`; see kernels/sensing/guided.py.
    integral : float, default 0.0
        Rate at which the integrated image error adds to the error [1/s], for laws with `looks`.
    asks : {4, 6}, optional
        Rank of the wrench that rotors must produce: 4 for thrust and moments, 6 for any force too.
        Default: unknown; `simulate` warns where rotors cannot produce a force across their thrust.
    bends : bool, default True
        Whether it exerts bend moments. If not, tendons keep to their own commands.
    believes : Vehicle, optional
        Nominal model of the law. Default: the simulated vehicle; see `believing`.
    at_limits : callable, optional
        From gains of one run or (runs, …) and actuator wrenches (runs, samples, numbers) to a dict
        of arrays (runs, samples): which parts, by name, are at a limit.
    known : callable, optional
        From a vehicle of one run to those gains, by name, that depend on it. The nominal model must
        agree with them.
    bandwidths : callable, optional
        From gains of one run or (runs, …) to bandwidths of position and attitude (..., 2) [rad/s],
        for laws that tilt to move.

    Raises
    ------
    InputError
        If the law is not callable, a gain is not finite, or the timing is not possible for the law.
    """

    name: str
    law: Callable[[LawCode], SimpleNamespace]
    gains: Values
    looks: bool = True
    settings: Values = field(default_factory=dict)
    runs: int | None = None
    period: float | None = None
    latency: float = 0.0
    guided: bool = False
    integral: float = 0.0
    asks: Literal[4, 6] | None = None
    bends: bool = True
    believes: Vehicle | None = None
    at_limits: Callable[[Values, np.ndarray], dict[str, np.ndarray]] | None = None
    known: Callable[[Vehicle], Mapping[str, np.ndarray]] | None = None
    bandwidths: Callable[[Values], np.ndarray] | None = None

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise InputError("law", f"is {shown(self.law)}", "give a function of the device code")
        if not isinstance(self.gains, Mapping):
            raise InputError(
                "gains", f"is {shown(self.gains)}", "give a value by name for every field of Gains"
            )
        gains = {name: self._gain(name, value) for name, value in self.gains.items()}
        object.__setattr__(self, "gains", FixedDict(gains))
        object.__setattr__(self, "settings", FixedDict(self.settings))
        self._check_timing()

    def _check_timing(self) -> None:
        """Raise InputError for timing that the law would ignore."""
        if self.period is not None:
            checks.positive("period", self.period, " [s], or None for the scenario's")
        if checks.number("latency", self.latency, least=0.0) and not self.guided:
            raise InputError(
                "latency",
                (
                    f"is {shown(self.latency)}, but the controller {self.name} is not "
                    "guided, and acts at once"
                ),
                "give 0, or guided=True and a law with a Memory",
            )
        if self.guided and self.period is None:
            raise InputError(
                "period", f"is None, but the controller {self.name} is guided", "give seconds"
            )
        if checks.number("integral", self.integral, least=0.0) and (self.guided or not self.looks):
            raise InputError(
                "integral",
                (
                    f"is {shown(self.integral)}, but the controller {self.name} sums up no "
                    "error of the image"
                ),
                "give 0",
            )

    def _gain(self, name: str, value: Any) -> np.ndarray:
        found = checks.finite_array(value)
        if found is None:
            raise InputError(
                name, f"of the controller {self.name} is {shown(value)}", "give finite gains"
            )
        return checks.frozen(found)

    def believing(self, vehicle: Vehicle) -> Controller:
        """Return the same law with another nominal model.

        Parameters
        ----------
        vehicle : Vehicle
            Nominal model, or one per run: made by `replace` from the simulated vehicle, with the
            same rotors and drag, which no law uses.

        Returns
        -------
        Controller
            The law, which computes weight, Jacobians, and the camera's mount and intrinsics from
            `vehicle`.

        Raises
        ------
        InputError
            If `vehicle` is not a vehicle, or a flight controller was made for another mass or
            inertia, which are among its gains.

        Notes
        -----
        Gains do not change. Measurements stay true: the state, the depths, and images in pixels,
        including the desired one. `simulate` raises InputError if rotors or drag differ.
        """
        check_vehicle(vehicle)
        if self.known is not None:
            for run in range(max(vehicle.runs or 1, self.runs or 1)):
                self._check_known(vehicle.select(min(run, (vehicle.runs or 1) - 1)), run)
        return replace(self, believes=vehicle)

    def _check_known(self, vehicle: Vehicle, run: int) -> None:
        """Raise InputError if a vehicle of one run disagrees with the gains of this run."""
        assert self.known is not None
        for name, value in self.known(vehicle).items():
            gain = self.gains[name]
            gain = gain if self.runs is None else gain[min(run, self.runs - 1)]
            if not np.allclose(gain, value, rtol=1e-6, atol=1e-6 * np.abs(value).max()):
                raise InputError(
                    "vehicle",
                    (
                        f"has {name} {shown(_plain(value))}, but the controller "
                        f"{self.name} has gains for {shown(_plain(gain))}"
                    ),
                    "make the controller for this vehicle",
                )

    def describe(self) -> dict[str, object]:
        """Return the name and settings in types of JSON.

        Returns
        -------
        dict
            The name, the settings, and under "believes" the nominal model if it is set.
        """
        nominal = {} if self.believes is None else {"believes": self.believes.describe()}
        return {"name": self.name, **{k: _plain(v) for k, v in self.settings.items()}, **nominal}


def stack(controllers: Sequence[Controller]) -> Controller:
    """Combine controllers of one law into one for a batch.

    Parameters
    ----------
    controllers : sequence of Controller
        One per run, all of one law with gains of equal shapes, and with the same timing.

    Returns
    -------
    Controller
        A controller whose run i has the gains of ``controllers[i]``.

    Raises
    ------
    InputError
        If a controller is a batch already, or they differ in more than gains and settings.
    """
    if (
        not isinstance(controllers, (list, tuple))
        or not controllers
        or any(not isinstance(c, Controller) for c in controllers)
    ):
        raise InputError("controllers", f"is {shown(controllers)}", "give one Controller per run")
    first = controllers[0]
    for other in controllers:
        if other.runs is not None:
            raise InputError(
                "controllers",
                f"holds {other.name} for {other.runs} runs already",
                "give one Controller per run, each of one run",
            )
        if other.law is not first.law:
            raise InputError(
                "controllers",
                f"holds the laws {first.name} and {other.name}",
                "stack controllers of one law",
            )
        for name in {**first.gains, **other.gains}:
            one, two = (np.shape(c.gains.get(name, ())) for c in (first, other))
            if one != two:
                raise InputError(
                    "controllers",
                    f"holds gains {name} of shapes {one} and {two}",
                    "stack controllers for as many points each",
                )
        if other.integral != first.integral:
            raise InputError(
                "controllers",
                f"have integral {first.integral:g} and {other.integral:g}",
                "give all of them the same",
            )
        for name in ("looks", "guided", "asks", "at_limits", "bandwidths"):
            one, two = (getattr(each, name) for each in (first, other))
            if one != two:
                raise InputError(
                    "controllers", f"have {name} {one} and {two}", "give all of them the same"
                )
        if other.believes is not first.believes:
            raise InputError(
                "controllers",
                "have different nominal models",
                "stack them first, and call believing with a batch",
            )
        if (other.period, other.latency) != (first.period, first.latency):
            raise InputError(
                "controllers",
                (
                    f"act every {first.period} s, {first.latency} s late, and every "
                    f"{other.period} s, {other.latency} s late"
                ),
                "give all of them the same rate and latency",
            )
    gains = {
        name: np.stack([np.asarray(c.gains[name]) for c in controllers]) for name in first.gains
    }
    few = len(controllers) <= _RECORDED_RUNS
    settings = {"runs": [c.describe() for c in controllers]} if few else {}
    return replace(first, gains=gains, settings=settings, runs=len(controllers))


def over_runs(
    first: Controller, gains: Mapping[str, np.ndarray], settings: Mapping[str, np.ndarray]
) -> Controller:
    """Return the first run's controller for a batch, with other gains and settings (runs, …)."""
    runs = len(next(iter(gains.values())))
    found = {
        name: gains.get(name, np.broadcast_to(value, (runs, *np.shape(value))))
        for name, value in first.gains.items()
    }
    recorded: dict[str, object] = {}
    if runs <= _RECORDED_RUNS:
        own = [{name: _plain(rows[run]) for name, rows in settings.items()} for run in range(runs)]
        recorded = {"runs": [first.describe() | each for each in own]}
    return replace(first, gains=found, settings=recorded, runs=runs)


def gain_matrix(name: str, value: ArrayLike, size: int) -> np.ndarray:
    """Return an SPD gain (size, size) of a scalar, a diagonal or a matrix, or raise InputError."""
    array = checks.finite_array(value)
    if array is None or array.shape not in ((), (size,), (size, size)):
        raise InputError(
            name,
            f"is {shown(value)}",
            (
                f"give a finite number, {size} of them, or {size} rows of {size} (twice "
                "the number of feature points)"
            ),
        )
    return definite(name, array if array.ndim == 2 else array * np.eye(size))


def definite(name: str, matrices: np.ndarray) -> np.ndarray:
    """Return gains (..., size, size) made symmetric to the last bit; SPD, or InputError."""
    turned = matrices.swapaxes(-1, -2)
    off, largest = (np.abs(each).max((-2, -1)) for each in (matrices - turned, matrices))
    if (off > 1e-9 * largest).any():
        raise InputError(name, "is not symmetric", "give a symmetric positive definite matrix")
    # Halves first: the sum of large ones may be infinite.
    symmetric: np.ndarray = matrices / 2 + turned / 2
    smallest = np.linalg.eigvalsh(symmetric)[..., :1].ravel()
    if not (smallest > 0.0).all():
        raise InputError(
            name,
            f"has the eigenvalue {smallest[~(smallest > 0.0)][0]:.6g}",
            "give a symmetric positive definite gain",
        )
    return symmetric


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
