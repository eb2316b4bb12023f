"""A file of a flight says that it lacks the rotors' wash exactly where an arm met it."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.analysis.motion import Motion
from continuair.engine.engine import Drive, Engine, Start
from continuair.interfaces.wash import was_washed
from continuair.vehicle.coordinates import branches_of, state_from_paper
from continuair.vehicle.layout import GENERAL, ROTORS

BELOW, BETWEEN = (0.14, 0.14, -0.05), (0.0, 0.0, -0.05)
"""A mount under a rotor, and one between them all, from which a straight arm meets no wash."""

ROTOR = {"layout": "quad_x", "lever": 0.2, "thrust_limits": [0.0, 14.0],
         "torque_per_thrust": 0.016, "radius": 0.12, "lag": 0.04}  # fmt: skip
VEHICLE = ca.load_vehicle("slender").replace(
    {"uav.mount": BETWEEN, "uav.rotors": ROTOR, "arm.drag_coefficient": 1.1}
)


def test_an_arm_is_washed_where_the_bends_of_the_model_feel_the_rotors() -> None:
    """Of the decoupled model, for whose arm the base stays: all else of rotors moves the base."""
    random, runs = np.random.default_rng(3), 200
    q = np.zeros((runs, 8))
    q[:, 6], q[:, 7] = random.uniform(0.1, 4.0, runs), random.uniform(-np.pi, np.pi, runs)
    engine, differ = Engine(VEHICLE, "decoupled"), []
    still = state_from_paper(q, np.zeros(q.shape), engine.layout)
    for speed in (0.0, 0.8):
        state = np.hstack([still, np.tile([speed, 0.0, 0.0, 0.0], (runs, 1))])
        drive = Drive(np.zeros((1, runs, engine.layout.inputs)), False, GENERAL + ROTORS, 9.81)
        rates = engine.derivative(Start(state, branches_of(q, engine.layout)), drive)
        differ.append(rates[:, engine.layout.bend_rate])
    felt = (differ[0] != differ[1]).any(axis=1)
    assert 0 < felt.sum() < runs
    thrust = xr.Dataset({"rotor_thrust": (("time", "rotor"), np.tile([9.0, 0, 0, 0], (runs, 1)))})
    bend = np.stack([q[:, 6] * np.cos(q[:, 7]), q[:, 6] * np.sin(q[:, 7])], axis=-1)
    motion = Motion(VEHICLE, np.arange(float(runs)), q[:, :3], still[:, 3:7], bend[:, None], thrust)
    found = [was_washed(motion.rows(slice(i, i + 1))) for i in range(runs)]
    np.testing.assert_array_equal(found, felt)


def written(to: Any, vehicle: ca.Vehicle, thrusts: list[float], path: Path) -> list[str]:
    """What is warned of while a flight becomes a file, as if this vehicle had flown it."""
    start = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.1, 0.6]
    bare = vehicle.replace({"uav.rotors": None, "arm.drag_coefficient": None})
    found = ca.simulate(bare, ca.Scenario("fall", start, duration=0.02), sample=0.01)
    found["rotor_thrust"] = (("time", "rotor"), np.tile(thrusts, (3, 1)), {"units": "N"})
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        to(found, path, vehicle=vehicle)
    return [str(each.message) for each in told]


@pytest.mark.parametrize("name", ["to_csv", "to_mcap"])
def test_a_file_of_a_flight_whose_rotors_wash_an_arm_says_that_it_lacks_it(
    name: str, tmp_path: Path
) -> None:
    if name == "to_mcap":
        pytest.importorskip("mcap")
    below = VEHICLE.replace({"uav.mount": BELOW})
    (told,) = written(getattr(ca, name), below, [5.0] * 4, tmp_path / "washed")
    assert told.startswith("washed ") and "rotors' wash" in told


@pytest.mark.parametrize(
    ("changes", "thrust"),
    [
        ({"uav.mount": BETWEEN}, 5.0),
        ({"arm.drag_coefficient": None}, 5.0),
        ({"uav.rotors.radius": None}, 5.0),
        ({}, 0.0),
    ],
)
def test_without_wash_on_an_arm_nothing_is_said_to_lack(
    changes: dict[str, Any], thrust: float, tmp_path: Path
) -> None:
    vehicle = VEHICLE.replace({"uav.mount": BELOW} | changes)
    assert not written(ca.to_csv, vehicle, [thrust] * 4, tmp_path / "still.csv")
