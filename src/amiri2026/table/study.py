"""Table I of the paper beside ours: one vehicle in one reading, and effects of each choice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.table.compiled import Job, fly
from amiri2026.table.metrics import Tips, error, euler_angles, geodesic, table_errors, tips
from amiri2026.table.printed import STATUS, PrintedModel
from amiri2026.table.reading import Reading
from continuair import Vehicle, load_vehicle
from continuair.progress import Progress

Array = np.ndarray

PRINTED = np.array([[0.0124, 0.2378, 0.3576, 0.2464], [1.0404, 0.2751, 0.5369, 0.3002]])
"""Table I: rows NRMSE_T and NRMSE_R, columns Tests A to D."""

READING = Reading()
"""The reading under which the preset `table1` gives the table."""

TOLERANCE, SAMPLE = 1e-8, 1e-3
"""Of the flights, and between their samples [s]; the paper prints neither."""

SAMPLES = (5e-4, 1e-3, 5e-3)
"""Sampling periods for which the table is given, multiples of the first [s]."""

TOLERANCES = (1e-6, 1e-7, TOLERANCE, 1e-9)

ABLATIONS: Mapping[str, Mapping[str, Any]] = {
    "decoupled: only the blocks between UAV and arm are zero": {"decoupled": "block"},
    "decoupled: position, attitude and arm are three blocks": {"decoupled": "uav blocks"},
    "decoupled: the diagonal of M, all of C": {"decoupled": "element, full C"},
    "without Remark 1": {"remark1": False},
    "metric: the printed, pooled formula": {"metric": "pooled"},
    "metric: the printed, pooled formula over x, y, z": {"metric": "pooled", "axes": "xyz"},
    "metric: RMSE in m and rad over x, y, z": {"metric": "rmse", "axes": "xyz"},
    "axes: x, y and z": {"axes": "xyz"},
    "angles: without jumps": {"angles": "continuous"},
    "angles: of the frame that spins with ψa": {"angles": "frenet principal"},
    "range: of both runs": {"range": "joint"},
    "force on the tip: +J_tᵀ F_e": {"force_sign": 1},
    "κ: the bend angle": {"kappa": "bend angle"},
    "damping: on both components of the bend vector": {"damping": "bend vector"},
    "rotary inertia of the cross-sections": {"rotary_inertia": True},
}
"""Changes of one choice of the reading at a time, by name."""


@dataclass(frozen=True)
class Flown:
    """Tips of the coupled and the decoupled flight of each test, and reasons of early ends."""

    pairs: Mapping[str, tuple[Tips, Tips]]
    ended: Mapping[str, str]

    def table(self, reading: Reading) -> Array:
        """Return the errors (2, tests) of translation and rotation in the tests flown."""
        return np.array([table_errors(*pair, reading) for pair in self.pairs.values()]).T

    def every(self, count: int) -> Flown:
        """Return the same flights with one of so many samples."""
        pairs = {
            test: (coupled.every(count), other.every(count))
            for test, (coupled, other) in self.pairs.items()
        }
        return Flown(pairs, self.ended)

    def plain(self) -> dict[str, dict[str, float]]:
        """Return, by test, `rmse_t_m` over x, y, z [m] and `angle_rad`, the RMS angle [rad]."""
        return {
            test: {
                "rmse_t_m": error(first.position, second.position, "rmse"),
                "angle_rad": geodesic(first, second),
            }
            for test, (first, second) in self.pairs.items()
        }


def fly_tests(
    vehicle: Vehicle,
    reading: Reading = READING,
    *,
    tolerance: float = TOLERANCE,
    sample: float = SAMPLE,
    tests: Iterable[str] = OPEN_LOOP_TESTS,
) -> Flown:
    """Fly tests with the coupled and the decoupled model as printed, under a reading.

    Raises InputError for a vehicle with several sections or arms.
    """
    names = tuple(tests)
    jobs = [
        Job(vehicle, reading, test, model)
        for test in names
        for model in ("coupled", reading.decoupled)
    ]
    flights = fly(jobs, tolerance=tolerance, sample=sample)
    model = PrintedModel(vehicle, reading)
    seen = [tips(model, flight) for flight in flights]
    ended = {
        f"Test {job.test}, {job.model}": STATUS[flight.status]
        for job, flight in zip(jobs, flights, strict=True)
        if flight.status
    }
    return Flown(dict(zip(names, zip(seen[::2], seen[1::2], strict=True), strict=True)), ended)


def factor(numbers: Array) -> float:
    """Return the largest ratio of numbers (2, 4) to the printed ones, either way.

    NaN where a flight ended early, inf where a number is 0 or has no range.
    """
    with np.errstate(divide="ignore"):
        ratios = np.reshape(numbers, PRINTED.shape) / PRINTED  # one test's would spread over all
        return float(np.exp(np.abs(np.log(ratios)).max()))


def table1(progress: Progress | None = None) -> dict[str, Any]:
    """Return Table I as the preset `table1` gives it under READING, JSON-able.

    `ours` and `printed` (2, 4), rows T and R, columns A to D; `factor`; the same flights in metres
    and radians; the factor at other sampling periods and tolerances, and with each choice changed.
    """
    tell = progress or (lambda done, total, what: None)
    total = 2 + len(TOLERANCES) + len(ABLATIONS)
    vehicle = load_vehicle("table1")
    tell(0, total, "Table I")
    flown = fly_tests(vehicle)
    ours = flown.table(READING)
    by_tolerance, ablations = {}, []
    tell(1, total, "Table I at other sampling periods")
    finest = fly_tests(vehicle, sample=SAMPLES[0])
    by_sample = {
        f"{1e3 * sample:g} ms": factor(finest.every(round(sample / SAMPLES[0])).table(READING))
        for sample in SAMPLES
    }
    for done, tolerance in enumerate(TOLERANCES, 2):
        tell(done, total, "Table I at other tolerances")
        at = flown if tolerance == TOLERANCE else fly_tests(vehicle, tolerance=tolerance)
        by_tolerance[f"{tolerance:g}"] = at.table(READING).tolist()
    flights = {READING.dynamics: flown}
    for done, (name, change) in enumerate(ABLATIONS.items(), total - len(ABLATIONS)):
        tell(done, total, "Table I with one choice changed")
        reading = READING.replace(**change)
        if reading.dynamics not in flights:
            flights[reading.dynamics] = fly_tests(vehicle, reading)
        changed = flights[reading.dynamics]
        numbers = changed.table(reading)
        ablations.append(
            {
                "change": name,
                "ours": numbers.tolist(),
                "factor": factor(numbers),
                "in_metres_and_radians": changed.plain(),
                "ended": dict(changed.ended),
            }
        )
    return {
        "vehicle": vehicle.describe(),
        "reading": READING.describe(),
        "tolerance": TOLERANCE,
        "sample_s": SAMPLE,
        "ours": ours.tolist(),
        "printed": PRINTED.tolist(),
        "ratios": (ours / PRINTED).tolist(),
        "factor": factor(ours),
        "in_metres_and_radians": flown.plain(),
        "ranges": _ranges(flown),
        "factor_by_sample": by_sample,
        "ours_by_tolerance": by_tolerance,
        "ablations": ablations,
    }


def _ranges(flown: Flown) -> dict[str, dict[str, Any]]:
    """Return by test the ranges of the coupled tip along x and y [m], and about each axis [rad]."""
    return {
        test: {
            "position_m": np.ptp(coupled.position[:, :2], axis=0).tolist(),
            "angles_rad": np.ptp(euler_angles(coupled, READING.angles), axis=0).tolist(),
        }
        for test, (coupled, _) in flown.pairs.items()
    }
