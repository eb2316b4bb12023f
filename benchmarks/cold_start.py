"""Time the command line as a process of its own: kernels compiled anew, and from the cache.

Also the processor time of the first flight of an arc and of a section with linear bending, whose
kernels are compiled.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

WARM_RUNS = 3
COLD_RUNS = 3
COMMANDS = {
    "--help": ["--help"],
    "check paper": ["check", "paper"],
    "open-loop --tests B": ["open-loop", "--tests", "B", "--out", "results"],
}

STRAINS: dict[str, dict[str, object]] = {
    "one arc": {},
    "linear bending": {"strain": {"bending": 1}},
}
FIRST_FLIGHT = """
from time import process_time
import continuair as ca
rod = {"length": 0.5, "radius": 0.006, "density": 1500.0, "youngs_modulus": 5e7}
uav = {"mass": 1.5, "inertia": [0.02, 0.03, 0.04]}
arm = {"mount": [0.0, 0.0, -0.05], "section": [rod | STRAIN]}
vehicle = ca.Vehicle(name="one arm", uav=uav, arm=[arm])
falling = ca.Scenario("falling", [0.0] * vehicle.layout.coordinates, duration=0.05)
begun = process_time()
ca.simulate(vehicle, falling)
print(process_time() - begun)
"""


def seconds(arguments: list[str], cache: Path, folder: Path) -> float:
    """Run `continuair` with these arguments and a kernel cache of its own; return its time [s]."""
    command = [sys.executable, "-c", "from continuair.__main__ import main; main()", *arguments]
    environment = {**os.environ, "WARP_CACHE_PATH": str(cache)}
    start = perf_counter()
    run = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True)
    elapsed = perf_counter() - start
    if run.returncode != 0:
        raise SystemExit(f"continuair {' '.join(arguments)} failed:\n{run.stderr}")
    return elapsed


def first_flight(strain: dict[str, object]) -> float:
    """Return the processor time of the first flight of a kind of section [s]."""
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, "-c", FIRST_FLIGHT.replace("STRAIN", repr(strain))]
        environment = {**os.environ, "WARP_CACHE_PATH": cache}
        return float(subprocess.check_output(command, env=environment, text=True))


def main() -> None:
    print(f"{'continuair':<22}{'cold [s]':>10}{'warm [s]':>10}")
    for name, arguments in COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            cache = Path(folder) / "kernels"
            cold = seconds(arguments, cache, Path(folder))
            warm = min(seconds(arguments, cache, Path(folder)) for _ in range(WARM_RUNS))
        print(f"{name:<22}{cold:>10.2f}{warm:>10.2f}")
    taken = np.array([[first_flight(each) for each in STRAINS.values()] for _ in range(COLD_RUNS)])
    ratios = np.median(taken / taken[:, :1], axis=0)
    print(f"{'first flight':<22}{'processor [s]':>14}{'over an arc':>14}")
    for name, own, ratio in zip(STRAINS, np.median(taken, axis=0), ratios, strict=True):
        print(f"{name:<22}{own:>14.2f}{ratio:>14.2f}")


if __name__ == "__main__":
    main()
