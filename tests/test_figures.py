"""Figures say what their datasets and results show, and hide nothing of it."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import amiri2026.open_loop.study as study
from amiri2026.figures import frames, one_letter, overview, tracking
from amiri2026.figures import open_loop as figures
from continuair.equations import position, section_rotation
from continuair.figures import curves, pictogram, style
from continuair.vehicle.camera import Camera
from continuair.vehicle.vehicle import load_vehicle
from tests.refusals import numbers_of
from tests.synthetic import flight

PAPER = load_vehicle("paper")


@pytest.fixture
def result(monkeypatch: pytest.MonkeyPatch) -> study.OpenLoop:
    monkeypatch.setattr(study, "simulate", flight)
    return study.open_loop(PAPER, "AB")


def other_vehicle(results: dict[str, Any]) -> dict[str, Any]:
    return results | {"vehicle": results["vehicle"] | {"name": "mine"}, "printed": {}}


def failed(dataset: xr.Dataset, model: str, end: float, status: int = 1) -> xr.Dataset:
    """The dataset with one model's flight ended early."""
    changed = dataset.copy(deep=True)
    late = changed["time"] > end
    for name, values in changed.data_vars.items():
        if "time" in values.dims:
            changed[name] = values.where(~late | (changed["model"] != model))
    changed["status"].loc[{"model": model}] = status
    changed["end_time"] = changed["end_time"].astype(float)
    changed["end_time"].loc[{"model": model}] = end
    return changed


def words(figure: Figure) -> str:
    """All that a figure says above its panels."""
    return " ".join(text.get_text() for text in figure.texts)


def line(axes: Any, model: str) -> Any:
    return next(item for item in axes.get_lines() if item.get_label() == model)


def crosses(figure: Figure) -> list[Any]:
    return [item for axes in figure.axes for item in axes.get_lines() if item.get_gid() == "failed"]


def assert_legends_cover_nothing(figure: Figure) -> None:
    """No legend, and no line of text above the panels, overlaps an axes' frame or another."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    legends: list[Any] = [*figure.legends]
    legends += [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    above = [item.get_window_extent(renderer) for item in [*legends, *figure.texts]]
    frames_drawn = [axes.get_window_extent(renderer) for axes in figure.axes]
    for i, box in enumerate(above):
        assert box.y1 <= figure.bbox.y1 + 1.0
        assert not any(box.overlaps(other) for other in [*frames_drawn, *above[i + 1 :]])


# A closed loop that no study flew: a circle, tracked the worse the simpler the plant.
def loop(noise: float = 0.0, seed: int = 0) -> xr.Dataset:
    """Flights of three plants on letters M and L, 10 s, with a feature error of known size.

    After the transient ‖e‖ is 1, 1.5 and 3 px, and the cameras are 1, 2 and 4 mm off the target.
    """
    time = np.linspace(0.0, 10.0, 1001)
    random = np.random.default_rng(seed)
    decay, target = np.exp(-5 * time), np.column_stack([np.cos(time), np.sin(time), 0 * time])

    def one(error: float, off: float) -> xr.Dataset:
        pixels = np.zeros((len(time), 8))
        pixels[:, 0] = error + 100 * decay + noise * random.normal(size=len(time))
        camera = target + [off, 0.0, 2.0]
        zero = np.zeros((len(time), 3))
        data: dict[str, Any] = {
            "feature_error": (("time", "pixel"), pixels),
            "features": (("time", "pixel"), 500.0 - pixels),
            "in_view": (("time", "point"), np.ones((len(time), 4))),
            "target_position": (("time", "axis"), target),
            "camera_position": (("time", "axis"), camera),
            "tip_position": (("time", "axis"), camera),
            "velocity": (("time", "axis"), zero + 0.1),
            "angular_velocity": (("time", "axis"), zero),
            "bend": (("time", "bend_axis"), zero[:, :2] + 0.1),
            "bend_rate": (("time", "bend_axis"), zero[:, :2] + [0.01, 0.0]),
            "q": (("time", "coordinate"), np.tile([0.0] * 6 + [0.1, 0.0], (len(time), 1))),
            "lyapunov_paper": ("time", 1.0 + decay),
            "lyapunov_sound": ("time", 1.0 + decay),
            "servo_error": ("time", 0.01 + decay),
            "status": ((), np.int8(0)),
            "end_time": ((), 10.0),
            "error_estimate": ((), 1e-5),
        }
        return xr.Dataset(data, {"time": time, "axis": list("xyz")})

    plants = {"coupled": (1.0, 1e-3), "decoupled": (1.5, 2e-3), "independent": (3.0, 4e-3)}
    flown = [one(*sizes).expand_dims(model=[m]) for m, sizes in plants.items()]
    letters = [xr.concat(flown, "model").expand_dims(letter=[name], axis=1) for name in "ML"]
    vehicle = PAPER.replace({"camera.noise": noise}).describe()
    return xr.concat(letters, "letter").assign_attrs(vehicle=json.dumps(vehicle))


def loop_results(name: str = "paper") -> dict[str, Any]:
    part = {
        "setting_meaning": "10 s a letter",
        "ultimate_bound": {"radius_least_of": {"M": 0.3, "L": 0.1}},
    }
    printed = {"ds_max_px": 0.7} if name == "paper" else {}
    vehicle = {"vehicle": {"name": name}, "printed": printed}
    return {"setting": "nominal", "settings": {"camera": part}} | vehicle | part


def written(
    monkeypatch: pytest.MonkeyPatch, write: Callable[..., None], *given: Any
) -> dict[str, Figure]:
    """The figures that a study's writer saves, by name."""
    kept: dict[str, Figure] = {}
    monkeypatch.setattr(style, "save", lambda figure, name, file: kept.update({name: figure}))
    write(*given, Path)
    return kept


@pytest.mark.long
def test_a_name_that_looks_like_a_formula_is_drawn_as_it_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(study, "simulate", flight)
    name = r"a $\frac$ and $x$"
    found = study.open_loop(PAPER.replace({"name": name}), "A")
    figures.write(found.results, found.datasets, lambda file: tmp_path / file)
    assert (tmp_path / "overview.png").exists()
    figure = style.new_figure()
    text: Any = figure.suptitle(style.plain(name))
    assert text._preprocess_math(text.get_text()) == (name, False)


def test_motion_draws_every_model_with_its_own_colour(result: study.OpenLoop) -> None:
    dataset = result.datasets["A"]
    axes: Any = figures.motion(dataset).axes[0]
    for model in ("coupled", "decoupled", "independent"):
        drawn = line(axes, model)
        np.testing.assert_array_equal(
            drawn.get_ydata(), dataset["tip_position"].sel(model=model, axis=0)
        )
        assert drawn.get_color() == style.MODELS[model]["color"]
    assert axes.get_ylabel() == "tip x [m]"


def test_motion_draws_what_moves_and_names_what_does_not(result: study.OpenLoop) -> None:
    """The stand-in moves along x and pitches; it falls freely, so that z beyond the fall is 0."""
    figure = figures.motion(result.datasets["A"])
    drawn = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_ylabel() for axes in drawn[:2]] == ["tip x [m]", "tip pitch [deg]"]
    still = ("tip y 0 m", "tip z beyond free fall 0 m", "tip roll 0 deg", "tip yaw 0 deg")
    assert all(each in words(figure) for each in still)


def test_motion_draws_a_quantity_over_the_times_of_its_difference(result: study.OpenLoop) -> None:
    """Whichever flight ends first."""
    dataset = failed(result.datasets["A"], "coupled", 0.3)
    figure = figures.motion(dataset)
    panels = [axes for axes in figure.axes if axes.axison]
    pairs = [axes for axes in panels if axes.get_ylabel().startswith("minus")]
    assert pairs
    for lower in pairs:
        box = lower.get_position()
        (upper,) = [
            axes for axes in panels if axes is not lower and axes.get_position().x0 == box.x0
        ]
        assert upper.get_xlim() == lower.get_xlim()


def test_motion_says_and_draws_how_far_the_models_are_apart(result: study.OpenLoop) -> None:
    # The stand-in's decoupled model ends 0.2 m, and 0.2 rad, from the coupled one.
    figure = figures.motion(result.datasets["A"], "Test A")
    said = figure.texts[0].get_text()
    assert said.startswith("Test A: decoupling") and numbers_of(said) == [0.2, 11.0]
    below = next(axes for axes in figure.axes if axes.get_ylabel() == "minus\ncoupled [m]")
    assert line(below, "independent").get_ydata()[-1] == pytest.approx(0.4, rel=1e-12)


def test_what_the_independent_model_changes_is_not_said_of_decoupling(
    result: study.OpenLoop,
) -> None:
    alone = result.datasets["A"].sel(model=["coupled", "independent"])
    said = figures.motion(alone, "Test A").figure.texts[0].get_text()
    assert "independent" in said and "decoupl" not in said and "0.4 m" in said


def test_printed_numbers_stand_beside_flights_as_the_papers_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """They are of the decoupled model, and of a chirp up to 1 Hz."""
    monkeypatch.setattr(study, "simulate", flight)
    assert study.open_loop(PAPER, "AD", ["decoupled"]).results["printed"] == study.PRINTED
    assert study.open_loop(PAPER, "A", ["decoupled"], f1=2.0).results["printed"] == study.PRINTED
    assert not study.open_loop(PAPER, "AD", ["decoupled"], f1=2.0).results["printed"]
    alone = study.open_loop(PAPER, "A", ["independent"])
    assert not alone.results["printed"]
    assert "paper" not in words(overview.table(alone.results)).replace("Vehicle paper", "")


@pytest.mark.parametrize("hertz", [(23.0, 9.0), (12.0, 17.0)])
def test_bending_titles_the_frequencies_of_the_samples(
    result: study.OpenLoop, hertz: tuple[float, float]
) -> None:
    dataset = result.datasets["B"].copy(deep=True)
    time = dataset["time"].to_numpy()
    rings = {"coupled": hertz[0], "decoupled": hertz[1], "independent": hertz[1]}
    for model, hz in rings.items():
        dataset["bend"].loc[{"model": model}] = np.outer(np.cos(2 * np.pi * hz * time), [0.1, 0.0])
    figure = figures.bending(dataset, "Test B")
    coupled, other = hertz
    said = figure.texts[0].get_text()
    assert numbers_of(said) == [coupled, other] and f"{coupled:g} Hz coupled" in said
    assert figure.axes[0].get_xlim() == (0.0, 0.5)
    x, y = line(figure.axes[-1], "coupled").get_data()
    assert x[np.argmax(y)] == pytest.approx(coupled, abs=0.1)


def test_bending_claims_no_frequency_where_there_is_none(result: study.OpenLoop) -> None:
    dataset = result.datasets["B"].copy(deep=True)
    dataset["bend"][:] = 0.1
    assert "Hz" not in words(figures.bending(dataset))
    # Nor a spectrum, where all flights end at once.
    dataset["bend"] = dataset["bend"].where(dataset["time"] <= dataset["time"][1])
    figures.bending(dataset)


def test_no_frequency_is_read_off_samples_that_are_too_coarse_for_the_arm(
    result: study.OpenLoop,
) -> None:
    """480 Hz of samples 1 ms apart would be 520: a peak on the other side of theirs."""
    dataset = result.datasets["B"].copy(deep=True)
    turned = 2 * np.pi * 520.0 * dataset["time"].to_numpy()
    dataset["bend"][:] = np.stack([np.outer(np.cos(turned), [0.1, 0.0])] * 3)
    assert "480 Hz" in words(figures.bending(dataset))
    told = words(figures.bending(dataset, swing=520.0))
    assert "520 Hz" in told and "480" not in told


def test_differences_leave_out_the_reference_and_end_at_the_known_distance(
    result: study.OpenLoop,
) -> None:
    figure = figures.differences(result.datasets["A"], "Test A")
    left, right = figure.axes
    assert [item.get_label() for item in left.get_lines()] == ["decoupled", "independent"]
    # The stand-in's models end 0.2 and 0.4 m, and as many radians, from the coupled one.
    assert line(left, "decoupled").get_ydata()[-1] == pytest.approx(0.2, rel=1e-12)
    assert line(right, "independent").get_ydata()[-1] == pytest.approx(np.degrees(0.4), rel=1e-12)
    assert numbers_of(figure.texts[0].get_text()) == [0.2, 11.0, 0.4, 23.0]


def test_overview_bars_are_the_results_and_the_papers_numbers(result: study.OpenLoop) -> None:
    axes: Any = overview.bars(result.results).axes[1]
    heights = [bar.get_height() for bar in axes.patches]
    tests = result.results["tests"]
    expected = [0.0124, 0.2378]
    expected += [tests[t][m]["rmse_t_m"] for m in ("decoupled", "independent") for t in "AB"]
    assert heights == expected


@pytest.mark.parametrize("draw", [overview.bars, overview.table])
def test_printed_numbers_stand_beside_the_papers_vehicle_only(
    result: study.OpenLoop, draw: Callable[[dict[str, Any]], Figure]
) -> None:
    def shown(figure: Figure) -> str:
        texts = [text.get_text() for axes in figure.axes for text in axes.texts]
        patches: list[Any] = [bar for axes in figure.axes for bar in axes.patches]
        bars = [f"{bar.get_height():.4f}" for bar in patches]
        return " ".join([words(figure), *texts, *bars])

    said = shown(draw(result.results))
    assert "1.0404" in said and style.UNNAMED in said.replace("\n", " ")
    said = shown(draw(other_vehicle(result.results)))
    assert "1.0404" not in said and "print" not in said.replace("as printed [-]", "")


def test_the_table_marks_what_has_not_converged_and_leaves_digits_of_small_numbers(
    result: study.OpenLoop,
) -> None:
    results = json.loads(json.dumps(other_vehicle(result.results)))
    changes = {"nrmse_t": 2.7e-5, "rmse_t_m": 0.012, "converged": True}
    results["tests"]["A"]["decoupled"] |= changes
    results["tests"]["B"]["decoupled"] |= changes | {"converged": False}
    figure = overview.table(results)
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    for number in ("2.7e-05", "0.0120"):
        assert {number, f"{number}*"} <= set(texts)
    assert "* Not converged." in words(figure)
    results["tests"]["B"]["decoupled"]["converged"] = True
    assert "* Not converged." not in words(overview.table(results))


def test_figures_of_flights_that_have_not_converged_say_so(
    result: study.OpenLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = json.loads(json.dumps(result.results))
    results["tests"]["B"]["decoupled"] |= {"converged": False, "status": 0}
    found = written(monkeypatch, figures.write, results, result.datasets)
    marked = {name for name, figure in found.items() if "Not converged: dec" in words(figure)}
    assert marked == {f"test_B_{kind}" for kind in ("motion", "bending", "differences")}


def test_the_table_counts_the_printed_numbers_that_ours_come_near(result: study.OpenLoop) -> None:
    results = json.loads(json.dumps(result.results))
    for letter in "AB":
        entry, printed = results["tests"][letter]["decoupled"], results["printed"][letter]
        entry |= {"rmse_t_m": 1.9 * printed["nrmse_t"], "rmse_r_rad": 2.1 * printed["nrmse_r"]}
        entry |= {"nrmse_t": 0.0, "nrmse_r": 0.0}
    said = words(overview.table(results))
    assert re.search(r"RMSE, 2 of the 4 .*NRMSE, 0", said)


def test_where_euler_angles_are_lost_figures_go_by_the_angle_and_say_so(
    result: study.OpenLoop,
) -> None:
    results = json.loads(json.dumps(other_vehicle(result.results)))
    for entry in results["tests"]["A"].values():
        entry |= {"nrmse_r": float("nan"), "rmse_r_rad": float("nan")}
    angles = {name: results["tests"][name]["decoupled"]["angle_rad"] for name in "AB"}
    most = max(angles, key=lambda name: angles[name])
    for draw in (overview.bars, overview.table):
        figure = draw(results)
        assert f"most turned in Test {most}, {style.short(angles[most])} rad" in words(figure)
        # The angles that the title tells of are drawn, in place of Euler angles.
        labels = [axes.get_ylabel() for axes in figure.axes]
        labels += [text.get_text() for axes in figure.axes for text in axes.texts]
        assert any("angle between tips" in label for label in labels)
        texts = [text.get_text() for axes in figure.axes for text in axes.texts]
        assert "Euler angles these are lost" in words(figure).replace("\n", " ")
        assert not {"nan", "failed"} & set(texts)
        assert ("lost" in texts) == (draw is overview.table)
    # So where they count a turn that no tip has made.
    for entry in results["tests"]["A"].values():
        entry |= {"nrmse_r": 0.5, "rmse_r_rad": 4.7}
    said = words(overview.bars(results)).replace("\n", " ")
    assert f"most turned in Test {most}, {style.short(angles[most])} rad" in said
    assert "overstate" in said and "are lost" not in said
    spinning = result.datasets["A"].copy(deep=True)
    spinning["tip_angular_velocity"] = 0.0 * spinning["tip_position"] + 1e6
    _, turned = figures._apart(*(spinning.sel(model=name) for name in ("coupled", "decoupled")))
    largest = style.short(float(np.degrees(turned.max())))
    figure = figures.motion(spinning)
    assert "deg" not in str(figure.get_label()) and f"{largest}°" in words(figure)


def test_a_failed_flight_has_a_cross_at_its_end_and_is_named(result: study.OpenLoop) -> None:
    dataset = failed(result.datasets["A"], "decoupled", 0.32)
    for draw in (figures.motion, figures.bending, figures.differences):
        figure = draw(dataset)
        assert "× Failed: decoupled ended at 0.32 s" in words(figure)
        assert crosses(figure)
        assert all(float(cross.get_xdata()[0]) == 0.32 for cross in crosses(figure))


def test_a_part_of_a_flight_before_it_fails_has_no_cross(result: study.OpenLoop) -> None:
    dataset = failed(result.datasets["A"], "decoupled", 0.8)
    figure = figures.bending(dataset)
    assert not crosses(figure) and "decoupled ended at 0.8 s" in words(figure)


def test_a_flight_that_is_silently_not_finite_is_named_too(result: study.OpenLoop) -> None:
    dataset = failed(result.datasets["A"], "independent", 0.5, status=0)
    (told,) = curves.failures(dataset)
    assert "independent" in told and numbers_of(told) == [0.501]
    assert curves.failures(result.datasets["A"]) == []


def test_a_failed_flight_is_a_cross_among_the_bars_and_no_number(result: study.OpenLoop) -> None:
    results = json.loads(json.dumps(result.results))
    results["tests"]["B"]["decoupled"] |= {"status": 2, "rmse_t_m": None, "nrmse_t": None}
    figure = overview.bars(results)
    assert len(crosses(figure)) == 4
    assert "× Failed: Test B, decoupled" in words(figure)
    table = overview.table(results)
    assert "failed" in [text.get_text() for text in table.axes[0].texts]


def test_traces_say_and_draw_the_distances_that_the_eye_cannot_see() -> None:
    figure = tracking.traces(loop(), "Vehicle mine.")
    assert re.search(r"1 mm coupled, 2 mm .*, 4 mm .* 1 mm decoupled, 3 mm", words(figure))
    off, apart = figure.axes[2], figure.axes[4]
    np.testing.assert_allclose(line(off, "independent").get_ydata(), 4.0, rtol=1e-9)
    np.testing.assert_allclose(line(apart, "decoupled").get_ydata(), 1.0, rtol=1e-9)
    assert "start of the camera" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_errors_say_how_large_they_and_ds_are() -> None:
    said = words(tracking.errors(loop()))
    # 100 exp(-10) = 0.005 px of the start is left after 2 s.
    assert "1 px coupled, 1.5 px decoupled, 3 px independent" in said
    assert "0.5 px decoupled, 2 px independent" in said


def test_noise_is_a_band_of_its_extremes_about_its_running_rms() -> None:
    dataset = loop(noise=0.2)
    figure = tracking.errors(dataset)
    assert curves.BAND in words(figure)
    assert len(figure.axes[0].collections) == 3 and not tracking.errors(loop()).axes[0].collections
    drawn = line(figure.axes[0], "coupled")
    norm = np.abs(dataset["feature_error"].sel(model="coupled", letter="M").isel(pixel=0))
    window = norm[500:550]
    at = np.argmin(np.abs(drawn.get_xdata() - float(window["time"].mean())))
    assert drawn.get_ydata()[at] == pytest.approx(float(np.sqrt((window**2).mean())), rel=1e-12)
    band: Any = figure.axes[0].collections[0].get_paths()[0].vertices
    here = band[np.isclose(band[:, 0], float(window["time"].mean())), 1]
    assert {here.min(), here.max()} == {float(window.min()), float(window.max())}


def test_the_papers_speed_stands_beside_a_regular_one_with_a_word_on_its_spikes() -> None:
    dataset = loop()
    dataset["bend_rate"][:] = [0.0, 0.2]
    dataset["q"][..., 6] = 1e-3
    figure = one_letter.speed_of(dataset.sel(letter="M"))
    # The bend turns by 0.2 / 1e-3 [rad/s]; the regular norm is that of 0.1, 0.1, 0.1 and 0.2.
    assert {200.0, 0.26} <= set(numbers_of(words(figure)))
    assert "rounding" not in words(figure)
    dataset["bend"][:] = 1e-18
    assert "rounding" in words(one_letter.speed_of(dataset.sel(letter="M")))


@pytest.mark.long
@pytest.mark.parametrize("name", ["paper", "mine"])
def test_the_papers_largest_ds_is_told_of_its_vehicle_and_setting_only(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {"nominal": loop(), "camera": loop(noise=0.2)}
    found = written(monkeypatch, tracking.write, loop_results(name), given, Camera())
    told = [kind for kind, figure in found.items() if "0.7 px" in words(figure)]
    assert told == (["ds_nominal"] if name == "paper" else [])
    assert name == "mine" or style.UNNAMED in words(found["ds_nominal"]).replace("\n", " ")


@pytest.mark.long
def test_letters_that_are_not_resolved_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    flights = loop()
    flights["error_estimate"].loc[{"model": "decoupled", "letter": "L"}] = 9e-3
    given = {"nominal": loop(), "camera": flights}
    found = written(monkeypatch, tracking.write, loop_results(), given, Camera())
    named = {kind for kind, figure in found.items() if "Not resolved" in words(figure)}
    assert "traces_camera" in named and not any("nominal" in kind for kind in named)
    told = words(found["traces_camera"]).replace("\n", " ")
    assert "Not resolved: decoupled L." in told


def test_of_a_start_alone_nothing_is_told_but_that() -> None:
    dataset = loop().sel(letter="M")
    for model in dataset["model"].to_numpy():
        dataset = failed(dataset, model, 0.0)
    for figure in (one_letter.speed_of(dataset), one_letter.norm_difference_of(dataset)):
        title = str(figure.get_label())
        assert "before" in title and "at most" not in title


@pytest.mark.parametrize(("letter", "allowed"), [("M", 0.3), ("L", 0.1)])
def test_the_error_of_a_letter_is_drawn_beside_its_own_bound(letter: str, allowed: float) -> None:
    bounds = {"M": 0.3, "L": 0.1}
    figure = tracking.stability(loop().sel(letter=[letter]), bounds)
    assert allowed in numbers_of(words(figure))
    drawn: Any = figure.axes[1]
    assert list(line(drawn, "least bound of the proof").get_ydata()) == [allowed, allowed]


@pytest.mark.long
def test_no_legend_covers_a_curve(result: study.OpenLoop, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"nominal": loop(), "camera": loop(noise=0.2)}
    found = written(monkeypatch, tracking.write, loop_results(), given, Camera())
    datasets = {"A": failed(result.datasets["A"], "coupled", 0.3), "B": result.datasets["B"]}
    found |= written(monkeypatch, figures.write, result.results, datasets)
    assert len(found) == 2 * 6 + 2 * 3 + 4
    for figure in found.values():
        assert_legends_cover_nothing(figure)


@pytest.mark.long
def test_every_flight_failing_is_drawn_and_said() -> None:
    dataset = loop()
    for model in dataset["model"].to_numpy():
        dataset = failed(dataset, model, 0.4, status=3)
    for draw in (tracking.traces, tracking.errors):
        figure = draw(dataset)
        assert "coupled M ended at 0.4 s" in words(figure)
        assert crosses(figure)
        assert_legends_cover_nothing(figure)


@pytest.mark.long
def test_equal_results_give_equal_files_and_leave_the_settings_alone(
    result: study.OpenLoop, tmp_path: Path
) -> None:
    before = dict(matplotlib.rcParams)
    for name in ("a", "b"):
        style.save(figures.differences(result.datasets["B"]), name, tmp_path.joinpath)
    for suffix in ("png", "svg", "pdf"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    assert b"<dc:date>" not in (tmp_path / "a.svg").read_bytes()
    assert dict(matplotlib.rcParams) == before


def test_the_frames_are_those_of_the_equations() -> None:
    vehicle = PAPER.replace({"camera.position": [0.0, 0.02, 0.1]})
    q = np.array([0.1, -0.2, 1.5, 0.0, 0.0, 0.5, 0.8, -0.4])
    found = frames.frame_poses(vehicle, q)
    np.testing.assert_allclose(found["tip"][0], position(vehicle, q, 1.0), rtol=1e-14)
    body = found["B"][1]
    np.testing.assert_allclose(
        found["tip"][1], body @ section_rotation(vehicle, q, 1.0), rtol=0, atol=1e-14
    )
    np.testing.assert_allclose(
        found["camera"][0] - found["tip"][0], found["tip"][1] @ [0.0, 0.02, 0.1], rtol=1e-12
    )
    assert 0.1 in numbers_of(words(frames.frames(vehicle)))
    assert 0.1 not in numbers_of(words(frames.frames(PAPER)))


def test_the_drawn_bend_has_its_radius_and_its_tip() -> None:
    figure = frames.bend_variables(PAPER, kappa=0.5, psi_a=0.3)
    # r = 1 / κ; the tip is (1 - cos κl) / κ aside.
    assert "r = 2 m" in words(figure) and f"{2 * (1 - np.cos(0.5)):.2g} m aside" in words(figure)
    centre = np.array([2.0, 0.0])
    flat: Any = figure.axes[1].get_lines()[0]
    np.testing.assert_allclose(np.linalg.norm(flat.get_xydata() - centre, axis=1), 2.0, rtol=1e-12)


def test_snapshots_draw_the_models_at_the_times_asked_for(result: study.OpenLoop) -> None:
    figure = pictogram.snapshots(result.datasets["A"], PAPER, [0.0, 0.5, 1.0])
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert labels[:3] == ["0.0 s", "0.5 s", "1.0 s"]
