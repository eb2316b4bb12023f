"""A CSV file is a recording that `identify` reads, and more."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import ContinuairWarning
from continuair.identification.recording import Recording, load_recording
from tests.interfaces.flights import flight
from tests.refusals import refused


def read(path: Path, vehicle: ca.Vehicle) -> Recording:
    with pytest.warns(ContinuairWarning, match="velocity_x"):
        return load_recording(path, vehicle)


def columns(path: Path) -> dict[str, np.ndarray]:
    headings = path.read_text().splitlines()[0].split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    return dict(zip(headings, rows.T, strict=True))


@pytest.mark.parametrize("name", ["paper", "two_section", "dual_arm"])
def test_a_recording_read_back_is_the_flight_to_the_last_bit(name: str, tmp_path: Path) -> None:
    dataset, vehicle = flight(name), ca.load_vehicle(name)
    ca.to_csv(dataset, tmp_path / "flight.csv")
    found = read(tmp_path / "flight.csv", vehicle)
    np.testing.assert_array_equal(found.time, dataset.time)
    np.testing.assert_array_equal(found.position, dataset.position)
    np.testing.assert_allclose(found.attitude, dataset.attitude, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(found.bend, dataset.bend.to_numpy().reshape(len(found.time), -1))
    assert found.inputs is not None
    np.testing.assert_array_equal(found.inputs[:, :3], [[0.5, -0.3, 10.5 * vehicle.mass]] * 26)
    np.testing.assert_array_equal(found.inputs[:, 3:], 0.0)


def test_all_else_that_was_logged_follows_with_units(tmp_path: Path) -> None:
    dataset = flight("dual_arm")
    ca.to_csv(dataset, tmp_path / "flight.csv")
    found = columns(tmp_path / "flight.csv")
    for heading, values in {
        "velocity_z [m/s]": dataset.velocity.sel(axis="z"),
        "tip_position_right_x [m]": dataset.tip_position.sel(arm="right", axis="x"),
        "bend_rate_left.0_x [1/(m s)]": dataset.bend_rate.sel(section="left.0", bend_axis="x"),
        "kinetic_energy [J]": dataset.kinetic_energy,
    }.items():
        np.testing.assert_array_equal(found[heading], values)


def test_inputs_over_time_are_sampled_from_the_scenario_and_missed_without_it(
    tmp_path: Path,
) -> None:
    vehicle = ca.load_vehicle("paper")

    def pushed(t: float) -> list[float]:
        return [np.sin(5.0 * t), 0.0, 9.81 * vehicle.mass]

    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    scenario = ca.Scenario("pushed", start, force=pushed, moment=[0.1, 0.0, 0.0], duration=0.2)
    dataset = ca.simulate(vehicle, scenario, sample=0.01)
    ca.to_csv(dataset, tmp_path / "whole.csv", scenario=scenario)
    whole = columns(tmp_path / "whole.csv")
    expected = np.sin(5.0 * whole["time"])
    np.testing.assert_allclose(whole["force_x"][:-1], expected[:-1], rtol=1e-15)
    assert whole["force_x"][-1] == pytest.approx(expected[-1], rel=1e-9)  # beside the end
    np.testing.assert_array_equal(whole["moment_x"], 0.1)
    with pytest.warns(ContinuairWarning, match="less.csv .*force"):
        ca.to_csv(dataset, tmp_path / "less.csv")
    assert "force_x" not in columns(tmp_path / "less.csv")


@pytest.mark.parametrize(
    "given", [None, [0.0, 0.0, 26.0], [[1.0, 0.0, 25.0]], lambda t: [0.0, 0.0, 25.0]]
)
def test_a_scenario_that_the_flight_contradicts_is_refused(tmp_path: Path, given: Any) -> None:
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    flown = ca.Scenario("pushed", start, force=[0.0, 0.0, 25.0], duration=0.05)
    other = flown.replace(force=given)
    for one, two in ((flown, other), (other, flown)):
        dataset = ca.simulate(ca.load_vehicle("paper"), one, sample=0.01)
        if "run" in dataset.dims:
            dataset = dataset.isel(run=0)
        with refused("scenario.force"):
            ca.to_csv(dataset, tmp_path / "other.csv", scenario=two)
        assert not (tmp_path / "other.csv").exists()


@pytest.mark.parametrize(
    "wind", [ca.gust([2.0, 0.0, 0.0], 0.01, 0.03), ca.dryden(5.0, 20.0, 3.0, seed=[1, 2])]
)
def test_a_wind_is_known_by_what_it_is_made_of(tmp_path: Path, wind: Any) -> None:
    vehicle = ca.load_vehicle("paper").replace({"uav.drag": {"linear": [0.3, 0.3, 0.5]}})
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    flown = ca.Scenario("windy", start, force=lambda t: [t, 0.0, 25.0], wind=wind, duration=0.04)
    dataset = ca.simulate(vehicle, flown, sample=0.01)
    one = dataset.isel(run=1) if "run" in dataset.dims else dataset
    with pytest.warns(ContinuairWarning, match="wind"):
        ca.to_csv(one, tmp_path / "windy.csv", scenario=flown)
    assert columns(tmp_path / "windy.csv")["force_x"][1] == 0.01
    other = flown.replace(wind=ca.gust([1.0, 0.0, 0.0], 0.01, 0.03))
    with refused("scenario.wind"):
        ca.to_csv(one, tmp_path / "other.csv", scenario=other)


def test_thrusts_that_the_flight_gave_by_itself_contradict_no_scenario(tmp_path: Path) -> None:
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 12.0],
              "torque_per_thrust": 0.02}  # fmt: skip
    vehicle = ca.load_vehicle("paper").replace({"uav.rotors": rotors})
    scenario = ca.Scenario("hover", [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0], duration=0.02)
    dataset = ca.simulate(vehicle, scenario, sample=0.01)
    ca.to_csv(dataset, tmp_path / "hover.csv", scenario=scenario)
    held = columns(tmp_path / "hover.csv")["force_z"]
    assert held[0] == pytest.approx(9.81 * vehicle.mass, rel=1e-9)


@pytest.mark.long
def test_labels_in_another_order_are_read_by_their_names(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("two_section")
    law = ca.hold(vehicle, [0.1, 0.2, 3.0])
    start = [0.0, 0.0, 3.0, 0.3, 0.1, 0.2, 0.2, 0.4, 0.1, 0.5]
    flight = ca.simulate(vehicle, ca.Scenario("held", start, controller=law, duration=0.02))
    ca.to_csv(flight, tmp_path / "one.csv")
    shuffled = flight
    for name in ("actuator", "axis", "quaternion", "section", "bend_axis"):
        shuffled = shuffled.sel({name: flight[name].values[::-1]})
    ca.to_csv(shuffled, tmp_path / "two.csv")
    one, two = (columns(tmp_path / f"{name}.csv") for name in ("one", "two"))
    assert one.keys() == two.keys()
    for name, values in one.items():
        np.testing.assert_array_equal(two[name], values)
    np.testing.assert_array_equal(
        ca.backbone(vehicle, shuffled).sel(axis=list("xyz")), ca.backbone(vehicle, flight)
    )


def test_rows_at_jumps_hold_what_acts_from_there_on(tmp_path: Path) -> None:
    """int(t / period) and the jumps that are named are a last digit apart at some of them."""
    period, forces = 0.01, np.random.default_rng(4).uniform(0.0, 30.0, (120, 3))
    jumps = tuple(period * np.arange(1, 120))
    assert [int(t / period) for t in jumps] != list(range(1, 120))
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    scenario = ca.Scenario(
        "held", start, force=lambda t: forces[int(t / period)], jumps=jumps, duration=1.2
    )
    dataset = ca.simulate(ca.load_vehicle("paper"), scenario, sample=period)
    ca.to_csv(dataset, tmp_path / "held.csv", scenario=scenario)
    found = columns(tmp_path / "held.csv")
    rows = np.column_stack([found[f"force_{axis}"] for axis in "xyz"])
    np.testing.assert_array_equal(rows, np.vstack([forces, forces[-1]]))


def test_what_a_simulation_was_given_by_steps_is_told_to_be_missing(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("paper")
    start = ca.Scenario("held", [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0], force=[0.0, 0.0, 25.7])
    live = ca.Simulation(vehicle, start, control_period=0.01)
    for _ in range(3):
        live.step(bend_moment=[0.5, 0.0], moment=[0.0, 0.0, 0.0])
    with pytest.warns(ContinuairWarning, match="bend_moment"):
        ca.to_csv(live.trajectory(), tmp_path / "flight.csv")
    with pytest.warns(ContinuairWarning, match="bend_moment"):
        ca.to_csv(live.trajectory(), tmp_path / "again.csv", scenario=start)
    for name in ("flight.csv", "again.csv"):
        found = columns(tmp_path / name)
        assert "bend_moment_x" not in found and (found["force_z"] == 25.7).all()


def test_what_rotors_give_is_written_as_the_force_and_moment_that_acted(tmp_path: Path) -> None:
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 12.0],
              "torque_per_thrust": 0.02}  # fmt: skip
    paper: dict[str, Any] = ca.load_vehicle("paper").describe()
    vehicle = ca.Vehicle(**paper | {"uav": paper["uav"] | {"rotors": rotors}})
    start = [0.0, 0.0, 3.0, 0.1, 0.2, 0.3, 0.1, 0.0]
    scenario = ca.Scenario("four", start, rotor_command=[5.0, 6.0, 7.0, 8.0], duration=0.1)
    dataset = ca.simulate(vehicle, scenario, sample=0.01)
    ca.to_csv(dataset, tmp_path / "flight.csv")
    found = columns(tmp_path / "flight.csv")
    # What acts is all that changes the momentum beside the weight.
    momentum = dataset.linear_momentum.to_numpy()
    rates = np.gradient(momentum, 0.01, axis=0, edge_order=2)
    forces = np.column_stack([found[f"force_{axis}"] for axis in "xyz"])
    expected = rates + [0.0, 0.0, 9.81 * vehicle.mass]
    np.testing.assert_allclose(forces[2:-2], expected[2:-2], rtol=0, atol=0.01 * 26)


def test_of_a_batch_the_inputs_are_those_of_the_run_that_is_written(tmp_path: Path) -> None:
    vehicle = ca.load_vehicle("paper")
    forces = [[0.0, 0.0, 20.0], [0.0, 0.0, 30.0], [0.0, 0.0, 40.0]]
    start = [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.1, 0.0]
    scenario = ca.Scenario("lifts", start, force=forces, duration=0.05)
    batch = ca.simulate(vehicle, scenario, sample=0.01)
    ca.to_csv(batch.isel(run=1), tmp_path / "flight.csv")
    np.testing.assert_array_equal(columns(tmp_path / "flight.csv")["force_z"], 30.0)
    with refused("force"):
        ca.to_csv(batch.isel(run=1, drop=True), tmp_path / "other.csv")
    relabelled = batch.isel(run=[2, 0]).assign_coords(run=[1.0, 2.0])
    ca.to_csv(relabelled.sel(run=1.0), tmp_path / "relabelled.csv")
    np.testing.assert_array_equal(columns(tmp_path / "relabelled.csv")["force_z"], 40.0)


def test_a_flight_that_ended_early_is_written_up_to_its_end(tmp_path: Path) -> None:
    whole = flight("paper")
    ended = whole.where(whole.time < 0.1)
    ended.attrs = whole.attrs
    ca.to_csv(ended, tmp_path / "flight.csv")
    assert columns(tmp_path / "flight.csv")["time"][-1] == pytest.approx(0.09)


def test_a_file_that_exists_stays(tmp_path: Path) -> None:
    path = tmp_path / "flight.csv"
    path.write_text("mine")
    with refused("path"):
        ca.to_csv(flight("paper"), path)
    assert path.read_text() == "mine"
