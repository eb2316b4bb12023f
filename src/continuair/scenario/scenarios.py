"""Scenarios: initial state, inputs over time, and duration of a flight.

Paper coordinates are q = [x y z roll pitch yaw kappa psi_a]: position [m], ZYX Euler angles [rad],
bend [1/m] and its direction [rad]. The last two repeat for every section, arm by arm from the
base out. An input is None, a constant or a function of the time [s]; one row of it acts in all
runs, and a leading dimension (runs,) gives each run its own.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from continuair import checks
from continuair.controllers.controller import Controller
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.scenario.obstacles import Obstacle
from continuair.scenario.payload import Payload
from continuair.scenario.records import with_known_fields
from continuair.scenario.setpoints import Setpoints
from continuair.scenario.targets import Target
from continuair.scenario.wrench import FlightState, Wrench
from continuair.typing import Array, ArrayLike
from continuair.vehicle.fields import is_title
from continuair.vehicle.layout import FIELDS, OF_NAME, ONE_SECTION, Layout

Input: TypeAlias = ArrayLike | Callable[[float], ArrayLike] | None

_LARGEST_SEED = 2**63 - 1

_ONE = ONE_SECTION.coordinates
_UAV = 6
_OF_TIP = OF_NAME["tip_wrench"].width(ONE_SECTION)

_OF_ACTUATORS = tuple(each.name for each in OF_NAME.values() if each.per in ("rotor", "tendon"))
"""Inputs whose width depends on the number of actuators of a vehicle."""

_INPUTS = {
    field: ", ".join(OF_NAME[name].meaning for name in given) for field, given in FIELDS.items()
}
"""Field -> meaning of its numbers."""


@with_known_fields("a scenario", "give a name, q and fields by name")
@dataclass(frozen=True, eq=False)
class Scenario(Immutable):
    """Initial state, inputs and duration of a flight.

    Parameters
    ----------
    name : str
        Name, for titles and provenance.
    q : array_like, shape (8,) or (runs, 8)
        Initial paper coordinates [m, rad, 1/m, rad]; of N arcs, 6 + 2 N numbers. The coordinates of
        a section whose strain varies stand in the place of κ and ψa, as in `accelerations`.
    qd : array_like, shape (8,) or (runs, 8), optional
        Initial rates of the paper coordinates [per s]. Default: 0.
    tau : array_like or callable, optional
        Generalised forces conjugate to q, as many as q has [N, N m, N m², N m]; Eq. of motion,
        Amiri et al. (2026): force in world axes, Euler-angle torques, Q_kappa and Q_psi_a.
    force : array_like or callable, optional
        Force at the UAV's centre of mass in world axes, shape (3,) [N].
    moment : array_like or callable, optional
        Moment on the UAV in body axes, shape (3,) [N m].
    bend_moment : array_like or callable, optional
        Generalised forces conjugate to the bend vectors, two per arc [N m²], or to the coordinates
        of a section whose strain varies [N m²; stretch and shear: N m].
    tip_wrench : array_like or callable, optional
        Force and moment at the tip in world axes, six per arm [N, N m].
    wind : array_like or callable, optional
        Velocity of the air in world axes, shape (3,) [m/s]. The vehicle must have drag.
    rotor_command : array_like or callable, optional
        Commanded thrust of each rotor [N]. Default without a controller: those that hold the
        vehicle level at its start.
    tendon_command : array_like or callable, optional
        Command of each tendon, arm by arm and group by group: a tension above its pretension, or a
        length to take in [N, m]. Motors start at the command. Default: 0.
    rotor_thrust : array_like, optional
        Initial thrust of each rotor, or a row per run [N]. Default: `rotor_command` at the start,
        or else the thrusts that hold the vehicle.
    tip_wrench_sign : {1, -1}, optional
        1: the wrench acts on the tip. -1: it acts reversed, as in the paper's equations.
    duration : float, optional
        Duration of the flight [s].
    jumps : sequence of float, optional
        Times inside the flight at which an input jumps; integration steps end there [s].
    gravity : float, optional
        Acceleration of gravity, along -z of the world [m/s²].
    controller : Controller, optional
        Feedback controller; the inputs above then act as disturbances.
    control_period : float or None, optional
        Time between controller updates [s]; its output is held in between. None: updates at every
        stage of a step. A controller with its own period keeps that.
    target : Target or sequence of Target, optional
        Target of the camera, or one per run with the same points.
    seed : int or sequence of int, optional
        Seed of the noise of camera and sensors: one for all runs, or one per run.
    setpoints : Setpoints, optional
        Set-points of a flight controller. Default: the start.
    obstacles : sequence of Obstacle, optional
        Solid objects that the arms touch: `Plane`, `Sphere`, `Box`, `Cylinder`.
    payload : Payload, optional
        A body that a tip picks up and releases.
    force_callback : callable, optional
        Python function f(t, state) that returns a `Wrench`, or several. They add to the inputs and
        are held between calls. It is slow.
    callback_rate : float, optional
        Rate at which `force_callback` is called [Hz].

    Raises
    ------
    InputError
        If a field cannot be used.

    Notes
    -----
    Fields are immutable. Functions of time are evaluated at t = 0, to check that they return finite
    numbers of the right shape.
    """

    name: str
    q: ArrayLike
    qd: ArrayLike | None = None
    tau: Input = None
    force: Input = None
    moment: Input = None
    bend_moment: Input = None
    tip_wrench: Input = None
    wind: Input = None
    rotor_command: Input = None
    tendon_command: Input = None
    rotor_thrust: ArrayLike | None = None
    tip_wrench_sign: int = 1
    duration: float = 1.0
    jumps: tuple[float, ...] = ()
    gravity: float = 9.81
    controller: Controller | None = None
    control_period: float | None = 1e-3
    target: Target | Sequence[Target] | None = None
    seed: int | Sequence[int] = 0
    setpoints: Setpoints | None = None
    obstacles: Sequence[Obstacle] = ()
    payload: Payload | None = None
    force_callback: Callable[[float, FlightState], Wrench | Sequence[Wrench]] | None = None
    callback_rate: float = 1000.0

    def __post_init__(self) -> None:
        if not is_title(self.name):
            raise InputError("name", f"is {shown(self.name)}, but must be text", "give a name")
        checked: dict[str, Any] = {"q": _state("q", self.q)}
        width = checked["q"].shape[-1]
        given = np.zeros(width) if self.qd is None else self.qd
        checked["qd"] = _state("qd", given, width)
        checked |= {name: _input(name, getattr(self, name), width) for name in _INPUTS}
        checked["rotor_thrust"] = _thrusts(self.rotor_thrust)
        _check_runs(checked)
        if not checks.is_number(self.tip_wrench_sign) or self.tip_wrench_sign not in (1, -1):
            raise InputError(
                "tip_wrench_sign",
                f"is {shown(self.tip_wrench_sign)}, but must be 1 or -1",
                "give 1 for a wrench that acts on the tip",
            )
        checked["tip_wrench_sign"] = int(self.tip_wrench_sign)
        checked["duration"] = checks.positive("duration", self.duration, " [s]")
        checked["jumps"] = _jumps(self.jumps, checked["duration"])
        checked["gravity"] = checks.gravity(self.gravity)
        checked["obstacles"] = _obstacles(self.obstacles)
        if self.payload is not None and not isinstance(self.payload, Payload):
            raise InputError(
                "payload", f"is {shown(self.payload)}", "give one continuair.Payload(mass=...)"
            )
        if self.payload is not None:
            checked["jumps"] = self.payload.within(checked["jumps"], checked["duration"])
        checked["seed"] = checks.seed(self.seed, _LARGEST_SEED)
        if self.control_period is not None:
            otherwise = " [s], or None to evaluate the controller at every stage"
            period = checks.positive("control_period", self.control_period, otherwise)
            checked["control_period"] = period
        self._check_loop()
        checked["callback_rate"] = checks.positive("callback_rate", self.callback_rate, " [Hz]")
        self._check_callback()
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def _check_loop(self) -> None:
        """Raise InputError for a controller, target or set-points that cannot be used."""
        if self.controller is not None and not isinstance(self.controller, Controller):
            raise InputError(
                "controller",
                f"is {shown(self.controller)}",
                "give a ca.Controller(name, law, gains), or one such as ca.hold(...)",
            )
        if self.target is not None:
            object.__setattr__(self, "target", _checked_targets(self.target))
        if self.setpoints is not None:
            self._check_setpoints()
        if self.controller is not None and self.controller.looks and not self.targets:
            raise InputError(
                "target",
                f"is None, but the controller {self.controller.name} needs one",
                "give a continuair.Target, or make the controller with looks=False",
            )

    def _check_callback(self) -> None:
        """Raise InputError for a `force_callback` that cannot be used."""
        if self.force_callback is None:
            return
        if not callable(self.force_callback):
            raise InputError(
                "force_callback",
                f"is {shown(self.force_callback)}",
                "give a function f(t, state) that returns a continuair.Wrench",
            )
        if self.controller is not None:
            raise InputError(
                "force_callback",
                (
                    f"is given with the controller {self.controller.name}, but works in "
                    "open loop only"
                ),
                "write the force as a continuair.Term",
            )

    def _check_setpoints(self) -> None:
        """Raise InputError for set-points that the controller cannot follow."""
        if not isinstance(self.setpoints, Setpoints):
            raise InputError(
                "setpoints",
                f"is {shown(self.setpoints)}",
                "give continuair.Setpoints(position=...)",
            )
        law = self.controller
        if law is None or not law.guided or law.looks:
            name = "None" if law is None else law.name
            raise InputError(
                "controller",
                f"is {name}, which follows no setpoints",
                "give continuair.flight_controller(vehicle), or omit setpoints",
            )
        held = law.gains.get("bend_limit")
        if self.setpoints.bend is not None and held is not None and not held.any():
            raise InputError(
                "setpoints",
                f"has a bend, which the controller {law.name} does not control",
                "give it a bend_bandwidth above 0, or omit bend",
            )

    @property
    def period(self) -> float | None:
        """Time between controller updates [s].

        The controller's own period, or else `control_period`. None without a controller, and for
        one that updates at every stage of a step.
        """
        if self.controller is None:
            return None
        own = self.controller.period
        return self.control_period if own is None else own

    @property
    def knots(self) -> Array:
        """Breakpoints of the wind [s], where integration steps end."""
        return np.array(getattr(self.wind, "knot_times", ()), float)

    @property
    def targets(self) -> tuple[Target, ...]:
        """Targets as a tuple: none, one for all runs, or one per run."""
        if self.target is None:
            return ()
        return (self.target,) if isinstance(self.target, Target) else tuple(self.target)

    @property
    def runs(self) -> int | None:
        """Number of runs if a state or a constant input has a row per run, else None."""
        values = [getattr(self, name) for name in ("q", "qd", "rotor_thrust", *_INPUTS)]
        arrays = [value for value in values if isinstance(value, np.ndarray)]
        return next((len(array) for array in arrays if array.ndim == 2), None)

    def replace(self, **changes: object) -> Scenario:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes : object
            New values of fields.

        Returns
        -------
        Scenario
            The copy.

        Raises
        ------
        InputError
            If a field cannot be used.
        """
        fields: dict[str, Any] = changes
        return dataclasses.replace(self, **fields)

    def describe(self) -> dict[str, object]:
        """Return all fields for JSON.

        Returns
        -------
        dict
            Field to value; functions of time are given by name.
        """
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        if self.force_callback is None:
            del fields["force_callback"], fields["callback_rate"]
        return {name: _plain(value) for name, value in fields.items()}


def _finite_array(value: object) -> Array | None:
    """Return finite numbers as a read-only array, and None for anything else."""
    array = checks.finite_array(value)
    return None if array is None else checks.frozen(array)


def _is_rows(array: Array) -> bool:
    """Return whether an array is one row, or a row per run."""
    return array.ndim in (1, 2) and array.size > 0


def _state(field: str, value: object, width: int | None = None) -> Array:
    """Return coordinates of any number of sections, or rates of the given width."""
    array = _finite_array(value)
    if array is not None and _is_rows(array):
        found = array.shape[-1]
        if found == width or (width is None and found >= _UAV):
            return array
    rates, many = " (rates)" if field == "qd" else "", width or _ONE
    names = "[x y z roll pitch yaw kappa psi_a]" if many >= _ONE else "[x y z roll pitch yaw]"
    further = " and kappa psi_a of each further section" if width not in (_UAV, _ONE) else ""
    raise InputError(
        field,
        f"is {shown(value)}, but must be {many} finite numbers or a row of {many} per run",
        f"give {names}{further}{rates}",
    )


def _fits(field: str, found: int, width: int) -> bool:
    """Return whether an input field has as many components as coordinates of a width need."""
    if field == "tip_wrench":
        return found % _OF_TIP == 0
    if field in _OF_ACTUATORS:
        return True  # their number is checked with the vehicle
    return found == _width_of(field, width)


def _width_of(field: str, width: int) -> int:
    """Return the number of components of an input, of one arm, for a number of coordinates."""
    layout = Layout.of_coordinates(width)
    return sum(OF_NAME[name].width(layout) for name in FIELDS[field])


def _check_runs(fields: dict[str, Any]) -> None:
    """Raise InputError for arrays over unequal numbers of runs; functions are not called."""
    lengths = {
        name: len(value)
        for name, value in fields.items()
        if isinstance(value, np.ndarray) and value.ndim == 2
    }
    if len(set(lengths.values())) > 1:
        (first, count), *others = lengths.items()
        rest = "".join(f" and {name} {runs}" for name, runs in others)
        raise InputError(
            first,
            f"holds {count}{rest} runs",
            "give equally many rows in each, or one row for all runs",
        )


def _input(field: str, value: Any, width: int) -> Array | Callable[[float], ArrayLike] | None:
    """Return a function of time, checked at t = 0, or a read-only array, or None."""
    if value is None:
        return None
    size = _width_of(field, width)
    given, at = value, ""
    if callable(value):
        at = " at t = 0"
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # reported below
                given = value(0.0)
        except Exception as error:  # whatever a user's function raises
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(
                field,
                f"cannot be evaluated at t = 0 ({reason})",
                "give a function of the time alone",
            ) from error
    array = _finite_array(given)
    if array is None or not _is_rows(array) or not _fits(field, array.shape[-1], width):
        numbers = f"{size} finite numbers or a row of {size} per run"
        if field in _OF_ACTUATORS:
            each = OF_NAME[field].per
            numbers = f"a finite number for each {each}, or a row of them per run"
        raise InputError(
            field, f"is {shown(given)}{at}, but must be {numbers}", f"give {_INPUTS[field]}"
        )
    result: Array | Callable[[float], ArrayLike] = value if at else array
    return result


def _thrusts(value: Any) -> Array | None:
    """Return thrusts of 0 or more, or None."""
    if value is None:
        return None
    array = _finite_array(value)
    if array is None or not _is_rows(array) or not (array >= 0.0).all():
        raise InputError(
            "rotor_thrust",
            f"is {shown(value)}",
            "give a finite thrust of 0 or more for each rotor [N], or a row of them per run",
        )
    return array


def _obstacles(value: Any) -> tuple[Obstacle, ...]:
    """Return obstacles as a tuple, or raise InputError."""
    given = [value] if isinstance(value, Obstacle) else value
    kinds_fit = isinstance(given, (list, tuple)) and all(
        isinstance(each, Obstacle) and each.shape for each in given
    )
    if not kinds_fit:
        raise InputError(
            "obstacles",
            f"is {shown(value)}",
            "give continuair.Plane, Sphere, Box or Cylinder, or a list of them",
        )
    return tuple(given)


def _jumps(value: Any, duration: float) -> tuple[float, ...]:
    """Return increasing times inside the flight, each once."""
    array = _finite_array(np.empty(0) if isinstance(value, tuple) and not value else value)
    if array is None or array.ndim != 1 or not ((array > 0) & (array < duration)).all():
        raise InputError(
            "jumps", f"is {shown(value)}", f"give a list of times above 0 and below {duration:g} s"
        )
    return tuple(np.unique(array).tolist())


def _checked_targets(given: Any) -> Target | tuple[Target, ...]:
    """Return a target or a tuple of targets with the same points, or raise InputError."""
    targets = given if isinstance(given, (list, tuple)) and given else [given]
    if any(not isinstance(target, Target) for target in targets):
        raise InputError("target", f"is {shown(given)}", "give a continuair.Target, or one per run")
    counts = sorted({len(target.points) for target in targets}, reverse=True)
    if len(counts) > 1:
        raise InputError(
            "target",
            f"has targets of {counts[0]} and {counts[1]} points",
            "give all runs the same points",
        )
    if any(not np.array_equal(target.points, targets[0].points) for target in targets):
        raise InputError(
            "target", "has targets of different points", "give all runs the same points"
        )
    return given if isinstance(given, Target) else tuple(targets)


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it; functions become their name."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, functools.partial):
        given = [repr(item) for item in value.args]
        given += [f"{name}={item!r}" for name, item in value.keywords.items()]
        return f"{_plain(value.func)}({', '.join(given)})"
    if hasattr(value, "describe"):
        return value.describe()
    if callable(value):
        return getattr(value, "__qualname__", type(value).__qualname__)
    return [_plain(item) for item in value] if isinstance(value, (tuple, list)) else value
