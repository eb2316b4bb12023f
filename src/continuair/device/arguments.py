"""Structs of kernel arguments that are the same for single runs and for packs."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import holding


@dataclass(frozen=True)
class Arguments:
    """Structs of initial conditions, steps and inputs."""

    Start: Any
    Steps: Any
    Drive: Any


@cache
def arguments(precision: str) -> Arguments:
    """Return the structs for one precision."""
    Cell = getattr(wp, precision)

    @wp.struct
    class Start:
        """Initial conditions.

        states (runs, 1, state); frozen: the same, or the states that the model "independent"
        freezes; angle (runs, sections + 3): ψa of each section, roll, pitch and yaw.
        """

        states: wp.array3d(dtype=Cell)
        frozen: wp.array3d(dtype=Cell)
        angle: wp.array2d(dtype=Cell)

    @wp.struct
    class Steps:
        """Starts and lengths of the steps, and the sample at the end of each step, or -1."""

        starts: wp.array(dtype=Cell)
        lengths: wp.array(dtype=Cell)
        sample_after: wp.array(dtype=wp.int32)

    @wp.struct
    class Drive:
        """Inputs (rows, runs or 1, inputs), rows per step (3 or 0), groups in use and gravity."""

        inputs: wp.array3d(dtype=Cell)
        stride: wp.int32
        groups: wp.int32
        gravity: Cell

    return holding(Arguments, locals())
