"""Factory of all kernels, from precision, tree of arms, model and controller."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import warp as wp

from continuair.device.arguments import Arguments, arguments
from continuair.device.numbers import DIRECTIONS, Numbers
from continuair.device.types import Tree, Types, device_types
from continuair.engine.compiling import compiles, made_once
from continuair.engine.law_made import MadeLaw
from continuair.engine.law_parts import check_reading
from continuair.errors import InputError
from continuair.kernels.adaptive import adaptive_kernel
from continuair.kernels.deviations import deviation_kernel
from continuair.kernels.dynamics import dynamics_code
from continuair.kernels.energies import energies_kernel
from continuair.kernels.flight import FlightCode, flight_code
from continuair.kernels.integrators import TSIT5
from continuair.kernels.logs import state_logger, tip_logger
from continuair.kernels.observe import observe_kernel, tips_kernel, watch_kernel
from continuair.kernels.rollout import derivative_kernel, rollout_kernel
from continuair.kernels.sensing.camera import CameraCode, camera_code
from continuair.kernels.sensing.guided import guided_pilot
from continuair.kernels.sensing.pilot import PilotCode, law_pilot, no_pilot
from continuair.kernels.slopes import step_slopes_kernel, tip_slopes_kernel
from continuair.kernels.turning import turning_kernel
from continuair.terms import TERMS
from continuair.vehicle.layout import OF_BODIES, OF_TIPS


@dataclass(frozen=True)
class Kernels:
    """Kernels of a model in open loop, and the structs of their arguments.

    lanes: runs per thread, 1 or those of a pack. method: integrator of roll-outs, by its name in
    kernels/integrators.py. tip_rollout logs only the tip's pose. A kernel is made on first access,
    and compiled on first launch.
    """

    numbers: Numbers
    tree: Tree
    model: str
    method: str = "RK4"

    @property
    def lanes(self) -> int:
        return self.numbers.lanes

    @property
    def types(self) -> Types:
        return _types(self.numbers, self.tree)

    @property
    def structs(self) -> FlightCode:
        return _structs(self.numbers, self.tree)

    @property
    def arguments(self) -> Arguments:
        return _arguments(self.numbers.precision)

    @property
    def pilot(self) -> PilotCode:
        return _no_pilot(self.numbers, self.tree)

    @property
    def rollout(self) -> wp.Kernel:
        return _rollout(self.numbers, self.tree, self.model, state_logger, self.method)

    @property
    def tip_rollout(self) -> wp.Kernel:
        return _rollout(self.numbers, self.tree, self.model, tip_logger, self.method)

    @property
    def derivative(self) -> wp.Kernel:
        return _derivative(self.numbers, self.tree, self.model)

    @property
    def observe(self) -> wp.Kernel:
        return _observe(self.numbers, self.tree, self.model)

    @property
    def tips(self) -> wp.Kernel:
        return _tips(self.numbers, self.tree)

    def observers(self, names: Collection[str]) -> list[wp.Kernel]:
        """Return the kernels that compute quantities along a log, by name, in their own columns."""
        found: list[wp.Kernel | None] = []
        wanted = set(names)
        if wanted & set(OF_TIPS) and self.tree.sections:
            found.append(self.tips)
        if wanted & set(OF_BODIES):
            found.append(self.observe)
        if wanted - {*OF_TIPS, *OF_BODIES}:
            found += [_observer_of(term, self.numbers, self.tree) for term in self.tree.terms]
            if self.tree.layout.energies:
                found.append(_energies(self.numbers, self.tree))
        return [kernel for kernel in found if kernel is not None]


@dataclass(frozen=True)
class LoopKernels:
    """Kernel `rollout` with a control law, and the types of its arguments.

    remembered: size of the law's memory; looks: whether a law with memory uses the camera.
    """

    law: MadeLaw
    model: str
    how: Closing
    pilot: PilotCode
    camera: CameraCode
    Gains: Any
    remembered: int = 0
    looks: bool = False

    @property
    def lanes(self) -> int:
        """Return the runs per thread, 1 or those of a pack."""
        return self.law.code.numbers.lanes

    @property
    def rollout(self) -> wp.Kernel:
        # Made on first access: of single runs and packs only one is used.
        return _closed_rollout(self.law, self.model, self.how)


def kernels(precision: str, tree: Tree, model: str, lanes: int = 1, method: str = "RK4") -> Kernels:
    """Return the kernels of a model in open loop; lanes: runs of a pack, or 1."""
    return Kernels(Numbers(precision, lanes), tree, model, method)


# Types are made once, too: two types of the same name would not be equal.
_types, _structs = made_once(device_types), made_once(flight_code)
_arguments, _no_pilot = made_once(arguments), made_once(no_pilot)


@made_once
def _rollout(
    numbers: Numbers, tree: Tree, model: str, logger: Callable[..., Any], method: str
) -> wp.Kernel:
    of = numbers, tree
    dynamics, pilot = dynamics_code(*of, model), no_pilot(*of)
    if method == TSIT5:
        return adaptive_kernel(*of, dynamics, pilot, logger(*of))
    return rollout_kernel(*of, dynamics, pilot, logger(*of), method)


@made_once
def _derivative(numbers: Numbers, tree: Tree, model: str) -> wp.Kernel:
    return derivative_kernel(numbers, tree, dynamics_code(numbers, tree, model))


@made_once
def _observe(numbers: Numbers, tree: Tree, model: str) -> wp.Kernel:
    return observe_kernel(numbers, tree, dynamics_code(numbers, tree, model))


@made_once
def _tips(numbers: Numbers, tree: Tree) -> wp.Kernel:
    return tips_kernel(numbers, tree)


@made_once
def _observer_of(term: Any, numbers: Numbers, tree: Tree) -> wp.Kernel | None:
    return term.observer(numbers, tree)


@made_once
def _energies(numbers: Numbers, tree: Tree) -> wp.Kernel:
    return energies_kernel(numbers, tree)


@dataclass(frozen=True)
class Closing:
    """Variant of a closed loop.

    every_stage: whether the law acts at every stage; method: integrator; integrates: whether the
    image error is integrated; believes: whether the law has a nominal model of its own.
    """

    every_stage: bool = False
    method: str = "RK4"
    integrates: bool = False
    believes: bool = False


@made_once
def closed_loop(law: MadeLaw, model: str, how: Closing) -> LoopKernels:
    """Return the roll-out with a control law.

    Raises InputError if constants of the law lose digits, or it uses the camera without a target.
    """
    found, points = law.parts, law.code.points
    of = law.code.numbers, law.code.tree
    check_reading(found, law.code)
    if hasattr(found, "Memory"):
        pilot = guided_pilot(*of, points, found, how.believes)
    else:
        choices = how.every_stage, how.integrates, how.believes
        pilot = law_pilot(*of, points, found, *choices)
    remembered = found.Memory._length_ if hasattr(found, "Memory") else 0
    looks = remembered > 0 and found.looks
    of_camera = camera_code(*of, points)
    return LoopKernels(law, model, how, pilot, of_camera, found.Gains, remembered, looks)


@made_once
def _closed_rollout(law: MadeLaw, model: str, how: Closing) -> wp.Kernel:
    of = law.code.numbers, law.code.tree
    pilot, logger = closed_loop(law, model, how).pilot, state_logger(*of)
    dynamics = dynamics_code(*of, model)
    if how.method == TSIT5:
        return adaptive_kernel(*of, dynamics, pilot, logger, how.every_stage, law.name)
    return rollout_kernel(*of, dynamics, pilot, logger, how.method, law.name)


@made_once
def packed_loop(law: MadeLaw, model: str, how: Closing) -> LoopKernels | None:
    """Return the same for packs of runs, loaded, or None if the law does not support packs.

    Such a law branches on its numbers, calls functions without a form for packs, or has gains of
    other types.
    """
    try:
        found = closed_loop(law, model, how)
    except Exception:
        # A law may raise anything with unexpected number types.
        return None
    fit = _numbers_alone(found.Gains, law.code.Real)
    return found if fit and compiles(found.rollout) else None


def _numbers_alone(kind: Any, Real: Any) -> bool:
    """Return whether a struct has only numbers, vectors and matrices of one type."""
    kinds = [variable.type for variable in kind.vars.values()]
    return all(getattr(each, "_wp_scalar_type_", each) is Real for each in kinds)


@made_once
def deviation(precision: str, lanes: int = 1) -> wp.Kernel:
    """Return the kernel that compares logged tips, the same for every model."""
    return deviation_kernel(Numbers(precision, lanes))


@made_once
def turning(precision: str) -> wp.Kernel:
    """Return the kernel that detects rotations too large for Euler angles to be followed."""
    return turning_kernel(getattr(wp, precision))


@made_once
def watching(
    precision: str, tree: Tree, points: int, lanes: int = 1
) -> tuple[wp.Kernel, CameraCode]:
    """Return the kernel `watch`, the same for every model, and its camera code."""
    of = Numbers(precision, lanes), tree
    of_camera = camera_code(*of, points)
    return watch_kernel(*of, of_camera), of_camera


_DUAL = Numbers("float64", DIRECTIONS, dual=True)


@made_once
def step_slopes(tree: Tree, model: str) -> tuple[wp.Kernel, Any]:
    """Return the kernel of derivatives of a model's steps, loaded, and the struct of its vehicles.

    Raises InputError if it does not compile with dual numbers.
    """
    kernel = step_slopes_kernel(_DUAL, tree, dynamics_code(_DUAL, tree, model))
    if not compiles(kernel):
        own = [type(term).__name__ for term in tree.terms if type(term) not in TERMS]
        if own:
            raise InputError(
                f"term {own[0]}",
                "does not compile with dual numbers",
                "leave differentiable out of its class, or write it for dual numbers",
            )
        raise InputError(
            "gradient",
            f"does not compile here with Warp {wp.__version__}",
            "use another version of Warp",
        )
    return kernel, flight_code(_DUAL, tree).Vehicles


@made_once
def tip_slopes(tree: Tree) -> wp.Kernel:
    """Return the kernel of derivatives of tips, the same for every model."""
    return tip_slopes_kernel(_DUAL, tree)
