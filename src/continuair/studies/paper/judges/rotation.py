"""How far Tests A to D turn the decoupled tip from the coupled one."""

from __future__ import annotations

from continuair.analysis.metrics import rotation_metric
from continuair.studies.paper.evidence import Evidence


def rotations(evidence: Evidence) -> tuple[dict[str, float], str]:
    """RMSE of the Euler angles by test [rad], or where samples do not follow them all the angle
    between the tips; and what to say of that."""
    flown = evidence.open_loop.results["tests"]
    tests = {name: entry["decoupled"] for name, entry in flown.items()}
    key = rotation_metric(tests.values())
    told = " (as the angle between the tips)" if key == "angle_rad" else ""
    return {name: float(test[key]) for name, test in tests.items()}, told
