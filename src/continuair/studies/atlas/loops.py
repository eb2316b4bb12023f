"""Paired closed loops over dimensionless groups: vehicles of all kinds write letters."""

from __future__ import annotations

import functools

import numpy as np
import xarray as xr

from continuair.analysis.determinacy import fly_twice
from continuair.analysis.groups import GRAVITY, coupling, vehicle_of
from continuair.controllers.controller import stack
from continuair.controllers.gains import design
from continuair.controllers.servoing import servoing
from continuair.equations.camera import facing
from continuair.kernels.dynamics import PLANTS
from continuair.progress import Progress
from continuair.scenario import paths
from continuair.scenario.letters import LETTERS
from continuair.scenario.scenarios import Scenario
from continuair.scenario.targets import DISTANCE, Target
from continuair.sweeps.closed_pairs import reduced
from continuair.sweeps.sampling import sobol_box
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import untold

Array = np.ndarray

LOOP_RANGES = {
    "mass_ratio": (0.01, 1.0),
    "inertia_ratio": (0.05, 30.0),
    "stiffness": (3.0, 30.0),
    "speed": (0.002, 0.03),
    "damping_ratio": (0.01, 0.1),
    "bandwidth": (1.5, 6.0),
    "length": (0.4, 1.2),
}
"""Ranges, sampled uniformly in the logarithm.

stiffness: clamped frequency over the loop's bandwidth; speed: the target's, over bandwidth times
the camera's distance; bandwidth [rad/s] and length [m] set the scales.
"""

DURATION, SETTLE = 5.0, 1.0
"""Duration of a loop, and from when the image counts [s]."""

SLENDERNESS = 0.01
LOOP_ERRORS = {
    "ds_px": "largest difference of the feature error's norm between the models [px]",
    "rms_px": "RMS of the decoupled model's feature error [px]",
    "coupled_rms_px": "RMS of the coupled model's feature error [px]",
    "error": "RMSE of the tip's position over the arm's length",
    "angle": "RMS of the angle between the tips [rad]",
    "lost_coupled": "1 if the coupled loop lost its target, left the model's range, or chattered "
    "so that rounding decides where it went",
    "lost_decoupled": "1 if the decoupled loop did",
}
"""Recorded values of a pair."""

_CHUNK, _SAMPLE = 64, 0.01
_TIP = ("tip_position", "tip_attitude")


def sample_loops(runs: int, seed: int) -> dict[str, Array]:
    """Return values (runs,) of LOOP_RANGES, a Sobol sequence scrambled by a seed."""
    return sobol_box(LOOP_RANGES, runs, [seed, 100])


def fly_loops(groups: dict[str, Array], progress: Progress | None = None) -> xr.Dataset:
    """Track letters with the coupled and the decoupled plant under the paper's law, designed gains.

    Returns LOOP_ERRORS and the groups over (run), NaN where a loop of the pair was lost.
    """
    runs = len(groups["speed"])
    kept = {name: np.full(runs, np.nan) for name in LOOP_ERRORS}
    strength = np.empty(runs)
    for first in range(0, runs, _CHUNK):
        if progress:
            progress(first, runs, "closed loop")
        part = slice(first, min(first + _CHUNK, runs))
        vehicle = loop_vehicle({name: values[part] for name, values in groups.items()})
        found = _flown(vehicle, {name: values[part] for name, values in groups.items()}, first)
        for name, values in found.items():
            kept[name][part] = values
        strength[part] = coupling(vehicle)
    data = {
        name: ("run", values, {"long_name": LOOP_ERRORS[name]}) for name, values in kept.items()
    }
    plain = {name: ("run", values) for name, values in groups.items()}
    return xr.Dataset({**data, **plain, "coupling": ("run", strength)})


def loop_vehicle(groups: dict[str, Array]) -> Vehicle:
    """Return the batch of vehicles of closed loops."""
    frequency = groups["stiffness"] * groups["bandwidth"]
    shape = {name: groups[name] for name in ("mass_ratio", "inertia_ratio", "damping_ratio")}
    shape["gravity_number"] = GRAVITY / (groups["length"] * frequency**2)
    shape["slenderness"] = np.full(len(frequency), SLENDERNESS)
    return vehicle_of(shape, 2.0 * np.pi / frequency)


def loop_scenario(vehicle: Vehicle, groups: dict[str, Array], first: int = 0) -> Scenario:
    """Return the loops of a batch: run i writes the letter of place first + i in turn.

    The camera starts where the image is the desired one, the arm straight.
    """
    names = list(LETTERS)
    speeds = groups["speed"] * groups["bandwidth"] * DISTANCE
    controllers, targets, q = [], [], np.zeros((len(speeds), 8))
    for run, speed in enumerate(speeds):
        one = vehicle.select(run)
        letter = names[(first + run) % len(names)]
        path = paths.letter(letter, speed * DURATION / _length(letter), DURATION)
        targets.append(Target(path, distance=DISTANCE))
        controllers.append(servoing(**design(one, groups["bandwidth"][run], distance=DISTANCE)))
        q[run, :3], q[run, 3:6] = facing(one, path([0.0])[0][0], DISTANCE)
    return Scenario(
        "closed loop", q, controller=stack(controllers), target=targets, duration=DURATION
    )


def _flown(vehicle: Vehicle, groups: dict[str, Array], first: int) -> dict[str, Array]:
    """Return LOOP_ERRORS of a batch; a loop counts if it keeps its target and is determined."""
    scenario = loop_scenario(vehicle, groups, first)
    # Loops that fail are counted, not reported one by one.
    with untold():
        flown = [
            fly_twice(vehicle, scenario, _TIP, model=model, sample=_SAMPLE) for model in PLANTS
        ]
    pair = reduced([flight for flight, _ in flown], SETTLE)
    held = (pair.status == 0) & np.stack([same for _, same in flown], axis=-1)
    known = {
        name: np.where(held.all(1, keepdims=True), values, np.nan)
        for name, values in pair.metrics.items()
    }
    return {
        "ds_px": known["ds_max_px"][:, 1],
        "rms_px": known["rms_px"][:, 1],
        "coupled_rms_px": known["rms_px"][:, 0],
        "error": known["rmse_t_m"][:, 1] / vehicle.arm.length,
        "angle": known["angle_rad"][:, 1],
        "lost_coupled": 1.0 - held[:, 0],
        "lost_decoupled": 1.0 - held[:, 1],
    }


@functools.cache
def _length(letter: str) -> float:
    """Return the length of a letter's path, of height 1."""
    position = paths.letter(letter, 1.0, 1.0)(np.linspace(0.0, 1.0, 2001))[0]
    return float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())
