"""The atlas of controlled vehicles as Markdown: its table, and the lines of the documentation."""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair.analysis.decoupling_rule import allowed
from continuair.analysis.shares import percent
from continuair.studies.atlas.answers import answers, medians, printed_limit
from continuair.studies.atlas.explaining import DECIDES
from continuair.studies.atlas.judging import KINDS
from continuair.studies.atlas.rule import LEVEL
from continuair.studies.tables import as_markdown

EXAMPLES = [(gravity, bandwidth) for gravity in (0.02, 0.5) for bandwidth in (0.5, 1.0, 3.0)]
"""Gravity number and bandwidth of the vehicles whose limits are printed."""

EXAMPLE = {"coupling": 0.4, "mass_ratio": 0.03}


def as_table(summary: xr.Dataset) -> str:
    """Return the study's conclusions in Markdown."""
    title = "# May I decouple a controlled vehicle? The atlas"
    return "\n".join([title, "", *limits_by_kind(summary), "", *block(summary)]) + "\n"


def block(summary: xr.Dataset) -> list[str]:
    """Return the lines that docs/explanation/decouple_controlled.md shows, too."""
    made = summary.attrs
    rows = [[each.claim, f"**{each.verdict}**", each.evidence] for each in answers(summary)]
    heads = ["claim", "holds", "because"]
    return [
        "So far the rule lets a vehicle of coupling "
        f"{EXAMPLE['coupling']:g} and mass ratio {EXAMPLE['mass_ratio']:g} be decoupled in a loop:",
        "",
        *_limits(summary),
        "",
        *as_markdown(heads, rows, heads),
        "",
        f"From {made['vehicles']} vehicles (seed {made['seed']}, continuair {made['version']}), "
        f"each flown under {summary.sizes['excitation']} loads at {summary.sizes['frequency']} "
        "frequencies, with and without the loop; "
        f"{percent(float(summary['unstable']))} of the loops are unstable at the bandwidth drawn, "
        "which `flight_controller` refuses: these vehicles count nowhere, neither fitted nor as "
        "judges. Numbers are fitted on one half of the others and judged by the other "
        f"half. A number decides if it takes every load to {percent(DECIDES)} or more. The rule is "
        f"fitted so that {percent(LEVEL)} of errors lie below it.",
    ]


def limits_by_kind(summary: xr.Dataset) -> list[str]:
    """Return the lines that docs/explanation/decouple.md shows: limits by arm and loop."""
    tolerance = percent(float(summary["accepted"][0]))
    return [
        f"Half of the vehicles whose loop is stable may be decoupled up to this frequency over "
        f"ω_c, without a loop → in one, at a tolerance of {tolerance} ({_told_kinds()}):",
        "",
        *_kinds(summary),
    ]


def _told_kinds() -> str:
    """Return the definitions of soft and stiff, fast and slow."""
    (gravity, bandwidth), (_, slow) = KINDS["soft, fast"], KINDS["soft, slow"]
    (_, stiff), _ = KINDS["stiff, fast"]
    return (
        f"soft: gravity number above {gravity[0]:g}, stiff: below {stiff:g}; fast: bandwidth above "
        f"{bandwidth[0]:g} ω_c, slow: below {slow[1]:g} ω_c"
    )


def _kinds(summary: xr.Dataset) -> list[str]:
    """Return medians of the simulated limits, without a loop and in one."""
    names = [str(name) for name in summary["excitation"].to_numpy()]
    rows = []
    for kind, count in zip(summary["kind"].to_numpy(), summary["vehicles"].to_numpy(), strict=True):
        both = medians(summary, kind)
        cells = [" → ".join(printed_limit(summary, of[name]) for of in both) for name in names]
        rows.append([str(kind), str(count), *cells])
    return as_markdown(["arm, loop", "vehicles", *names], rows, ("arm, loop",))


def _limits(summary: xr.Dataset) -> list[str]:
    """Return the rule's limits of some vehicles."""
    tolerance = float(summary["accepted"][0])
    names = [str(name) for name in summary["excitation"].to_numpy()]
    gravity, bandwidth = (np.array(each) for each in zip(*EXAMPLES, strict=True))
    groups = {name: np.full(len(EXAMPLES), value) for name, value in EXAMPLE.items()}
    groups |= {"gravity_number": gravity, "bandwidth": bandwidth}
    found = allowed(summary, "position", groups, tolerance)
    rows = [
        [f"{g:g}", f"{b:g}", *(printed_limit(summary, limit) for limit in limits)]
        for g, b, limits in zip(gravity, bandwidth, found.T, strict=True)
    ]
    return as_markdown(["gravity number", "bandwidth / ω_c", *names], rows, ())
