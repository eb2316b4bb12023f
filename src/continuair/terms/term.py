"""Interface of a term: one force on a vehicle, defined in one file.

Device code, packing, base reactions, energies, CasADi, gradients and Lyapunov functions treat all
forces through this interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import prod
from typing import TYPE_CHECKING, ClassVar, Protocol, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree
from continuair.errors import InputError
from continuair.kernels.device import Device, OnDevice
from continuair.kernels.term_sum import Acting
from continuair.sections.kind import SymbolicSection
from continuair.typing import Array
from continuair.vehicle.effect import Effect, numbers_of
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX

    from continuair.sections.symbolic import Frame


class CasadiArm(Protocol):
    """Arm of a `CasadiModel`: its sections, and the frame of its tip."""

    @property
    def sections(self) -> Sequence[SymbolicSection]: ...

    @property
    def tip(self) -> Frame: ...


class CasadiModel(Protocol):
    """Symbolic vehicle that `Term.casadi` reads.

    vehicle: the vehicle. x: arguments by name, such as ``x["tip_wrench"]``. R: rotation from body
    to world axes (3, 3). arms: its arms. none: a generalised force of zeros (6 + 2 N,).
    body_velocity: of B's origin in body axes (3,). rates: body velocity, angular velocity and bend
    rates (6 + 2 N,). speed(v): norm of a velocity, with derivatives at rest.
    """

    @property
    def vehicle(self) -> Vehicle: ...

    @property
    def x(self) -> dict[str, SX]: ...

    @property
    def R(self) -> SX: ...

    @property
    def arms(self) -> Sequence[CasadiArm]: ...

    @property
    def none(self) -> SX: ...

    @property
    def body_velocity(self) -> SX: ...

    @property
    def rates(self) -> SX: ...

    def speed(self, v: SX) -> SX: ...


@dataclass(frozen=True)
class Stream:
    """Moving air of a term, such as a downwash, in device code.

    Parameters
    ----------
    State : type
        Warp type of what `begun` computes once per evaluation.
    begun : wp.Function
        ``begun(y, flight, row, push) -> State``.
    velocity : wp.Function
        ``velocity(plant, point, state) -> vec3``, the velocity of the air at a point in body axes
        [m/s].
    """

    State: type
    begun: wp.Function
    velocity: wp.Function


@dataclass(frozen=True)
class Term(Effect):
    """A force on a vehicle, in one class.

    Subclass it as a frozen dataclass, and set instances of it with
    ``vehicle.replace({"terms": (MyTerm(...),)})``. Its method `device` returns device functions.

    Attributes
    ----------
    field : str
        Name in error messages. Default: the name of the class.
    in_wind : bool, default False
        Whether it depends on the wind.
    in_stream : bool, default False
        Whether it depends on moving air of another term, such as a downwash.
    differentiable : bool, default False
        Whether its device code compiles for dual numbers, which `gradient` needs.
    has_power : bool, default True
        Whether it does work; if so, `lyapunov` rejects it.
    has_energy : bool, default False
        Whether it has a potential energy, `Acting.energy`; results then hold ``term_energy``.
    flown : tuple of str, default ()
        Fields of `parameters` that must be equal in a controller's nominal model and in the
        simulated vehicle.
    carries : bool, default False
        Whether it adds a body to a tip in flight, by `Acting.laden`.
    stiff : bool, default True
        Whether it may change faster than the steps of ``method="implicit"``. That method
        evaluates terms explicitly and rejects a stiff one.
    kinked : bool, default False
        Whether its force has kinks, such as the begin of a contact. The second flight of
        ``check=True`` is then at a hundredth of the tolerance.

    Raises
    ------
    InputError
        If a number is not finite or of another shape.

    Notes
    -----
    A field of type ``float``, or ``tuple[float, ...]``, is a parameter of the vehicle. It may vary
    over runs, ``vehicle.replace({"terms.0.name": [1.0, 2.0]})`` changes it, and a new value needs
    no compilation. In `device` it has no value; read it with ``code.reader(self.name)``. A field of
    any other type is a constant of the kernels, and a new value compiles them again.

    Device code is Warp: its file must not use ``from __future__ import annotations``. Files do not
    contain code: results store the name of the class and its fields, and `sweep`, which reads
    vehicles from files, has no terms (`run_pairs` accepts any vehicle). `modes` and the designs of
    controllers do not include terms; `linearize` and the automatic step do.

    Examples
    --------
    Drag of the tips, ``-c v``, in air at rest:

    .. code-block:: python

        @dataclass(frozen=True)
        class TipDrag(ca.Term):
            per_velocity: float

            def device(self, code):
                types, drag = code.types, code.reader(self.per_velocity)
                State, Flight, vec3 = types.State, code.Flight, types.vec3

                def wrench_of(arm):
                    world_tip = code.tips.world_tip_of(arm)

                    @wp.func
                    def wrench(y: State, flight: Flight, row: int):
                        velocity = world_tip(y, flight.plant).velocity
                        return -drag(flight.plant) * velocity, vec3()

                    return wrench

                return Acting(on_arm=code.on_tip(wrench_of))

        vehicle = vehicle.replace({"terms": (TipDrag(per_velocity=0.4),)})
    """

    field: ClassVar[str] = ""
    in_wind: ClassVar[bool] = False
    in_stream: ClassVar[bool] = False
    differentiable: ClassVar[bool] = False
    has_power: ClassVar[bool] = True
    has_energy: ClassVar[bool] = False
    flown: ClassVar[tuple[str, ...]] = ()
    stiff: ClassVar[bool] = True
    kinked: ClassVar[bool] = False
    carries: ClassVar[bool] = False

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return a term of the list TERMS for a vehicle.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        Term or None
            The term; None if it does not act on the vehicle.
        """
        return cls()

    @property
    def moves_air(self) -> bool:
        """Return whether the term moves the air, by `stream`."""
        return False

    @property
    def states(self) -> dict[str, int]:
        """Return the states that the term adds, by name, and the numbers of each.

        They are 0 at the start of a flight, unless a scenario sets them.
        """
        return {}

    def state_units(self, vehicle: Vehicle, runs: int) -> dict[str, Array]:
        """Return the natural units of the states, which scale errors of integration steps.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.

        Returns
        -------
        dict of str to ndarray
            Units (runs, n) of each of `states`, 1 by default.
        """
        return {name: np.ones((runs, count)) for name, count in self.states.items()}

    @property
    def counts(self) -> dict[str, int]:
        """Return the actuators with an input of their own, by name, and their number."""
        return {}

    @property
    def variables(self) -> dict[str, int]:
        """Return the variables that `observer` computes, by name, and the numbers of each."""
        return {}

    @property
    def rows(self) -> int:
        """Return the number of rows that the term adds to the table of coefficients."""
        return 0

    @property
    def columns(self) -> int:
        """Return the number of columns that these rows need."""
        return 0

    def table(self, vehicle: Vehicle, runs: int, at: slice) -> Array:
        """Return the rows of the term in the table of coefficients.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, plain or batched.
        runs : int
            Number of runs.
        at : slice
            The requested runs.

        Returns
        -------
        ndarray, shape (n, rows, columns)
            The coefficients.
        """
        return np.zeros((len(range(*at.indices(runs))), self.rows, self.columns))

    @property
    def width(self) -> int:
        """Return how many numbers its fields hold in one run."""
        return sum(prod(shape) for shape in self._shapes().values())

    def _shapes(self) -> dict[str, tuple[int, ...]]:
        """Return the fields that hold numbers, and the shape of each in one run."""
        found = {}
        for name, open_shape in numbers_of(type(self)).items():
            value = getattr(self, name)
            shape = value.shape if isinstance(value, OnDevice) else np.shape(value)
            found[name] = tuple(shape[len(shape) - len(open_shape) :])
        return found

    def compiled(self, first: int) -> Self:
        """Return the term with the places of its numbers in place of their values.

        Parameters
        ----------
        first : int
            Index of its first number in ``plant.term_numbers``.

        Returns
        -------
        Term
            A copy whose numeric fields are `OnDevice`. Equal copies share kernels.
        """
        shapes, found = self._shapes(), object.__new__(type(self))
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name in shapes:
                value = OnDevice(first, shapes[each.name])
                first += value.size
            object.__setattr__(found, each.name, value)
        return found

    def values(self, runs: int) -> Array:
        """Return the numbers of its fields.

        Parameters
        ----------
        runs : int
            Number of runs.

        Returns
        -------
        ndarray, shape (runs, width)
            The numbers, field by field.
        """
        parts = [
            per_run(getattr(self, name), runs, *shape).reshape(runs, -1)
            for name, shape in self._shapes().items()
        ]
        return np.hstack([np.empty((runs, 0)), *parts])

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return further fields of the device's Plant.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field: ``()``, ``(n,)`` or ``(n, m)``.
        """
        return {}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the fields of `parameters`.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle, plain or batched.
        """

    def device(self, code: Device) -> Acting:
        """Return the device functions of the term.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Device functions of its loads, and optionally of rates, energy and limits.

        Raises
        ------
        InputError
            If a subclass does not define the method.
        """
        raise InputError(
            f"term {type(self).__name__}",
            "has no method device(self, code)",
            "define it, as in continuair.Term",
        )

    def left(self, numbers: Numbers, tree: Tree) -> wp.Function | None:
        """Return the function of the part of an actuator wrench that this term does not apply.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Function or None
            ``left(push) -> Push``; None if the term applies no part of the wrench.
        """
        return None

    def stream(self, numbers: Numbers, tree: Tree) -> Stream | None:
        """Return the moving air of the term; at most one term of a vehicle has any.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        Stream or None
            Device functions of the moving air.
        """
        return None

    def observer(self, numbers: Numbers, tree: Tree) -> wp.Kernel | None:
        """Return the kernel that computes variables of the term along a log.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Kernel or None
            The kernel, or None.
        """
        return None

    def casadi(self, model: CasadiModel) -> SX | None:
        """Return the generalised force of the term in CasADi.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle (interfaces/casadi_dynamics.py).

        Returns
        -------
        SX or None
            Force (6 + 2 N, 1); None if the term has no form in CasADi, so that `to_casadi` rejects
            the vehicle.
        """
        return None


def name_of(term: Effect) -> str:
    """Return the name of a term in messages.

    Parameters
    ----------
    term : Term
        Any term, such as one of `Vehicle.terms`.

    Returns
    -------
    str
        Its `field`, or else the name of its class.
    """
    return getattr(term, "field", "") or type(term).__name__
