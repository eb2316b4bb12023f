"""Wrenches on the tips: a force and a moment on each, in world axes."""

from dataclasses import dataclass
from typing import Any

import warp as wp

from continuair.kernels.arm.tip import tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.numbers import Numbers
from continuair.kernels.term_sum import Acting
from continuair.kernels.types import Tree, device_types
from continuair.terms.term import Term
from continuair.vehicle.layout import TIP


@dataclass(frozen=True)
class TipWrench(Term):
    """The input `tip_wrench`: what pushes on a tip pushes on bends and UAV, J_tᵀ of Eq. (10)."""

    def device(self, numbers: Numbers, tree: Tree, frozen_arm: bool) -> Acting:
        return Acting(on_arm=lambda arm: _load(numbers, tree, frozen_arm, arm))

    def casadi(self, model: Any) -> Any:
        import casadi

        found = model.none
        for index, arm in enumerate(model.arms):
            back, wrench = (model.R @ arm.tip.axes).T, model.x["tip_wrench"][index, :].T
            found += arm.tip.motion.T @ casadi.vertcat(back @ wrench[:3], back @ wrench[3:])
        return found


def _load(numbers: Numbers, tree: Tree, frozen_arm: bool, arm: int) -> Any:
    """The function that gives the load of the wrench on an arm's tip.

    frozen_arm: the tip pushes the base where it was at the start.
    """
    types, tips = device_types(numbers, tree), tip_code(numbers, tree)
    Load, Flight = load_code(numbers, tree).Load, flight_code(numbers, tree).Flight
    State, Push, Along = types.State, types.Push, types.Along
    vec3, attitude_of, three_of = types.vec3, types.attitude_of, types.three_of
    tip_of, wrench_on = tips.tip_of(arm), tips.wrench_on(arm)
    tip_force = types.layout.tip_wrench.start + 6 * arm
    tip_moment = tip_force + 3

    @wp.func
    def wrench(y: State, flight: Flight, row: int):
        out = Load()
        plant, q = flight.plant, attitude_of(y)
        force = three_of(flight.inputs, row, flight.run, tip_force)
        moment = three_of(flight.inputs, row, flight.run, tip_moment)
        tip = tip_of(y, plant)
        out.force = wp.quat_rotate_inv(q, force)
        on_arm = out.force
        turning = wp.quat_rotate_inv(q, moment)
        bending = turning
        point = tip.point
        if wp.static(frozen_arm):
            frozen = flight.frozen
            point = vec3(frozen.tips[arm, 0], frozen.tips[arm, 1], frozen.tips[arm, 2])
            on_arm = wp.quat_rotate_inv(frozen.attitude, force)
            bending = wp.quat_rotate_inv(frozen.attitude, moment)
        out.moment = wp.cross(point, out.force) + turning
        out.bend = wrench_on(y, plant, tip, on_arm, bending)
        return out

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        out = Load()
        if (flight.groups & TIP) != 0:
            out = wrench(y, flight, row)
        return out

    return load
