"""Types and functions for the device code of a term, in one object."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any, cast

import warp as wp

from continuair.device.numbers import Numbers, Struct
from continuair.device.types import Tree, Types, device_types
from continuair.errors import InputError
from continuair.kernels.arm.tip import TipCode, tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code


@dataclass(frozen=True)
class OnDevice:
    """Place in a Plant of a number, vector or matrix of a term; it has no value.

    Parameters
    ----------
    first : int
        Index of its first entry in ``plant.term_numbers``.
    shape : tuple of int
        ``()``, ``(n,)`` or ``(n, m)``.
    """

    first: int
    shape: tuple[int, ...]

    @property
    def size(self) -> int:
        """Return the number of entries."""
        return prod(self.shape)

    def __float__(self) -> float:
        raise InputError(
            "device(code)",
            "uses a term's number, but its kernels are shared by all values",
            "read it with code.reader(self.name)(plant)",
        )


@dataclass(frozen=True)
class Device:
    """Types and functions for Warp functions in `Term.device`.

    Parameters
    ----------
    numbers : Numbers
        Precision and lanes; ``types.Real`` is one number, or one number of each run of a pack.
    tree : Tree
        Sections of each arm, and the other constants of kernels.
    frozen_arm : bool, default False
        Whether the arm's base stays at its initial pose, as in the model "independent".
    """

    numbers: Numbers
    tree: Tree
    frozen_arm: bool = False

    @cached_property
    def types(self) -> Types:
        """Return the types `Real`, `vec3`, `quat`, `State`, `Plant`, … and readers of a state."""
        return device_types(self.numbers, self.tree)

    @cached_property
    def tips(self) -> TipCode:
        """Return functions of an arm's tip, such as `world_tip_of(arm)(y, plant)`."""
        return tip_code(self.numbers, self.tree)

    @property
    def Load(self) -> Struct:
        """Return the struct of a generalised force: force, moment (body axes, about B), bend."""
        return cast(Struct, load_code(self.numbers, self.tree).Load)

    @property
    def Flight(self) -> Struct:
        """Return the struct of a run: plant, inputs, gravity, and what a model freezes."""
        return cast(Struct, flight_code(self.numbers, self.tree).Flight)

    def reader(self, number: OnDevice | float | tuple[float, ...]) -> wp.Function:
        """Return the device function that reads a number of a term from a Plant.

        Parameters
        ----------
        number : float or tuple of float
            A numeric field of the term, such as ``self.stiffness``.

        Returns
        -------
        wp.Function
            ``read(plant)``, which returns a ``Real``, a vector or a matrix.
        """
        place = cast(OnDevice, number)
        types, first, shape = self.types, place.first, place.shape
        Plant = types.Plant
        if not shape:

            @wp.func
            def scalar(plant: Plant):
                return plant.term_numbers[first]

            return scalar
        rows, columns = shape[0], shape[-1]
        if len(shape) == 1:
            Vector = types.vec3 if rows == 3 else wp.types.vector(rows, types.Real)

            @wp.func
            def vector(plant: Plant):
                out = Vector()
                for j in range(rows):
                    out[j] = plant.term_numbers[first + j]
                return out

            return vector
        Matrix = wp.types.matrix(shape, types.Real)

        @wp.func
        def matrix(plant: Plant):
            out = Matrix()
            for i in range(rows):
                for j in range(columns):
                    out[i, j] = plant.term_numbers[first + columns * i + j]
            return out

        return matrix

    def on_tip(self, wrench_of: Callable[[int], wp.Function]) -> Callable[[int], wp.Function]:
        """Return `Acting.on_arm` for a wrench on each tip.

        Parameters
        ----------
        wrench_of : callable
            A call ``wrench_of(arm)`` returns the device function ``wrench(y, flight, row)`` of an
            arm, which returns force [N] and moment [N m] at the tip in world axes.

        Returns
        -------
        callable
            Function of the index of an arm that returns the device function of the load.
        """
        return lambda arm: _tip_load(self, arm, wrench_of(arm))


def _tip_load(code: Device, arm: int, wrench: Any) -> Any:
    """Return the load of a wrench on a tip, J_tᵀ of Eq. (10), Amiri et al. (2026)."""
    types, tips, Load, Flight = code.types, code.tips, code.Load, code.Flight
    State, Push, Along, vec3 = types.State, types.Push, types.Along, types.vec3
    attitude_of, frozen_arm = types.attitude_of, code.frozen_arm
    tip_of, wrench_on = tips.tip_of(arm), tips.wrench_on(arm)

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        out = Load()
        plant, q = flight.plant, attitude_of(y)
        force, moment = wrench(y, flight, row)
        tip = tip_of(y, plant)
        out.force = wp.quat_rotate_inv(q, force)
        on_arm = out.force
        turning = wp.quat_rotate_inv(q, moment)
        bending = turning
        point = tip.point
        if wp.static(frozen_arm):
            # The wrench acts on the base at its initial pose.
            frozen = flight.frozen
            point = vec3(frozen.tips[arm, 0], frozen.tips[arm, 1], frozen.tips[arm, 2])
            on_arm = wp.quat_rotate_inv(frozen.attitude, force)
            bending = wp.quat_rotate_inv(frozen.attitude, moment)
        out.moment = wp.cross(point, out.force) + turning
        out.bend = wrench_on(y, plant, tip, on_arm, bending)
        return out

    return load
