"""How a claim about a sweep is judged: verdicts with the numbers behind them.

A trend is judged twice: on the few values that the paper compares, and by Spearman's rank
correlation over many values between them, because a few values may show a trend by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import spearmanr

from continuair.kernels.dynamics import PLANTS
from continuair.studies.sensitivity.task import PARAMETERS
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, UNDECIDED, Judgement

STRONG, WEAK = 0.5, 0.2
"""A rank correlation in the claimed sense supports it from STRONG on, and does not up to WEAK."""

TIE = 0.01
"""Values that differ by less than this share count as equal."""


Check = Callable[[dict[str, Any]], Judgement]
"""From the results' sweeps to a judgement; KeyError where a sweep was not flown."""


def trend(sweep: str, measure: str, sense: int) -> Check:
    """Return the check that a measure rises (sense 1) or falls (-1) with the parameter.

    measure: of MEASURES, a column of a row, or "error", the horizontal RMSE of the tip, decoupled.
    """

    def check(sweeps: dict[str, Any]) -> Judgement:
        few = column(sweeps[sweep]["rows"], measure)
        rho = correlation(sweeps, sweep, measure)
        pairs = zip(few, few[1:], strict=False)
        steps = [sense * (b - a) > -TIE * max(abs(a), abs(b)) for a, b in pairs]
        ends = sense * (few[-1] - few[0]) > TIE * max(abs(few[0]), abs(few[-1]))
        holds = all(steps) and ends
        labels = [row["label"] for row in sweeps[sweep]["rows"]]
        many = len(sweeps[sweep]["between"]["value"])
        evidence = (
            f"{NAMES[measure]} {listed(few)} {UNITS[measure]} at {', '.join(labels)}; "
            f"rank correlation {rho:+.2f} over {many} values"
        )
        numbers = {_name(measure, label): x for label, x in zip(labels, few, strict=True)}
        numbers[f"rank correlation of the {NAMES[measure]}"] = rho
        found = Judgement(_trend_verdict(holds, sense * rho), evidence, numbers)
        return if_converged([sweeps[sweep]], found)

    return check


def _trend_verdict(holds: bool, rho: float) -> str:
    if holds and rho >= STRONG:
        return REPRODUCED
    return NOT_REPRODUCED if not holds and rho <= WEAK else UNDECIDED


def largest_above_the_middle(sweep: str) -> Check:
    """Return the check that the error is largest in the upper half of the range."""

    def check(sweeps: dict[str, Any]) -> Judgement:
        rows = sweeps[sweep]["rows"]
        few = column(rows, "error")
        between = sweeps[sweep]["between"]
        many = column_between(between, "error")
        where = rows[int(np.argmax(few))]["label"]
        peak = sweeps[sweep]["scale"] * between["value"][int(np.argmax(many))]
        # Of all values tried: those that are left out may be on one side.
        tried = sorted([*between["value"], *between["ended_early"], *between["unresolved"]])
        place = tried.index(between["value"][int(np.argmax(many))])
        ends = (np.argmax(few) >= (len(few) - 1) / 2, place >= (len(tried) - 1) / 2)
        evidence = (
            f"error {listed(few)} m at {', '.join(row['label'] for row in rows)}, the largest at "
            f"{where}; over {len(many)} values the largest, "
            f"{max(many):.3g} m, is at {peak:.3g} {sweeps[sweep]['units']}"
        )
        numbers = {_name("error", row["label"]): x for row, x in zip(rows, few, strict=True)}
        numbers |= {f"largest error is at [{sweeps[sweep]['units']}]": peak}
        return if_converged([sweeps[sweep]], Judgement(_agreed(ends), evidence, numbers))

    return check


def at_most(
    value: Callable[[dict[str, Any]], tuple[Sequence[float], bool]], limit: float, text: str
) -> Check:
    """Return the check that all numbers that `value` gives are at most `limit`.

    value: from the sweeps to numbers, and whether the rows that they come from have converged.
    text: what they are, with {} for the numbers.
    """
    return _bounded(value, lambda number: number <= limit, f"{text} (limit {limit:g})")


def at_least(
    value: Callable[[dict[str, Any]], tuple[Sequence[float], bool]], limit: float, text: str
) -> Check:
    """Return the check that all numbers that `value` gives are at least `limit`; as `at_most`."""
    return _bounded(value, lambda number: number >= limit, f"{text} (limit {limit:g})")


def _bounded(value: Any, holds: Callable[[float], bool], text: str) -> Check:
    def check(sweeps: dict[str, Any]) -> Judgement:
        numbers, usable = value(sweeps)
        verdict = _agreed([all(holds(number) for number in numbers)])
        name = text.partition(" (limit")[0].format("…")
        named = {f"{name} ({i + 1})": number for i, number in enumerate(numbers)}
        if len(numbers) == 1:
            named = {name: numbers[0]}
        found = Judgement(verdict, text.format(listed(numbers)), named)
        return found if usable else _hanging(found)

    return check


def least_spread(sweep: str) -> Check:
    """Return the check that the error varies less over this sweep than over every other one."""

    def check(sweeps: dict[str, Any]) -> Judgement:
        every = {name: sweeps[name] for name in PARAMETERS}
        few = {name: np.ptp(column(part["rows"], "error")) for name, part in every.items()}
        many = {
            name: np.ptp(np.quantile(column_between(part["between"], "error"), (0.1, 0.9)))
            for name, part in every.items()
        }
        ranks = [1 + sorted(found.values()).index(found[sweep]) for found in (few, many)]
        evidence = (
            f"the error varies by {few[sweep]:.3g} m, rank {ranks[0]} of {len(few)} from the least "
            f"(least: {min(few, key=lambda name: few[name])}); over many values, from the 10th to "
            f"the 90th percentile, by {many[sweep]:.3g} m, rank {ranks[1]} "
            f"(least: {min(many, key=lambda name: many[name])})"
        )
        numbers = {f"spread of the error over the {name} [m]": few[name] for name in few}
        found = Judgement(_agreed([rank == 1 for rank in ranks]), evidence, numbers)
        return if_converged(every.values(), found)

    return check


def goes_with(measure: str) -> Check:
    """Return the check that over all sweeps the error goes with a measure of the flight."""

    def check(sweeps: dict[str, Any]) -> Judgement:
        every = [sweeps[name]["between"] for name in PARAMETERS]
        x = [value for between in every for value in column_between(between, measure)]
        y = [value for between in every for value in column_between(between, "error")]
        rho = rank_correlation(x, y)
        verdict = REPRODUCED if rho >= STRONG else NOT_REPRODUCED if rho <= WEAK else UNDECIDED
        found = Judgement(
            verdict,
            f"rank correlation of the error with the {NAMES[measure]} {rho:+.2f} over {len(x)} "
            "flights of all sweeps",
            {f"rank correlation with the {NAMES[measure]}": rho},
        )
        return if_converged([sweeps[name] for name in PARAMETERS], found)

    return check


def _agreed(holds: Sequence[Any]) -> str:
    """Verdict of several views of one claim, which may disagree."""
    if any(holds) != all(holds):
        return UNDECIDED
    return REPRODUCED if all(holds) else NOT_REPRODUCED


def correlation(sweeps: dict[str, Any], sweep: str, measure: str) -> float:
    """Return the rank correlation of a measure with the parameter over many values."""
    between = sweeps[sweep]["between"]
    return rank_correlation(between["value"], column_between(between, measure))


def rank_correlation(x: ArrayLike, y: ArrayLike) -> float:
    """Return Spearman's rank correlation; 0 where one of the two does not vary."""
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        return 0.0
    return float(spearmanr(x, y).statistic)


def converged(sweep: dict[str, Any]) -> bool:
    """Tell whether no row of a sweep is an error of the integration."""
    return all(row["models"][model]["converged"] for row in sweep["rows"] for model in PLANTS)


def if_converged(sweeps: Iterable[dict[str, Any]], found: Judgement) -> Judgement:
    """Return a judgement that rests on sweeps, undecided if a row has not converged."""
    return found if all(converged(sweep) for sweep in sweeps) else _hanging(found)


def _hanging(found: Judgement) -> Judgement:
    told = f"{found.evidence}; that rests on flights that have not converged"
    return Judgement(UNDECIDED, told, found.numbers)


def column(rows: list[dict[str, Any]], measure: str) -> list[float]:
    """Return a measure of every row."""
    if measure == "error":
        return [row["models"]["decoupled"]["rmse_xy_m"] for row in rows]
    return [row[measure] for row in rows]


def column_between(between: dict[str, Any], measure: str) -> list[float]:
    """Return a measure of every value between."""
    found: list[float] = (
        between["rmse_xy_m"]["decoupled"] if measure == "error" else between[measure]
    )
    return found


def _name(measure: str, label: str) -> str:
    return f"{NAMES[measure]} at {label} [{UNITS[measure]}]"


def listed(numbers: Iterable[float]) -> str:
    """Return numbers as evidence prints them."""
    return ", ".join(f"{number:.3g}" for number in numbers)


NAMES = {
    "error": "error",
    "mass_kg": "mass of the vehicle",
    "arm_inertia_kg_m2": "arm's inertia",
    "displacement_m": "displacement",
    "oscillation_m": "oscillation",
    "largest_bend_1_m": "largest bend",
    "com_travel_m": "travel of the centre of mass",
    "inertia_change": "change of the inertia",
}
"""Measure -> what evidence calls it; "error" is the horizontal RMSE of the tip, decoupled."""

UNITS = {
    "error": "m",
    "mass_kg": "kg",
    "arm_inertia_kg_m2": "kg m²",
    "displacement_m": "m",
    "oscillation_m": "m",
    "largest_bend_1_m": "1/m",
    "com_travel_m": "m",
    "inertia_change": "(share)",
}
