"""The factory of all kernels: from precision, tree of arms, model and controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import warp as wp

from continuair.engine.compiling import made_once
from continuair.errors import InputError
from continuair.kernels.deviations import deviation_kernel
from continuair.kernels.dynamics import dynamics_code
from continuair.kernels.flight import FlightCode, flight_code
from continuair.kernels.logs import state_logger, tip_logger
from continuair.kernels.observe import observe_kernel, watch_kernel
from continuair.kernels.rollout import Arguments, arguments, derivative_kernel, rollout_kernel
from continuair.kernels.sensing.eye import Eye, eye_code
from continuair.kernels.sensing.pilot import PilotCode, law_pilot, no_pilot
from continuair.kernels.sensing.sense import law_code
from continuair.kernels.turning import turning_kernel
from continuair.kernels.types import Tree, Types, device_types


@dataclass(frozen=True)
class Kernels:
    """Kernels of a model in open loop, and the structs of their arguments.

    tip_rollout logs the tip's pose and nothing else.
    """

    types: Types
    structs: FlightCode
    arguments: Arguments
    pilot: PilotCode
    rollout: wp.Kernel
    tip_rollout: wp.Kernel
    derivative: wp.Kernel
    observe: wp.Kernel


@dataclass(frozen=True)
class LoopKernels:
    """The kernel `rollout` with a controller's law, and the types of its arguments."""

    rollout: wp.Kernel
    pilot: PilotCode
    eye: Eye
    Gains: Any


@made_once
def kernels(precision: str, tree: Tree, model: str) -> Kernels:
    """The kernels of a model in open loop; each compiles when it is first launched."""
    of = precision, tree
    dynamics, pilot = dynamics_code(*of, model), no_pilot(*of)
    return Kernels(
        types=device_types(*of),
        structs=flight_code(*of),
        arguments=arguments(precision),
        pilot=pilot,
        rollout=rollout_kernel(*of, dynamics, pilot, state_logger(*of)),
        tip_rollout=rollout_kernel(*of, dynamics, pilot, tip_logger(*of)),
        derivative=derivative_kernel(*of, dynamics),
        observe=observe_kernel(*of, dynamics),
    )


@made_once
def closed_loop(
    precision: str,
    tree: Tree,
    model: str,
    law: Callable[..., SimpleNamespace],
    points: int,
    every_stage: bool,
) -> LoopKernels:
    """The roll-out with a controller's law; raises InputError for a law without its parts."""
    of = precision, tree
    found = law(law_code(*of, points))
    for name in ("Gains", "control"):
        if not hasattr(found, name):
            raise InputError(
                f"law gives no {name}; return a namespace with Gains, a Warp struct, and control, "
                "a Warp function."
            )
    pilot = law_pilot(*of, points, found, every_stage)
    rollout = rollout_kernel(*of, dynamics_code(*of, model), pilot, state_logger(*of))
    return LoopKernels(rollout, pilot, eye_code(*of, points), found.Gains)


@made_once
def deviation(precision: str) -> wp.Kernel:
    """The kernel that compares logged tips, the same for every model."""
    return deviation_kernel(getattr(wp, precision))


@made_once
def turning(precision: str) -> wp.Kernel:
    """The kernel that finds turns of logged tips which may lose Euler angles."""
    return turning_kernel(getattr(wp, precision))


@made_once
def watching(precision: str, tree: Tree, points: int) -> tuple[wp.Kernel, Eye]:
    """The kernel `watch`, the same for every model, and its eye."""
    eye = eye_code(precision, tree, points)
    return watch_kernel(precision, tree, eye), eye
