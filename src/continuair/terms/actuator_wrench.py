"""Inputs force, moment and bend moment, and a controller's actuator wrench, applied directly."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.term_sum import Acting
from continuair.terms.term import CasadiModel, Term
from continuair.vehicle.layout import COMMAND

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class ActuatorWrench(Term):
    """Forces and moments on the UAV and the bends, except those that other terms apply."""

    differentiable: ClassVar[bool] = True
    has_power: ClassVar[bool] = False
    stiff: ClassVar[bool] = False

    def device(self, code: Device) -> Acting:
        """Return the device function of the load.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on UAV and bends.
        """
        return Acting(on_uav=_load(code.numbers, code.tree))

    def casadi(self, model: CasadiModel) -> "SX":
        """Return the inputs as a generalised force in CasADi.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle.

        Returns
        -------
        SX, shape (6 + 2 N, 1)
            The force.
        """
        import casadi

        x = model.x
        bending = casadi.vec(x["bend_moment"].T)
        return casadi.vertcat(model.R.T @ x["force"], x["moment"], bending)


def _load(numbers: Numbers, tree: Tree) -> Any:
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Flight, of_row = flight_code(numbers, tree).Flight, number_code(numbers).of_row
    State, Push, Along, layout = types.State, types.Push, types.Along, types.layout
    attitude_of, force_of = types.attitude_of, types.force_of
    moment_of, bend_moment_of = types.moment_of, types.bend_moment_of
    pushes, bends = layout.push.stop, layout.bends

    @wp.func
    def left(push: Push):
        return push

    def and_left(before: Any, of_term: Any) -> Any:
        @wp.func
        def found(push: Push):
            return of_term(before(push))

        return found

    for taker in (term.left(numbers, tree) for term in tree.terms):
        left = left if taker is None else and_left(left, taker)

    @wp.func
    def push_load(y: State, along: Along, flight: Flight, row: int, command: Push):
        out = Load()
        if flight.groups != 0:
            push = left(command)
            if flight.groups != COMMAND:
                for j in range(pushes):
                    push[j] = push[j] + of_row(flight.inputs, row, flight.run, j)
            out.force = wp.quat_rotate_inv(attitude_of(y), force_of(push))
            out.moment = moment_of(push)
            out.bend = bend_moment_of(push)
            for j in range(bends):
                out.bend[j] = out.bend[j] / flight.plant.unit[j]
        return out

    return push_load
