"""Device code that writes a row of a log: the whole state, or the pose of the tip alone."""

from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.tip import tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.step import stepping_code
from continuair.kernels.types import Tree, device_types
from continuair.vehicle.layout import TIP_POSE


@cache
def state_logger(precision: str, tree: Tree) -> Any:
    """The function `log_row`: state, branches and push, as `Layout` orders a log row."""
    types, stepping = device_types(precision, tree), stepping_code(precision, tree)
    Real, State, Push, Branch = types.Real, types.State, types.Push, stepping.Branch
    Flight, signed_of = flight_code(precision, tree).Flight, stepping.signed_of
    layout = types.layout
    width, bends, pushes = layout.state, layout.bends, layout.push.stop
    B, DB = layout.bend.start, layout.bend_rate.start
    branch_at, command_at, roll_at = layout.branch.start, layout.command.start, layout.roll.start

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Real), run: int, sample: int, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        unit = flight.plant.unit
        for j in range(width):
            log[run, sample, j] = y[j]
        for j in range(bends):
            log[run, sample, B + j] = y[B + j] / unit[j // 2]
            log[run, sample, DB + j] = y[DB + j] / unit[j // 2]
        signed = signed_of(branch, y)
        for k in range(bends // 2):
            log[run, sample, branch_at + 2 * k] = signed[2 * k] / unit[k]
            log[run, sample, branch_at + 2 * k + 1] = signed[2 * k + 1]
        roll = branch.direction
        log[run, sample, roll_at] = wp.atan2(roll[bends + 1], roll[bends])
        for j in range(pushes):
            log[run, sample, command_at + j] = push[j]

    return log_row


@cache
def tip_logger(precision: str, tree: Tree) -> Any:
    """The function `log_row` that writes the pose of the camera's tip, TIP_POSE, alone."""
    types, tip_of = device_types(precision, tree), tip_code(precision, tree).tip_of(tree.eye)
    Real, State, Push = types.Real, types.State, types.Push
    Flight, Branch = (
        flight_code(precision, tree).Flight,
        stepping_code(precision, tree).Branch,
    )
    position_of, attitude_of = types.position_of, types.attitude_of
    P, Q = TIP_POSE["position"].start, TIP_POSE["attitude"].start

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Real), run: int, sample: int, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        q = attitude_of(y)
        tip = tip_of(y, flight.plant)
        at = position_of(y) + wp.quat_rotate(q, tip.point)
        turn = q * tip.attitude
        for j in range(3):
            log[run, sample, P + j] = at[j]
        for j in range(4):
            log[run, sample, Q + j] = turn[j]

    return log_row
