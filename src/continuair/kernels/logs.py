"""Device code of log rows: of whole states, or of the tip alone."""

from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree, device_types
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.step import stepping_code
from continuair.vehicle.layout import TIP_POSE


@cache
def state_logger(numbers: Numbers, tree: Tree) -> Any:
    """Return the function `log_row`: state, branches and actuator wrench, in the order of `Layout`.

    It writes a sample for each run where it is due.
    """
    types, stepping = device_types(numbers, tree), stepping_code(numbers, tree)
    Cell, Real, State, Push, Branch = (
        types.Cell, types.Real, types.State, types.Push, stepping.Branch,
    )  # fmt: skip
    keep_where = number_code(numbers).keep_where
    Flight, signed_of = flight_code(numbers, tree).Flight, stepping.signed_of
    euler_of = stepping.euler_of
    layout = types.layout
    width, bends, pushes = layout.state, layout.bends, layout.push.stop
    B, DB = layout.bend.start, layout.bend_rate.start
    branch_at, command_at, euler_at = layout.branch.start, layout.command.start, layout.euler.start
    columns = layout.log
    Row = wp.types.vector(columns, Real)

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Cell), sample: Real, due: Real, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        unit = flight.plant.unit
        row = Row()
        for j in range(width):
            row[j] = y[j]
        for j in range(bends):
            row[B + j] = y[B + j] / unit[j]
            row[DB + j] = y[DB + j] / unit[j]
        signed = signed_of(branch, y, unit)
        for j in range(bends):
            row[branch_at + j] = signed[j]
        euler = euler_of(branch)
        for j in range(3):
            row[euler_at + j] = euler[j]
        for j in range(pushes):
            row[command_at + j] = push[j]
        for j in range(columns):
            keep_where(log, flight.run, sample, j, row[j], due)

    return log_row


@cache
def push_reader(numbers: Numbers, tree: Tree) -> Any:
    """Return logged_push(log, run, sample), which reads a logged actuator wrench."""
    types, of_sample = device_types(numbers, tree), number_code(numbers).of_sample
    Cell, Push, layout = types.Cell, types.Push, types.layout
    pushes, command_at = layout.push.stop, layout.command.start

    @wp.func
    def logged_push(log: wp.array3d(dtype=Cell), run: int, sample: int):
        push = Push()
        for j in range(pushes):
            push[j] = of_sample(log, run, sample, command_at + j)
        return push

    return logged_push


@cache
def tip_logger(numbers: Numbers, tree: Tree) -> Any:
    """Return the function `log_row` that writes the pose of the camera's tip, TIP_POSE."""
    types, tip_of = device_types(numbers, tree), tip_code(numbers, tree).tip_of(tree.camera_arm)
    Cell, Real, State, Push = types.Cell, types.Real, types.State, types.Push
    keep_where = number_code(numbers).keep_where
    Flight, Branch = (
        flight_code(numbers, tree).Flight,
        stepping_code(numbers, tree).Branch,
    )
    position_of, attitude_of = types.position_of, types.attitude_of
    P, Q = TIP_POSE["position"].start, TIP_POSE["attitude"].start

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Cell), sample: Real, due: Real, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        q = attitude_of(y)
        tip = tip_of(y, flight.plant)
        at = position_of(y) + wp.quat_rotate(q, tip.point)
        turn = q * tip.attitude
        for j in range(3):
            keep_where(log, flight.run, sample, P + j, at[j], due)
        for j in range(4):
            keep_where(log, flight.run, sample, Q + j, turn[j], due)

    return log_row
