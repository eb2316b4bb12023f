"""Random vehicles within the paper's unstated parameters, in its open-loop tests.

The paper prints no table of parameters. Its statements on Tests A to D are therefore judged with
its preset, and by whether they hold for most vehicles that it could have used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS, open_loop_test, tip_chirp
from continuair import Scenario, Vehicle, run_pairs
from continuair.analysis import RTOL
from continuair.flight import RESOLVED, tells_rotation
from continuair.sweeps import sobol_box
from continuair.warning import untold

Array = np.ndarray

VEHICLES, SEED = 128, 0

RANGES = {
    "arm.radius": (1e-3, 1e-2),
    "arm.length": (0.5, 1.5),
    "arm.youngs_modulus": (40e9, 207e9),
    "uav.mass": (1.0, 3.0),
}
"""Ranges of the paper's sweeps; below 1.5 m it prints no length. The inertia follows the mass."""

MOST = 0.5
"""A share above this counts as most."""

FORCE_ON_UAV, MOMENT_ON_UAV = "the force of Test D on the UAV", "a moment on the UAV"


@dataclass(frozen=True)
class Drawn:
    """Errors of the decoupled model by test, for each vehicle drawn that flew them all to the end,
    resolved.

    position: RMSE of the tip [m]; rotation: RMSE of its Euler angles [rad], or of a vehicle whose
    angles samples do not follow in every test the angle between the tips; length: of the arm [m].
    """

    position: dict[str, Array]
    rotation: dict[str, Array]
    length: Array

    def share(self, holds: Array) -> float:
        """Return the share of the vehicles for which something holds."""
        return float(np.mean(holds))


def fly_drawn(vehicle: Vehicle) -> Drawn:
    """Simulate Tests A to D, and other excitations of the UAV, with VEHICLES vehicles."""
    drawn = vehicle.replace(draw(vehicle))
    found = {name: _fly(drawn, each) for name, each in _scenarios().items()}
    well = np.all([_well(each) for each in found.values()], axis=0)

    def of(metric: str) -> dict[str, Array]:
        return {
            name: each[metric].sel(model="decoupled").to_numpy()[well]
            for name, each in found.items()
        }

    length = np.asarray(drawn.arm.length)[well]
    return Drawn(of("rmse_t_m"), _rotation(of("rmse_r_rad"), of("angle_rad")), length)


def error_under_a_moment(vehicle: Vehicle) -> float:
    """Return the RMSE of a vehicle's decoupled tip with the moment on its UAV [m], or NaN."""
    found = _fly(vehicle, _scenarios()[MOMENT_ON_UAV])
    error = found["rmse_t_m"].sel(model="decoupled").where(_well(found))
    return float(error.item())


@untold("error_estimate")
def _fly(vehicle: Vehicle, scenario: Scenario) -> xr.Dataset:
    return run_pairs(vehicle, scenario, rtol=RTOL, check=True)


def _well(found: xr.Dataset) -> Array:
    ended = (found["status"] != 0) | (found["error_estimate"] > RESOLVED)
    return np.asarray(~ended.any("model"))


def _rotation(euler: dict[str, Array], angle: dict[str, Array]) -> dict[str, Array]:
    """Return errors in rotation by test, each vehicle's of one kind."""
    of_euler = np.all([tells_rotation(euler[name], angle[name]) for name in euler], axis=0)
    return {name: np.where(of_euler, euler[name], angle[name]) for name in euler}


def draw(vehicle: Vehicle, count: int = VEHICLES) -> dict[str, Array]:
    """Return the fields of vehicles drawn from RANGES, and their inertia, each (count, ...)."""
    fields = sobol_box(RANGES, count, SEED)
    scale = fields["uav.mass"] / vehicle.uav.mass
    return fields | {"uav.inertia": scale[:, None, None] * np.asarray(vehicle.uav.inertia)}


def _scenarios() -> dict[str, Scenario]:
    tests = {name: open_loop_test(name) for name in OPEN_LOOP_TESTS}
    fall = tests["B"]
    return tests | {
        FORCE_ON_UAV: fall.replace(force=_force_of_test_d),
        MOMENT_ON_UAV: fall.replace(moment=[1.0, 0.0, 0.0]),
    }


def _force_of_test_d(t: float) -> tuple[float, ...]:
    return tip_chirp(t)[:3]
