"""Gains made anew for the image of now: from where they bring it home, and how they are given."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026.region.flights import TARGET
from amiri2026.region.starts import RANDOM, starts
from continuair.controllers.gain_files import Gains, load_gains
from continuair.controllers.servoing import current_law as law
from continuair.device.numbers import NARROW
from continuair.engine.engine import Engine
from continuair.engine.factory import Closing, packed_loop
from continuair.engine.law_made import made_law
from continuair.scenario.tracking_task import SETTINGS, equipped, task
from tests.closed_loop import flights
from tests.refusals import refused

CURRENT = load_gains("current").controller(flights.VEHICLE)
CONSTANT = load_gains("paper").controller(flights.VEHICLE)
DEGREE = np.pi / 180.0
FAR = {
    "90° of yaw": (5, 90.0 * DEGREE),
    "0.8 m to the side": (1, 0.8),
    "15° of roll": (3, 15.0 * DEGREE),
}


def fly(q: np.ndarray, law: ca.Controller, duration: float, **options: Any) -> xr.Dataset:
    scenario = flights.scenario(law, duration, q=q, control_period=1e-3)
    return ca.simulate(
        flights.VEHICLE, scenario, sample=0.01, variables=["feature_error"], **options
    )


def worst(run: xr.Dataset, since: float) -> xr.DataArray:
    """Largest error of any point from a time on [px], NaN of runs that ended before."""
    late = abs(run["feature_error"]).sel(time=slice(since, None))
    return late.max(("time", "pixel"), skipna=False)


@pytest.mark.parametrize("model", ["coupled", pytest.param("decoupled", marks=pytest.mark.long)])
def test_from_far_off_the_image_is_within_a_pixel_after_eight_seconds(model: str) -> None:
    q = np.tile(flights.start(x=0.0, z=0.0, kappa=0.1), (len(FAR), 1))
    for row, (coordinate, off) in zip(q, FAR.values(), strict=True):
        row[coordinate] += off
    run = fly(q, CURRENT, 9.0, model=model)
    assert (run["status"] == 0).all() and (worst(run, 8.0) < 1.0).all()
    constant = fly(q, CONSTANT, 0.1, model=model)
    assert (constant["status"] != 0).any(), "constant gains lose it from there"


@pytest.mark.long
def test_of_random_starts_in_view_99_percent_end_within_a_pixel() -> None:
    found = starts(flights.VEHICLE, TARGET, 200, seed=5)
    q = found["q"].to_numpy()[found["direction"] == RANDOM]
    run = fly(q, CURRENT, 10.0)
    assert ((run["status"] == 0) & (worst(run, 9.9) < 1.0)).sum() >= 198


@pytest.mark.parametrize("setting", list(SETTINGS))
def test_letters_are_tracked_as_well_as_by_constant_gains(setting: str) -> None:
    vehicle = equipped(ca.load_vehicle("paper"), SETTINGS[setting])
    rms = []
    for name in ("current", "paper"):
        scenario = task(
            vehicle, "L", load_gains(name).controller(vehicle), SETTINGS[setting].duration
        )
        run = ca.simulate(vehicle, scenario, sample=0.02, variables=["feature_error"])
        rms.append(float(np.sqrt((run["feature_error"].sel(time=slice(5.0, None)) ** 2).mean())))
    assert rms[0] <= 1.05 * rms[1]


def test_at_the_desired_image_the_push_is_that_of_constant_gains() -> None:
    """But for the floor of 1e-6 in W, of which s_1² makes 5e-4."""
    q, qd = flights.start(0.0, 0.0, 0.0), np.array([0.1, -0.2, 0.05, 0.1, 0.2, -0.1, 0.0, 0.0])
    pushes = []
    for name in ("constant", "current"):
        gains = ca.design(flights.VEHICLE, 4.0, gains=name, conditioning=2e-3)
        scenario = flights.scenario(ca.servoing(**gains), 1e-3, q=q, qd=qd)
        run = ca.simulate(flights.VEHICLE, scenario, sample=1e-3, variables=["command"])
        pushes.append(run["command"][0].to_numpy())
    assert np.linalg.norm(pushes[1] - pushes[0]) < 1e-3 * np.linalg.norm(pushes[0])


def test_they_fly_in_packs_and_a_run_has_the_same_bits_in_any() -> None:
    tree, few = Engine(flights.VEHICLE, "coupled").tree, NARROW["float64"]
    made = made_law(law, "float64", tree, 4, few)
    assert packed_loop(made, "coupled", Closing()) is not None
    q = starts(flights.VEHICLE, TARGET, 11, seed=3)["q"].to_numpy()[-11:]
    together = fly(q, CURRENT, 1.0)
    for run in range(len(q)):
        alone = fly(q[run], CURRENT, 1.0)
        np.testing.assert_array_equal(alone["feature_error"], together["feature_error"][run])


MINE = {"gains": "current", "Kp": 1.0, "Kd": 1.0}
CURRENT_DESIGN: dict[str, Any] = {"bandwidth": 3.0, "gains": "current"}
REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: ca.design(flights.VEHICLE, 3.0, gains="now"), "gains"),  # type: ignore[arg-type]
    (lambda: ca.design(flights.VEHICLE, **CURRENT_DESIGN, cap=[0.5, 0.0]), "cap"),
    (lambda: ca.design(flights.VEHICLE, 3.0, cap=[0.5, 0.5]), "cap"),
    (
        lambda: ca.servoing(**{**ca.design(flights.VEHICLE, **CURRENT_DESIGN), "Kd": 1.0}),  # type: ignore[arg-type]
        "Kp",
    ),
    (lambda: ca.servoing(**ca.design(flights.VEHICLE, **CURRENT_DESIGN) | {"Cp": 2.0}), "Cp"),
    (lambda: ca.design(flights.VEHICLE, 1e200, gains="current"), "bandwidth"),
    (lambda: Gains("mine.toml", MINE), "gains"),
]


@pytest.mark.parametrize(("make", "field"), REFUSED)
def test_what_cannot_be_flown_is_refused_in_one_sentence(
    make: Callable[[], object], field: str
) -> None:
    with refused(field):
        make()
