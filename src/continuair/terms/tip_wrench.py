"""Wrenches on the tips: a force and a moment on each, in world axes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import warp as wp

from continuair.kernels.device import Device
from continuair.kernels.term_sum import Acting
from continuair.terms.term import CasadiModel, Term
from continuair.vehicle.layout import TIP

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class TipWrench(Term):
    """Input `tip_wrench`, mapped to UAV and bends by J_tᵀ, Eq. (10), Amiri et al. (2026)."""

    differentiable: ClassVar[bool] = True
    has_power: ClassVar[bool] = False
    stiff: ClassVar[bool] = False

    def device(self, code: Device) -> Acting:
        """Return the device functions of the wrenches.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load through each arm.
        """
        on_tip = code.on_tip(lambda arm: _wrench(code, arm))
        return Acting(on_arm=lambda arm: _if_given(code, on_tip(arm)))

    def casadi(self, model: CasadiModel) -> "SX":
        """Return the wrenches as a generalised force in CasADi.

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

        found = model.none
        for index, arm in enumerate(model.arms):
            back, wrench = (model.R @ arm.tip.axes).T, model.x["tip_wrench"][index, :].T
            found += arm.tip.motion.T @ casadi.vertcat(back @ wrench[:3], back @ wrench[3:])
        return found


def _wrench(code: Device, arm: int) -> Any:
    types, Flight, State = code.types, code.Flight, code.types.State
    three_of = types.three_of
    tip_force = types.layout.tip_wrench.start + 6 * arm
    tip_moment = tip_force + 3

    @wp.func
    def wrench(y: State, flight: Flight, row: int):
        force = three_of(flight.inputs, row, flight.run, tip_force)
        return force, three_of(flight.inputs, row, flight.run, tip_moment)

    return wrench


def _if_given(code: Device, given: Any) -> Any:
    """Return the device function of the load, zero if no wrench is given."""
    types, Load, Flight = code.types, code.Load, code.Flight
    State, Push, Along = types.State, types.Push, types.Along

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        out = Load()
        if (flight.groups & TIP) != 0:
            out = given(y, along, flight, row, push)
        return out

    return load
