"""The first screen of the report: the paper's findings, which of them hold, and their meaning."""

from __future__ import annotations

from collections import Counter
from typing import Any

from amiri2026.open_loop_tests import OPEN_LOOP_TESTS
from amiri2026.sentences import PARTS
from amiri2026.table import report as table
from amiri2026.verdicts import (
    CLASSES,
    DEPENDS,
    HOLDS,
    MISPRINT,
    UNDECIDED,
    UNTESTABLE,
)
from continuair.studies import as_markdown

FOUND = (
    "Amiri, Sepahvand, Mantegh and Janabi-Sharifi (arXiv 2602.18684) derive the dynamics of a UAV "
    "with one bending arm. They compare the coupled model with a decoupled one, in which the "
    "off-diagonal elements of M and C are zero. In open loop they find large differences in some "
    "tests and negligible ones in others. Under visual servoing they find differences below a "
    "pixel at a lower cost. They print some of their parameters, and no gains."
)

FLOWN = (
    "The presets are ours: `paper` is a UAV of 2 kg with a steel arm of 1 m and 5 mm, and `table1` "
    "was fitted to Table I. Neither is known to be the authors' vehicle. Unless a row says "
    "otherwise, the decoupled model has the blocks between UAV and arm zero; the paper sets every "
    "off-diagonal element to zero."
)

FLOWN_IN = dict.fromkeys(
    ("IV-B", "IV-C"),
    "In this part the decoupled model has the blocks of M and C between UAV and arm zero; the "
    "paper sets every off-diagonal element to zero.",
)
"""Part of the paper -> the setting of its sentences."""

CLASSES_EXPLAINED = (
    "*Wrong as printed*: an equation, unit, sign or statement to which a counterexample is given, "
    "with the right form and the residual of both. *Depends on what is not printed*: it holds for "
    "one vehicle or reading and fails for another, or fails for all that were flown; they are "
    "named. *Cannot be tested here*: it needs the authors' program."
)

_TRACKING = "Abstract.9"
"""The sentence whose numbers are differences of feature errors [px]."""

_VERBS = {
    HOLDS: ("holds", "hold"),
    MISPRINT: ("is wrong as printed", "are wrong as printed"),
    DEPENDS: ("depends on what is not printed", "depend on what is not printed"),
    UNTESTABLE: ("cannot be tested here", "cannot be tested here"),
    UNDECIDED: ("has two views that disagree", "have two views that disagree"),
}
"""Verb of one sentence with a verdict, and of several."""


def overview(results: dict[str, Any]) -> list[str]:
    """Return the first screen in Markdown, for all that a run has judged."""
    lines = ["## What the paper found", "", FOUND, "", "## What holds", "", counted(results)]
    if "table1" in results:
        found = results["table1"]
        lines += ["", "## Table I, and ours", "", *table.beside(found), "", table.reading(found)]
        lines += ["", f"{table.message(found)} {table.CAUTION}"]
        lines += ["", "## If you decide between the models", "", *advice(results)]
    return [*lines, "", "## Redo it", "", *redo(results)]


def counted(results: dict[str, Any]) -> str:
    """Return a sentence with the counts of verdicts, and what verdicts mean."""
    return f"{summary(results)} {CLASSES_EXPLAINED} {FLOWN}"


def summary(results: dict[str, Any]) -> str:
    """Return how many sentences got which verdict."""
    count = Counter(entry["verdict"] for entry in results["sentences"])
    names = {**_VERBS, **{name: (name, name) for name in count if name not in _VERBS}}
    told = [f"{count[name]} {verbs[count[name] > 1]}" for name, verbs in names.items()
            if count[name]]  # fmt: skip
    number = len(results["sentences"])
    listed = ", ".join(told[:-1]) + (" and " if len(told) > 1 else "") + told[-1]
    return f"Of {number} sentence{'s' if number > 1 else ''} of the paper {listed}."


def advice(results: dict[str, Any]) -> list[str]:
    """Return lines on the consequences for a user, with the numbers of this run."""
    found = results["table1"]
    block = next(entry for entry in found["ablations"] if "only the blocks" in entry["change"])
    pairs = ", ".join(
        f"{test} {_mm(found, test)} and {_mm(block, test)} mm" for test in OPEN_LOOP_TESTS
    )
    lines = [
        "* Zero the blocks between UAV and arm, not every off-diagonal element. The position RMSE "
        f"of that vehicle, every element and blocks alone: {pairs}.",
        "* State errors in metres and radians, or in arm lengths. The range of a falling or "
        "flying tip mainly measures the path of the UAV.",
    ]
    tracked = next((e for e in results["sentences"] if e["id"] == _TRACKING), None)
    if tracked is not None and tracked["numbers"]:
        lines.append(
            "* Under visual servoing both plants track alike: over four letters their RMS feature "
            f"errors differ by at most {max(tracked['numbers'].values()):.2g} px with our gains."
        )
    return [*lines, "* Ask for your own vehicle and task: `continuair advise my_drone.toml`."]


def _mm(flown: dict[str, Any], test: str) -> str:
    return f"{1e3 * flown['in_metres_and_radians'][test]['rmse_t_m']:.3g}"


def redo(results: dict[str, Any]) -> list[str]:
    """Return the lines with the commands that make these results again."""
    vehicle = results["vehicle"]["name"]
    return [
        "`continuair paper --out results/paper` judges every sentence (here with vehicle "
        f"`{vehicle}`). `continuair paper --only table` flies Table I, and "
        "`continuair paper --only III-C.8` judges one sentence. `python -m research.paper_table` "
        "searches for vehicles.",
    ]


def by_part(results: dict[str, Any]) -> list[str]:
    """Return the lines of a table of how many sentences of each part got which verdict."""
    rows = []
    for part, title in PARTS.items():
        here = [e["verdict"] for e in results["sentences"] if e["id"].partition(".")[0] == part]
        if here:
            cells = [str(Counter(here)[verdict] or "") for verdict in CLASSES]
            name = part if part == title else f"{part}: {title}"
            rows.append([name, str(len(here)), *cells])
    total = Counter(entry["verdict"] for entry in results["sentences"])
    rows.append(["all", str(total.total()), *(str(total[verdict]) for verdict in CLASSES)])
    return as_markdown(("part", "sentences", *CLASSES.values()), rows, ("part",))
