"""Of flights that ended early, or that are not resolved, sentences are not decided."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026.open_loop.study import OpenLoop
from amiri2026.open_loop_tests import open_loop_test
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import disks, letter, open_loop
from amiri2026.paper.judging import judge
from amiri2026.table.study import PRINTED
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, UNDECIDED, UNTESTABLE, judged
from tests.paper import given

VEHICLE = ca.load_vehicle("paper")


def test_what_rests_on_a_number_that_is_told_as_nan_is_not_decided() -> None:
    for holds in (True, False):
        found = judged(holds, "up to nan % of an energy", another=1.0)
        assert found.verdict == UNDECIDED and found.evidence != "up to nan % of an energy"
    assert judged(True, "a banana", one=1.0).verdict == HOLDS


@pytest.mark.parametrize(
    ("error", "change", "verdict"),
    [(0.05, 0.01, HOLDS), (0.05, 0.3, DEPENDS), (np.nan, np.inf, UNDECIDED)],
)
def test_a_finer_tolerance_says_nothing_of_flights_that_ended_early(
    error: float, change: float, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """IV.2, with the error of Test C, and what a tenth of the tolerance changes."""

    def entry(error: float, change: float) -> dict[str, Any]:
        return {"decoupled": {"rmse_t_m": error, "relative_error": change}}

    tests = {name: entry(0.05, 1e-3) for name in "ABD"} | {"C": entry(error, change)}
    study = OpenLoop({"rtol": 1e-6, "tests": tests}, {})
    same = SimpleNamespace(table=lambda reading: PRINTED)
    monkeypatch.setattr(open_loop, "fly_tests", lambda vehicle, **_: same)
    found = given.evidence(open_loop=study, table=given.table())
    assert open_loop.identical_conditions(found).verdict == verdict


def test_a_tolerance_that_changes_the_table_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    for share, verdict in ((1.05, HOLDS), (1.2, FAILS)):
        loose = SimpleNamespace(table=lambda reading, share=share: share * PRINTED)
        monkeypatch.setattr(open_loop, "fly_tests", lambda vehicle, loose=loose, **_: loose)
        kept, changed = open_loop._tolerances(given.table())
        assert (kept.found.verdict, changed.found.verdict) == (HOLDS, verdict)


def test_the_images_slopes_end_with_the_flight() -> None:
    camera = VEHICLE.camera
    pixels = np.tile([300.0, 200.0, 340.0, 200.0, 340.0, 260.0, 300.0, 260.0], (4, 1))
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    data = {
        "features": (("time", "pixel"), pixels),
        "depth": (("time", "point"), np.full((4, 4), 2.0)),
        "camera_attitude": (("time", "quaternion"), attitude),
    }
    flight = xr.Dataset(data)
    whole = letter.image_slopes(flight, VEHICLE)
    assert camera is not None and np.isfinite(whole).all()
    for ended in (0.0, np.nan):
        lost = flight.copy(deep=True)
        for name in data:
            lost[name][2:] = ended
        found = letter.image_slopes(lost, VEHICLE)
        np.testing.assert_array_equal(found[:2], whole[:2])
        assert np.isnan(found[2:]).all()


@pytest.mark.long
def test_errors_with_disks_and_without_are_those_of_a_much_finer_tolerance() -> None:
    """In Test C the arm passes straight, where errors of single steps grow the most."""
    vehicle = VEHICLE.replace(
        {"arm.radius": 3.5e-3, "arm.length": 0.8, "uav.mass": 1.2, "arm.youngs_modulus": 2e11}
    )
    full = disks.with_disks(vehicle)
    fine = ca.run_pairs(full, open_loop_test("C"), ["decoupled"], method="Tsit5", rtol=1e-9)
    expected = float(fine["rmse_t_m"].sel(model="decoupled")[0])
    assert disks.errors_of_tests(full)["C"] == pytest.approx(expected, rel=1e-4)


def test_shares_of_disks_are_not_known_where_tolerances_do_not_agree(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(disks, "_SAME", 1e-15)
    assert np.isnan(disks.shares_of_energy(VEHICLE, "C")[0].larger)
    assert np.isnan(list(disks.errors_of_tests(VEHICLE).values())).all()


@pytest.mark.long
def test_times_of_a_vehicle_that_loses_its_target_end_nothing() -> None:
    vehicle = ca.load_vehicle(Path(__file__).parents[1] / "long_light_arm.toml")
    (found,) = judge(["IV-C.16"], Evidence(vehicle, quick=True))
    assert found["verdict"] == UNTESTABLE
    assert "fails within 5 s" in found["evidence"] and not found["evidence"].endswith(".")
