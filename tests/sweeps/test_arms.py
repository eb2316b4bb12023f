"""Flights and sweeps of vehicles whose arms are a list: refusals, dimensions, one design."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.vehicle.vehicle_file import as_toml
from tests.refusals import refused
from tests.sections.strains import flying, rod

TWO = ca.load_vehicle("two_section")


def start(sections: int) -> np.ndarray:
    return np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0] + [0.1, 0.0] * sections)


def test_a_start_for_another_number_of_sections_is_refused() -> None:
    with refused("scenario.q"):
        ca.simulate(TWO, ca.Scenario("short", start(1)))
    with refused("scenario.q"):
        ca.simulate(ca.load_vehicle("paper"), ca.Scenario("long", start(2)))
    with refused("scenario.q"):
        ca.simulate(TWO, ca.Scenario("odd", np.zeros(9)))


def test_a_wrench_for_another_number_of_arms_is_refused() -> None:
    pushed = ca.Scenario("pushed", start(2), tip_wrench=np.zeros(12))
    with refused("scenario.tip_wrench"):
        ca.simulate(TWO, pushed)


def test_inputs_are_as_many_as_the_start_has_bends() -> None:
    with refused("bend_moment"):
        ca.Scenario("bent", start(2), bend_moment=[1.0, 0.0])
    with refused("tau"):
        ca.Scenario("pushed", start(2), tau=np.zeros(8))


def test_the_papers_tests_are_for_its_vehicle() -> None:
    design = xr.Dataset(
        {"vehicle.uav.mass": ("mass", [1.0, 2.0])},
        attrs={"vehicle": "two_section", "scenario": {"test": "A"}},
    )
    with refused("scenario.test"):
        ca.sweep(design, "never.zarr")
    assert not Path("never.zarr").exists()


@pytest.mark.long
def test_a_sweep_flies_with_the_integrator_of_its_design(tmp_path: Path) -> None:
    excited = {"excitation": "sine", "on": "force_x", "amplitude": 1.0, "frequency": 0.5}
    shared = {"vehicle": "two_section", "scenario": excited | {"duration": 0.2, "lift": 1.0}}
    masses = {"vehicle.uav.mass": ("mass", [1.0, 2.0])}
    steps = {}
    for method in ("RK4", "implicit"):
        design = xr.Dataset(
            masses, attrs=shared | {"method": method, "step": "auto", "sample": 0.02}
        )
        steps[method] = ca.sweep(design, tmp_path / method)["step"].to_numpy()
    assert (steps["implicit"] > 1.5 * steps["RK4"]).all()


@pytest.mark.slow
def test_a_run_of_a_sweep_is_what_a_single_flight_gives(tmp_path: Path) -> None:
    excited = {"excitation": "sine", "on": "force_x", "amplitude": 1.0, "frequency": 0.5}
    design = xr.Dataset(
        {
            "vehicle.uav.mass": ("mass", [1.0, 2.0, 3.0]),
            "vehicle.arm.arm.section.tip.length": ("length", [0.2, 0.3]),
        },
        attrs={"vehicle": "two_section", "scenario": excited | {"duration": 0.5, "lift": 1.0}},
    )
    found = ca.sweep(design, tmp_path / "store.zarr")
    assert not found["status"].any()
    one = TWO.replace({"uav.mass": 2.0, "arm.arm.section.tip.length": 0.3})

    def force(t: float) -> list[float]:
        return [np.sin(np.pi * t), 0.0, 9.81 * one.mass]

    scenario = ca.Scenario("one", start(2), force=force, duration=0.5)
    flights = [ca.simulate(one, scenario, model=m, sample=2e-3) for m in ("coupled", "decoupled")]
    compared = np.ravel(ca.compare(*flights)["angle_rad"])
    run = found.isel(mass=1, length=1).sel(model="decoupled")
    assert float(run.angle_rad) == pytest.approx(float(compared[0]), rel=1e-6)
    assert flights[0]["bend"].dims == ("time", "section", "bend_axis")
    assert flights[0]["tip_position"].dims == ("time", "arm", "axis")
    assert list(flights[0]["section"].to_numpy()) == ["arm.base", "arm.tip"]


@pytest.mark.long
@pytest.mark.parametrize("vehicle", ["two_section", "dual_arm"])
def test_a_closed_loop_of_a_sweep_starts_before_its_target_and_follows_it(
    vehicle: str, tmp_path: Path
) -> None:
    design = xr.Dataset(
        {"vehicle.uav.mass": ("mass", [1.6, 2.4])},
        attrs={
            "vehicle": vehicle,
            "scenario": {"duration": 4.0, "kappa": 0.05},
            "controller": {"law": "servoing", "bandwidth": 6.0},
            "target": {"letter": "L", "duration": 60.0},
            "settle": 2.0,
        },
    )
    found = ca.sweep(design, tmp_path / "store.zarr")
    assert not found["status"].any()
    # It starts 0.1 m off, some 50 px.
    assert (found["rms_px"].sel(model="coupled") < 1.0).all()


@pytest.mark.long
def test_a_sweep_flies_arms_whose_strain_varies(tmp_path: Path) -> None:
    vehicle = flying(rod(bending=1))
    (tmp_path / "rod.toml").write_text(as_toml(vehicle))
    design = xr.Dataset(
        {"scenario.kappa_rate": ("rate", [0.0, 2.0])},
        attrs={
            "vehicle": str(tmp_path / "rod.toml"),
            "scenario": {"kappa": 1.0, "psi_a": 0.5, "psi_a_rate": 3.0, "duration": 0.1, "z": 5.0},
        },
    )
    found = ca.sweep(design, tmp_path / "store.zarr").sel(model="decoupled")
    sine, cosine = np.sin(0.5), np.cos(0.5)
    for place, rate in enumerate((0.0, 2.0)):
        q, qd = np.zeros((2, 10))
        q[2], q[[6, 8]] = 5.0, [cosine, sine]
        qd[[6, 8]] = rate * cosine - 3.0 * sine, rate * sine + 3.0 * cosine
        alone = ca.simulate(vehicle, ca.Scenario("one", q, qd, duration=0.1), model="decoupled")
        of_run = found.isel(rate=place)
        tip = [float(of_run[f"tip_{axis}_m"]) for axis in "xyz"]
        np.testing.assert_allclose(tip, alone.tip_position[-1, 0], atol=1e-9)
