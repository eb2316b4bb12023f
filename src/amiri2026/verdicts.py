"""Verdicts on the sentences of the paper, and the numbers behind them.

A view is a sentence tested with one vehicle under one reading: it holds, fails, or is undecided.
The verdict on a sentence is one of CLASSES, made from its views.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

HOLDS, FAILS = "holds", "fails"
MISPRINT, DEPENDS, UNTESTABLE, UNDECIDED = "misprint", "depends", "untestable", "undecided"

CLASSES = {
    HOLDS: "holds",
    MISPRINT: "wrong as printed",
    DEPENDS: "depends on what is not printed",
    UNTESTABLE: "cannot be tested here",
    UNDECIDED: "two views disagree",
}
"""Verdicts on sentences, and their meanings."""

_NAN = re.compile(r"\bnan\b")


@dataclass(frozen=True)
class Judgement:
    """A verdict, the finding in words, and its numbers by name.

    verdict: of a view HOLDS, FAILS or UNDECIDED; of a sentence one of CLASSES. numbers: the same on
    every machine to a few percent, so that a later run can be compared with them; units are in
    their names. times: measured on this machine. correction: of a misprint, the right form, with
    the residuals of both. cases: views of a sentence; note: a remark on all of them.
    """

    verdict: str
    evidence: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)
    correction: str = ""
    cases: tuple[Case, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Case:
    """A view of a sentence: the vehicle by name, the reading in words, and the finding."""

    vehicle: str
    reading: str
    found: Judgement


def judged(holds: bool, evidence: str, **numbers: float) -> Judgement:
    """Return the judgement of a view; it is undecided if a number or the evidence has a NaN."""
    if any(math.isnan(number) for number in numbers.values()) or _NAN.search(evidence):
        told = f"{evidence}; nan marks flights that stopped early or did not converge"
        return Judgement(UNDECIDED, told, numbers)
    return Judgement(HOLDS if holds else FAILS, evidence, numbers)


def judged_alike(holds: Iterable[bool], evidence: str, **numbers: float) -> Judgement:
    """Return the judgement of a view whose numbers have several possible values."""
    every = list(holds)
    if any(every) == all(every):
        return judged(all(every), evidence, **numbers)
    told = f"{evidence}; the verdict changes with the step of flights that have not converged"
    return Judgement(UNDECIDED, told, numbers)


def all_of(parts: Sequence[Judgement], note: str = "") -> Judgement:
    """Return the judgement of a view from those of its parts: it holds only if all of them do.

    The evidence lists the parts one by one, with their verdicts, and ends with the note.
    """
    several = len(parts) > 1
    told = [f"{part.evidence} ({part.verdict})" if several else part.evidence for part in parts]
    told = [sentence_case(text) for text in told]
    numbers = {name: value for part in parts for name, value in part.numbers.items()}
    times = {name: value for part in parts for name, value in part.times.items()}
    evidence = ". ".join([*told, note] if note else told)
    return Judgement(_combined([part.verdict for part in parts]), evidence, numbers, times)


def or_misprint(found: Judgement, correction: str) -> Judgement:
    """Return the judgement of an equation: a misprint where it fails, with what would be right."""
    if found.verdict != FAILS:
        return found
    return replace(found, verdict=MISPRINT, correction=sentence_case(correction))


def over_cases(cases: Sequence[Case], note: str = "") -> Judgement:
    """Return the judgement of a sentence from its views: it depends unless it holds in all.

    Numbers carry the vehicle and reading of their case where several cases give them.
    """
    verdicts = [case.found.verdict for case in cases]
    verdict = DEPENDS if FAILS in verdicts else _combined(verdicts)
    told = [f"for {case.vehicle}, {case.reading}: {case.found.evidence} ({case.found.verdict})"
            for case in cases]  # fmt: skip
    numbers = {
        f"{case.vehicle}, {case.reading}: {name}": value
        for case in cases
        for name, value in case.found.numbers.items()
    }
    times = {name: value for case in cases for name, value in case.found.times.items()}
    evidence = sentence_case("; ".join(told)) + (f". {note}" if note else "")
    return Judgement(verdict, evidence, numbers, times, "", tuple(cases), note)


def untestable(evidence: str, **times: float) -> Judgement:
    """Return the judgement of a sentence that cannot be tested here, with the reason."""
    return Judgement(UNTESTABLE, evidence, times=times)


def sentence_case(text: str) -> str:
    """Return a text with a capital at its beginning, but a Greek letter as it is: κ is no K."""
    first = text[:1]
    return first.upper() + text[1:] if first.isascii() else text


def _combined(verdicts: Sequence[str]) -> str:
    if FAILS in verdicts:
        return FAILS
    return HOLDS if verdicts and set(verdicts) == {HOLDS} else UNDECIDED
