"""The side of `benchmarks/compare.py` that runs inside a peer's own Python: stop-watch and answers.

An adapter is a script that hands `serve` one builder per case. It needs nothing of continuair, and
talks JSON lines: it reads the name of a case, takes its work once, and answers with the times.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from time import perf_counter, process_time
from typing import Any


@dataclass
class Case:
    """`run` takes `work` units (steps, evaluations, iterations) of what `what` says."""

    run: Callable[[], object]
    work: int
    unit: str
    what: str
    dtype: str = "float64"
    integrator: str = "RK4"
    step: float | None = None
    runs: int = 1


@dataclass
class Setup:
    """What the builders are told: the vehicle's numbers (SI), and how many threads to use."""

    vehicle: dict[str, Any]
    threads: int
    stages: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time of a block [s] to a stage: "import", "build" or "compile"."""
        start = perf_counter()
        yield
        self.stages[stage] = self.stages.get(stage, 0.0) + perf_counter() - start


Builder = Callable[[Setup], Case]


def serve(
    distributions: Sequence[str], single: Mapping[str, Builder], batch: Mapping[str, Builder]
) -> None:
    """Answer compare.py until it closes the pipe; `single` is left out on several threads.

    --first: build and take the first case only. --only: those whose names contain a text.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--threads", type=int, required=True)
    parser.add_argument("--first", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--needs", action="store_true", help="print the distributions, and stop")
    arguments = parser.parse_args()
    if arguments.needs:
        print(json.dumps(list(distributions)))
        return
    # Before any engine starts its threads: they find as many cores as they may use.
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: arguments.threads])
    # What engines print must not come between the answers.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    setup = Setup(json.loads(sys.stdin.readline()), arguments.threads)
    builders = {**single, **batch} if arguments.threads == 1 else batch
    named = [(name, build) for name, build in builders.items() if arguments.only in name]
    chosen = dict(named[: 1 if arguments.first else None])
    cases = {name: build(setup) for name, build in chosen.items()}
    for case in cases.values():
        case.run()
    described = {
        name: {key: value for key, value in asdict(case).items() if key != "run"}
        for name, case in cases.items()
    }
    ready = {
        "versions": {name: version(name) for name in distributions},
        "stages": setup.stages,
        "cases": described,
        "memory_mib": _peak_memory(),
    }
    print(json.dumps(ready), file=answers)
    for line in sys.stdin:
        print(json.dumps(_measure(cases[line.strip()])), file=answers)


def _measure(case: Case) -> dict[str, float]:
    wall, processor = perf_counter(), process_time()
    case.run()
    wall, processor = perf_counter() - wall, process_time() - processor
    return {"wall": wall, "cpu": processor, "memory_mib": _peak_memory()}


def _peak_memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
