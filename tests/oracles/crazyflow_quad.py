"""crazyflow's first principles in float64, run by a Python that has it: a case in, its rates out.

Nothing of ours is imported here: see test_crazyflow.py.
"""

# Another Python than that of the tests has these packages.
# mypy: ignore-errors

import json
import os
import sys

os.environ["SCIPY_ARRAY_API"] = "1"
import numpy as np
from crazyflow.dynamics.first_principles.dynamics import dynamics


def main() -> None:
    case = json.load(sys.stdin)
    params = {name: np.array(value, float) for name, value in case["params"].items()}
    states = {name: np.array(value, float) for name, value in case["states"].items()}
    _, _, velocity, spin, rotors = dynamics(**states, **params)
    found = {"velocity": velocity, "spin": spin, "rotors": rotors}
    json.dump({name: np.asarray(value).tolist() for name, value in found.items()}, sys.stdout)


if __name__ == "__main__":
    main()
