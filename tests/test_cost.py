"""What `continuair cost` tells beside its times."""

from __future__ import annotations

import pytest

import continuair as ca
from amiri2026 import cost


@pytest.mark.long
@pytest.mark.parametrize(("heavier", "beside"), [(1.0, True), (1.01, False)])
def test_the_papers_times_stand_beside_the_papers_vehicle_alone(
    heavier: float, beside: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cost, "REPEATS", 1)
    vehicle = ca.load_vehicle("paper")
    flown = vehicle.replace({"uav.mass": heavier * vehicle.uav.mass})
    results = cost.cost(flown, models=["coupled", "decoupled"])
    text = cost.as_table(results)
    assert ("paper [ms]" in text) == beside
    assert ("in the paper" in text) == beside
    assert ("Simulink" in text) == beside
    # As the parts add up to a flight that was timed, whatever is printed.
    for entry in results["models"].values():
        parts = entry["dynamics_s"] + entry["camera_s"] + entry["control_s"]
        assert parts == pytest.approx(entry["total_s"]) and entry["dynamics_s"] > 0.0
    assert cost.ratio_printed() == pytest.approx(22 / 32)
