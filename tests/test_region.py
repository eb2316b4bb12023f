"""The region of operation: which starts there are, what counts as reached, and what is written."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from amiri2026.figures import region as figures
from amiri2026.figures.laws import LAWS as STYLES
from amiri2026.region.flights import TARGET
from amiri2026.region.report import summary
from amiri2026.region.starts import BEND, HEIGHT, RANDOM, SIDEWAYS, TILT, YAW, starts
from amiri2026.region.study import Region, region
from amiri2026.standard_laws import LAWS
from continuair import equations
from continuair.controllers.gain_files import Gains
from continuair.equations.camera import in_view
from continuair.flight.resolution import RESOLVED
from tests.refusals import assert_refused, refused
from tests.weak_rotors import with_weak_rotors

RUNS = 40


@pytest.fixture(scope="module")
def vehicle() -> ca.Vehicle:
    return ca.load_vehicle("paper")


@pytest.fixture(scope="module")
def study(vehicle: ca.Vehicle) -> Region:
    return region(vehicle, models=["coupled"], runs=RUNS, seed=1)


@pytest.mark.parametrize("kappa_s", [0.0, 0.5])
def test_what_is_in_view_does_not_depend_on_where_straightness_begins(
    vehicle: ca.Vehicle, kappa_s: float
) -> None:
    expected = starts(vehicle, TARGET, 20, seed=2)
    found = starts(vehicle.replace({"arm.kappa_s": kappa_s}), TARGET, 20, seed=2)
    np.testing.assert_array_equal(found["visible"], expected["visible"])
    ladder = expected["visible"].to_numpy()[expected["direction"] != RANDOM]
    assert 0.2 < ladder.mean() < 1.0


@pytest.mark.long
def test_random_starts_fill_their_box_with_all_points_in_view(vehicle: ca.Vehicle) -> None:
    found = starts(vehicle, TARGET, 300, seed=2)
    q = (found["q"] - found["centre"]).to_numpy()[found["direction"] == RANDOM]
    aside = np.hypot(q[:, 0], q[:, 1])
    assert 0.9 * SIDEWAYS < aside.max() <= SIDEWAYS
    assert HEIGHT[0] <= q[:, 2].min() < q[:, 2].max() <= HEIGHT[1]
    lean = np.arccos(np.cos(q[:, 3]) * np.cos(q[:, 4]))
    assert 0.9 * TILT < lean.max() <= TILT + 1e-12
    # The yaw of a tilted body is the angle about the vertical to first order in the tilt squared.
    assert 0.9 * YAW < np.abs(q[:, 5]).max() <= YAW + TILT**2
    assert q[:, 6].min() >= 0.0 and 0.9 * BEND < q[:, 6].max() <= BEND
    for row in found["q"].to_numpy()[found["direction"] == RANDOM]:
        assert in_view(vehicle.camera, *equations.look(vehicle, row, TARGET.points)).all()


@pytest.mark.long
@pytest.mark.parametrize("mounted", [("z", np.pi), ("z", -np.pi / 2), ("y", 0.35)], ids=str)
def test_random_starts_are_off_from_where_the_camera_faces_the_target(
    vehicle: ca.Vehicle, mounted: tuple[str, float]
) -> None:
    """Tilt and yaw of a vehicle that faces the target otherwise than level and along x."""
    turn = Rotation.from_euler(*mounted)
    found = starts(vehicle.replace({"camera.attitude": turn.as_quat()}), TARGET, 300, seed=2)
    of = found["q"][found["direction"] == RANDOM].sel(coordinate=["yaw", "pitch", "roll"])
    centre = found["centre"].sel(coordinate=["yaw", "pitch", "roll"])
    off = Rotation.from_euler("ZYX", of) * Rotation.from_euler("ZYX", centre).inv()
    lean = np.arccos(off.as_matrix()[:, 2, 2])
    yaw = off.as_euler("ZYX")[:, 0]
    assert 0.9 * TILT < lean.max() <= TILT + 1e-12
    for side in (-yaw, yaw):
        assert 0.9 * YAW < side.max() <= YAW + TILT**2
    # As the figure draws them: by how much they were turned, whatever way the centre is tilted.
    shown = figures.yaws_off(found["q"], found["centre"])
    assert 0.9 * YAW < np.abs(shown[found["direction"] == RANDOM]).max() <= YAW * (1.0 + 1e-12)
    ladder = found["direction"] == "yaw"
    said = np.radians(found["off_by"].to_numpy()[ladder])
    np.testing.assert_allclose(np.cos(shown[ladder] - said), 1.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("rolled", [np.pi / 2, np.pi, -2.0])
def test_a_rolled_camera_turns_the_vehicle_below_the_same_starts(
    vehicle: ca.Vehicle, rolled: float
) -> None:
    turn = Rotation.from_euler("z", rolled)
    other = vehicle.replace({"camera.attitude": turn.as_quat()})
    one, two = (starts(each, TARGET, 1, seed=2)["q"].to_numpy()[:-1] for each in (vehicle, other))
    np.testing.assert_allclose(two[:, [0, 1, 2, 6]], one[:, [0, 1, 2, 6]], rtol=0, atol=1e-12)
    of, level = (Rotation.from_euler("ZYX", each[:, 5:2:-1]) for each in (two, one))
    assert (of.inv() * level * turn).magnitude().max() < 1e-7
    np.testing.assert_allclose(np.cos(two[:, 7] - one[:, 7] + rolled), 1.0, rtol=0, atol=1e-12)


@pytest.mark.long
def test_current_gains_reach_at_least_as_far_as_constant_ones_in_every_direction(
    study: Region,
) -> None:
    constant, current = (
        next(case for case in study.results["cases"] if case["law"] == law)
        for law in ("constant", "current")
    )
    for one, other in zip(constant["directions"], current["directions"], strict=True):
        assert other["reached"] >= one["reached"], (one, other)
    assert constant["random"]["share"] < 0.9 < current["random"]["share"]


@pytest.mark.long
def test_what_counts_as_reached_follows_from_the_flights(study: Region) -> None:
    for case in study.results["cases"]:
        own = study.flights.sel(law=case["law"], model=case["model"], rate=case["rate_hz"])
        drawn = own.isel(start=own["direction"] == RANDOM)
        well = (drawn["status"] == 0) & (drawn["error"] < 1.0)
        assert case["random"]["well"] == int(well.sum())
        assert len(case["random"]["failures"]) == RUNS - case["random"]["well"]
        for entry in case["directions"]:
            along = (own["direction"] == entry["direction"]) & (
                own["start_bend"] == entry["bend_1_m"]
            )
            ladder = own.isel(start=along)
            within = ladder["off_by"] <= entry["reached"]
            assert ladder["well"].to_numpy()[within].all()
            if entry["failed_at"] is not None:
                failed = ladder.isel(start=int(within.sum()))
                assert float(failed["off_by"]) == entry["failed_at"]
                assert not failed["well"] and entry["reason"]
                within |= ladder["off_by"] == entry["failed_at"]
            coarse = ladder["error_estimate"].to_numpy()[within] > RESOLVED
            assert entry["unresolved"] == coarse.sum()
    assert sum(each["unresolved"] for case in study.results["cases"] for each in case["directions"])


@pytest.mark.long
def test_a_study_writes_tables_flights_and_figures_with_failures_drawn_as_failed(
    study: Region, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from amiri2026.report.keeping import keep
    from continuair.studies.results import ResultFolder

    with ResultFolder(tmp_path / "out", "region") as folder:
        keep("region", study, folder)
        folder.finish()
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"region.json", "region.csv", "table.md", "region_flights.nc"} <= written
    assert {"reach_coupled_1000_hz.png", "random_coupled_1000_hz.svg"} <= written
    results = json.loads((tmp_path / "out" / "region.json").read_text("utf-8"))
    table = (tmp_path / "out" / "table.md").read_text("utf-8")
    assert "Failed: constant" in table
    for case in results["cases"]:
        for entry in case["directions"]:
            assert not entry["reason"] or not entry["in_view"] or entry["reason"] in table
    figure = figures.random_starts(results, study.flights, "coupled", 1000.0)
    crosses = [
        len(line.get_xdata())  # type: ignore[arg-type]
        for axes in figure.axes
        for line in axes.get_lines()
        if line.get_gid() == "failed"
    ]
    failed = {case["law"]: RUNS - case["random"]["well"] for case in results["cases"]}
    assert crosses == [failed[law] for law in STYLES]
    # One start in a thousand that fails is not told as none.
    own = study.flights.isel(start=np.flatnonzero(study.flights["direction"] == "random"))
    many = own.isel(start=np.zeros(1000, int)).copy(deep=True)
    many["well"][:] = many["start"].copy(data=np.arange(1000)) > 0
    figure = figures.random_starts(results, many, "coupled", 1000.0)
    told = figure.texts[0].get_text()
    assert all(f"above 99 % {law}" in told.replace("\n", " ") for law in STYLES)


REFUSED: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({}, {"laws": ["now"]}, "laws"),
    ({}, {"models": ["rigid"]}, "models"),
    ({}, {"rates": [0.0]}, "rates"),
    ({}, {"rates": [100.0, 100.00001]}, "rates"),
    ({}, {"rates": []}, "rates"),
    ({}, {"runs": 0}, "runs"),
    ({}, {"laws": ["classic"], "gains": Gains("mine.toml", {"bandwidth": 3.0})}, "gains"),
    ({"camera.attitude": [1.0, 0.0, 0.0, 0.0]}, {"runs": 5}, "camera"),
]


@pytest.mark.parametrize(("changes", "options", "field"), REFUSED)
def test_a_study_that_cannot_be_flown_is_refused(
    changes: dict[str, Any], options: dict[str, Any], field: str, vehicle: ca.Vehicle
) -> None:
    with refused(field):
        region(vehicle.replace(changes), **options)


@pytest.mark.parametrize(
    ("option", "given", "field"),
    [("law", "now", "laws"), ("rate", "-5", "rates"), ("vehicle", "two_section", "vehicle")],
)
def test_the_command_refuses_in_one_sentence(
    option: str, given: str, field: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    arguments = ["region", f"--{option}", given, "--out", str(out)]
    assert_refused(CliRunner().invoke(cli.app, arguments), field)
    assert not out.exists()


def test_the_command_shows_its_laws() -> None:
    help_text = CliRunner().invoke(cli.app, ["region", "--help"]).stdout
    assert all(law in help_text for law in LAWS)


@pytest.mark.long
def test_flights_whose_rotors_saturate_are_counted_and_told(vehicle: ca.Vehicle) -> None:
    tilted = with_weak_rotors(vehicle)
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        found = region(tilted, laws=["constant"], models=["coupled"], runs=3)
    (case,) = found.results["cases"]
    assert case["saturated"] == int((found.flights["largest_saturation"] > 1e-9).sum()) > 0
    assert f"saturate in {case['saturated']} flights" in "\n".join(summary(found.results))
