"""Forces that a Python function of time and state returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from continuair.errors import InputError, shown
from continuair.typing import Array, ArrayLike


@dataclass(frozen=True, eq=False)
class Wrench:
    """A force and a moment at a point of the vehicle.

    Parameters
    ----------
    force : array_like, shape (3,) or (runs, 3)
        Force in world axes [N].
    moment : array_like, optional
        Moment in world axes [N m], of the same shape. Default: none. A moment on the UAV turns with
        it until the next call.
    at : {"uav", "tip"} or tuple ("tip", int), default "uav"
        The UAV's centre of mass, the tip of the first arm, or the tip of an arm by index.

    Raises
    ------
    InputError
        If `at` is no such point.

    Examples
    --------
    >>> ca.Wrench([0.0, 0.0, 1.0], at="tip").at
    'tip'
    """

    force: ArrayLike
    moment: ArrayLike | None = None
    at: Literal["uav", "tip"] | tuple[Literal["tip"], int] = "uav"

    def __post_init__(self) -> None:
        at = self.at
        of_arm = isinstance(at, tuple) and len(at) == 2 and at[0] == "tip" and type(at[1]) is int
        if not of_arm and at not in ("uav", "tip"):
            raise InputError(
                "at", f"is {shown(at)}", "give 'uav', 'tip' or ('tip', index of the arm)"
            )


@dataclass(frozen=True, eq=False)
class FlightState:
    """The state of a flight, as a ``force_callback`` receives it.

    Parameters
    ----------
    position, velocity : ndarray, shape (3,)
        Of the UAV's centre of mass, in world axes [m, m/s].
    attitude : ndarray, shape (4,)
        Quaternion x y z w, body to world.
    angular_velocity : ndarray, shape (3,)
        In body axes [rad/s].
    bend, bend_rate : ndarray, shape (sections, 2)
        Bend vectors and their rates [1/m, 1/(m s)]. Of arms with a section whose strain varies,
        shape (coordinates,): those of all sections, as `strain` and `strain_rate` of results.
    tip_position, tip_velocity : ndarray, shape (arms, 3)
        In world axes [m, m/s].

    Notes
    -----
    In a batch every array has a leading dimension (runs,). Runs that have stopped keep their last
    state. ``bend`` and ``tip_position`` of a vehicle with an [arm] table have shapes (2,) and (3,),
    as in results.
    """

    position: Array
    attitude: Array
    velocity: Array
    angular_velocity: Array
    bend: Array
    bend_rate: Array
    tip_position: Array
    tip_velocity: Array
