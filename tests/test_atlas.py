"""Dimensionless groups determine the scaled error, and the atlas summarises it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import continuair as ca
from continuair.analysis.couplings import attribution
from continuair.analysis.groups import PERIOD, coupling, place, vehicle_of
from continuair.analysis.importance import importance
from continuair.cli.commands import app
from continuair.figures import atlas as figures
from continuair.flight.resolution import angles_unread
from continuair.kernels.dynamics import COUPLINGS
from continuair.studies.atlas.collapse import inertia_for
from continuair.studies.atlas.flights import RANGES, fly, load_angle, sample, varied
from continuair.studies.atlas.report import as_table
from continuair.studies.atlas.study import atlas
from continuair.studies.atlas.summary import _explained_by, load, save
from continuair.studies.standard_excitations import EXCITATIONS, standard_scenario
from tests.refusals import assert_refused, refused

MIDDLE = {name: float(np.sqrt(low * high)) for name, (low, high) in RANGES.items()}


def groups_of(runs: int = 1, **changes: object) -> dict[str, np.ndarray]:
    """The middle of every range, some of them changed."""
    values = MIDDLE | changes
    return {name: np.broadcast_to(np.asarray(v, float), runs) for name, v in values.items()}


@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_vehicles_with_the_same_groups_have_the_same_scaled_error(excitation: str) -> None:
    """Length 400 times, mass 10^4 times, period 20 times as large."""
    groups = sample(excitation, 4, seed=7)
    found = []
    for stretch, mass in ((1.0, 0.1), (400.0, 1e3)):
        vehicle = vehicle_of(groups, PERIOD * stretch**0.5, mass)
        fields: dict[str, Any] = {
            name: groups[name] for name in ("load", "frequency", "bend") if name in groups
        }
        scenario = standard_scenario(excitation, vehicle, **fields)
        step = PERIOD * stretch**0.5 / 120.0
        with angles_unread():
            pair = ca.run_pairs(
                vehicle, scenario, ["decoupled"], method="RK4", step=step, sample=3.0 * step
            )
        one = pair.sel(model="decoupled")
        found.append([one["nrmse_t"], one["rmse_t_m"] / vehicle.arm.length, one["angle_rad"]])
    # Equal steps in periods: what is left is rounding, grown along the flight.
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10)


def test_a_vehicle_is_placed_where_its_groups_say() -> None:
    groups = {n: v for n, v in groups_of(3, inertia_ratio=[0.1, 1.0, 10.0]).items()}
    placed = place(vehicle_of(groups))
    for name in ("mass_ratio", "inertia_ratio", "gravity_number", "slenderness", "damping_ratio"):
        assert placed[name] == pytest.approx(groups[name], rel=1e-12)


def test_the_coupling_of_light_arms_is_that_of_the_straight_arm_by_hand() -> None:
    """M_ba = m l²/6 and m l³/8, M_aa = m l⁴/20: 5/9 of the mass and 5/16 of the inertia ratio."""
    groups = groups_of(2, mass_ratio=[1e-5, 1e-6], inertia_ratio=[1e-6, 1e-5], slenderness=1e-4)
    expected = 5 / 9 * groups["mass_ratio"] + 5 / 16 * groups["inertia_ratio"]
    # A difference of squares of frequencies: 1e-16 over 1e-6.
    assert coupling(vehicle_of(groups)) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("moments", [(0.02, 0.012), (0.012, 0.02)])
def test_of_unequal_moments_the_coupling_takes_the_smaller(moments: tuple[float, float]) -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.radius": 1e-4, "uav.mount": (0.0, 0.0, 0.0)})
    arm = vehicle.arm
    expected = 5 / 9 * arm.mass / vehicle.uav.mass + 5 / 16 * arm.mass * arm.length**2 / 0.012
    found = coupling(vehicle.replace({"uav.inertia": (*moments, 0.03)}))
    # The next term is its square.
    assert found == pytest.approx(expected, rel=1e-2)


def test_the_coupling_is_what_the_modes_show() -> None:
    vehicle = ca.load_vehicle("slender").replace({"arm.disks": [{"position": 1.0, "mass": 0.05}]})
    clamped = ca.modes(vehicle, base="clamped", gravity=0.0).frequencies[-1]
    free = ca.modes(vehicle).frequencies[-1]
    assert place(vehicle)["coupling"] == pytest.approx(1 - (clamped / free) ** 2, rel=2e-11)


@pytest.mark.parametrize("excitation", ["bend", "tip", "release"])
def test_the_error_vanishes_with_the_arm(excitation: str) -> None:
    """Where nothing moves the base itself, the error is of the order of the coupling."""
    light = groups_of(3, mass_ratio=[1e-3, 1e-4, 1e-5], inertia_ratio=[1e-3, 1e-4, 1e-5])
    names = varied(excitation)
    found = fly(excitation, {name: light[name] for name in names}, rtol=1e-6)
    error = found["error"].sel(model="decoupled").to_numpy()
    assert error[1:] / error[:-1] == pytest.approx(0.1, rel=0.05)


def test_a_moved_base_keeps_its_error_however_light_the_arm() -> None:
    """The decoupled arm does not feel its base accelerate, or fall, whatever it weighs."""
    light = groups_of(2, mass_ratio=[1e-4, 1e-6], inertia_ratio=[1e-4, 1e-6], frequency=0.8)
    for name in ("force", "fall"):
        groups = {group: light[group] for group in varied(name)}
        error = fly(name, groups)["error"].sel(model="decoupled").to_numpy()
        assert error[1] == pytest.approx(error[0], rel=1e-2)
        assert error[1] > 0.01 * load_angle(name, light)[1]


@pytest.mark.long
def test_different_vehicles_of_one_coupling_err_alike() -> None:
    """To a third; over the atlas the same error varies by a factor of hundreds."""
    mass = np.array([0.02, 0.2, 0.45])
    inertia = [inertia_for(0.4, m) for m in mass]
    fields = {"mass_ratio": mass, "inertia_ratio": inertia, "frequency": 0.6}
    error = fly("bend", groups_of(3, gravity_number=0.01, **fields))["nrmse"][:, 0].to_numpy()
    assert error.max() < 1.35 * error.min()


def test_attribution_of_balanced_forces_leaves_nothing_to_the_carriage() -> None:
    """With no net force on the vehicle, the common acceleration is none, and its loss no loss."""
    groups = groups_of(2, bend=[0.02, 0.2], load=[0.02, 0.2])
    vehicle = vehicle_of(groups)
    fields: dict[str, Any] = {name: groups[name] for name in ("bend", "load", "frequency")}
    scenario = standard_scenario("bend", vehicle, **fields, periods=2.0)
    found = attribution(vehicle, scenario, PERIOD / 40)
    errors = {without: of_model["rmse_t_m"] for without, of_model in found.items()}
    assert (errors["carriage"] < 1e-9 * errors["inertia"]).all()
    # Quadratic in the rates: ten times the motion, a hundred times the error.
    assert errors["coriolis"][1] / errors["coriolis"][0] == pytest.approx(100.0, rel=0.3)


def test_importance_of_a_known_function_is_that_of_its_terms() -> None:
    """y = 2 a + b + a' b' of uniform inputs: variances 4/12, 1/12 and 1/144."""
    points = np.random.default_rng(0).random((4000, 4))
    a, b = points[:, 0] - 0.5, points[:, 1] - 0.5
    found = importance(points, 2 * a + b + a * b)
    whole = 5 / 12 + 1 / 144
    first = np.array([4 / 12, 1 / 12, 0.0, 0.0]) / whole
    assert found.first == pytest.approx(first, abs=1e-12)
    assert found.total[:2] == pytest.approx(first[:2] + 1 / 144 / whole, abs=1e-12)
    assert found.explained == pytest.approx(1.0, abs=1e-12)


def test_importance_of_noise_is_not_explained() -> None:
    points = np.random.default_rng(0).random((3000, 3))
    assert importance(points, np.random.default_rng(1).normal(size=3000)).explained < 0.05


@pytest.fixture(scope="module")
def small() -> xr.Dataset:
    return atlas(600, seed=3)


@pytest.mark.long
def test_a_small_atlas_is_reproducible_and_says_how_it_was_made(
    small: xr.Dataset, tmp_path: Path
) -> None:
    made = small.attrs
    assert made["runs"] == 600 and made["closed_loop_runs"] == 12 and made["seed"] == 3
    save(small, tmp_path / "atlas.npz")
    assert load(tmp_path / "atlas.npz").identical(small)
    assert set(small["coupling"].to_numpy()) == set(COUPLINGS)
    assert "| fall |" in as_table(small)


@pytest.mark.long
def test_shares_of_importance_add_up(small: xr.Dataset) -> None:
    for summary in (small, load()):
        first, total = summary["first"].sum("group"), summary["total"].sum("group")
        assert (first <= 1.0 + 1e-9).all() and (total >= 1.0 - 1e-9).all()
        assert (
            (summary["total"] >= summary["first"] - 1e-9)
            .where(summary["first"].notnull(), True)
            .all()
        )


def test_the_shipped_atlas_is_of_the_size_that_it_claims_and_small() -> None:
    summary = load()
    assert summary.attrs["runs"] >= 100_000 and summary.attrs["closed_loop_runs"] >= 2_000
    assert int(summary["count"].sum()) > 0.9 * summary.attrs["runs"]
    assert (summary["tolerance_error"] < 0.01).all()
    shipped = Path(figures.__file__).parents[1] / "studies" / "atlas" / "atlas.npz"
    assert shipped.stat().st_size < 300_000


@pytest.mark.long
def test_the_shipped_map_agrees_with_new_flights() -> None:
    """Half of new flights in a cell are above its median, and one in ten above its 90 %."""
    summary = load()
    groups = sample("bend", 256, seed=99)
    flight = fly("bend", groups)
    one = summary.sel(excitation="bend", model="decoupled")
    row = np.searchsorted(one["coupling_edges"], flight["coupling"]) - 1
    column = np.searchsorted(one["frequency_edges"], groups["frequency"]) - 1
    inside = (row >= 0) & (row < one.sizes["row"])
    error = flight["nrmse"].sel(model="decoupled").to_numpy()[inside]
    limits = one["nrmse_map"].to_numpy()[:, row[inside], column[inside]]
    below = (error <= limits).mean(axis=1)
    assert below == pytest.approx([0.1, 0.5, 0.9], abs=0.12)


def test_the_shipped_map_grows_with_the_coupling_below_resonance() -> None:
    """An actuated arm that is slow: the more its base gives way, the more decoupling errs."""
    one = load().sel(excitation="bend", model="decoupled", quantile=0.5)
    slow = one["nrmse_map"].to_numpy()[:, one["frequency_edges"].to_numpy()[1:] < 0.6]
    assert (np.diff(np.log(slow).mean(axis=1)) > 0.1).all()


def test_a_map_marks_a_vehicle_at_its_coupling() -> None:
    groups = place(ca.load_vehicle("slender"))
    figure = figures.validity_map(load(), {"mine": groups}, frequencies={"force": 0.3})
    axes = figure.axes[0]
    height = np.log(groups["coupling"] / (1 - groups["coupling"]))
    lines = [np.asarray(line.get_ydata())[0] for line in axes.lines]
    assert lines == pytest.approx([height, height], rel=1e-12)
    assert "mine" in [text.get_text() for text in axes.texts]


@pytest.mark.parametrize(("frequency", "marker"), [(0.3, "D"), (0.06, "<"), (9.0, ">")])
def test_a_limit_beyond_the_map_is_no_diamond_on_its_edge(frequency: float, marker: str) -> None:
    groups = place(ca.load_vehicle("slender"))
    axes = figures.validity_map(load(), {"mine": groups}, frequencies={"force": frequency}).axes[0]
    (mark,) = [line for line in axes.lines if len(np.asarray(line.get_xdata())) == 1]
    left, right = axes.get_xlim()
    assert mark.get_marker() == marker
    assert np.asarray(mark.get_xdata())[0] == np.clip(frequency, left, right)


@pytest.mark.parametrize(
    "options",
    [
        ["--runs", "10"],
        ["--seed", "-1"],
        ["--out", ""],
        ["--vehicles", "200"],
        ["--runs", "700", "--loop", "position"],
    ],
)
def test_bad_input_is_told_in_one_sentence_and_nothing_is_written(
    options: list[str], tmp_path: Path
) -> None:
    out = tmp_path / "atlas"
    given = ["atlas", "--out", str(out), *options]
    assert_refused(CliRunner().invoke(app, given), options[0].removeprefix("--"))
    assert not out.exists()


def test_a_file_that_is_no_atlas_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.npz"
    np.savez(path, a=np.zeros(3))
    with refused("atlas"):
        load(path)
    with refused("atlas"):
        load(tmp_path / "none.npz")


def test_what_a_map_explains_of_chance_is_nothing_however_few_flights_there_are() -> None:
    """In 72 cells a hundred random numbers lie close to the means of their cells."""
    rng = np.random.default_rng(0)
    cells, values = rng.integers(0, 72, (200, 100)), rng.normal(size=(200, 100))
    found = [_explained_by(*each) for each in zip(cells, values, strict=True)]
    # Each of a spread of √(2/28) or so, from some 28 degrees of freedom.
    assert abs(np.mean(found)) < 0.05
    assert _explained_by(np.repeat([0, 1], 50), np.repeat([1.0, 2.0], 50)) == 1.0
    assert np.isnan(_explained_by(np.arange(5), np.arange(5.0)))
