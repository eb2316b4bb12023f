"""Results tell which vehicle flew them, that of each run too."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.flight import simulate
from continuair.flight.provenance import model_of
from continuair.flight.reading import scenario_of, vehicle_of, vehicles_of
from tests.refusals import refused

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
    with refused("flight"):
        vehicle_of(found)


def test_a_flight_tells_the_duration_that_it_was_given() -> None:
    scenario = open_loop_test("A")
    for duration in (None, 0.25):
        found = ca.simulate(ca.load_vehicle("paper"), scenario, duration=duration, sample=0.05)
        assert scenario_of(found)["duration"] == found.time[-1]


PAPER = ca.load_vehicle("paper")
START = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.2, 0.0]


def pushed(newtons: float, vehicle: ca.Vehicle = PAPER, **options: Any) -> xr.Dataset:
    scenario = ca.Scenario("pushed", START, force=[newtons, 0.0, 25.0], duration=0.03)
    return ca.simulate(vehicle, scenario, sample=0.01, **options)


def test_a_joined_flight_is_not_told_by_the_attributes_of_another(tmp_path: Path) -> None:
    both = xr.concat([pushed(1.0), pushed(5.0)], "push")
    batches = [PAPER.replace({"uav.mass": masses}) for masses in ([1.8, 2.0], [2.2, 2.4])]
    chunks = xr.concat([pushed(1.0, each) for each in batches], "run")
    cast = pushed(1.0).astype(np.float32)
    for flight in (both.isel(push=1), chunks.isel(run=3), pushed(1.0).drop_attrs(deep=False), cast):
        with refused("flight"):
            vehicle_of(flight)
        assert scenario_of(flight) == {}
    kept = {"first": both.isel(push=0), "cut": pushed(1.0).isel(time=slice(2))}
    kept |= {"masked": pushed(1.0).where(pushed(1.0).time < 0.015), "alike": both.isel(push=[0, 0])}
    for name, flight in kept.items():
        assert vehicle_of(flight) == PAPER, name
        assert scenario_of(flight)["force"] == [1.0, 0.0, 25.0], name
    with pytest.warns(ca.ContinuairWarning, match="scenario"):
        ca.to_csv(both.isel(push=1), tmp_path / "untold.csv", vehicle=PAPER)
    told = ca.Scenario("pushed", START, force=[5.0, 0.0, 25.0], duration=0.03)
    ca.to_csv(both.isel(push=1), tmp_path / "told.csv", vehicle=PAPER, scenario=told)
    header, row = (tmp_path / "told.csv").read_text().splitlines()[:2]
    assert float(row.split(",")[header.split(",").index("force_x")]) == 5.0


def test_a_joined_flight_is_that_of_its_own_model() -> None:
    models = ["coupled", "decoupled", "independent"]
    flights = [pushed(1.0, model=model) for model in models]
    for joined in (xr.concat(flights, xr.Variable("model", models)), xr.concat(flights, "case")):
        (dim,) = set(joined.sizes) - set(flights[0].sizes)
        assert [model_of(joined.isel({dim: i})) for i in range(3)] == models
    assert model_of(xr.concat(flights, "case")) == ""
    figure = ca.plot.bend(xr.concat(flights, "case").isel(case=1))
    assert [text.get_text() for each in figure.legends for text in each.get_texts()] == models[1:2]


def _stored_elsewhere(file: Any) -> None:
    del file["position"]
    file.create_dataset("position", (4, 3), "f8", external=[("/etc/hostname", 0, 96)])


def _linked(file: Any) -> None:
    import h5py

    del file["position"]
    file["position"] = h5py.ExternalLink("other.nc", "/position")


def _sparse(file: Any) -> None:
    file.create_dataset("large", (200_000_000_000,), "f8", chunks=(1_000_000,))


@pytest.mark.parametrize("crafted", [_stored_elsewhere, _linked, _sparse])
def test_a_file_of_others_gives_no_bytes_of_other_files_and_does_not_fill_the_memory(
    crafted: Any, tmp_path: Path
) -> None:
    h5py = pytest.importorskip("h5py")
    pushed(1.0).to_netcdf(tmp_path / "flight.nc", engine="h5netcdf")
    with h5py.File(tmp_path / "flight.nc", "a") as file:
        crafted(file)
    with refused("result"):
        ca.read_result(tmp_path / "flight.nc")


def test_what_a_flight_takes_is_known_before_it_is_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    needed: dict[str, float] = {}
    monkeypatch.setattr(simulate, "check_memory", lambda kept, _: needed.update(kept))
    for name in ("paper", "dual_arm", "two_section"):
        vehicle = ca.load_vehicle(name)
        scenario = ca.Scenario("rest", np.zeros(vehicle.layout.coordinates), duration=0.02)
        needed.clear()
        flight = ca.simulate(vehicle, scenario, sample=0.01)
        assert {key: flight[key].nbytes for key in needed} == needed


@pytest.mark.long
def test_results_that_do_not_fit_into_memory_are_refused_before_work_starts() -> None:
    vehicles = PAPER.replace({"uav.mass": np.linspace(2.0, 3.0, 10_000)})
    long = ca.Scenario("long", START, duration=50_000.0)
    start = time.perf_counter()
    with refused("sample"):
        ca.simulate(vehicles, long, sample=1e-2)
    assert time.perf_counter() - start < 60.0


def test_a_result_whose_attributes_are_no_utf_8_is_read() -> None:
    """As files of others may be; what they say of the vehicle is none."""
    scenario = ca.Scenario("fall", [0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0], duration=0.02)
    flight = ca.simulate(ca.load_vehicle("paper"), scenario, sample=2e-3)
    broken = flight.assign_attrs(vehicle=flight.attrs["vehicle"] + "\udcff")
    assert vehicles_of(broken) == []
    assert scenario_of(broken) == {}
