"""‖q̇‖ and DS of one letter over time, in the form of Figs. 5 and 6 of Amiri et al.

Datasets hold the flights of one letter, leading dimension `model`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from amiri2026.tracking.largest import ds_extremes, in_transient
from continuair.analysis import TRANSIENT, joint_speed, norm_difference, regular_speed, samples
from continuair.figures import curves, style
from continuair.figures.style import grouped, short
from continuair.kernels import REFERENCE

Array = NDArray[np.float64]

_SPIKES = (
    "ψ̇a is the bend's rate across its direction over κ: it grows without bound as the bend passes "
    "zero. Mixed units."
)

_LEAST = 1e-3
"""Least span of an axis of DS [px]."""

_ROUNDING = 1e-12
"""Bend [1/m] below which its direction is rounding."""


def speed_of(flights: xr.Dataset, subtitle: str = "") -> Figure:
    """Return ‖q̇‖ as the paper defines it, and beside it a norm of regular rates, over time.

    ‖q̇‖ holds Euler rates and polar bend rates, ψ̇a among them (`joint_speed`); the regular norm the
    velocity, the angular velocity and the rate of the bend vector (`regular_speed`).
    """
    with style.applied():
        figure = style.new_figure(height=2.2)
        left, right = figure.subplots(1, 2, sharey=True)
        draw = curves.band if curves.noisy(flights) else curves.line
        for model in flights["model"].to_numpy():
            flight = flights.sel(model=model)
            draw(left, flight, joint_speed(flight), model)
            draw(right, flight, regular_speed(flight), model)
        left.set_title(r"$\Vert\dot q\Vert$ of the paper's q, with $\dot\psi_a$", loc="left")
        right.set_title("velocity, angular velocity, bend rate", loc="left")
        for axes in (left, right):
            axes.set_xlabel("time [s]")
        curves.logarithmic([left, right])
        left.set_ylabel("norm [mixed units]")
        text = f"{subtitle} Letter {flights['letter'].item()}. {_SPIKES}"
        if curves.noisy(flights):
            text += f" {curves.BAND}"
        handles = style.model_handles(left)
        style.head(figure, _peaks(flights), text, curves.doubts(flights), handles)
    return figure


def norm_difference_of(
    flights: xr.Dataset, subtitle: str = "", printed: dict[str, Any] | None = None
) -> Figure:
    """Return DS = ‖e‖_c - ‖e‖_d [px] over time, its transient and its rest apart.

    Before TRANSIENT of all plants in one panel, from it on of each in its own. printed: the largest
    |DS| that the paper prints, to be named in words.
    """
    coupled = flights.sel(model=REFERENCE)
    others = [str(m) for m in flights["model"].to_numpy() if m != REFERENCE]
    early = in_transient(flights)
    with style.applied():
        figure = style.new_figure(height=2.2)
        panels = figure.subplots(1, 1 + len(others))
        draw = curves.band if curves.noisy(flights) else curves.line
        for axes, model in zip(panels[1:], others, strict=True):
            flight = flights.sel(model=model)
            ds = norm_difference(coupled, flight)
            curves.line(panels[0], flight.isel(time=early), ds[early], model)
            draw(axes, flight.isel(time=~early), ds[~early], model)
            axes.set_title(model, loc="left")
        panels[0].set_title("all", loc="left")
        curves.tell_empty(panels)
        curves.widen(panels, _LEAST)
        for axes in panels:
            axes.axhline(0.0, color="#000000", lw=0.5)
            axes.set_xlabel("time [s]")
        panels[0].set_ylabel(f"DS before {TRANSIENT:g} s [px]")
        for axes in panels[1:]:
            axes.set_ylabel(f"DS from {TRANSIENT:g} s [px]")
        text = f"{subtitle} DS = ‖e‖ coupled - ‖e‖ of the plant."
        if curves.noisy(flights):
            text += f" {curves.BAND}"
        if printed:
            text += f" The paper prints |DS| below {printed['ds_max_px']:g} px. {style.UNNAMED}"
        finding = f"Letter {flights['letter'].item()}: {_ds_finding(flights, others)}"
        handles = style.model_handles(panels[0])
        style.head(figure, finding, text, curves.doubts(flights), handles)
    return figure


def _peaks(flights: xr.Dataset) -> str:
    """Return a clause on the peak of ‖q̇‖, its bend, and the peak of the regular norm."""
    highest, bend, regular = 0.0, float("nan"), 0.0
    if _only_the_start(flights):
        return "The flights fail before a second sample"
    for model in flights["model"].to_numpy():
        flight = flights.sel(model=model)
        speed, rate = joint_speed(flight), regular_speed(flight)
        top = int(np.nanargmax(speed))
        regular = max(regular, float(np.nanmax(rate)))
        if speed[top] > highest:
            highest = float(speed[top])
            bends = np.linalg.norm(samples(flight, "bend", "bend_axis"), axis=-1)
            # Of several sections the one that is nearest to straight turns fastest.
            bend = float(bends[..., top].min())
    if highest == 0.0:
        return "Nothing moves before the flights fail"
    rounded = ", which is rounding, as ψ̇a then is" if bend < _ROUNDING else ""
    return (
        f"‖q̇‖ with ψ̇a peaks at {short(highest)}, at a bend of {bend:.1g} 1/m{rounded}; "
        f"a regular norm of the same motion at {short(regular)}"
    )


def _only_the_start(flights: xr.Dataset) -> bool:
    """Return whether no flight has a sample after that of its start."""
    bends = flights["bend"].transpose("model", "time", ...).to_numpy()
    seen = np.isfinite(bends).reshape(*bends.shape[:2], -1).all(-1)
    return bool(seen.sum(-1).max() < 2)


def _ds_finding(flights: xr.Dataset, others: list[str]) -> str:
    """The largest |DS| of each plant before and after the end of the transient."""
    coupled, words = flights.sel(model=REFERENCE), {}
    for model in others:
        early, late = ds_extremes(coupled, flights.sel(model=model))
        if np.isfinite(early):
            rest = f"{short(late)} px" if np.isfinite(late) else "an unknown size"
            words[model] = f"{short(early)} px and {rest}"
    if not words:
        return f"flights fail before {TRANSIENT:g} s"
    return f"|DS| before {TRANSIENT:g} s, and from then on, is at most {grouped(words)}"
