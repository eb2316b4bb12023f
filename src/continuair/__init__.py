"""Simulation and analysis of aerial continuum manipulators.

*vehicle, scenario, model -> simulate -> trajectory -> metric -> figure.*
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from continuair import paths as paths
    from continuair.beam import curvature_error as curvature_error
    from continuair.controllers.classic import classic as classic
    from continuair.controllers.controller import Controller as Controller
    from continuair.controllers.controller import stack as stack
    from continuair.controllers.gains import design as design
    from continuair.controllers.gains import rigid_inertia as rigid_inertia
    from continuair.controllers.hold import hold as hold
    from continuair.controllers.servoing import servoing as servoing
    from continuair.errors import ContinuairWarning as ContinuairWarning
    from continuair.errors import InputError as InputError
    from continuair.interactive import Simulation as Simulation
    from continuair.linear import linearize as linearize
    from continuair.linear import modes as modes
    from continuair.linear import trim as trim
    from continuair.metrics import compare as compare
    from continuair.scenarios import Scenario as Scenario
    from continuair.scenarios import open_loop_test as open_loop_test
    from continuair.simulation import MODELS as MODELS
    from continuair.simulation import forward_dynamics as forward_dynamics
    from continuair.simulation import simulate as simulate
    from continuair.sweeps import open_sweep as open_sweep
    from continuair.sweeps import run_pairs as run_pairs
    from continuair.sweeps import sweep as sweep
    from continuair.targets import Target as Target
    from continuair.targets import square as square
    from continuair.vehicle import Vehicle as Vehicle
    from continuair.vehicle import load_vehicle as load_vehicle
    from continuair.vehicle import preset_names as preset_names

_HOME = {
    "ContinuairWarning": "errors",
    "InputError": "errors",
    "Vehicle": "vehicle",
    "load_vehicle": "vehicle",
    "preset_names": "vehicle",
    "Scenario": "scenarios",
    "open_loop_test": "scenarios",
    "simulate": "simulation",
    "forward_dynamics": "simulation",
    "MODELS": "simulation",
    "curvature_error": "beam",
    "linearize": "linear",
    "modes": "linear",
    "trim": "linear",
    "compare": "metrics",
    "Simulation": "interactive",
    "Target": "targets",
    "square": "targets",
    "Controller": "controllers.controller",
    "stack": "controllers.controller",
    "servoing": "controllers.servoing",
    "classic": "controllers.classic",
    "hold": "controllers.hold",
    "design": "controllers.gains",
    "rigid_inertia": "controllers.gains",
    "open_sweep": "sweeps",
    "run_pairs": "sweeps",
    "sweep": "sweeps",
}
__all__ = sorted([*_HOME, "paths"])


def __getattr__(name: str) -> Any:
    # Names load on first use: the import itself stays light and compiles nothing.
    if name == "paths":
        return import_module("continuair.paths")
    if name == "__version__":
        return import_module("importlib.metadata").version("continuair")
    if name not in _HOME:
        raise AttributeError(f"module 'continuair' has no attribute {name!r}")
    return getattr(import_module(f"continuair.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
