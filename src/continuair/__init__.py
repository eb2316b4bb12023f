"""Simulation and analysis of aerial continuum manipulators.

*vehicle, scenario, model -> simulate -> trajectory -> metric -> figure.*
"""

from importlib import import_module

# Without the module typing, which takes longer to load than the rest of this file. Until `__main__`
# is loaded, Python handles Ctrl-C.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    __version__: str
    from continuair import equations as equations
    from continuair.analysis.accelerations import accelerations as accelerations
    from continuair.analysis.accelerations import forward_dynamics as forward_dynamics
    from continuair.analysis.beam import curvature_error as curvature_error
    from continuair.analysis.gradient import gradient as gradient
    from continuair.analysis.linear import linearize as linearize
    from continuair.analysis.lyapunov import lyapunov as lyapunov
    from continuair.analysis.metrics import compare as compare
    from continuair.analysis.modes import modes as modes
    from continuair.analysis.motion import backbone as backbone
    from continuair.analysis.pressing import pressing as pressing
    from continuair.analysis.tendon_tensions import tendon_tensions as tendon_tensions
    from continuair.analysis.trim import trim as trim
    from continuair.controllers.classic import classic as classic
    from continuair.controllers.controller import Controller as Controller
    from continuair.controllers.controller import stack as stack
    from continuair.controllers.flight import flight_controller as flight_controller
    from continuair.controllers.gain_files import Gains as Gains
    from continuair.controllers.gain_files import load_gains as load_gains
    from continuair.controllers.gains import design as design
    from continuair.controllers.hold import hold as hold
    from continuair.controllers.inertias import rigid_inertia as rigid_inertia
    from continuair.controllers.servoing import servoing as servoing
    from continuair.controllers.twist_servoing import twist_servoing as twist_servoing
    from continuair.errors import ContinuairWarning as ContinuairWarning
    from continuair.errors import InputError as InputError
    from continuair.figures import plot as plot
    from continuair.flight.live import Simulation as Simulation
    from continuair.flight.reading import read_result as read_result
    from continuair.flight.simulate import simulate as simulate
    from continuair.interfaces import frames as frames
    from continuair.interfaces.casadi_model import to_casadi as to_casadi
    from continuair.interfaces.csv_table import to_csv as to_csv
    from continuair.interfaces.drone_models import drone_models_vehicle as drone_models_vehicle
    from continuair.interfaces.gltf import to_gltf as to_gltf
    from continuair.interfaces.mcap_log import to_mcap as to_mcap
    from continuair.interfaces.mjcf import to_mjcf as to_mjcf
    from continuair.interfaces.rosbag import read_rosbag as read_rosbag
    from continuair.interfaces.rotorpy import rotorpy_vehicle as rotorpy_vehicle
    from continuair.interfaces.ulog import read_ulog as read_ulog
    from continuair.kernels.dynamics import MODELS as MODELS
    from continuair.scenario import paths as paths
    from continuair.scenario.obstacles import Box as Box
    from continuair.scenario.obstacles import Cylinder as Cylinder
    from continuair.scenario.obstacles import Obstacle as Obstacle
    from continuair.scenario.obstacles import Plane as Plane
    from continuair.scenario.obstacles import Sphere as Sphere
    from continuair.scenario.payload import Payload as Payload
    from continuair.scenario.scenarios import Scenario as Scenario
    from continuair.scenario.setpoints import Setpoints as Setpoints
    from continuair.scenario.targets import Target as Target
    from continuair.scenario.targets import square as square
    from continuair.scenario.wind import dryden as dryden
    from continuair.scenario.wind import gust as gust
    from continuair.scenario.wrench import Wrench as Wrench
    from continuair.studies.advise.study import advise as advise
    from continuair.sweeps import open_sweep as open_sweep
    from continuair.sweeps import run_pairs as run_pairs
    from continuair.sweeps import sweep as sweep
    from continuair.terms.term import Term as Term
    from continuair.vehicle.camera import Camera as Camera
    from continuair.vehicle.combined import combine_fits as combine_fits
    from continuair.vehicle.section import Section as Section
    from continuair.vehicle.uncertain import UncertainVehicle as UncertainVehicle
    from continuair.vehicle.uncertain import band as band
    from continuair.vehicle.uncertain import load_uncertain as load_uncertain
    from continuair.vehicle.vehicle import Vehicle as Vehicle
    from continuair.vehicle.vehicle import load_vehicle as load_vehicle
    from continuair.vehicle.vehicle import preset_names as preset_names
    from continuair.viewer.video import animate as animate
    from continuair.viewer.view import view as view

_HOME = {
    "ContinuairWarning": "errors",
    "InputError": "errors",
    "UncertainVehicle": "vehicle.uncertain",
    "band": "vehicle.uncertain",
    "combine_fits": "vehicle.combined",
    "load_uncertain": "vehicle.uncertain",
    "Vehicle": "vehicle.vehicle",
    "load_vehicle": "vehicle.vehicle",
    "preset_names": "vehicle.vehicle",
    "Scenario": "scenario.scenarios",
    "Term": "terms.term",
    "Wrench": "scenario.wrench",
    "simulate": "flight.simulate",
    "accelerations": "analysis.accelerations",
    "forward_dynamics": "analysis.accelerations",
    "MODELS": "kernels.dynamics",
    "curvature_error": "analysis.beam",
    "gradient": "analysis.gradient",
    "linearize": "analysis.linear",
    "modes": "analysis.modes",
    "pressing": "analysis.pressing",
    "tendon_tensions": "analysis.tendon_tensions",
    "trim": "analysis.trim",
    "lyapunov": "analysis.lyapunov",
    "compare": "analysis.metrics",
    "Simulation": "flight.live",
    "Target": "scenario.targets",
    "square": "scenario.targets",
    "gust": "scenario.wind",
    "dryden": "scenario.wind",
    "Controller": "controllers.controller",
    "stack": "controllers.controller",
    "flight_controller": "controllers.flight",
    "twist_servoing": "controllers.twist_servoing",
    "Setpoints": "scenario.setpoints",
    "Box": "scenario.obstacles",
    "Cylinder": "scenario.obstacles",
    "Obstacle": "scenario.obstacles",
    "Plane": "scenario.obstacles",
    "Payload": "scenario.payload",
    "Sphere": "scenario.obstacles",
    "servoing": "controllers.servoing",
    "classic": "controllers.classic",
    "hold": "controllers.hold",
    "design": "controllers.gains",
    "rigid_inertia": "controllers.inertias",
    "to_casadi": "interfaces.casadi_model",
    "to_csv": "interfaces.csv_table",
    "to_gltf": "interfaces.gltf",
    "to_mcap": "interfaces.mcap_log",
    "to_mjcf": "interfaces.mjcf",
    "read_result": "flight.reading",
    "read_rosbag": "interfaces.rosbag",
    "read_ulog": "interfaces.ulog",
    "rotorpy_vehicle": "interfaces.rotorpy",
    "drone_models_vehicle": "interfaces.drone_models",
    "advise": "studies.advise.study",
    "open_sweep": "sweeps",
    "run_pairs": "sweeps",
    "sweep": "sweeps",
    "backbone": "analysis.motion",
    "animate": "viewer.video",
    "view": "viewer.view",
    "Camera": "vehicle.camera",
    "Section": "vehicle.section",
    "Gains": "controllers.gain_files",
    "load_gains": "controllers.gain_files",
}
_MODULES = {
    "equations": "equations",
    "paths": "scenario.paths",
    "plot": "figures.plot",
    "frames": "interfaces.frames",
}
_MOVED = {"open_loop_test": "amiri2026.open_loop_test"}
__all__ = sorted([*_HOME, *_MODULES])


def __getattr__(name: str) -> "Any":
    # Names load on first use: the import itself is fast and compiles nothing.
    if name in _MODULES:
        return import_module(f"continuair.{_MODULES[name]}")
    if name == "__version__":
        return import_module("importlib.metadata").version("continuair")
    if name not in _HOME:
        moved = f"; it is {_MOVED[name]} now" if name in _MOVED else ""
        raise AttributeError(f"module 'continuair' has no attribute {name!r}{moved}")
    return getattr(import_module(f"continuair.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
