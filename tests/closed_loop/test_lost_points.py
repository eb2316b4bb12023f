"""Points that leave the image: some are done without, and without any the run ends."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from tests.closed_loop import flights

# So weak that the camera stays where it is.
WEAK: dict[str, Any] = {"Kp": 0.01, "Kd": 0.001, "Cp": 1.0, "Cd": 0.1, "Cs": 0.01}


def test_losing_all_points_ends_that_run_with_a_status_and_keeps_what_was_recorded() -> None:
    """One target runs away at once, the other stays."""
    away = ca.paths.line([0.0, 0.0, 0.0], [20.0, 0.0, 0.0], duration=2.0)
    targets = [ca.Target(away), flights.STILL]
    scenario = flights.scenario(ca.servoing(**WEAK), 2.0, target=targets)
    run = ca.simulate(flights.VEHICLE, scenario)
    np.testing.assert_array_equal(run.status, [3, 0])
    assert "all feature points lost" in run.status.attrs["long_name"]
    end = float(run.end_time[0])
    assert 0.1 < end < 1.0
    lost = run.isel(run=0)
    recorded = lost.sel(time=slice(None, end + 1e-9))
    later = lost.sel(time=slice(end + 1e-9, None))
    assert np.isfinite(recorded.features).all() and np.isfinite(recorded.bend).all()
    assert np.isfinite(recorded.command).all()
    assert np.isnan(later.features).all() and np.isnan(later.bend).all()
    # The last sample is the first without a point.
    in_view = recorded.in_view.sum("point").to_numpy()
    assert in_view[-1] == 0 and (in_view[:-1] > 0).all()
    assert np.isfinite(run.isel(run=1).bend).all()
    assert float(run.end_time[1]) == 2.0


@pytest.mark.long
def test_a_point_out_of_view_does_not_act() -> None:
    """With one corner hidden by a narrow image, the push is that of the other three."""
    far = np.vstack([ca.square(), [[-1.24, 0.0, 0.0]]])
    target = ca.Target(ca.paths.line([0, 0, 0], [-8.0, 0, 0], duration=10.0), far)
    q = flights.start(x=0.0, z=0.0, kappa=0.0)
    five = flights.scenario(ca.servoing(**WEAK, points=5), 1.5, q=q, target=target)
    names = ["q", "in_view", "command"]
    run = ca.simulate(flights.VEHICLE, five, variables=names)
    hidden = np.flatnonzero(run.in_view[:, 4] == 0)
    assert run.status == 0 and len(hidden) > 0
    i = hidden[0]
    state = run.isel(time=i)
    four = flights.scenario(
        ca.servoing(**WEAK),
        1e-3,
        q=state.q.to_numpy(),
        qd=_rates(run, i),
        target=ca.Target(_moved(target.path, float(state.time))),
    )
    push = ca.simulate(flights.VEHICLE, four).command[0]
    np.testing.assert_allclose(push, state.command, rtol=0, atol=1e-3 * np.abs(state.command).max())


@pytest.mark.long
def test_points_behind_the_camera_have_no_image_and_no_error_in_pixels() -> None:
    """The vehicle holds its place, and its target rises through the camera."""
    vehicle = flights.VEHICLE
    path = ca.paths.line([0, 0, 0], [0, 0, 40.0], duration=1.0)
    target = ca.Target(path, ca.square(0.5))
    scenario = flights.scenario(ca.hold(vehicle, [0, 0, 3.0]), 0.2, target=target)
    flight = ca.simulate(vehicle, scenario, sample=0.01)
    behind = flight.depth.to_numpy() <= 0.0
    assert flight.status == 0 and behind.any() and not behind.all()
    for name in ("features", "feature_error"):
        missing = np.isnan(flight[name].to_numpy())
        np.testing.assert_array_equal(missing, np.repeat(behind, 2, axis=1))
    seen, blind = (
        ca.run_pairs(vehicle, scenario, sample=0.01, duration=each) for each in (0.05, 0.2)
    )
    for name in ("rms_px", "max_px", "ds_max_px"):
        assert np.isfinite(seen[name]).all() and np.isnan(blind[name]).all()
    assert np.isfinite(blind.angle_rad).all()


def test_what_a_simulation_observes_behind_the_camera_has_no_image() -> None:
    target = ca.Target(ca.paths.line([0, 0, 0], [0, 0, 40.0], duration=1.0), ca.square(0.5))
    start = flights.scenario(ca.hold(flights.VEHICLE, [0, 0, 3.0]), 0.2, target=target)
    sim = ca.Simulation(flights.VEHICLE, start.replace(controller=None), control_period=0.1)
    assert np.isfinite(sim.observe().features).all()
    sim.step(np.zeros(8))
    seen = sim.observe()
    assert (seen.depth < 0.0).all() and np.isnan(seen.features).all() and not seen.in_view.any()


def _rates(run: xr.Dataset, i: int) -> np.ndarray:
    """Rates of the paper's coordinates by central differences."""
    return np.asarray((run.q[i + 1] - run.q[i - 1]) / 2e-3)


def _moved(path: ca.paths.Path, time: float) -> ca.paths.Path:
    return ca.paths.Path("later", path.duration, lambda t: path(t + time))
