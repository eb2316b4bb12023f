"""The atlas as tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import xarray as xr

from continuair.analysis.shares import percent
from continuair.kernels.dynamics import COUPLINGS
from continuair.studies.tables import as_markdown, number


def as_table(summary: xr.Dataset) -> str:
    """Return the summary in Markdown."""
    made = summary.attrs
    each = round(made["attributed_runs"] / summary.sizes["excitation"])
    errors = ["NRMSE", "tip error / l", "angle [rad]", "lost", "tolerance", "map explains"]
    lines = [
        "# When may I decouple? The atlas",
        "",
        f"{made['runs']} paired flights in open loop, {made['closed_loop_runs']} in closed loop, "
        f"seed {made['seed']}, continuair {made['version']}.",
        "",
        "Decoupled model, median (9 of 10 below) of all flights; tolerance: what a tenth of it "
        "changes in 9 of 10.",
        "",
        *_by_excitation(summary, errors, _errors),
        "",
        "Importance of each group for the decoupled NRMSE: alone (with others)",
        "",
        *_by_excitation(summary, [str(g) for g in summary["group"].to_numpy()], _importance),
        "",
        f"Share of flights, of {each} each, for which the loss of one coupling alone errs most "
        "(and its median error over that of decoupling)",
        "",
        *_by_excitation(summary, COUPLINGS, _couplings),
        "",
        *_loops(summary),
    ]
    return "\n".join(lines) + "\n"


def _by_excitation(
    summary: xr.Dataset, headings: Sequence[str], cells: Callable[[xr.Dataset], list[str]]
) -> list[str]:
    rows = [[name, *cells(summary.sel(excitation=name))] for name in summary["excitation"].values]
    return as_markdown(["excitation", *headings], rows, ("excitation",))


def _errors(one: xr.Dataset) -> list[str]:
    one = one.sel(model="decoupled")
    spreads = (one[f"{error}_spread"].to_numpy()[1:] for error in ("nrmse", "error", "angle"))
    lost, tolerance, by_map = one["lost"], one["tolerance_error"], one["by_map"].sel(error="angle")
    shares = [percent(float(lost)), number(float(tolerance)), percent(float(by_map))]
    return [_pair(*spread) for spread in spreads] + shares


def _importance(one: xr.Dataset) -> list[str]:
    one = one.sel(model="decoupled", error="nrmse")
    pairs = zip(one["first"].to_numpy(), one["total"].to_numpy(), strict=True)
    return ["" if math.isnan(alone) else _shares(alone, total) for alone, total in pairs]


def _couplings(one: xr.Dataset) -> list[str]:
    pairs = zip(one["responsible"].to_numpy(), one["alone"].to_numpy(), strict=True)
    return [
        "-" if math.isnan(share) else f"{percent(share)} ({number(ratio, 2)})"
        for share, ratio in pairs
    ]


def _loops(summary: xr.Dataset) -> list[str]:
    spread = summary["loop_spread"].sel(quantile=[0.5, 0.9])
    errors = [
        f"{name} {_pair(*spread.sel(loop_error=name).to_numpy())}"
        for name in ("ds_px", "rms_px", "coupled_rms_px")
    ]
    groups = (summary[name].to_numpy() for name in ("loop_group", "loop_first", "loop_total"))
    shares = [f"{name} {_shares(alone, total)}" for name, alone, total in zip(*groups, strict=True)]
    lost = [
        f"{plant} {percent(float(summary['loop_lost'].sel(plant=plant)))}"
        for plant in summary["plant"].to_numpy()
    ]
    return [
        f"Closed loop, median (9 of 10 below) of those held: {', '.join(errors)}. "
        f"Lost: {', '.join(lost)}; both plants end alike in "
        f"{percent(float(summary['loop_alike']))} of the pairs.",
        "",
        f"Importance for DS: {', '.join(shares)}.",
    ]


def _pair(median: float, high: float) -> str:
    return f"{number(median, 3)} ({number(high, 3)})"


def _shares(alone: float, total: float) -> str:
    return f"{alone:.2f} ({total:.2f})"
