"""Notes on rotors at rest beside forces that act directly."""

from __future__ import annotations

from typing import Any


def of_still_rotors(results: dict[str, Any]) -> list[str]:
    """Return a sentence where a study's vehicle has rotors, which the study leaves at rest."""
    if results["vehicle"]["uav"]["rotors"] is None:
        return []
    return ["Rotors stand still here: forces act on the UAV directly, as the paper's do."]
