"""The kernels compile for CUDA without a card: Warp brings the compiler along."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import warp as wp

from continuair.controllers.servoing import law
from continuair.device.types import Tree
from continuair.engine.compiling import start_warp
from continuair.engine.factory import Closing, closed_loop, kernels, watching
from continuair.engine.law_made import made_law
from continuair.sections import arcs
from continuair.sections.strain import StrainField
from continuair.terms import ActuatorWrench, ArmDrag, PaperTorques, RotorThrusts, TipWrench, UavDrag
from continuair.vehicle.strain import Orders

INPUTS = ActuatorWrench(), PaperTorques(), TipWrench()
ONE, ARMS = Tree(arcs(1), terms=INPUTS), Tree(arcs(2, 1), bodies=True, turned=True, terms=INPUTS)
THRUSTS = RotorThrusts(count=6, prompt=True, washing=True)
ALL = ActuatorWrench(), PaperTorques(), THRUSTS, UavDrag(), ArmDrag(), TipWrench()
FURNISHED = Tree(arcs(2, 1), turned=True, terms=ALL)
STRAINED = Tree(((StrainField(6, Orders(bending=1, twist=1)),),))
HOPPER = 90
"""Compute capability 9.0, of the H100 and H200."""

KERNELS: dict[str, Callable[[], Any]] = {
    "coupled roll-out, float64": lambda: kernels("float64", ONE, "coupled").rollout,
    "coupled roll-out, float32": lambda: kernels("float32", ONE, "coupled").rollout,
    "implicit steps": lambda: kernels("float64", ONE, "coupled", method="implicit").rollout,
    "error control": lambda: kernels("float64", ONE, "coupled", method="Tsit5").rollout,
    "error control, tips, float32": lambda: (
        kernels("float32", ONE, "coupled", method="Tsit5").tip_rollout
    ),
    "decoupled rates": lambda: kernels("float64", ONE, "decoupled").derivative,
    "independent rates": lambda: kernels("float64", ONE, "independent").derivative,
    "observed quantities": lambda: kernels("float64", ONE, "coupled").observe,
    "tips": lambda: kernels("float64", ONE, "coupled").tips,
    "closed loop": lambda: (
        closed_loop(made_law(law, "float64", ONE, 4), "coupled", Closing()).rollout
    ),
    "closed loop, error control": lambda: (
        closed_loop(made_law(law, "float64", ONE, 4), "coupled", Closing(method="Tsit5")).rollout
    ),
    "two arms, one of two sections": lambda: kernels("float64", ARMS, "coupled").rollout,
    "strain field": lambda: kernels("float64", STRAINED, "coupled").rollout,
    "what the camera sees": lambda: watching("float64", ONE, 4)[0],
    "rotors, drag and wash": lambda: kernels("float64", FURNISHED, "coupled").rollout,
    "thrusts": lambda: kernels("float64", FURNISHED, "coupled").observers(["rotor_thrust"])[0],
}


_LONG = (
    "two arms, one of two sections",
    "rotors, drag and wash",
    "closed loop",
    "closed loop, error control",
)


@pytest.mark.long
@pytest.mark.parametrize(
    "kernel",
    [
        pytest.param(kernel, id=name, marks=[pytest.mark.soak] if name in _LONG else [])
        for name, kernel in KERNELS.items()
    ],
)
def test_compiles(kernel: Callable[[], Any], tmp_path: Path) -> None:
    start_warp()
    made = wp.compile_aot_module(
        kernel().module, arch=HOPPER, use_ptx=True, module_dir=tmp_path, strip_hash=False
    )
    (code,) = (Path(path).read_text() for path in made)
    assert f".target sm_{HOPPER}" in code and "fma.rn.f" in code
