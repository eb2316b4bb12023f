"""Evidence that is given instead of flown, so that its verdict is known."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import xarray as xr

import continuair as ca
from amiri2026.open_loop.study import OpenLoop
from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.paper.evidence import Evidence
from amiri2026.table.study import ABLATIONS, PRINTED, factor
from continuair.scenario import paths

LETTERS = ("M", "R", "A", "L")


def evidence(**studies: Any) -> Evidence:
    """Evidence of the preset `paper`; studies: results by name, in place of flights."""
    given = Evidence(ca.load_vehicle("paper"))
    given.__dict__.update(studies)  # where cached properties keep what they have found
    return given


def table(
    ours: np.ndarray = PRINTED,
    position_m: dict[str, float] | None = None,
    angle_rad: dict[str, float] | None = None,
    length: float = 1.0,
    changed: dict[str, np.ndarray] | None = None,
) -> dict[str, Any]:
    """Table I of errors (2, 4), its flights in units if these are others, and ablations.

    changed: errors by the ablation's name; the others have those of the table.
    """
    moved, turned = (
        dict(zip(OPEN_LOOP_TESTS, map(float, row), strict=True)) if given is None else given
        for row, given in zip(ours, (position_m, angle_rad), strict=True)
    )
    numbers = dict.fromkeys(ABLATIONS, ours) | (changed or {})
    return {
        "vehicle": {"arm": {"length": length}},
        "tolerance": 1e-8,
        "ours": ours.tolist(),
        "factor": factor(ours),
        "ours_by_tolerance": {"1e-06": ours.tolist(), "1e-09": ours.tolist()},
        "in_metres_and_radians": {
            test: {"rmse_t_m": moved[test], "angle_rad": turned[test]} for test in OPEN_LOOP_TESTS
        },
        "ablations": [
            {"change": name, "ours": found.tolist(), "factor": factor(found), "ended": {}}
            for name, found in numbers.items()
        ],
    }


def open_loop_of(position: dict[str, float], rotation: dict[str, float] | None = None) -> OpenLoop:
    """Errors of the decoupled model by test, in position and rotation, which have converged."""
    turned = rotation or position
    tests = {
        test: {
            "coupled": {"converged": True},
            "decoupled": {
                "rmse_t_m": error,
                "angle_rad": turned[test],
                "nrmse_t": error,
                "nrmse_r": turned[test],
                "converged": True,
            },
        }
        for test, error in position.items()
    }
    return OpenLoop({"tests": tests}, {})


def hanging(study: OpenLoop, test: str, share: float = 0.0) -> OpenLoop:
    """The study with a test that has not converged, and what share of its error is not known."""
    results = copy.deepcopy(study.results)
    results["tests"][test]["decoupled"] |= {"converged": False, "relative_error": share}
    return OpenLoop(results, {})


def cost(coupled: tuple[float, ...], decoupled: tuple[float, ...]) -> dict[str, Any]:
    """Times of dynamics, camera and control of both plants [µs]."""
    models = {}
    for model, times in {"coupled": coupled, "decoupled": decoupled}.items():
        parts = dict(zip(("dynamics_s", "camera_s", "control_s"), times, strict=True))
        models[model] = {name: 1e-6 * time for name, time in parts.items()}
        models[model]["total_s"] = 1e-6 * sum(times)
    return {"models": models}


def letters(ds: Any, apart: Any, error: float = 1.0) -> xr.Dataset:
    """Both plants over four letters of 50 s: a constant feature error of the coupled one [px].

    ds, apart: functions of time [s] and of whether the target turns, for DS [px] and for the
    distance of the tips [m].
    """
    time = np.linspace(0.0, 50.0, 5001)
    found = []
    for letter in LETTERS:
        position, velocity, acceleration = paths.letter(letter)(time)
        size = np.linalg.norm(acceleration, axis=1)
        turns = size > 0.05 * size.max()
        for model, differs in {"coupled": 0.0, "decoupled": 1.0}.items():
            # One of eight coordinates is off: its size is the norm.
            features = np.zeros((len(time), 8))
            features[:, 0] = error - differs * ds(time, turns)
            tip = position + differs * np.outer(apart(time, turns), [1.0, 0.0, 0.0])
            found.append(_flight(model, letter, time, features, tip, velocity))
    merged = xr.combine_by_coords(found)
    assert isinstance(merged, xr.Dataset)
    return merged


def _flight(
    model: str,
    letter: str,
    time: np.ndarray,
    features: np.ndarray,
    tip: np.ndarray,
    velocity: np.ndarray,
) -> xr.Dataset:
    data = {
        "feature_error": (("time", "pixel"), features),
        "tip_position": (("time", "axis"), tip),
        "target_velocity": (("time", "axis"), velocity),
        "velocity": (("time", "axis"), velocity),
        "angular_velocity": (("time", "axis"), 0.0 * velocity),
        "bend_rate": (("time", "bend_axis"), 0.0 * velocity[:, :2]),
        "error_estimate": ((), 1e-5),
    }
    flight = xr.Dataset(data, {"time": time})
    return flight.expand_dims(model=[model], letter=[letter])
