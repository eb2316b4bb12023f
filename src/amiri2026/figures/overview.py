"""The open-loop study's metrics: as bars, and in the layout of the paper's table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from continuair.analysis import rotation_metric
from continuair.figures import style
from continuair.figures.curves import WORDS
from continuair.figures.style import short
from continuair.flight import overstated
from continuair.kernels import REFERENCE
from continuair.vehicle import vehicle_of_run

_PANELS = (
    ("nrmse_t", "nrmse_t", "NRMSE$_T$ as printed [-]"),
    ("rmse_t_m", "nrmse_t", "RMSE of tip position [m]"),
    ("nrmse_r", "nrmse_r", "NRMSE$_R$ as printed [-]"),
    ("rmse_r_rad", "nrmse_r", "RMSE of Euler angles [rad]"),
)
"""Metric, the number of the paper that it may be, and its label."""

_ANGLE = ("angle_rad", "", "angle between tips, RMS [rad]")
"""In place of Euler angles where these do not tell the rotations."""

_HATCHES = {"decoupled": "", "independent": "...."}
"""Hatches of the models' bars, which tell them apart in grey."""

_NUMBERS: dict[str, Any] = {"fontsize": 5.5, "padding": 2, "rotation": 90}
"""Style of the numbers on bars."""

_FAILED, _UNFOLLOWED = "failed", "lost"
"""In place of a number: of a flight that failed, and of Euler angles that samples do not follow."""

_CLOSE = 2.0
"""Factor within which a number of ours counts as near to one that the paper prints."""


def bars(results: dict[str, Any]) -> Figure:
    """Return the metrics of each model as bars, in four readings.

    Beside vehicle `paper` only: the numbers that the paper prints, one per test and kind, in both
    readings. A flight that failed is a cross with a word.
    """
    tests, printed = list(results["tests"]), results["printed"]
    with style.applied():
        figure = style.new_figure(height=3.8)
        panels = zip(figure.subplots(2, 2).flat, _readings(results), strict=True)
        for axes, (key, of_paper, label) in panels:
            numbers = (
                [printed[letter][of_paper] for letter in tests] if printed and of_paper else []
            )
            _bars(axes, results, key, numbers)
            axes.set_ylabel(label)
            axes.set_xticks(range(len(tests)), [f"Test {letter}" for letter in tests])
            axes.grid(axis="x", visible=False)
            axes.margins(y=0.2)
        text = f"{_of(results)}; tips against the coupled one."
        if printed:
            text += f" {style.UNNAMED} They print one number a test, shown in both readings."
        entries = [entry for each in results["tests"].values() for entry in each.values()]
        if not all(entry["converged"] or _failed(entry) for entry in entries):
            text += " White: not converged."
        text += _unfollowed(results)
        failed = _failures(results)
        handles = list(figure.axes[0].containers)
        style.head(figure, _largest(results), text, failed, handles)
    return figure


def table(results: dict[str, Any]) -> Figure:
    """Return the paper's table, metric x test, of the decoupled model in both readings.

    Beside vehicle `paper` only: the paper's numbers above ours. Bold: the largest of a row.
    """
    tests, printed = list(results["tests"]), results["printed"]
    rows = []
    for key, of_paper, label in _readings(results):
        if printed and key == of_paper:
            unit = {"nrmse_t": "m", "nrmse_r": "rad"}[key]
            numbers = [printed[letter][key] for letter in tests]
            above = f"{label.split(' as')[0]} [{unit}], printed by the paper"
            rows.append((above, numbers, [False] * len(tests)))
        name = f"{model}, {label}" if (model := _shown(results)) else label
        entries = [results["tests"][letter][model] for letter in tests]
        found = [_FAILED if _failed(each) else each[key] for each in entries]
        rows.append((name, found, [not each["converged"] for each in entries]))
    with style.applied():
        figure = style.new_figure(height=0.22 * (len(rows) + 1.5))
        _draw_table(figure.subplots(), rows, tests, bool(printed))
        text = f"{_of(results)}, {_shown(results)} against coupled."
        if printed:
            text += f" {style.UNNAMED}"
        if any(
            _finite(each) and loose for _, *row in rows for each, loose in zip(*row, strict=True)
        ):
            text += " * Not converged."
        text += _unfollowed(results)
        style.head(figure, _nearness(results, printed), text, _failures(results))
    return figure


def _of(results: dict[str, Any]) -> str:
    """Which vehicle, and which of several arms, the metrics are of."""
    name = f"Vehicle {style.plain(results['vehicle']['name'])}"
    if "arms" not in results:
        return name
    flown = vehicle_of_run(results["vehicle"], None)
    return f"{name}, arm {style.plain(flown.arms[flown.camera_arm].name)}"


def _bars(axes: Any, results: dict[str, Any], key: str, printed: list[float]) -> None:
    models, tests = _models(results), list(results["tests"])
    width = 0.8 / (len(models) + bool(printed))
    places = np.arange(len(tests)) - 0.4 + width / 2
    if printed:
        drawn = axes.bar(
            places, printed, width, color=style.PAPER_COLOUR, label="printed by the paper"
        )
        axes.bar_label(drawn, fmt="%.2g", **_NUMBERS)
    for index, model in enumerate(models, start=bool(printed)):
        entries = [results["tests"][letter][model] for letter in tests]
        heights = [np.nan if _failed(entry) else entry[key] for entry in entries]
        colour = style.MODELS[model]["color"]
        look = {"color": colour, "hatch": _HATCHES[model], "edgecolor": "white", "linewidth": 0.0}
        drawn = axes.bar(places + index * width, heights, width, label=model, **look)
        words = [short(entry[key]) if _finite(entry[key]) else "" for entry in entries]
        axes.bar_label(drawn, words, **_NUMBERS)
        for bar, entry, place in zip(drawn, entries, places + index * width, strict=True):
            if _failed(entry):
                axes.plot(place, 0.0, "x", color=colour, ms=6, mew=1.8, clip_on=False, gid="failed")
            elif not entry["converged"]:
                bar.set(facecolor="white", edgecolor=colour, linewidth=1.0)


def _draw_table(axes: Any, rows: list[Any], tests: list[str], printed: bool) -> None:
    """Rows of numbers between rules, as in a printed table."""
    axes.set_axis_off()
    axes.set(xlim=(0.0, 1.0), ylim=(len(rows) + 0.5, -0.9))
    columns = 0.52 + 0.47 * (np.arange(len(tests)) + 0.5) / len(tests)
    axes.text(0.01, -0.35, "Metric", weight="bold", va="center")
    for x, letter in zip(columns, tests, strict=True):
        axes.text(x, -0.35, f"Test {letter}", weight="bold", ha="center", va="center")
    for y, (label, numbers, unsettled) in enumerate(rows):
        colour = "#666666" if "printed by" in label else "#000000"
        axes.text(0.01, y + 0.55, label, va="center", color=colour)
        finite = [number for number in numbers if _finite(number)]
        for x, number, loose in zip(columns, numbers, unsettled, strict=True):
            lost = _FAILED if number == _FAILED else _UNFOLLOWED
            text = f"{_digits(number)}{'*' * loose}" if _finite(number) else lost
            weight = "bold" if finite and number == max(finite) else "normal"
            axes.text(x, y + 0.55, text, ha="center", va="center", weight=weight, color=colour)
    for place, width in ((-0.85, 1.0), (0.0, 0.6), (len(rows) + 0.2, 1.0)):
        axes.axhline(place, color="#000000", lw=width)


def _digits(number: float) -> str:
    """Format with four decimals, as the paper does, unless the number would vanish."""
    return f"{number:.4f}" if number == 0.0 or number >= 1e-3 else f"{number:.1e}"


def _readings(results: dict[str, Any]) -> tuple[tuple[str, str, str], ...]:
    """The metrics that are shown: of rotations that of Euler angles where these tell them all."""
    model = _shown(results)
    flown = [entries[model] for entries in results["tests"].values()]
    flown = [entry for entry in flown if not _failed(entry)]
    told = not flown or rotation_metric(flown) == "rmse_r_rad"
    return _PANELS if told else (*_PANELS[:-1], _ANGLE)


def _models(results: dict[str, Any]) -> list[str]:
    first = next(iter(results["tests"].values()))
    return [model for model in style.MODELS if model != REFERENCE and model in first]


def _shown(results: dict[str, Any]) -> str:
    """Return the model of the table: decoupled, as in the paper, if it was simulated."""
    models = _models(results)
    return "decoupled" if "decoupled" in models else models[0]


def _finite(value: float | str | None) -> bool:
    return isinstance(value, float) and math.isfinite(value)


def _failed(entry: dict[str, Any]) -> bool:
    return bool(entry["status"]) or not _finite(entry["rmse_t_m"])


def _unfollowed(results: dict[str, Any]) -> str:
    """Return a note on flights whose Euler angles cannot be compared, or describe no rotation."""
    flown = [entry for entries in results["tests"].values() for entry in entries.values()]
    ended = [entry for entry in flown if not _failed(entry)]
    text = ""
    if any(not _finite(each["rmse_r_rad"]) for each in ended):
        text += " Where samples do not follow Euler angles these are lost."
    if any(overstated(each["rmse_r_rad"], each["angle_rad"]) for each in ended):
        text += " Euler angles overstate a rotation here, of which the angle between tips tells."
    return text


def _failures(results: dict[str, Any]) -> list[str]:
    """Return a sentence on the flights that failed."""
    named = [
        f"Test {letter}, {model} ({WORDS[entry['status']] if entry['status'] else 'no number'})"
        for letter, entries in results["tests"].items()
        for model, entry in entries.items()
        if _failed(entry)
    ]
    return [f"× Failed: {'; '.join(named)}."] if named else []


def _largest(results: dict[str, Any]) -> str:
    """Return in which test decoupling moves and turns the tip most."""
    model, texts = _shown(results), []
    flown = {letter: entries[model] for letter, entries in results["tests"].items()}
    flown = {letter: entry for letter, entry in flown.items() if not _failed(entry)}
    readings = [key for key, _, _ in _readings(results)]
    for key, state, unit in zip(
        readings[1::2], ("farthest off", "most turned"), ("m", "rad"), strict=True
    ):
        found = {letter: entry[key] for letter, entry in flown.items()}
        if found:
            most = max(found, key=found.__getitem__)
            texts.append(f"{state} in Test {most}, {short(found[most])} {unit}")
    if not texts:
        return f"No flight of the {model} model can be compared"
    return f"The {model} tip is {', and '.join(texts)} (RMS)"


def _nearness(results: dict[str, Any], printed: dict[str, Any]) -> str:
    """Return how many printed numbers ours are close to, in each reading; else the largest."""
    if not printed:
        return _largest(results)
    model, counts = _shown(results), []
    shown = [key for key, _, _ in _readings(results)]
    for keys in (shown[0::2], shown[1::2]):
        pairs = [
            (entries[model][key], printed[letter][of_paper])
            for letter, entries in results["tests"].items()
            for key, of_paper in zip(keys, ("nrmse_t", "nrmse_r"), strict=True)
        ]
        near = [_finite(a) and b / _CLOSE <= a <= b * _CLOSE for a, b in pairs]
        counts.append((sum(near), len(near)))
    (as_nrmse, total), (as_rmse, _) = counts
    return (
        f"Read as RMSE, {as_rmse} of the {total} printed numbers are within a factor of "
        f"{_CLOSE:g} of ours; read as NRMSE, {as_nrmse}"
    )
