"""The tracking study: what its metrics mean, that its gains do what they say, and what it shows."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026.figures import tracking as figures
from amiri2026.tracking import report as tracking_output
from amiri2026.tracking.candidates import fly, fly_whole
from amiri2026.tracking.largest import ds_extremes
from amiri2026.tracking.law_variants import law_variants
from amiri2026.tracking.study import Tracking, tracking
from amiri2026.tracking.tuning import as_toml, tune
from continuair.analysis.lyapunov import ultimate_bound
from continuair.analysis.metrics import norm_difference
from continuair.controllers.gain_files import Gains, gain_presets, load_gains
from continuair.controllers.gains import design
from continuair.controllers.inertias import camera_inertia
from continuair.equations.camera import interaction_matrix
from continuair.kernels.step import STATUS
from continuair.scenario.tracking_task import (
    SETTINGS,
    damping_notes,
    equipped,
    task,
)
from continuair.studies.results import as_json
from tests.refusals import numbers_of
from tests.weak_rotors import with_weak_rotors

IMAGE = np.array([1, -1, -1, -1, -1, 1, 1, 1]) * 0.125


def late(vehicle: ca.Vehicle) -> ca.Vehicle:
    """With a camera whose frames come so late that every law loses its target."""
    return vehicle.replace({"camera.latency": 3.0})


@pytest.fixture(scope="module")
def vehicle() -> ca.Vehicle:
    return ca.load_vehicle("paper")


@pytest.fixture(scope="module")
def study(vehicle: ca.Vehicle) -> Tracking:
    return tracking(vehicle, "L", models=["decoupled"], settings=["nominal", "fast"])


def poles(vehicle: ca.Vehicle, **gains: Any) -> np.ndarray:
    """Poles of the camera as a free body under the law, linearised at the desired image."""
    made = design(vehicle, **gains)
    L, inertia = interaction_matrix(IMAGE, 2.0), camera_inertia(vehicle)
    stiffness = np.linalg.solve(inertia, L.T @ made["Kp"] @ (made["Cp"] * L))
    damping = np.linalg.solve(inertia, L.T @ made["Kp"] @ made["Cd"] @ L)
    nothing, one = np.zeros((6, 6)), np.eye(6)
    return np.linalg.eigvals(np.block([[nothing, one], [-stiffness, -damping]]))


@pytest.mark.parametrize("size", [1.0, 0.1])
def test_designed_gains_give_every_direction_the_poles_asked_for(
    vehicle: ca.Vehicle, size: float
) -> None:
    scaled = vehicle.replace(
        {
            "uav.mass": 2.0 * size**3,
            "uav.inertia": np.asarray(vehicle.uav.inertia) * size**5,
            "arm.length": size,
            "arm.radius": 0.005 * size,
        }
    )
    found = poles(scaled, bandwidth=5.0, damping_ratio=0.6, conditioning=0.0, rate_gain=1e-9)
    expected = 5.0 * (-0.6 + 0.8j)
    assert np.abs(np.where(found.imag > 0, found, found.conj()) - expected).max() < 2e-3


def test_conditioning_slows_the_directions_that_the_image_hardly_shows(
    vehicle: ca.Vehicle,
) -> None:
    ω, ζ, μ = 5.0, 1.0, 0.01
    inertia, axes = np.linalg.eigh(camera_inertia(vehicle))
    s = np.linalg.svd(
        interaction_matrix(IMAGE, 2.0) @ (axes / np.sqrt(inertia)) @ axes.T, compute_uv=False
    )
    each = ω * s**2 / (s**2 + (μ * s[0]) ** 2)
    found = poles(vehicle, bandwidth=ω, damping_ratio=ζ, conditioning=μ, rate_gain=1e-9)
    product = sorted(each**2)
    assert np.allclose(np.sort(np.abs(found))[::2] ** 2, product, rtol=0.05)
    assert each.min() < 0.5 * ω < 0.99 * ω < each.max()


def test_ds_is_the_difference_of_the_norms_of_the_stacked_errors() -> None:
    def flight(values: list[list[float]]) -> xr.Dataset:
        return xr.Dataset(
            {"feature_error": (("time", "pixel"), np.array(values))}, {"time": [0.0, 1.0, 3.0]}
        )

    coupled = flight([[3.0, 4.0], [0.0, 2.0], [1.0, 0.0]])
    other = flight([[0.0, 0.0], [5.0, 12.0], [0.0, 1.5]])
    assert norm_difference(coupled, other).tolist() == [5.0, -11.0, -0.5]
    assert ds_extremes(coupled, other) == (11.0, 0.5)


def test_letters_are_tracked_within_a_pixel_and_the_plants_agree_after_two_seconds(
    study: Tracking,
) -> None:
    entry = study.results["letters"]["L"]
    for model in ("coupled", "decoupled"):
        assert entry[model]["status"] == 0
        assert entry[model]["rms_px"] < 1.0
        assert entry[model]["out_of_view_samples"] == 0
        assert entry[model]["error_estimate"] < 1e-3
    assert entry["ds_max_px_after_2s"] < 0.7 < entry["ds_max_px_before_2s"]


def test_a_fast_target_shows_where_decoupling_costs(study: Tracking) -> None:
    slow = study.results["letters"]["L"]["decoupled"]
    fast = study.results["settings"]["fast"]["letters"]["L"]["decoupled"]
    assert fast["ds_max_px_after_2s"] > 5.0 * slow["ds_max_px_after_2s"]


def test_metrics_agree_with_the_trajectory(study: Tracking) -> None:
    flight = study.datasets["nominal"].sel(model="coupled", letter="L")
    late = flight.sel(time=slice(5.0, None))
    entry = study.results["letters"]["L"]["coupled"]
    error = late["feature_error"].to_numpy()
    assert entry["rms_px"] == pytest.approx(float(np.sqrt(np.mean(error**2))), rel=1e-13)
    path = late["camera_position"] - late["target_position"]
    np.testing.assert_allclose(path.sel(axis="z"), 2.0, rtol=0, atol=2e-4)
    assert entry["tip_max_m"] == pytest.approx(
        float(np.hypot(path.sel(axis="x"), path.sel(axis="y")).max())
    )
    norm = np.linalg.norm(flight["feature_error"], axis=-1)
    assert (norm[flight["time"] >= entry["converged_s"]] < 5.0).all()
    assert norm[flight["time"] < entry["converged_s"]][-1] >= 5.0


def test_the_start_is_a_decimetre_off_in_x_and_z(study: Tracking) -> None:
    flight = study.datasets["nominal"].isel(time=0).sel(model="coupled", letter="L")
    straight = ca.load_vehicle("paper").arm.length
    off = flight["q"].to_numpy()[:3] - flight["target_position"].to_numpy()
    np.testing.assert_allclose(off, [0.1, 0.0, 2.0 + straight + 0.1], rtol=0, atol=1e-14)
    assert float(flight["q"].sel(coordinate="kappa")) == 0.1


def test_a_real_camera_limits_the_error_and_its_noise_is_repeatable(vehicle: ca.Vehicle) -> None:
    flown = equipped(vehicle, SETTINGS["camera"])
    scenario = task(flown, ["M"], load_gains("paper").controller(flown), 50.0)
    runs = [ca.simulate(flown, scenario, variables=["feature_error"], sample=0.1) for _ in range(2)]
    assert runs[0]["status"] == 0
    late = runs[0]["feature_error"].sel(time=slice(5.0, None))
    assert 0.05 < float(np.sqrt((late**2).mean())) < 5.0
    assert runs[0]["feature_error"].equals(runs[1]["feature_error"])


def test_metrics_of_a_run_that_ended_early_are_not_finite_and_its_status_is_kept(
    vehicle: ca.Vehicle,
) -> None:
    found = tracking(late(vehicle), "M", models=["coupled"], settings=["fast"])
    found = found.results["letters"]["M"]["coupled"]
    assert found["status"] != 0 and found["end_time_s"] < 10.0
    whole = ("rms_px", "converged_s", "force_rms_n", "bend_moment_rms_nm2", "largest_bend_1_m")
    assert np.isnan([found[name] for name in whole]).all()


@pytest.mark.long
def test_the_study_is_stored_as_strict_json_csv_and_table(
    study: Tracking, vehicle: ca.Vehicle
) -> None:
    text = as_json(study.results)
    stored = json.loads(text, parse_constant=lambda name: pytest.fail(name))
    assert {"rms_px", "max_px", "tip_rms_m"} <= set(stored["letters"]["L"]["coupled"])
    assert {"ds_max_px_before_2s", "ds_max_px_after_2s"} <= set(stored["letters"]["L"])
    assert len(list(tracking_output.records(study.results))) == 2 * 2
    assert "| L | decoupled |" in tracking_output.as_table(study.results)
    # What the paper prints stands beside its vehicle, and other ones have a table, too.
    assert "below 0.7 px" in tracking_output.as_table(study.results)
    own = tracking(
        vehicle.replace({"uav.mass": 2.1}), "L", models=["decoupled"], settings=["nominal"]
    ).results
    assert "0.7 px" not in tracking_output.as_table(own)


@pytest.mark.long
def test_figures_are_drawn_for_every_setting(study: Tracking, tmp_path: Path) -> None:
    camera = ca.load_vehicle("paper").camera
    figures.write(study.results, study.datasets, camera, lambda name: tmp_path / name)
    for setting in ("nominal", "fast"):
        for kind in ("traces", "errors", "speed", "ds", "image", "stability"):
            assert (tmp_path / f"{kind}_{setting}.png").stat().st_size > 10_000


def test_the_ultimate_bound_holds_but_says_little(study: Tracking) -> None:
    bound = study.results["ultimate_bound"]
    assert bound["reached"] < bound["radius_least"] <= bound["radius_provable"]
    assert bound["radius_least_of"] == {"L": bound["radius_least"]}


def test_the_proof_bounds_each_letter_by_its_own_motion(vehicle: ca.Vehicle) -> None:
    law = load_gains("paper").controller(vehicle)
    flown = ["L", "M"]
    together = task(vehicle, flown, law, 20.0)
    each = [ultimate_bound(together, run) for run in range(2)]
    alone = [ultimate_bound(task(vehicle, [letter], law, 20.0)) for letter in flown]
    assert each == alone
    assert ultimate_bound(together)["radius_least"] == max(found["radius_least"] for found in each)
    # M turns more sharply: its bound says nothing of L.
    assert each[0]["radius_least"] < 0.5 * each[1]["radius_least"]


def test_the_study_says_which_conditions_of_stability_its_gains_break(study: Tracking) -> None:
    table = tracking_output.as_table(study.results)
    for part in (study.results, study.results["settings"]["fast"]):
        broken = {
            (statement, each["name"]): each["value"]
            for statement, conditions in part["conditions"].items()
            for each in conditions
            if not each["holds"]
        }
        # The period of control [s], the gains' share off the diagonal, and C_d [s].
        assert broken["theorem", "control continuous, control_period None"] == 1e-3
        assert 0.1 < broken["sound", "K_p C_s diagonal, not negative"] < 1.0
        assert broken["proof", "C_d = 0"] > 0.1
        assert broken["sound", "target at rest"] == part["ultimate_bound"]["target_speed_m_s"]
    assert "| sound V | K_p C_s diagonal, not negative | off-diagonal share" in table
    assert "K_p C_p symmetric positive definite" not in table


@pytest.mark.slow
def test_cancelling_the_spring_lets_the_arm_wind_up(vehicle: ca.Vehicle) -> None:
    rows = {row["variant"]: row for row in law_variants(vehicle, load_gains("paper"))}
    assert all(row["error_estimate"] > 0.0 for row in rows.values())
    flown = rows["as flown: matrix gains, gravity only"]
    assert flown["error_estimate"] < 1e-3
    literal = rows["literal G (elasticity cancelled), no structural damping"]
    assert literal["largest_bend_1_m"] > 2.0 * flown["largest_bend_1_m"]
    assert flown["status"] == 0 and flown["rms_px"] < 1.0
    (scalar,) = (
        row for name, row in rows.items() if "scalar" in name and name.endswith("gravity only")
    )
    assert scalar["rms_px"] > 3.0 * flown["rms_px"]


@pytest.mark.long
def test_a_vehicle_with_drag_is_tracked_without_a_proof_that_knows_none(
    vehicle: ca.Vehicle,
) -> None:
    found = tracking(
        vehicle.replace({"uav.drag": {"linear": [0.05, 0.05, 0.05]}}),
        "L",
        models=[],
        settings=["nominal"],
    )
    assert "ultimate_bound" not in found.results
    assert "V" not in found.datasets["nominal"]
    assert found.results["letters"]["L"]["coupled"]["status"] == 0


@pytest.mark.slow
def test_variants_fly_what_they_are_called_whatever_the_file_chooses(vehicle: ca.Vehicle) -> None:
    plain = load_gains("paper")
    chosen = {"compensation": "literal", "posture_damping": 0.3, "feed_forward": False}
    chosen |= {"integral": 0.2}
    of_plain, of_chosen = (
        {row["variant"]: row for row in law_variants(vehicle, gains)}
        for gains in (plain, Gains("literal", {**plain.settings, **chosen}))
    )
    told = "as flown: matrix gains, literal G (elasticity cancelled), without target feed-forward"
    assert f"{told}, posture damping 0.3 N m³ s, integral 0.2 1/s" in of_chosen
    both = of_plain.keys() & of_chosen.keys()
    assert len(both) == len(of_plain) - 1
    assert all(of_plain[name] == of_chosen[name] for name in both)


@pytest.mark.long
def test_a_search_is_repeatable_and_its_file_flies(vehicle: ca.Vehicle, tmp_path: Path) -> None:
    found = [
        tune(vehicle, ["L"], ["fast"], candidates=8, rounds=2, seed=3, progress=None)
        for _ in range(2)
    ]
    assert found[0] == found[1]
    file = tmp_path / "gains.toml"
    file.write_text(as_toml(found[0]), encoding="utf-8")
    assert load_gains(file).settings == found[0]["gains"]


@pytest.mark.long
def test_the_preset_is_reproduced_by_its_record(vehicle: ca.Vehicle) -> None:
    import tomllib

    import continuair.controllers.gain_files as home

    assert gain_presets() == ("current", "paper")
    stored = tomllib.loads(
        (Path(home.__file__).parent / "presets" / "paper.toml").read_text(encoding="utf-8")
    )
    row = {k: v for k, v in stored.items() if k != "record"}
    costs = []
    for setting, plants in stored["record"]["rms_px"].items():
        for plant, letters in plants.items():
            whole = fly_whole(vehicle, row, ["M"], setting, plant)
            assert whole.pixels[0, 0] == pytest.approx(letters["M"], rel=5e-5)
            costs.append(fly(vehicle, [row], ["M"], setting, plant).cost)
    assert np.mean(costs) == pytest.approx(stored["record"]["objective"], rel=1e-4)


def test_flights_that_ended_early_are_told_and_have_no_largest_difference(
    vehicle: ca.Vehicle,
) -> None:
    results = tracking(late(vehicle), "M", models=["decoupled"], settings=["fast"]).results
    lost = results["letters"]["M"]["decoupled"]
    assert np.isnan(lost["ds_max_px_after_2s"])
    assert any("fast, M, coupled: ended at" in line for line in tracking_output.remarks(results))


def test_flights_that_end_alike_are_told_of_in_one_sentence() -> None:
    def entry(end: float, status: int, error: float) -> dict[str, Any]:
        return {"end_time_s": end, "status": status, "error_estimate": error}

    models = {"coupled": entry(0.2, 2, 1e-5), "decoupled": entry(0.1, 2, 1e-5)}
    rough = {"coupled": entry(9.0, 0, 2e-3), "decoupled": entry(9.0, 0, 1e-5)}
    results = {"setting": "nominal", "letters": {"M": models, "R": models, "A": rough}}
    ended, rounded = tracking_output.remarks(results | {"settings": {}})
    assert "nominal, M, decoupled" in ended and STATUS[2] in ended
    assert {0.1, 3.0, 6.0} <= set(numbers_of(ended))
    assert "nominal, A, coupled" in rounded and 0.002 in numbers_of(rounded)


@pytest.mark.long
def test_gains_of_the_image_of_now_track_as_well_and_no_proof_is_said_to_hold(
    vehicle: ca.Vehicle, study: Tracking
) -> None:
    found = tracking(vehicle, "L", load_gains("current"), ["coupled"], ["nominal"])
    constant = study.results["letters"]["L"]["coupled"]["rms_px"]
    assert found.results["letters"]["L"]["coupled"]["rms_px"] <= 1.05 * constant
    assert "conditions" in study.results and "conditions" not in found.results
    assert "## Stability" not in tracking_output.as_table(found.results)


def test_studies_tell_of_the_damping_that_they_give_an_undamped_arm() -> None:
    paper = ca.load_vehicle("paper")
    assert 0.03 in numbers_of(damping_notes(paper)[0])
    assert not damping_notes(paper.replace({"arm.damping_ratio": 1e-9}))
    two = ca.load_vehicle("two_section").replace({"arm.arm.section.0.damping": 0.0})
    name = two.arms[0].section[0].name
    assert f"arm.arm.section.{name}" in damping_notes(two)[0]


@pytest.mark.long
def test_rotors_that_saturate_are_told_in_the_results_and_in_a_sentence(
    vehicle: ca.Vehicle,
) -> None:
    tilted = with_weak_rotors(vehicle)
    with pytest.warns(ca.ContinuairWarning, match="saturate"):
        results = tracking(tilted, "M", models=["coupled"], settings=["fast"]).results
    beyond = results["letters"]["M"]["coupled"]["largest_saturation"]
    assert beyond > 0.0
    (told,) = [line for line in tracking_output.remarks(results) if "saturate" in line]
    assert f"{beyond:.1%}" in told
