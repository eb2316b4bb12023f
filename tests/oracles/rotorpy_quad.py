"""RotorPy's rigid quadrotor, run by a Python that has it: a case as JSON in, its motion out.

Nothing of ours is imported here: see test_rotorpy.py.
"""

# Another Python than that of the tests has these packages.
# mypy: ignore-errors

import json
import sys

import numpy as np
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.vehicles.multirotor import Multirotor

TIGHT = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}


def main() -> None:
    case = json.load(sys.stdin)
    params = case["params"]
    params["rotor_pos"] = {name: np.array(at) for name, at in params["rotor_pos"].items()}
    params["rotor_directions"] = np.array(params["rotor_directions"])
    start = {name: np.array(value) for name, value in case["start"].items()}
    quad = Multirotor(params, start, integrator_kwargs=TIGHT)
    state, flown = start, []
    for speeds in case["speeds"]:
        state = quad.step(state, {"cmd_motor_speeds": np.array(speeds)}, case["period"])
        state["wind"] = start["wind"]
        flown.append({name: value.tolist() for name, value in state.items()})
    shared = Multirotor(params, start, control_abstraction="cmd_ctbm")
    commands = [
        shared.get_cmd_motor_speeds(
            start, {"cmd_thrust": lift, "cmd_moment": np.array(moment)}
        ).tolist()
        for lift, *moment in case["wrenches"]
    ]
    law = SE3Control(params | {"k_d": 0.0, "k_z": 0.0, "k_flap": 0.0})
    for name, value in case["gains"].items():
        setattr(law, name, np.array(value))
    pushes = []
    for state, wanted in case["looks"]:
        state = {name: np.array(value) for name, value in state.items()}
        still = {name: np.zeros(3) for name in ("x_ddot", "x_dddot", "x_ddddot")}
        wanted = (
            {name: np.array(value) for name, value in wanted.items()} | still | {"yaw_dot": 0.0}
        )
        found = law.update(0.0, state, wanted)
        pushes.append([found["cmd_thrust"], *found["cmd_moment"]])
    json.dump({"flown": flown, "commands": commands, "pushes": pushes}, sys.stdout)


if __name__ == "__main__":
    main()
