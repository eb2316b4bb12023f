"""Paired flights in memory say what single flights say."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026 import open_loop_test
from continuair.analysis.metrics import tip_euler
from continuair.controllers.controller import Controller, stack
from continuair.controllers.gains import design
from continuair.controllers.servoing import servoing
from continuair.scenario import paths
from continuair.scenario.targets import Target
from continuair.vehicle.layout import DEVIATIONS
from tests.refusals import refused

STEP = 5e-4


def some_vehicles(runs: int) -> ca.Vehicle:
    radii, masses = np.linspace(0.002, 0.008, runs), np.linspace(3.0, 1.0, runs)
    return ca.load_vehicle("paper").replace({"arm.radius": radii, "uav.mass": masses})


@pytest.mark.filterwarnings("ignore:nrmse_r and rmse_r_rad overstate")
@pytest.mark.parametrize("test", "ABCD")
def test_metrics_are_those_of_compare(test: str) -> None:
    vehicle, scenario = some_vehicles(12), open_loop_test(test)
    found = ca.run_pairs(vehicle, scenario, ("decoupled", "independent"), method="RK4", step=STEP)
    coupled = ca.simulate(vehicle, scenario, method="RK4", step=STEP)
    for model in ("decoupled", "independent"):
        other = ca.simulate(vehicle, scenario, model=model, method="RK4", step=STEP)
        compared = ca.compare(coupled, other)
        for name in DEVIATIONS:
            # The sums run in another order, and nothing else differs.
            np.testing.assert_allclose(found[name].sel(model=model), compared[name], rtol=2e-12)
        end = other["tip_position"].isel(time=-1)
        np.testing.assert_allclose(found["tip_position"].sel(model=model), end, rtol=0, atol=5e-14)


def test_a_vehicle_that_stays_where_it_is_held_differs_by_nothing() -> None:
    """What is left of its motion is rounding, as what is left of the models' difference is."""
    vehicle = ca.load_vehicle("paper")
    rest, push = ca.trim(vehicle, bend=(0.3, 0.2)), np.array([0.0, 0.01, 10.0])
    scenario = ca.Scenario(
        "push",
        rest.q,
        force=rest.force + push[:, None] * [1.0, 0.0, 0.0],
        moment=rest.moment,
        bend_moment=rest.bend_moment,
        duration=0.5,
    )
    found = ca.run_pairs(vehicle, scenario, ["decoupled"], method="RK4", step=STEP)
    flights = [
        ca.simulate(vehicle, scenario, model=m, method="RK4", step=STEP)
        for m in found["model"].values
    ]
    compared = {name: np.asarray(value) for name, value in ca.compare(*flights).items()}
    for name in ("nrmse_t", "nrmse_r"):
        assert float(found[name][0, 1]) == compared[name][0] == 0.0
        assert (found[name][1:, 1] > 1e-4).all()
        np.testing.assert_allclose(found[name][1:, 1], compared[name][1:], rtol=1e-9)


@pytest.mark.filterwarnings("ignore:nrmse_r and rmse_r_rad overstate")
def test_angles_follow_tumbles_through_both_triples() -> None:
    vehicle = some_vehicles(1).select(0)
    # Several turns about all axes, through pitch = π/2.
    q, qd = (0, 0, 5, 0.1, 0.2, 0, 0.1, 0), (0, 0, 0, 9.0, 17.0, -4.0, 0, 0)
    scenario = ca.Scenario("tumble", q, qd, duration=2.0)
    found = ca.run_pairs(vehicle, scenario, method="RK4", step=STEP).isel(run=0)
    flights = [
        ca.simulate(vehicle, scenario, model=m, method="RK4", step=STEP)
        for m in found["model"].values
    ]
    angles = tip_euler(flights[0])
    assert np.ptp(angles, axis=0).max() > 2 * np.pi
    compared = ca.compare(*flights)
    assert float(found["rmse_r_rad"][1]) == pytest.approx(compared["rmse_r_rad"], rel=1e-13)


def test_a_run_does_not_depend_on_its_batch() -> None:
    vehicle, scenario = some_vehicles(9), open_loop_test("A")
    together = ca.run_pairs(vehicle, scenario)
    assert len(np.unique(together["steps"])) > 1, "the runs should need different steps"
    for run in (0, 4, 8):
        alone = ca.run_pairs(vehicle.select(run), scenario).isel(run=0)
        for name in together:
            np.testing.assert_allclose(together[name].isel(run=run), alone[name], rtol=1e-11)


def test_a_run_that_ends_early_is_a_row_with_a_status() -> None:
    vehicle = some_vehicles(3)
    # A moment on the bend that no arm holds, in the middle run.
    scenario = ca.Scenario(
        "overbent", (0, 0, 5, 0, 0, 0, 0.1, 0), bend_moment=[[0.0, 0.0], [4e3, 0.0], [0.0, 0.0]]
    )
    found = ca.run_pairs(vehicle, scenario)
    assert (found["status"] != 0).any("model").values.tolist() == [False, True, False]
    assert float(found["end_time"][1, 1]) < 1.0 == float(found["end_time"][0, 1])
    assert np.isnan(found["nrmse_t"][1, 1]) and np.isfinite(found["nrmse_t"][[0, 2]]).all()


def test_closed_loops_agree_with_single_flights() -> None:
    """Also with a sample that lies a last digit before the time from which on errors count."""
    assert 11 * 0.03 < 0.33
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.05})
    target = Target(paths.letter("L", duration=20.0))
    start = target.path(0.0)[0][0]
    controllers = [servoing(**design(vehicle, bandwidth)) for bandwidth in (2.0, 4.0)]
    q = [start[0] + 0.05, start[1], 3.05, 0, 0, 0, 0.1, 0]

    def flight(controller: Controller) -> ca.Scenario:
        return ca.Scenario("L", q, controller=controller, target=target, duration=1.0)

    both = stack(controllers)
    found = ca.run_pairs(vehicle, flight(both), sample=0.03, settle=0.33)
    for run, controller in enumerate(controllers):
        flights = [
            ca.simulate(vehicle, flight(controller), model=model, sample=0.03)
            for model in found["model"].values
        ]
        errors = [f["feature_error"].sel(time=slice(0.33 - 1e-9, None)).values for f in flights]
        norms = [np.linalg.norm(error, axis=-1) for error in errors]
        one = found.isel(run=run, model=1)
        assert float(one["rms_px"]) == pytest.approx(np.sqrt(np.mean(errors[1] ** 2)), rel=1e-12)
        assert float(one["max_px"]) == pytest.approx(np.abs(errors[1]).max(), rel=1e-12)
        assert float(one["ds_max_px"]) == pytest.approx(
            np.abs(norms[1] - norms[0]).max(), rel=1e-11
        )
        compared = ca.compare(*flights)
        assert float(one["rmse_t_m"]) == pytest.approx(compared["rmse_t_m"], rel=1e-12)
    assert float(found["rms_px"][0, 0]) > float(found["rms_px"][1, 0]) > 0.0


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("models", ["lumped"]),
        ("sample", 0.0),
        ("step", -1.0),
        ("settle", 2.0),
        ("device", "tpu"),
    ],
)
def test_options_that_cannot_be_used_are_named(field: str, value: Any) -> None:
    with refused(field):
        ca.run_pairs(some_vehicles(2), open_loop_test("B"), **{field: value})


def test_pairs_say_what_varied() -> None:
    masses, radii = [2.0, 2.5], [0.004, 0.005]
    vehicles = ca.load_vehicle("paper").replace({"uav.mass": masses, "arm.radius": radii})
    pairs = ca.run_pairs(vehicles, open_loop_test("B"), duration=0.01)
    np.testing.assert_array_equal(pairs["uav.mass"], masses)
    np.testing.assert_array_equal(pairs["arm.radius"], radii)
    assert pairs["arm.radius"].dims == ("run",)
