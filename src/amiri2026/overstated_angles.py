"""Notes on studies in which Euler angles do not describe the rotation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from continuair.flight import overstated
from continuair.studies import number


def of_overstated_angles(named: Iterable[tuple[str, Mapping[str, Any]]]) -> list[str]:
    """Return a sentence on the flights, by their metrics, whose NRMSE_R and RMSE_R overstate."""
    flights = list(named)
    found = {
        name: entry["rmse_r_rad"] / entry["angle_rad"]
        for name, entry in flights
        if overstated(entry["rmse_r_rad"], entry["angle_rad"])
    }
    if not found:
        return []
    most = max(found, key=found.__getitem__)
    return [
        f"NRMSE_R and RMSE_R overstate the rotation in {len(found)} of {len(flights)} flights, "
        f"{number(found[most], 2)} times in {most}: Euler angles count whole turns, and half turns "
        "of roll and yaw where a tip passes beside a pitch of 90°. The angle holds."
    ]
