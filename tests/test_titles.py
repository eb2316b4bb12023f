"""What a title states is in the panels below it, and turns where the data turn.

Flights here have a known finding; of the opposite one, the title says the opposite.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import amiri2026.open_loop.study as study
from amiri2026.figures import one_letter, tracking
from amiri2026.figures import open_loop as figures
from amiri2026.report.page import page
from amiri2026.tracking.study import metrics
from continuair.figures import advise, atlas, curves, pictogram, style
from continuair.figures.style import short
from continuair.studies.contents import Contents
from continuair.vehicle.vehicle import load_vehicle
from tests.synthetic import flight
from tests.test_figures import loop

MODELS = ("coupled", "decoupled", "independent")
OTHERS = MODELS[1:]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> xr.Dataset:
    """Flights of Test B, of the stand-in."""
    monkeypatch.setattr(study, "simulate", flight)
    return study.open_loop(load_vehicle("paper"), "B").datasets["B"].copy(deep=True)


def ringing(dataset: xr.Dataset, hertz: dict[str, float]) -> xr.Dataset:
    """The dataset with bends that swing at known frequencies."""
    time = dataset["time"].to_numpy()
    for model, hz in hertz.items():
        dataset["bend"].loc[{"model": model}] = np.outer(np.sin(2 * np.pi * hz * time), [0.1, 0.0])
    return dataset


def swapped(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with the flights of both simpler models exchanged."""
    order = {"decoupled": "independent", "independent": "decoupled"}
    names = [order.get(str(model), str(model)) for model in dataset["model"].to_numpy()]
    return dataset.assign_coords(model=names).sel(model=list(MODELS))


def between(dataset: xr.Dataset, first: float, last: float) -> xr.DataArray:
    """1 between two times, and 0 elsewhere."""
    return ((dataset["time"] > first) & (dataset["time"] < last)).astype(float)


def stated(figure: Figure) -> str:
    return str(figure.get_label())


def claims(title: str) -> dict[str, str]:
    """The number that a title gives last before the name of each model."""
    found, last = {}, ""
    for word in re.findall(r"[\d.]+(?:e-?\d+)?(?=°| Hz| px| mm| m\b)|coupled|decoupled|independent",
                           title):  # fmt: skip
        if word in MODELS:
            found[word] = last
        else:
            last = word
    return found


@pytest.mark.parametrize(
    "hertz",
    [
        # Fewer than two cycles in the flight's second, as a soft arm swings, and many.
        dict(zip(MODELS, (1.9, 1.6, 1.4), strict=True)),
        dict(zip(MODELS, (31.0, 14.0, 9.0), strict=True)),
    ],
)
def test_a_spectrum_that_is_drawn_with_a_peak_is_titled_with_it(
    opened: xr.Dataset, hertz: dict[str, float]
) -> None:
    figure = figures.bending(ringing(opened, hertz))
    drawn = curves.highest(figure.axes[-1])
    assert set(drawn) == set(MODELS)
    assert claims(stated(figure)) == {model: short(hz) for model, (hz, _) in drawn.items()}
    # All that is marked is in the panel.
    low, high = figure.axes[-1].get_xlim()
    assert all(low <= hz <= high for hz, _ in drawn.values())


def test_a_bend_that_stays_is_titled_with_no_peak(opened: xr.Dataset) -> None:
    opened["bend"][:] = 0.1
    figure = figures.bending(opened)
    assert not claims(stated(figure))
    low, high = figure.axes[-1].get_ylim()
    assert low == 0.0 and high >= 1e-6


def test_of_two_models_the_one_that_moves_has_the_peak(opened: xr.Dataset) -> None:
    opened["bend"][:] = 0.0
    for model, other in (OTHERS, OTHERS[::-1]):
        found = claims(stated(figures.bending(ringing(opened, {model: 7.0, other: 0.0}))))
        assert set(found) == {model} and float(found[model]) == pytest.approx(7.0, abs=0.2)


LETTER: dict[str, Callable[[xr.Dataset], Figure]] = {
    "traces": tracking.traces,
    "errors": tracking.errors,
    "ds": lambda dataset: one_letter.norm_difference_of(dataset.sel(letter="M")),
}


@pytest.mark.long
@pytest.mark.parametrize("draw", LETTER.values(), ids=LETTER)
def test_titles_of_tracking_turn_with_the_flights(draw: Callable[[xr.Dataset], Figure]) -> None:
    one, other = claims(stated(draw(loop()))), claims(stated(draw(swapped(loop()))))
    assert one["decoupled"] == other["independent"] != one["independent"] == other["decoupled"]


def test_titles_of_open_loop_tests_turn_with_the_flights(opened: xr.Dataset) -> None:
    one, other = (stated(figures.differences(each)) for each in (opened, swapped(opened)))
    assert claims(one)["decoupled"] == claims(other)["independent"] != claims(one)["independent"]
    # Of tips that coincide, no error is told, and none is drawn at full scale.
    same = opened.copy(deep=True)
    for name in ("tip_position", "tip_attitude"):
        same[name][:] = opened[name].sel(model="coupled") * (1.0 + 1e-16)
    figure = figures.differences(same)
    assert not claims(stated(figure))
    assert all(axes.get_ylim()[1] >= 1e-6 for axes in figure.axes)


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("since", [5.0, 2.0])
def test_the_largest_error_of_the_title_is_that_of_the_table(noise: float, since: float) -> None:
    """Whatever comes before the window, and however many coordinates err."""
    dataset = loop(noise)
    dataset["feature_error"] += 0.5 + 39.5 * between(dataset, 3.0, 4.0)
    found = claims(stated(tracking.errors(dataset, since=since)).partition(";")[0])
    for model in MODELS:
        zero = {"command": (("time", "actuator"), np.zeros((dataset.sizes["time"], 8)))}
        flights = [dataset.sel(model=model, letter=each).assign(zero) for each in "ML"]
        entries = [metrics(each, since) for each in flights]
        assert found[model] == short(max(entry["norm_max_px"] for entry in entries))
        # The norm of eight coordinates is no coordinate.
        assert all(entry["norm_max_px"] > entry["max_px"] for entry in entries)


def test_the_distances_of_the_title_are_those_of_the_table() -> None:
    dataset = loop()
    dataset["camera_position"] += 0.5 * between(dataset, 3.0, 4.0)
    found = claims(stated(tracking.traces(dataset)).partition(";")[0])
    zero = {"command": (("time", "actuator"), np.zeros((dataset.sizes["time"], 8)))}
    for model in MODELS:
        one = dataset.sel(model=model, letter="M").assign(zero)
        assert found[model] == short(1e3 * metrics(one, 5.0)["tip_max_m"])


@pytest.mark.parametrize(
    ("errors", "limit"),
    [
        ([0.01, 0.019, 0.021, 0.5], 2.0),
        ([0.5, 0.01, 0.01, 0.01], np.nan),
        ([0.01] * 4, np.inf),
        ([0.01, None, 0.01, 0.01], 1.0),
    ],
)
def test_advice_is_titled_with_what_its_curves_cross(errors: Any, limit: float) -> None:
    hz = [1.0, 2.0, 3.0, 4.0]
    assert advise.within(hz, errors, 0.02) == pytest.approx(limit, nan_ok=True)
    entry = {"hz": hz, "errors": errors, "limit_hz": limit}
    results = {
        "vehicle": {"name": "mine", "arm": {}},
        "loop": {"name": "none"},
        "tolerance": 0.02,
        "clamped_hz": 2.5,
        "excitations": {"tip": {"models": {"decoupled": entry, "independent": entry}}},
        "tracking": {},
    }
    figure = advise.advice(results)
    assert (f"up to {short(limit)} Hz" in stated(figure)) == bool(np.isfinite(limit))
    diamonds = [line for line in figure.axes[0].get_lines() if line.get_marker() == "D"]
    assert [float(np.ravel(each.get_xdata())[0]) for each in diamonds] == (
        [limit] if np.isfinite(limit) else []
    )
    assert len(figure.axes[0].get_lines()) == 4 + len(diamonds)  # both models, and two limits


def test_a_collapse_is_titled_with_the_factors_that_are_drawn() -> None:
    frequency = np.geomspace(0.1, 4.0, 5)
    rows = {"same_groups": [1.0, 1.0], "same_coupling": [1.0, 1.25], "others": [1.0, 40.0]}

    def dataset(rows: dict[str, list[float]]) -> xr.Dataset:
        sizes = {name: (("vehicle", "frequency"), np.outer(row, 0.1 + frequency))
                 for name, row in rows.items()}  # fmt: skip
        numbers = {name: ("vehicle", [0.1, 0.2]) for name in ("length", "mass_ratio")}
        given = sizes | numbers | {"inertia_ratio": ("vehicle", [1.0, 2.0]), "coupling": 0.4}
        return xr.Dataset(given, {"frequency": frequency})

    said = stated(atlas.collapse(dataset(rows)))
    assert [said.count(factor) for factor in ("1.00", "1.25", " 40 ")] == [1, 1, 1]
    turned = rows | {"same_groups": rows["others"], "others": rows["same_groups"]}
    assert "40.00 with the same groups" in stated(atlas.collapse(dataset(turned)))


def test_axes_of_rounding_have_a_floor() -> None:
    axes: Any = Figure().subplots()
    axes.plot([0.0, 1.0], [1e-16, -1e-16])
    curves.widen([axes], 1e-6)
    assert np.ptp(axes.get_ylim()) == pytest.approx(1e-6)
    axes.plot([0.0, 1.0], [0.0, 3.0])
    axes.autoscale()
    before = axes.get_ylim()
    curves.widen([axes], 1e-6)
    assert axes.get_ylim() == before
    log: Any = Figure().subplots()
    log.plot([0.0, 1.0, 2.0], [2.0, 1e-3, 1e-17])
    curves.logarithmic([log])
    assert log.get_ylim()[0] == pytest.approx(2e-6)
    curves.floor([log], 1e-4)
    assert log.get_ylim()[0] == 1e-4 and log.get_ylim()[1] > 2.0


def test_files_hold_the_title_and_the_report_begins_with_it(tmp_path: Path) -> None:
    with style.applied():
        figure = style.new_figure()
        figure.subplots()
    style.head(figure, "‖$e_a$‖ < 3 & falls")
    style.save(figure, "errors", lambda name: tmp_path / name)
    (tmp_path / "plain.svg").write_text("<svg></svg>", encoding="utf-8")
    drawn = {"errors": tmp_path / "errors.png", "plain": tmp_path / "plain.svg"}
    results = {"vehicle": {"name": "mine"}, "verdict": "decouple <nothing>"}
    made = page(Contents(tmp_path, "advise", "1", "", results, "# Title\n\nTABLE", drawn, []))
    places = [
        made.index(each)
        for each in ("decouple &lt;nothing&gt;", 'href="#advise-errors">‖e_a‖ &lt; 3 &amp; falls<',
                     'href="#advise-plain">plain<', 'id="advise-errors"', "TABLE")
    ]  # fmt: skip
    assert places == sorted(places)


def test_snapshots_have_a_scale_and_the_ground_where_it_is_near(opened: xr.Dataset) -> None:
    vehicle = load_vehicle("paper")
    opened["position"].loc[{"axis": 2}] += 1.4
    figure = pictogram.snapshots(opened, vehicle, [0.0, 0.5, 1.0])

    def drawn(gid: str, figure: Figure) -> list[Any]:
        return [line for line in figure.axes[0].get_lines() if line.get_gid() == gid]

    (scale,) = drawn("scale", figure)
    length = np.ptp(scale.get_xdata())
    assert f"{length:g} m" in [text.get_text() for text in figure.axes[0].texts]
    assert 0.2 <= length / float(vehicle.reach) <= 0.5
    low, high = figure.axes[0].get_ylim()
    assert low < scale.get_ydata()[0] < high
    # It falls from 6.4 m by 4.9: the ground is near at the end alone.
    (ground,) = drawn("ground", figure)
    assert ground.get_ydata()[0] == pytest.approx(-(6.4 - 4.905), abs=1e-9)
    for lift in (100.0, -101.0):  # far above it, and below it at the end
        opened["position"].loc[{"axis": 2}] += lift
        assert not drawn("ground", pictogram.snapshots(opened, vehicle, [0.0, 0.5, 1.0]))


@pytest.mark.parametrize(("most", "length"), [(0.5, 0.5), (0.49, 0.2), (3.0, 2.0), (1e-3, 1e-3)])
def test_a_scale_has_a_round_length(most: float, length: float) -> None:
    assert pictogram.round_length(most) == pytest.approx(length)
