"""Robustness: how well laws track a letter on a vehicle that is not the one they were made for."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

from amiri2026.ladder import climbed
from amiri2026.robustness.flights import (
    GROUNDED,
    LETTER,
    SETTING,
    Wrong,
    fly,
    groups,
    harm,
)
from amiri2026.robustness.mistakes import MISTAKES
from amiri2026.standard_laws import LAWS, check_gains, law_of
from continuair import MODELS, Gains, Vehicle, checks
from continuair.kernels import OK, PLANTS, STATUS
from continuair.progress import Progress, Steps
from continuair.scenario import damping_notes, equipped
from continuair.vehicle import check_one_section

BORNE, LOST = 5.0, "lost without a mistake"
"""Largest increase of the RMS feature error by a tolerated mismatch [px]."""


@dataclass(frozen=True)
class Robustness:
    """Results of the study.

    results: JSON-able; results["cases"] holds one per law and model: the RMS of the error without
    mismatch, and for each mismatch and value the worst of its ways, and the largest tolerated
    value.
    """

    results: dict[str, Any]


def robustness(
    vehicle: Vehicle,
    laws: Iterable[str] = tuple(LAWS),
    models: Iterable[str] = PLANTS,
    mistakes: Iterable[str] = tuple(MISTAKES),
    gains: Gains | None = None,
    *,
    progress: Progress | None = None,
) -> Robustness:
    """Simulate a letter with every law, designed for the vehicle, on plants that differ from it.

    gains: of `load_gains`, instead of the preset of their law. progress: called with (done, total,
    what) before each batch. Raises InputError.
    """
    check_one_section(vehicle)
    names, plants = checks.choices("laws", laws, LAWS), checks.choices("models", models, MODELS)
    chosen = checks.choices("mistakes", mistakes, MISTAKES)
    check_gains(gains, names)
    nominal = equipped(vehicle, SETTING)
    wrong = [each for name in chosen for each in _tried(name)]
    batches = groups([Wrong(None), *wrong])
    steps = Steps(progress, len(names) * len(plants) * len(batches))
    controllers, cases = {name: law_of(name, nominal, gains) for name in names}, []
    for name, plant in product(names, plants):
        found: dict[Wrong, dict[str, Any]] = {}
        for batch in batches:
            steps.begin(f"{name}, {plant}, {batch[-1].name or 'no mistake'}")
            found |= zip(batch, fly(nominal, controllers[name], plant, batch), strict=True)
        cases.append(_case(name, plant, chosen, found))
    return Robustness(
        {
            "study": "robustness",
            "vehicle": vehicle.describe(),
            "notes": damping_notes(vehicle),
            "laws": {name: law.describe() for name, law in controllers.items()},
            "letter": LETTER,
            "duration_s": SETTING.duration,
            "settled_s": SETTING.settled,
            "borne_px": BORNE,
            "cases": cases,
        }
    )


def _tried(name: str) -> list[Wrong]:
    """Return a mistake, of every value in each of its ways."""
    mistake = MISTAKES[name]
    return [Wrong(name, *each) for each in product(mistake.values, mistake.ways)]


def _worst(wrong: Iterable[Wrong], found: dict[Wrong, Any]) -> dict[str, Any]:
    """Return the way of a mismatch that fails first, or else has the largest error."""
    worst = max(wrong, key=lambda each: harm(found[each]))
    return {"value": worst.value, "way": worst.way, **found[worst]}


def _case(law: str, model: str, chosen: list[str], found: dict[Wrong, Any]) -> dict[str, Any]:
    """Return the results of a law on a plant."""
    return {
        "law": law,
        "model": model,
        "without": found[Wrong(None)],
        "mistakes": {name: _reach(name, found) for name in chosen},
    }


def _reach(name: str, found: dict[Wrong, Any]) -> dict[str, Any]:
    """Return the largest value up to which all are tolerated, the next one, and why that is not.

    Return nothing if the law fails without a mismatch.
    """
    mistake, most = MISTAKES[name], found[Wrong(None)]["rms_px"] + BORNE
    told = {"meaning": mistake.meaning, "unit": mistake.unit}
    ways = [[Wrong(name, value, way) for way in mistake.ways] for value in mistake.values]
    values = [_worst(each, found) for each in ways]
    if math.isnan(most):
        return told | {"values": values, "reached": None, "failed_at": None, "reason": LOST}
    count = climbed([each["status"] == OK and each["rms_px"] <= most for each in values])
    beyond = values[count] if count < len(values) else None
    return told | {
        "values": values,
        "reached": values[count - 1]["value"] if count else 0.0,
        "failed_at": None if beyond is None else beyond["value"],
        "reason": "" if beyond is None else reason(beyond),
    }


def reason(flight: dict[str, Any]) -> str:
    """Return why a mismatch was not tolerated."""
    way = f" ({flight['way']})" if flight.get("way") else ""
    if flight["status"] == GROUNDED:
        return f"the rotors do not lift it{way}"
    if flight["status"] != OK:
        return f"{STATUS[flight['status']]} at {flight['end_time_s']:.3g} s{way}"
    return f"{flight['rms_px']:.3g} px RMS{way}"
