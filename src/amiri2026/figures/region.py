"""Figures of the region of operation: how far laws reach, and random starts brought home."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.spatial.transform import Rotation

from amiri2026.figures.laws import LAWS
from continuair.analysis import percent
from continuair.figures import style

_CROSS: dict[str, Any] = {"marker": "x", "ls": "", "color": style.FAILED_COLOUR}
_DOT: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "none"}


def reaches(results: dict[str, Any], model: str, rate: float) -> Figure:
    """Return a figure of the farthest successful start per direction and law.

    A cross marks the first failure. Only bent starts count; there is no cross if points are not in
    view.
    """
    cases = {
        case["law"]: case["directions"]
        for case in results["cases"]
        if case["model"] == model and case["rate_hz"] == rate
    }
    laws = [name for name in LAWS if name in cases]
    names = list(dict.fromkeys(each["direction"] for each in cases[laws[0]]))
    with style.applied():
        figure = style.new_figure(height=2.6)
        panels = figure.subplots(2, -(-len(names) // 2)).ravel()
        for axes, name in zip(panels, names, strict=False):
            for place, law in enumerate(laws):
                _bar(axes, -place, law, [e for e in cases[law] if e["direction"] == name][-1])
            axes.set_yticks([-place for place in range(len(laws))], laws)
            axes.set_ylim(0.6 - len(laws), 0.6)
            axes.set_xlim(left=0.0)
            axes.grid(axis="y", visible=False)
        for axes in panels[len(names) :]:
            axes.remove()
        bend = cases[laws[0]][-1]["bend_1_m"]
        style.head(
            figure,
            _farthest(cases, laws),
            f"{_named(results, model, rate)} Starts bent by {bend:g} 1/m besides.",
            handles=[Line2D([], [], label="first start that fails", **_CROSS)],
        )
    return figure


def random_starts(results: dict[str, Any], flights: xr.Dataset, model: str, rate: float) -> Figure:
    """Return the random starts of laws, by yaw and distance to the side; failed ones crossed."""
    own = flights.sel(model=model, rate=rate)
    own = own.isel(start=np.flatnonzero(own["direction"] == "random"))
    laws = [name for name in LAWS if name in own["law"]]
    q = own["q"] - own["centre"]
    aside = np.hypot(*(q.sel(coordinate=name).to_numpy() for name in "xy"))
    yaw = np.degrees(yaws_off(own["q"], own["centre"]))
    with style.applied():
        figure = style.new_figure(height=2.4)
        panels = figure.subplots(1, len(laws), sharex=True, sharey=True, squeeze=False)[0]
        words = []
        for axes, law in zip(panels, laws, strict=True):
            well = own["well"].sel(law=law).to_numpy()
            axes.plot(yaw[well], aside[well], ms=2, color=LAWS[law]["color"], **_DOT)
            axes.plot(yaw[~well], aside[~well], ms=3, mew=0.8, gid="failed", **_CROSS)
            axes.set(title=f"{law}: {well.sum()} of {well.size}", xlabel="yaw [°]")
            words.append(f"{percent(well.mean())} {law}")
        panels[0].set_ylabel("to the side [m]")
        key = [
            Line2D([], [], ms=3, color="#333333", label="ended well", **_DOT),
            Line2D([], [], ms=4, label="failed", **_CROSS),
        ]
        style.head(
            figure,
            f"Random starts that end well: {', '.join(words)}",
            _named(results, model, rate),
            handles=key,
        )
    return figure


def yaws_off(q: xr.DataArray, centre: xr.DataArray) -> np.ndarray:
    """Return the angles by which starts q (start, coordinate) are turned about the vertical [rad].

    They are measured from a centre (coordinate) that may be tilted, before any further tilt.
    """
    at, to = (
        Rotation.from_euler("ZYX", each.sel(coordinate=["yaw", "pitch", "roll"]).to_numpy())
        for each in (q.transpose("start", "coordinate"), centre)
    )
    _, _, z, w = (at * to.inv()).as_quat().T
    return np.asarray(np.arctan2(2.0 * z * w, w**2 - z**2))


def write(results: dict[str, Any], flights: xr.Dataset, file: Callable[[str], Path]) -> None:
    """Write the figures of every plant and control rate as PNG, SVG and PDF."""
    for model in flights["model"].to_numpy():
        for rate in flights["rate"].to_numpy():
            name = f"{model}_{rate:g}_hz"
            style.save(reaches(results, str(model), float(rate)), f"reach_{name}", file)
            drawn = random_starts(results, flights, str(model), float(rate))
            style.save(drawn, f"random_{name}", file)


def _bar(axes: Any, place: float, law: str, entry: dict[str, Any]) -> None:
    look = LAWS[law]
    axes.barh(
        place, entry["reached"], 0.7, color="none", edgecolor=look["color"], hatch=look["hatch"]
    )
    if entry["failed_at"] is not None and entry["in_view"]:
        axes.plot(entry["failed_at"], place, ms=5, mew=1.5, gid="failed", **_CROSS)
    axes.set_title(f"{entry['direction']} [{entry['unit'].strip()}]", loc="left")


def _farthest(cases: dict[str, Any], laws: list[str]) -> str:
    """Return a sentence on how far each law converges to the side and in yaw."""
    words = []
    for law in laws:
        reached = {each["direction"]: each["reached"] for each in cases[law]}
        words.append(f"{reached['y']:g} m and {reached['yaw']:g}° {law}")
    return f"Flights end well from as far as {', '.join(words)} (to the side, and in yaw)"


def _named(results: dict[str, Any], model: str, rate: float) -> str:
    vehicle = style.plain(results["vehicle"]["name"])
    return f"Vehicle {vehicle}, {model} plant, control at {rate:g} Hz."
