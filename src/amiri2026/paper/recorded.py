"""The verdicts that the pages of the documentation show, and whether a run finds them again."""

from __future__ import annotations

import json
import math
from importlib import resources
from typing import Any

from amiri2026.verdicts import UNDECIDED

RELATIVE, ABSOLUTE = 0.02, 1e-6
"""Numbers count as found again within this share, or within this."""

CORRELATION = 0.02
"""Rank correlations, shares and other numbers without a scale of their own: within this."""

_SCALELESS = ("correlation", "share")


def recorded() -> dict[str, Any]:
    """Return the recorded results of `continuair paper`."""
    text = resources.files("amiri2026.paper").joinpath("verdicts.json").read_text("utf-8")
    return dict(json.loads(text))


def as_recorded(results: dict[str, Any]) -> dict[str, Any]:
    """Return the recorded part of a run: without times, which are of one machine."""
    kept = ["id", "quote", "claims", "criterion", "verdict", "evidence", "correction", "note"]
    kept += ["cases", "numbers"]
    entries = [{key: entry[key] for key in kept} for entry in results["sentences"]]
    vehicle = {"name": results["vehicle"]["name"]}
    return {"vehicle": vehicle, "table1": results["table1"], "sentences": entries}


def differences(results: dict[str, Any]) -> list[str]:
    """Return a line for every verdict or number that is not found again."""
    known = recorded()
    of_sentences = {entry["id"]: entry for entry in known["sentences"]}
    lines = [
        line
        for entry in results["sentences"]
        for line in _differences(entry, of_sentences.get(entry["id"]))
    ]
    if "table1" in results:
        pairs = zip(results["table1"]["ours"], known["table1"]["ours"], strict=True)
        lines += [
            f"Table I, row {row}: {found}, recorded: {wanted}"
            for row, (found, wanted) in zip("TR", pairs, strict=True)
            if not all(is_found_again("", a, b) for a, b in zip(found, wanted, strict=True))
        ]
    return lines


def _differences(entry: dict[str, Any], known: dict[str, Any] | None) -> list[str]:
    name = entry["id"]
    if known is None:
        return [f"{name}: no verdict is recorded"]
    lines = []
    if entry["verdict"] != known["verdict"] and not _is_busy(entry):
        lines.append(f"{name}: {entry['verdict']}, recorded: {known['verdict']}")
    numbers = {key: (entry["numbers"].get(key), known["numbers"].get(key))
               for key in {**entry["numbers"], **known["numbers"]}}  # fmt: skip
    return lines + [
        f"{name}: {key} is {found}, recorded: {wanted}"
        for key, (found, wanted) in numbers.items()
        if not is_found_again(key, found, wanted)
    ]


def _is_busy(entry: dict[str, Any]) -> bool:
    """Return whether times could not decide, as on a busy machine."""
    return bool(entry.get("times")) and entry["verdict"] == UNDECIDED


def is_found_again(name: str, found: float | None, wanted: float | None) -> bool:
    """Return whether a number agrees with the recorded one, within its tolerance."""
    if found is None or wanted is None or not (math.isfinite(found) and math.isfinite(wanted)):
        return found == wanted
    scaleless = any(word in name for word in _SCALELESS)
    allowed = max(ABSOLUTE, RELATIVE * max(abs(found), abs(wanted)))
    return abs(found - wanted) <= (max(allowed, CORRELATION) if scaleless else allowed)
