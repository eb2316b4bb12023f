"""How far Tests A to D turn the decoupled tip from the coupled one."""

from __future__ import annotations

import math

from continuair.studies.paper.evidence import Evidence


def rotations(evidence: Evidence) -> tuple[dict[str, float], str]:
    """RMSE of the Euler angles by test [rad], or where samples do not follow them all the angle
    between the tips; and what to say of that."""
    flown = evidence.open_loop.results["tests"]
    tests = {name: entry["decoupled"] for name, entry in flown.items()}
    found = {name: float(test["rmse_r_rad"]) for name, test in tests.items()}
    if all(math.isfinite(value) for value in found.values()):
        return found, ""
    angles = {name: float(test["angle_rad"]) for name, test in tests.items()}
    return angles, " (as the angle between the tips)"
