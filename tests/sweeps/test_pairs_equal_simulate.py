"""`run_pairs` is `simulate` and `compare`: steps, statuses, ends and metrics, in any batch."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026 import open_loop_test
from continuair.analysis.metrics import tip_euler
from continuair.errors import ContinuairWarning
from continuair.typing import Model
from tests import random_flights
from tests.random_flights import Case

Array = np.ndarray

RELATIVE = 1e-12
# Of the largest coordinate: `run_pairs` flies with another kernel, whose sums may be rounded
# otherwise, and a flight amplifies that. A sixteenth of it is reached, a hundredth as a rule.
ROUNDING = 256 * np.finfo(float).eps

OPEN, CLOSED = range(20), range(8)
MORE_OPEN, MORE_CLOSED = range(20, 220), range(8, 80)


@pytest.mark.parametrize(
    "numbers", [OPEN, pytest.param(MORE_OPEN, marks=pytest.mark.soak)], ids=["some", "more"]
)
def test_open_loop(numbers: range) -> None:
    for number in numbers:
        assert_pairs_are_simulate(random_flights.open_case(number))


@pytest.mark.parametrize(
    "numbers", [CLOSED, pytest.param(MORE_CLOSED, marks=pytest.mark.soak)], ids=["some", "more"]
)
def test_closed_loop(numbers: range) -> None:
    for number in numbers:
        assert_pairs_are_simulate(random_flights.closed_case(number))


@pytest.mark.parametrize("batched", [False, True])
def test_an_overdamped_arm_in_test_a(batched: bool) -> None:
    """With the step that its frequency alone allows, the tip would be kilometres off."""
    ratio = [0.0, 5.0] if batched else 5.0
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": ratio})
    case = Case(vehicle, open_loop_test("A"), ("decoupled", "independent"), 0.0, {})
    found = assert_pairs_are_simulate(case)
    assert float(found["rmse_t_m"].sel(model="decoupled")[-1]) == pytest.approx(0.0205, rel=5e-3)


def test_a_sweep_of_one_run_is_its_pair(tmp_path: Path) -> None:
    pytest.importorskip("zarr", reason="the extra 'sweep' installs zarr")
    table = {"test": "A", "duration": 0.2}
    design = xr.Dataset({"vehicle.arm.damping_ratio": ("ratio", [5.0])}, attrs={"scenario": table})
    swept = ca.sweep(design, tmp_path / "store.zarr").isel(ratio=0)
    vehicle = ca.load_vehicle("paper").replace({"arm.damping_ratio": 5.0})
    pair = ca.run_pairs(vehicle, open_loop_test("A"), duration=0.2, sample=2e-3).isel(run=0)
    for name in ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_r_rad", "angle_rad", "status", "steps"):
        wanted = np.broadcast_to(pair[name], swept[name].shape)
        np.testing.assert_allclose(swept[name], wanted, rtol=RELATIVE, err_msg=name)


def assert_pairs_are_simulate(case: Case) -> xr.Dataset:
    """Fly a case both ways, and compare all that `run_pairs` returns; return that."""
    found, said = heard(
        lambda: ca.run_pairs(
            case.vehicle, case.scenario, case.models, settle=case.settle, **case.options
        )
    )
    flights = [flown(case, model, said) for model in ("coupled", *case.models)]
    assert found["model"].values.tolist() == ["coupled", *case.models]
    assert_same_ends(case, found, flights)
    for column, flight in enumerate(flights):
        wanted, allowed = compared(flights[0], flight)
        if "feature_error" in flight:
            seen, floor = in_pixels(flights[0], flight, case)
            wanted, allowed = wanted | seen, allowed | floor
        for name in wanted:
            reached = found[name].to_numpy()[:, column]
            assert_within(f"{name} of {flight.model}", reached, wanted[name], allowed[name], case)
    return found


def flown(case: Case, model: Model, said: list[str]) -> xr.Dataset:
    """The flight of one model."""
    options = dict(case.options)
    flight, also = heard(lambda: ca.simulate(case.vehicle, case.scenario, model=model, **options))
    assert of_steps_and_inputs(also) == of_steps_and_inputs(said), str(case)
    return flight if "run" in flight.dims else flight.expand_dims("run")


def of_steps_and_inputs(said: list[str]) -> list[str]:
    """Warnings but for those of angles, of which pairs have those of the tips and a flight those of
    the UAV."""
    others = "roll, pitch", "rmse_r_rad"
    return [text for text in said if not any(other in text for other in others)]


def heard(act: Callable[[], xr.Dataset]) -> tuple[xr.Dataset, list[str]]:
    """What a call returns, and what it warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContinuairWarning)
        found = act()
    return found, [str(one.message) for one in caught]


def assert_same_ends(case: Case, found: xr.Dataset, flights: list[xr.Dataset]) -> None:
    """Steps, statuses and ends are the same numbers, and tips end at the same place."""
    for column, flight in enumerate(flights):
        counted = ("steps",) if "steps" in found else ()
        for name in ("status", "end_time", *counted):
            same = found[name].isel(model=column)
            np.testing.assert_array_equal(same, flight[name], err_msg=f"{name}: {case}")
        for name in ("tip_position", "tip_attitude"):
            wanted = flight[name].transpose("run", "time", ...).to_numpy()
            allowed = ROUNDING * np.nanmax(np.abs(wanted), axis=(1, 2))[:, None]
            reached = found[name].to_numpy()[:, column]
            assert_within(name, reached, wanted[:, -1], allowed, case)


def compared(coupled: xr.Dataset, other: xr.Dataset) -> tuple[dict[str, Array], dict[str, Array]]:
    """What `compare` says of every run, and by how much rounding may change it.

    Of an RMSE that is the rounding of a coordinate; an NRMSE divides it, and the range it is
    divided by has that rounding twice. An Euler angle has the rounding of the attitude over cos θ.
    """
    well = ((coupled.status == 0) & (other.status == 0)).to_numpy()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContinuairWarning)
        found = ca.compare(coupled, other)
    # A run is not compared with one that ended early.
    names = ("nrmse_t", "nrmse_r", "rmse_t_m", "rmse_r_rad", "angle_rad")
    wanted = {name: np.where(well, found[name], np.nan) for name in names}
    allowed = {"angle_rad": RELATIVE * wanted["angle_rad"] + ROUNDING}
    position = coupled["tip_position"].transpose("run", "time", "axis").to_numpy()
    for unit, values, worst in (
        ("t_m", position, np.abs(position).max(axis=(1, 2))),
        ("r_rad", *angles_and_rounding(coupled, other)),
    ):
        rounding, spread = ROUNDING * worst, np.linalg.norm(np.ptp(values, axis=1), axis=-1)
        ratio = f"nrmse_{unit[0]}"
        allowed[f"rmse_{unit}"] = RELATIVE * wanted[f"rmse_{unit}"] + rounding
        allowed[ratio] = allowed[f"rmse_{unit}"] / spread + 2 * wanted[ratio] * rounding / spread
    return wanted, allowed


def angles_and_rounding(*flights: xr.Dataset) -> tuple[Array, Array]:
    """Euler angles of the first flight (runs, samples, 3), and what rounding grows by in all."""
    angles = [tip_euler(flight) for flight in flights]
    worst = [np.abs(of).max(axis=(1, 2)) + 1 / np.abs(np.cos(of[..., 1])).min(1) for of in angles]
    return angles[0], np.maximum(*worst)


def in_pixels(
    coupled: xr.Dataset, flight: xr.Dataset, case: Case
) -> tuple[dict[str, Array], dict[str, Array]]:
    """The image's metrics after `settle`, and by how much rounding may change them."""
    late = flight["time"].to_numpy() >= case.settle
    error, other = (
        of["feature_error"].transpose("run", "time", "pixel").to_numpy()[:, late]
        for of in (flight, coupled)
    )
    gap = np.linalg.norm(error, axis=-1) - np.linalg.norm(other, axis=-1)
    wanted = {
        "rms_px": np.sqrt(np.mean(error**2, axis=(1, 2))),
        "max_px": np.abs(error).max(axis=(1, 2)),
        "ds_max_px": np.abs(gap).max(axis=1),
    }
    well = ((coupled.status == 0) & (flight.status == 0)).to_numpy()
    wanted = {name: np.where(well, values, np.nan) for name, values in wanted.items()}
    floor = ROUNDING * np.max(case.vehicle.camera.focal_length)
    return wanted, {name: RELATIVE * values + floor for name, values in wanted.items()}


def assert_within(name: str, found: Array, wanted: Any, allowed: Array, case: Case) -> None:
    """Equal within what is allowed, and not a number, or infinite, in the same places."""
    wanted = np.asarray(wanted)
    plain = np.isfinite(wanted)
    np.testing.assert_array_equal(found[~plain], wanted[~plain], err_msg=f"{name}: {case}")
    gap = np.where(plain, np.abs(found - np.where(plain, wanted, 0.0)), 0.0)
    allowed = np.where(plain, np.broadcast_to(allowed, wanted.shape), 1.0)
    assert (gap <= allowed).all(), f"{name}: {found} is not {wanted} within {allowed}\n{case}"
