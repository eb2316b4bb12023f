"""The factory of all kernels: from precision, number of sections, model and controller."""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import warp as wp

from continuair.errors import InputError
from continuair.kernels.arm.one_section import section_code
from continuair.kernels.closed_loop import controlled, watcher
from continuair.kernels.deviations import deviation_kernel, tip_logger
from continuair.kernels.dynamics import device_code
from continuair.kernels.observe import observer
from continuair.kernels.rollout import differentiator, integrator
from continuair.kernels.sensing.eye import vision_code
from continuair.kernels.sensing.sense import control_code
from continuair.kernels.step import stepping_code


@cache
def kernels(precision: str, sections: int, model: str) -> SimpleNamespace:
    """The kernels of a model in open loop; `tip_rollout` logs the tip's pose and nothing else."""
    code = _plant_code(precision, sections, model)
    return SimpleNamespace(
        code=code,
        rollout=integrator(code, code.log_row),
        tip_rollout=integrator(code, tip_logger(code)),
        derivative=differentiator(code),
        observe=observer(code),
    )


@cache
def deviation(precision: str) -> wp.Kernel:
    """The kernel that compares logged tips, the same for every model."""
    return deviation_kernel(wp.float64 if precision == "float64" else wp.float32)


@cache
def closed_loop(
    precision: str,
    sections: int,
    model: str,
    law: Callable[..., SimpleNamespace],
    points: int,
    every_stage: bool,
) -> SimpleNamespace:
    """The kernel `rollout` with a controller's law, and the types of its arguments."""
    code = _seeing_code(precision, sections, model, points)
    # Laws push with what they sense: control_code has its own camera_push.
    code = SimpleNamespace(**{**vars(code), **vars(control_code(code))})
    found = law(code)
    for name in ("Gains", "control"):
        if not hasattr(found, name):
            raise InputError(
                f"law gives no {name}; return a namespace with Gains, a Warp struct, and control, "
                "a Warp function."
            )
    rollout, Scene = controlled(code, found, every_stage)
    return SimpleNamespace(code=code, rollout=rollout, Scene=Scene, Gains=found.Gains)


@cache
def watch_kernel(precision: str, sections: int, points: int) -> SimpleNamespace:
    """The kernel `watch`, the same for every model."""
    code = _seeing_code(precision, sections, "coupled", points)
    return SimpleNamespace(code=code, watch=watcher(code))


@cache
def _plant_code(precision: str, sections: int, model: str) -> SimpleNamespace:
    code = device_code(precision, sections, model)
    return SimpleNamespace(**vars(code), **vars(stepping_code(code)))


@cache
def _seeing_code(precision: str, sections: int, model: str, points: int) -> SimpleNamespace:
    code, vision = _plant_code(precision, sections, model), _vision(precision, sections, points)
    return SimpleNamespace(**{**vars(vision), **vars(code)})


@cache
def _vision(precision: str, sections: int, points: int) -> SimpleNamespace:
    return vision_code(section_code(precision, sections), points)
