"""Time the command line as a process of its own: kernels compiled anew, and from the cache."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

WARM_RUNS = 3
COMMANDS = {
    "--help": ["--help"],
    "check paper": ["check", "paper"],
    "open-loop --tests B": ["open-loop", "--tests", "B", "--out", "results"],
}


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


def main() -> None:
    print(f"{'continuair':<22}{'cold [s]':>10}{'warm [s]':>10}")
    for name, arguments in COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            cache = Path(folder) / "kernels"
            cold = seconds(arguments, cache, Path(folder))
            warm = min(seconds(arguments, cache, Path(folder)) for _ in range(WARM_RUNS))
        print(f"{name:<22}{cold:>10.2f}{warm:>10.2f}")


if __name__ == "__main__":
    main()
