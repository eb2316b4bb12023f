"""Forces that a Python function returns, held between its calls."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from continuair.scenario.wrench import FlightState
from tests.refusals import refused
from tests.sections.strains import flying, rod
from tests.terms.tip_drag import TipDrag

VEHICLE = ca.load_vehicle("paper")
Callback = Callable[[float, FlightState], Any]

pytestmark = pytest.mark.filterwarnings("ignore:force_callback is Python")


def scenario(runs: slice | int = 0, **fields: Any) -> ca.Scenario:
    q, qd = np.random.default_rng(5).normal(size=(2, 9, 8))
    return ca.Scenario("called", 0.2 * q[runs], 0.5 * qd[runs], duration=0.02, **fields)


def flown(callback: Callback | None, runs: slice | int = 0, **fields: Any) -> xr.Dataset:
    vehicle = fields.pop("vehicle", VEHICLE)
    chosen = scenario(runs, force_callback=callback, **fields)
    return ca.simulate(vehicle, chosen, method="RK4", step=5e-4, sample=2e-3)


def same(one: xr.Dataset, other: xr.Dataset, tolerance: float) -> None:
    for name in ("position", "bend", "tip_velocity", "base_force", "kinetic_energy"):
        a, b = one[name].to_numpy(), other[name].to_numpy()
        assert a.shape == b.shape
        assert np.abs(a - b).max() <= tolerance * np.abs(b).max(), name
    assert (one["status"] == other["status"]).all()


def test_a_constant_wrench_is_that_input() -> None:
    force, moment = [1.0, 2.0, 12.0], np.array([0.1, -0.2, 0.05])
    wrench = [0.2, 0.1, 0.3, 0.0, 0.01, 0.0]

    def callback(time: float, state: FlightState) -> list[ca.Wrench]:
        turned = Rotation.from_quat(state.attitude).apply(moment)
        return [ca.Wrench(force, turned), ca.Wrench(wrench[:3], wrench[3:], at="tip")]

    expected = flown(None, force=force, moment=moment, tip_wrench=wrench)
    same(flown(callback), expected, 1e-9)
    # Also of calls that meet neither steps nor samples.
    between = flown(callback, callback_rate=777.0)["tip_position"].to_numpy()
    assert between == pytest.approx(expected["tip_position"].to_numpy(), rel=1e-6)


def test_a_callback_sees_the_coordinates_of_sections_of_any_kind() -> None:
    """It returns a force of them, which a flight with that force alone repeats."""
    vehicle = flying(rod(bending=1, nodes=4), rod())
    q = [0, 0, 1, 0.1, 0, 0, 1.0, 0.3, 0.2, 0.1, 2.0, 0.5]
    start = ca.Scenario("called", q, duration=0.02)
    seen, forces = [], []

    def callback(time: float, state: FlightState) -> ca.Wrench:
        seen.append(np.concatenate([state.bend, state.bend_rate]))
        forces.append([0.1 * state.bend[1], state.bend[4], 1e-3 * state.bend_rate[0]])
        return ca.Wrench(forces[-1], at="tip")

    options: dict[str, Any] = {"method": "RK4", "step": 2.5e-4, "sample": 1e-3}
    flight = ca.simulate(vehicle, start.replace(force_callback=callback), **options)
    along = xr.concat([flight["strain"], flight["strain_rate"]], "strain_coordinate")
    assert np.asarray(seen).shape == (20, 12)
    np.testing.assert_allclose(seen, along.to_numpy()[:-1], rtol=1e-9, atol=1e-9)
    held, jumps = np.asarray(forces), 1e-3 * np.arange(1, 20)

    def wrench(time: float) -> list[float]:
        return [*held[np.searchsorted(jumps, time, side="right")], 0.0, 0.0, 0.0]

    same = start.replace(tip_wrench=wrench, jumps=tuple(jumps))
    expected = ca.simulate(vehicle, same, **options)
    for name in ("strain", "tip_position"):
        np.testing.assert_allclose(flight[name], expected[name], rtol=1e-9, atol=1e-9)
    assert np.abs(held).max(axis=0).min() > 1e-2


def test_a_batch_is_called_once_for_all_its_runs() -> None:
    shapes = []

    def callback(time: float, state: FlightState) -> ca.Wrench:
        shapes.append(state.tip_velocity.shape)
        return ca.Wrench(-0.4 * state.tip_velocity, at=("tip", 0))

    batch = flown(callback, slice(None))
    assert shapes == [(9, 3)] * 20
    for run in (0, 8):
        same(flown(callback, run), batch.isel(run=run).drop_vars("step"), 1e-11)


def test_drag_converges_to_the_term_at_first_order() -> None:
    def callback(time: float, state: FlightState) -> ca.Wrench:
        return ca.Wrench(-0.4 * state.tip_velocity, at="tip")

    exact = flown(None, vehicle=VEHICLE.replace({"terms": (TipDrag(0.4),)}))["tip_velocity"]
    errors = [
        float(np.abs(flown(callback, callback_rate=rate)["tip_velocity"] - exact).max())
        for rate in (500.0, 1000.0, 2000.0)
    ]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


def test_a_run_that_ends_early_is_nan_from_there_on() -> None:
    def callback(time: float, state: FlightState) -> ca.Wrench:
        assert np.isfinite(state.tip_position).all()
        force = np.zeros((9, 3))
        force[3] = 1e9 * (time > 0.009)
        return ca.Wrench(force, at="tip")

    flight = flown(callback, slice(None))
    assert (np.flatnonzero(flight["status"]) == [3]).all()
    assert 0.01 <= float(flight["end_time"][3]) < 0.012
    lost = flight["tip_position"].isnull().any("axis")
    assert lost.sum("time").to_numpy().tolist() == [0, 0, 0, 5, 0, 0, 0, 0, 0]


def test_it_warns_that_it_is_slow() -> None:
    with pytest.warns(ca.ContinuairWarning, match="slow") as caught:
        flown(lambda time, state: ca.Wrench([0.0, 0.0, 1.0]))
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    "returned",
    [
        [0.0, 0.0, 1.0],
        ca.Wrench([0.0, 1.0]),
        ca.Wrench([0.0, np.nan, 1.0]),
        ca.Wrench([0.0, 0.0, 1.0], ["a"]),
        ca.Wrench([0.0, 0.0, 1.0], at=("tip", 1)),
        ZeroDivisionError("no"),
    ],
)
def test_what_is_no_wrench_is_refused(returned: Any) -> None:
    def callback(time: float, state: FlightState) -> Any:
        if isinstance(returned, Exception):
            raise returned
        return returned

    with refused("force_callback"):
        flown(callback)


def test_what_does_not_call_it_refuses_it() -> None:
    def callback(time: float, state: FlightState) -> ca.Wrench:
        return ca.Wrench([0.0, 0.0, 1.0])

    called = scenario(force_callback=callback)
    with refused("scenario"):
        ca.run_pairs(VEHICLE, called)
    with refused("scenario"):
        ca.Simulation(VEHICLE, called)
    for given in ({"method": "implicit", "step": 1e-3}, {"rtol": 1e-6}, {"max_step": 1e-3}):
        with refused("force_callback"):
            ca.simulate(VEHICLE, called, **given)
    assert ca.simulate(VEHICLE, called, duration=2e-3).attrs["method"] == "RK4"
    with refused("check"):
        ca.simulate(VEHICLE, called, check=True)
    with refused("force_callback"):
        scenario(force_callback=callback, controller=ca.hold(VEHICLE, np.zeros(3)))
    with refused("force_callback"):
        scenario(force_callback=3)
    with refused("at"):
        ca.Wrench([0.0, 0.0, 1.0], at="base")  # type: ignore[arg-type]
