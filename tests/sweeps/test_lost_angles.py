"""Euler angles count where samples follow them; where they do not, that is told."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from continuair.errors import ContinuairWarning
from continuair.typing import Model

pytestmark = pytest.mark.targets

VEHICLE = ca.load_vehicle("paper")
EULER = ("nrmse_r", "rmse_r_rad")
BESIDE = ca.Scenario(
    "beside",
    [0, 0, 5, -0.5121, 1.4069, 1.2669, 0.3, 2.5924],
    [0, 0, 0, -4.6208, 2.7482, 5.1291, 0, 0],
    duration=0.7,
)
"""A tumble that passes a pitch of a quarter turn at 0.008 rad."""


def pair(scenario: ca.Scenario, sample: float, vehicle: ca.Vehicle = VEHICLE) -> xr.Dataset:
    found = ca.run_pairs(vehicle, scenario, sample=sample, method="RK4", step=min(sample, 5e-4))
    return found.sel(model="decoupled").isel(run=0)


def both(scenario: ca.Scenario, sample: float, vehicle: ca.Vehicle = VEHICLE) -> Any:
    flights = [
        ca.simulate(
            vehicle,
            scenario,
            model=model,
            sample=sample,
            method="RK4",
            step=min(sample, 5e-4),
            variables=["tip_position", "tip_attitude", "tip_angular_velocity"],
        )
        for model in ("coupled", "decoupled")
    ]
    return ca.compare(*flights)


@pytest.mark.parametrize("fly", [pair, both])
@pytest.mark.parametrize("sample", [1e-2, 2e-3, 1e-3])
def test_samples_that_pass_beside_a_pole_have_no_euler_metrics(fly: Any, sample: float) -> None:
    """At 2 ms no angle changes by more than 0.8 rad, on the wrong triple."""
    with pytest.warns(ContinuairWarning, match="NaN.* angle_rad"):
        found = fly(BESIDE, sample)
    for name in EULER:
        assert np.isnan(found[name])
    for name in ("nrmse_t", "rmse_t_m", "angle_rad"):
        assert np.isfinite(found[name])


@pytest.mark.parametrize("fly", [pair, both])
def test_samples_that_follow_the_angles_agree_with_finer_ones(fly: Any) -> None:
    with pytest.warns(ContinuairWarning, match="overstate.* angle_rad"):
        fine, finer = (fly(BESIDE, sample) for sample in (1e-4, 2.5e-5))
    for name in EULER:
        assert float(fine[name]) == pytest.approx(float(finer[name]), rel=1e-3)
    # As 2 ms would have it, the angles end whole turns apart.
    assert float(fine["rmse_r_rad"]) > 2.0


@pytest.mark.parametrize("fly", [pair, both])
@pytest.mark.parametrize("rate", [31.5, 20 * np.pi])
def test_a_spin_that_samples_do_not_follow_is_told(fly: Any, rate: float) -> None:
    """Half a turn between samples, and a whole one, which attitudes do not show."""
    q, qd = [0, 0, 5, 0, 0, 0, 0.5, 0.3], [0, 0, 0, 0, 0, rate, 0, 0]
    spin, slender = ca.Scenario("spin", q, qd, duration=0.5), ca.load_vehicle("slender")
    with pytest.warns(ContinuairWarning, match="samples of 0.1 s"):
        found = fly(spin, 0.1, slender)
    assert np.isnan([found[name] for name in EULER]).all() and np.isfinite(found["angle_rad"])
    followed = fly(spin, 0.002, slender)
    assert np.isfinite([followed[name] for name in EULER]).all()


@pytest.mark.parametrize("fly", [pair, both])
def test_a_tumble_right_through_a_pole_keeps_its_angles(fly: Any) -> None:
    q, qd = [0, 0, 5, 0, 0, 0, 0.3, 0], [0, 0, 0, 0, 6.0, 0, 0, 0]
    tumble = ca.Scenario("tumble", q, qd, duration=1.0)
    coarse, fine = (fly(tumble, sample) for sample in (0.02, 1e-3))
    for name in EULER:
        assert float(coarse[name]) == pytest.approx(float(fine[name]), rel=0.05)


def test_axes_of_angles_are_lost_together_and_a_flight_agrees_with_itself() -> None:
    with pytest.warns(ContinuairWarning, match="NaN"):
        found = both(BESIDE, 2e-3)
    lost = [name for name, value in found.items() if np.isnan(value)]
    assert lost == [*EULER, "rmse_roll_rad", "rmse_pitch_rad", "rmse_yaw_rad"]
    variables = ["tip_position", "tip_attitude"]
    flight = ca.simulate(VEHICLE, BESIDE, sample=2e-3, variables=variables)
    assert set(ca.compare(flight, flight).values()) == {0.0}


@pytest.mark.parametrize("model", ["coupled", "decoupled"])
def test_q_follows_its_angles_whatever_the_samples_and_the_steps(model: Model) -> None:
    """Beside a pole and beside straight, where angles swing by half a turn within a step, and with
    whole turns between samples."""
    start = [0, 0, 5, 7.0, 0.1, -9.0, 0.3, 0.2], [0, 0, 0, 30.0, -8.0, 5.0, 0.4, 3.0]
    tumble = ca.Scenario("tumble", *start, duration=2.0)
    for scenario in (BESIDE, tumble):
        ends = [
            ca.simulate(VEHICLE, scenario, model=model, sample=sample, variables=["q"], **options)
            .q[-1]
            .to_numpy()
            for sample, options in (
                (0.1, {"rtol": 1e-8}),
                (1e-3, {"rtol": 1e-6}),
                (0.1, {"method": "RK4", "step": 2e-4}),
            )
        ]
        for end in ends[1:]:
            np.testing.assert_allclose(end, ends[0], rtol=0, atol=2e-3)
    begun = ca.simulate(VEHICLE, tumble, duration=1e-3, variables=["q"]).q[0]
    np.testing.assert_allclose(begun, start[0], rtol=0, atol=1e-12)


def test_samples_change_no_flight_whose_torques_follow_a_direction() -> None:
    """A bend of 1e-5 1/m whirls by whole turns within a step."""
    bend, whirl = [9.723876e-06, 2.398355], [0.000293532, -50.434715]
    q, qd = [0] * 6 + bend, [0, 0, 0, 0.657157, 1.719174, -0.519397, *whirl]
    scenario = ca.Scenario("whirl", q, qd, tau=1e-3 * np.eye(8)[6], gravity=0.0, duration=1.0)
    flights = [ca.simulate(VEHICLE, scenario, sample=sample) for sample in (1.0, 1e-2, 1e-3)]
    for flight in flights[1:]:
        assert int(flight["steps"]) == int(flights[0]["steps"])
        for name in ("tip_position", "bend"):
            np.testing.assert_array_equal(flight[name][-1], flights[0][name][-1])


@pytest.mark.parametrize(
    "euler", [(2.0, np.pi / 2, 1.0), (0.3, -np.pi / 2, 0.2), (7, np.pi / 2, -9)]
)
@pytest.mark.parametrize("options", [{}, {"method": "RK4", "step": 1e-3}])
def test_roll_and_yaw_of_a_vehicle_that_stands_upright_stay(
    euler: tuple[float, ...], options: dict[str, Any]
) -> None:
    still = ca.Scenario("still", [0, 0, 0, *euler, 0, 0.4], gravity=0.0, duration=0.1)
    flight = ca.simulate(VEHICLE, still, sample=0.01, variables=["q"], **options)
    np.testing.assert_allclose(flight["q"][:, 3:6], [euler] * 11, rtol=0, atol=1e-9)


def test_a_pass_beside_a_pole_takes_the_same_side_at_any_step() -> None:
    """At 1.2e-5 rad, much less than a step turns by."""
    qd = [0, 0, 0, 0, 8.0, -0.0014227877, 0, 0]
    scenario = ca.Scenario("pass", [0, 0, 0, 0, 1.2, 0, 0, 0], qd, gravity=0.0, duration=0.1)
    how: tuple[dict[str, Any], ...] = (
        {"sample": 0.1},
        {"sample": 1e-3},
        {"rtol": 1e-9},
        {"method": "RK4", "step": 1e-3},
    )
    for options in how:
        end = ca.simulate(VEHICLE, scenario, variables=["q"], **options)["q"][-1, 3:6]
        np.testing.assert_allclose(end, [-np.pi, np.pi - 2.0, -np.pi], rtol=0, atol=1e-3)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_swing_in_a_plane_keeps_its_direction(dtype: Literal["float64", "float32"]) -> None:
    vehicle = VEHICLE.replace({"uav.inertia": [0.05, 0.05, 0.09]})
    rng = np.random.default_rng(0)
    q = np.zeros((64, 8))
    q[:, 6], q[:, 7] = rng.choice([-0.5, 0.5], 64), rng.uniform(-3.0, 3.0, 64)
    swing = ca.Scenario("swing", q, gravity=0.0, duration=2.0)
    flight = ca.simulate(vehicle, swing, sample=0.01, dtype=dtype, variables=["q"])
    # Near straight the direction of a float32 bend is that of few digits.
    assert float(abs(flight["q"][..., 7] - q[:, None, 7]).max()) < 0.1
    assert float(flight["q"][..., 6].min()) < -0.4 < 0.4 < float(flight["q"][..., 6].max())


@pytest.mark.parametrize(("sample", "told"), [(1e-3, "NaN"), (1e-4, "overstate")])
def test_an_opened_sweep_tells_of_lost_and_of_overstated_angles(
    tmp_path: Path, sample: float, told: str
) -> None:
    pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")
    table = {"duration": 0.7, "roll": -0.5121, "pitch": 1.4069, "yaw": 1.2669, "kappa": 0.3}
    table |= {"psi_a": 2.5924, "roll_rate": -4.6208, "pitch_rate": 2.7482}
    design = xr.Dataset(
        {"scenario.yaw_rate": ("rate", [5.1291])},
        attrs={"scenario": table, "sample": sample},
    )
    with pytest.warns(ContinuairWarning, match=f"rmse_r_rad .*{told}"):
        ca.sweep(design, tmp_path / "store.zarr")
    with pytest.warns(ContinuairWarning, match=f"rmse_r_rad .*{told}"):
        ca.open_sweep(tmp_path / "store.zarr")
