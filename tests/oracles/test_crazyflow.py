"""crazyflow's first principles, run live in an environment of its own: rotors, lag, linear drag."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.engine.engine import Drive, Engine, Start
from continuair.vehicle.layout import ROTORS
from tests.oracles.conftest import Claim
from tests.oracles.peers import python_with

SOURCE = "crazyflow 0.4.0"
COUNT = 50
MASS, LAG, LEVER = 0.9, 0.05, 0.11
"""LEVER: of each rotor along x and along y."""

INERTIA = [[0.006, 0.0002, -0.0001], [0.0002, 0.007, 0.0003], [-0.0001, 0.0003, 0.011]]
DRAG = [0.2, 0.3, 0.15]
FULL, COEFFICIENT, TORQUE = 12000.0, 4.5e-8, 6.0e-10
"""Greatest speed [rpm], thrust [N] and torque [N m] per squared speed."""

# Rows of roll, pitch and yaw: thrust to the left rolls right, ahead it pitches back.
MIXING = np.array([[1.0, 1.0, -1.0, -1.0], [-1.0, 1.0, 1.0, -1.0], [-1.0, 1.0, -1.0, 1.0]])
RNG = np.random.default_rng(5)
STATES = {
    "pos": RNG.normal(size=(COUNT, 3)),
    "quat": RNG.normal(size=(COUNT, 4)),
    "vel": RNG.normal(scale=3.0, size=(COUNT, 3)),
    "ang_vel": RNG.normal(scale=3.0, size=(COUNT, 3)),
    "cmd": RNG.uniform(3000.0, FULL, (COUNT, 4)),
    "rotor_vel": RNG.uniform(3000.0, FULL, (COUNT, 4)),
}
STATES["quat"] /= np.linalg.norm(STATES["quat"], axis=1, keepdims=True)


def rigid() -> ca.Vehicle:
    """The arm weighs 1e-13 of the vehicle: what it does is lost in rounding."""
    hubs = LEVER * np.column_stack([-MIXING[1], MIXING[0], np.zeros(4)])
    listed = [
        {"position": at, "spin": -way} for at, way in zip(hubs.tolist(), MIXING[2], strict=True)
    ]
    rotors = {
        "rotor": listed,
        "thrust_limits": [0.0, COEFFICIENT * FULL**2],
        "torque_per_thrust": TORQUE / COEFFICIENT,
        "lag": LAG,
    }
    return ca.Vehicle(
        name="rigid",
        uav={"mass": MASS, "inertia": INERTIA, "rotors": rotors, "drag": {"linear": DRAG}},
        arm={"length": 0.1, "mass_per_length": 1e-12, "bending_stiffness": 1e-14},
    )


@pytest.fixture(scope="module")
def theirs() -> Any:
    """Rates of the states by crazyflow."""
    params = {"mass": MASS, "L": [LEVER], "prop_inertia": [0.0], "gravity_vec": [0.0, 0.0, -9.81]}
    params |= {"J": INERTIA, "J_inv": np.linalg.inv(INERTIA).tolist()}
    params |= {"rpm2thrust": [[0.0, 0.0, COEFFICIENT]], "rpm2torque": [[0.0, 0.0, TORQUE]]}
    params |= {"mixing_matrix": MIXING.tolist(), "drag_matrix": np.diag(np.negative(DRAG)).tolist()}
    params |= {"rotor_dyn_coef": [[1.0 / LAG, 0.0, 1.0 / LAG, 0.0]]}
    case = {"params": params, "states": {name: rows.tolist() for name, rows in STATES.items()}}
    python = python_with("crazyflow", "crazyflow_rigid", "crazyflow==0.4.0")
    script = Path(__file__).with_name("crazyflow_quad.py")
    run = subprocess.run(
        [python, str(script)], input=json.dumps(case), capture_output=True, text=True, check=True
    )
    # Before it, imports say what they do not find.
    return json.loads(run.stdout.splitlines()[-1])


def test_rates_of_a_rigid_quadrotor(claim: Claim, theirs: Any) -> None:
    engine = Engine(rigid(), "coupled")
    layout = engine.layout
    states, inputs = np.zeros((COUNT, layout.state)), np.zeros((1, COUNT, layout.inputs))
    of_ours = {"position": "pos", "attitude": "quat", "velocity": "vel"}
    of_ours |= {"angular_velocity": "ang_vel"}
    for name, own in of_ours.items():
        states[:, getattr(layout, name)] = STATES[own]
    states[:, layout.rotor_speed] = STATES["rotor_vel"] / FULL
    inputs[0, :, layout.of_input["rotor_command"]] = COEFFICIENT * STATES["cmd"] ** 2
    start = Start(states, np.zeros((COUNT, 2)))
    rates = engine.derivative(start, Drive(inputs, False, ROTORS, 9.81))
    ours = {
        "velocity": rates[:, layout.velocity],
        "spin": rates[:, layout.angular_velocity],
        "rotors": FULL * rates[:, layout.rotor_speed],
    }
    for name, found in ours.items():
        expected = np.array(theirs[name])
        claim(
            f"rates of a rigid quadrotor in 50 random states, {name}: largest difference over the "
            "largest rate",
            SOURCE,
            1e-9,
            float(np.abs(found - expected).max() / np.abs(expected).max()),
        )
