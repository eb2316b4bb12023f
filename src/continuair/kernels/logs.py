"""Device code that writes a row of a log: the whole state, or the pose of the tip alone."""

from functools import cache
from typing import Any

import warp as wp

from continuair.kernels.arm.one_section import section_code
from continuair.kernels.flight import flight_code
from continuair.kernels.step import stepping_code
from continuair.kernels.types import device_types
from continuair.vehicle.layout import TIP_POSE


@cache
def state_logger(precision: str, sections: int) -> Any:
    """The function `log_row`: state, branch and push, as `Layout` orders a log row."""
    types, stepping = device_types(precision, sections), stepping_code(precision, sections)
    Real, State, Push, Branch = types.Real, types.State, types.Push, stepping.Branch
    Flight, angle_of = flight_code(precision, sections).Flight, stepping.angle_of
    bend_of, layout = types.bend_of, types.layout
    width, bends, pushes = layout.state, layout.bends, layout.push.stop
    B, DB = layout.bend.start, layout.bend_rate.start
    branch_at, command_at = layout.branch.start, layout.command.start

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Real), run: int, sample: int, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        unit = flight.plant.unit
        for j in range(width):
            log[run, sample, j] = y[j]
        for j in range(bends):
            log[run, sample, B + j] = y[B + j] / unit
            log[run, sample, DB + j] = y[DB + j] / unit
        log[run, sample, branch_at] = wp.dot(bend_of(y), branch.direction) / unit
        log[run, sample, branch_at + 1] = angle_of(branch)
        for j in range(pushes):
            log[run, sample, command_at + j] = push[j]

    return log_row


@cache
def tip_logger(precision: str, sections: int) -> Any:
    """The function `log_row` that writes the tip's pose, TIP_POSE, and nothing else."""
    types, section = device_types(precision, sections), section_code(precision, sections)
    Real, State, Push = types.Real, types.State, types.Push
    Flight, Branch = (
        flight_code(precision, sections).Flight,
        stepping_code(precision, sections).Branch,
    )
    position_of, attitude_of, bend_of = types.position_of, types.attitude_of, types.bend_of
    tip_of, tip_attitude = section.tip_of, section.tip_attitude
    P, Q = TIP_POSE["position"].start, TIP_POSE["attitude"].start

    @wp.func
    def log_row(
        log: wp.array3d(dtype=Real), run: int, sample: int, y: State, flight: Flight,
        branch: Branch, push: Push,
    ):  # fmt: skip
        q, b, plant = attitude_of(y), bend_of(y), flight.plant
        at = position_of(y) + wp.quat_rotate(q, plant.mount + plant.unit * tip_of(b).point)
        turn = q * tip_attitude(b)
        for j in range(3):
            log[run, sample, P + j] = at[j]
        for j in range(4):
            log[run, sample, Q + j] = turn[j]

    return log_row
