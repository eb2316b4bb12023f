"""Figures show the numbers of the datasets and results that they are given."""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

import continuair.studies.open_loop.study as study
from continuair.figures import open_loop as figures
from continuair.figures import pictogram, style
from continuair.vehicle.vehicle import load_vehicle
from tests.synthetic import flight

PAPER = load_vehicle("paper")


@pytest.fixture
def result(monkeypatch: pytest.MonkeyPatch) -> study.OpenLoop:
    monkeypatch.setattr(study, "simulate", flight)
    return study.open_loop(PAPER, "AB")


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


def line(axes: Any, model: str) -> Any:
    return next(item for item in axes.get_lines() if item.get_label() == model)


def test_motion_draws_every_model_with_its_own_colour(result: study.OpenLoop) -> None:
    dataset = result.datasets["A"]
    figure = figures.motion(dataset)
    assert len(figure.axes) == 9
    for model in ("coupled", "decoupled", "independent"):
        drawn = line(figure.axes[0], model)
        np.testing.assert_array_equal(
            drawn.get_ydata(), dataset["tip_position"].sel(model=model, axis=0)
        )
        assert drawn.get_color() == style.MODELS[model]["color"]
    assert figure.axes[0].get_ylabel() == "tip x [m]"


def test_differences_leave_out_the_reference_and_end_at_the_known_distance(
    result: study.OpenLoop,
) -> None:
    left, right = figures.differences(result.datasets["A"]).axes
    assert [item.get_label() for item in left.get_lines()] == ["decoupled", "independent"]
    # The stand-in's models end 0.2 and 0.4 m, and as many radians, from the coupled one.
    assert line(left, "decoupled").get_ydata()[-1] == pytest.approx(0.2, rel=1e-12)
    assert line(right, "independent").get_ydata()[-1] == pytest.approx(np.degrees(0.4), rel=1e-12)


def test_overview_bars_are_the_results_and_the_papers_numbers(result: study.OpenLoop) -> None:
    axes: Any = figures.overview(result.results).axes[1]
    heights = [bar.get_height() for bar in axes.patches]
    tests = result.results["tests"]
    expected = [0.0124, 0.2378]
    expected += [tests[t][m]["rmse_t_m"] for m in ("decoupled", "independent") for t in "AB"]
    assert heights == expected


def test_equal_results_give_equal_files_and_leave_the_settings_alone(
    result: study.OpenLoop, tmp_path: Path
) -> None:
    before = dict(matplotlib.rcParams)
    for name in ("a", "b"):
        style.save(figures.differences(result.datasets["B"]), name, tmp_path.joinpath)
    for suffix in ("png", "pdf"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("kappa", [0.0, 1e-9, 0.5, 2.0])
def test_drawn_backbone_has_the_arms_length_and_hangs_from_the_mount(kappa: float) -> None:
    points = pictogram.backbone(np.array([0.6 * kappa, 0.8 * kappa]), 1.2, (0.1, 0.0, -0.2))
    np.testing.assert_array_equal(points[0], [0.1, 0.0, -0.2])
    # Chords of 39 pieces are shorter than the arc by (kappa l / 39)² / 24.
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert length == pytest.approx(1.2, rel=1e-3)
    assert points[-1, 2] < -0.2


def test_snapshots_draw_the_models_at_the_times_asked_for(result: study.OpenLoop) -> None:
    figure = pictogram.snapshots(result.datasets["A"], PAPER, [0.0, 0.5, 1.0])
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert labels == ["0.0 s", "0.5 s", "1.0 s"]
