"""How a claim about a sweep is judged: verdicts with the numbers behind them.

A trend is judged twice: on the few values that the paper compares, and by Spearman's rank
correlation over many values between them, because a few values may show a trend by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import spearmanr

from amiri2026.sensitivity.task import PARAMETERS
from amiri2026.verdicts import FAILS, HOLDS, UNDECIDED, Judgement
from continuair.kernels import PLANTS

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

    at_few = trend_of_few(sweep, measure, sense)

    def check(sweeps: dict[str, Any]) -> Judgement:
        few = at_few(sweeps)
        rho = correlation(sweeps, sweep, measure)
        many = len(sweeps[sweep]["between"]["value"])
        evidence = f"{few.evidence}; rank correlation {rho:+.2f} over {many} values"
        numbers = {**few.numbers, f"rank correlation of the {NAMES[measure]}": rho}
        verdict = few.verdict
        supported, refuted = sense * rho >= STRONG, sense * rho <= WEAK
        if (few.verdict == HOLDS and not supported) or (few.verdict == FAILS and not refuted):
            verdict = UNDECIDED
        return Judgement(verdict, evidence, numbers)

    return check


def trend_of_few(sweep: str, measure: str, sense: int) -> Check:
    """Return the check that a measure rises or falls over the few values alone; as `trend`."""

    def check(sweeps: dict[str, Any]) -> Judgement:
        rows = sweeps[sweep]["rows"]
        few, labels = column(rows, measure), [row["label"] for row in rows]
        evidence = f"{NAMES[measure]} {listed(few)} {UNITS[measure]} at {', '.join(labels)}"
        numbers = {_name(measure, label): x for label, x in zip(labels, few, strict=True)}
        verdict = HOLDS if bool(follows(few, sense)) else FAILS
        return if_converged([sweeps[sweep]], Judgement(verdict, evidence, numbers))

    return check


def follows(numbers: ArrayLike, sense: int) -> NDArray[np.bool_]:
    """Return whether rows of numbers (..., n) rise (sense 1) or fall (-1), apart from ties."""
    found = np.asarray(numbers, float)

    def moves(a: Any, b: Any, least: float) -> NDArray[np.bool_]:
        return np.asarray(sense * (b - a) > least * np.maximum(np.abs(a), np.abs(b)))

    steps = moves(found[..., :-1], found[..., 1:], -TIE).all(axis=-1)
    return np.asarray(steps & moves(found[..., 0], found[..., -1], TIE))


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
            f"error {listed(few)} m at {', '.join(row['label'] for row in rows)}, largest at "
            f"{where}; over {len(many)} values it is largest, {max(many):.3g} m, at {peak:.3g} "
            f"{sweeps[sweep]['units']}"
        )
        numbers = {_name("error", row["label"]): x for row, x in zip(rows, few, strict=True)}
        numbers |= {f"largest error is at [{sweeps[sweep]['units']}]": peak}
        return if_converged([sweeps[sweep]], Judgement(_agreed(ends), evidence, numbers))

    return check


def at_most(
    value: Callable[[dict[str, Any]], tuple[Sequence[float], bool]], limit: float, text: str
) -> Check:
    """Return the check that all numbers of `value` are at most `limit`.

    value: from the sweeps to numbers, and whether the rows that they come from have converged.
    text: their meaning, with {} for the numbers.
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
        return found if usable else _unconverged(found)

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
            f"the error varies by {few[sweep]:.3g} m over the {sweep}, rank {ranks[0]} of "
            f"{len(few)} from the least (least: {min(few, key=lambda name: few[name])}). Between "
            f"the 10th and the 90th percentile of many values it varies by {many[sweep]:.3g} m, "
            f"rank {ranks[1]} (least: {min(many, key=lambda name: many[name])})"
        )
        numbers = {f"spread of the error over the {name} [m]": few[name] for name in few}
        found = Judgement(_agreed([rank == 1 for rank in ranks]), evidence, numbers)
        return if_converged(every.values(), found)

    return check


def goes_with(measure: str, names: Sequence[str] = tuple(PARAMETERS)) -> Check:
    """Return the check that over sweeps, all by default, the error rises with a measure."""

    def check(sweeps: dict[str, Any]) -> Judgement:
        every = [sweeps[name]["between"] for name in names]
        x = [value for between in every for value in column_between(between, measure)]
        y = [value for between in every for value in column_between(between, "error")]
        rho = rank_correlation(x, y)
        verdict = HOLDS if rho >= STRONG else FAILS if rho <= WEAK else UNDECIDED
        found = Judgement(
            verdict,
            f"rank correlation of the error with the {NAMES[measure]} {rho:+.2f} over {len(x)} "
            "flights",
            {f"rank correlation with the {NAMES[measure]}": rho},
        )
        return if_converged([sweeps[name] for name in names], found)

    return check


def _agreed(holds: Sequence[Any]) -> str:
    """Return verdict of several views of one claim, which may disagree."""
    if any(holds) != all(holds):
        return UNDECIDED
    return HOLDS if all(holds) else FAILS


def correlation(sweeps: dict[str, Any], sweep: str, measure: str) -> float:
    """Return the rank correlation of a measure with the parameter over many values."""
    between = sweeps[sweep]["between"]
    return rank_correlation(between["value"], column_between(between, measure))


def rank_correlation(x: ArrayLike, y: ArrayLike) -> float:
    """Return Spearman's rank correlation; 0 where one of the two does not vary."""
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        return 0.0
    return float(spearmanr(x, y).statistic)


def restricted(sweep: dict[str, Any], least: float) -> dict[str, Any]:
    """Return the part of a sweep with values from `least` on."""
    between = sweep["between"]
    kept = [run for run, value in enumerate(between["value"]) if value >= least]

    def part(found: Any) -> Any:
        if isinstance(found, dict):
            return {key: part(column) for key, column in found.items()}
        return [found[run] for run in kept]

    per_value = {key: part(each) for key, each in between.items() if key not in _NOT_PER_VALUE}
    rows = [row for row in sweep["rows"] if row["value"] >= least]
    return sweep | {"rows": rows, "between": per_value}


_NOT_PER_VALUE = ("ended_early", "unresolved", "follows")


def converged(sweep: dict[str, Any]) -> bool:
    """Return whether no row of a sweep is an error of the integration."""
    return all(row["models"][model]["converged"] for row in sweep["rows"] for model in PLANTS)


def if_converged(sweeps: Iterable[dict[str, Any]], found: Judgement) -> Judgement:
    """Return a judgement from sweeps, undecided if a row has not converged."""
    return found if all(converged(sweep) for sweep in sweeps) else _unconverged(found)


def _unconverged(found: Judgement) -> Judgement:
    told = f"{found.evidence}; some of these flights have not converged"
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
    "inertia_change": "(share of the whole)",
}
