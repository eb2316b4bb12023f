"""What a term is: one thing that acts on vehicles, of which its own file alone knows.

Whatever has to do with all that acts goes through the terms of a vehicle: device code, packing,
base reactions, energies, CasADi, gradients and Lyapunov functions.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import prod
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from continuair.device.numbers import Numbers
from continuair.device.types import Tree
from continuair.errors import InputError
from continuair.kernels.device import Device, OnDevice
from continuair.kernels.term_sum import Acting
from continuair.vehicle.effect import Effect, numbers_of
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class Stream:
    """Air that a term moves, as device functions: its State, begun(y, flight, row, push) -> State,
    and velocity(plant, point, state) at a point in body axes [m/s]."""

    State: Any
    begun: Any
    velocity: Any


@dataclass(frozen=True)
class Term(Effect):
    """A force on a vehicle, in one class.

    Subclass it in a file of your own, as a frozen dataclass, and set instances of it with
    ``vehicle.replace({"terms": (MyTerm(...),)})``. Its method `device` returns what it does.

    Attributes
    ----------
    field : str
        Name in error messages. Default: the name of the class.
    in_wind : bool, default False
        Whether it depends on the wind.
    in_stream : bool, default False
        Whether it depends on air that another term moves.
    differentiable : bool, default False
        Whether its device code compiles for dual numbers, so that `gradient` differentiates it.
    has_power : bool, default True
        Whether it takes or gives power; if so, `lyapunov` refuses it.
    has_energy : bool, default False
        Whether it has a potential energy, `Acting.energy`; results then hold ``term_energy``.
    flown : tuple of str, default ()
        Fields of `parameters` in which a vehicle that a controller believes in must be the one that
        flies.
    stiff : bool, default True
        Whether it may change faster than the steps of ``method="implicit"``, which evaluates
        terms explicitly and refuses a stiff one.

    Raises
    ------
    InputError
        If a number is not finite or of another shape.

    Notes
    -----
    A field of type ``float``, or ``tuple[float, ...]``, is a number of the vehicle: it may vary
    over runs, ``vehicle.replace({"terms.0.name": [1.0, 2.0]})`` changes it, and another value
    compiles nothing. In `device` it has no value; read it there with ``code.reader(self.name)``. A
    field of any other type is part of the kernels, which another value compiles anew.

    Device code is Warp: a file of it must not use ``from __future__ import annotations``. No file
    holds code: results name the class and its fields, and `sweep`, which reads vehicles from files,
    has no terms (`run_pairs` takes any vehicle). `modes` and the designs of controllers do not
    include it; `linearize` and the automatic step do.

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

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return a term of the list TERMS as it acts on a vehicle; None if it does not."""
        return cls()

    @property
    def moves_air(self) -> bool:
        """Whether it moves the air, by `stream`."""
        return False

    @property
    def states(self) -> int:
        """How many numbers the term adds to a state."""
        return 0

    @property
    def width(self) -> int:
        """How many numbers its fields hold in one run."""
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
        """Return what kernels are made for: the term with places of its numbers, not their values.

        Parameters
        ----------
        first : int
            Index of its first number in ``plant.term_numbers``.
        """
        shapes, found = self._shapes(), object.__new__(type(self))
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name in shapes:
                value = OnDevice(first, shapes[each.name])
                first += value.size
            object.__setattr__(found, each.name, value)
        return found

    def values(self, runs: int) -> np.ndarray:
        """Return its numbers (runs, width)."""
        parts = [
            per_run(getattr(self, name), runs, *shape).reshape(runs, -1)
            for name, shape in self._shapes().items()
        ]
        return np.hstack([np.empty((runs, 0)), *parts])

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return further fields of the device's Plant, with the shape of each: (), (n,), (n, m)."""
        return {}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill these fields of structured plants (runs,)."""

    def device(self, code: Device) -> Acting:
        """Return what it does on the device.

        Parameters
        ----------
        code : Device
            Types and functions to write it with.

        Returns
        -------
        Acting
            Device functions of its loads, and of what else it has.
        """
        raise InputError(
            f"term {type(self).__name__} has no method device(self, code); define it, as "
            "continuair.Term says."
        )

    def left(self, numbers: Numbers, tree: Tree) -> Any:
        """Return the device function of the part of a controller's push that this term does not
        apply itself; None if it applies none, as all terms of a vehicle but one."""
        return None

    def stream(self, numbers: Numbers, tree: Tree) -> Stream | None:
        """Return the air that it moves, as one term of a vehicle at most does."""
        return None

    def observer(self, numbers: Numbers, tree: Tree) -> Any:
        """Return the kernel that computes its variables along a log; None if it has none."""
        return None

    def casadi(self, model: Any) -> SX | None:
        """Return its generalised force (6 + 2 N,) in a model of interfaces/casadi_dynamics.py; None
        if it has no form in CasADi, so that `to_casadi` refuses the vehicle."""
        return None


def name_of(term: Term) -> str:
    """Return the name of a term in messages."""
    return term.field or type(term).__name__
