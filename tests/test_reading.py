"""Results tell which vehicle flew them, that of each run too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.flight.reading import scenario_of, vehicle_of

BATCHES: dict[str, dict[str, Any]] = {
    "paper": {"arm.length": [0.5, 1.0, 1.5], "uav.inertia": np.tile(0.05 * np.eye(3), (3, 1, 1))},
    "dual_arm": {"arm.left.mount": [[0.0, y, 0.0] for y in (0.1, 0.2, 0.3)]},
}


@pytest.mark.parametrize("name", BATCHES)
def test_a_run_of_a_batch_was_flown_by_its_own_vehicle_wherever_it_stands_in_a_file(
    name: str, tmp_path: Path
) -> None:
    vehicles = ca.load_vehicle(name).replace(BATCHES[name])
    rest = ca.Scenario("rest", np.zeros(6 + 2 * vehicles.sections), duration=0.02)
    flight = ca.simulate(vehicles, rest, sample=0.01)
    flight.isel(run=[2, 0]).assign_coords(run=[0, 1]).to_netcdf(
        tmp_path / "some.nc", engine="h5netcdf"
    )
    found = ca.read_result(tmp_path / "some.nc")
    assert [vehicle_of(found.isel(run=i)) for i in (0, 1)] == [
        vehicles.select(2),
        vehicles.select(0),
    ]
    with pytest.raises(ca.InputError, match=r"choose a run, as in flight.isel\(run=0\)"):
        vehicle_of(found)


def test_a_flight_tells_the_duration_that_it_was_given() -> None:
    scenario = ca.open_loop_test("A")
    for duration in (None, 0.25):
        found = ca.simulate(ca.load_vehicle("paper"), scenario, duration=duration, sample=0.05)
        assert scenario_of(found)["duration"] == found.time[-1]
