"""A verdict on a sentence of the paper, and the numbers behind it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

REPRODUCED, NOT_REPRODUCED, UNDECIDED = "reproduced", "not reproduced", "cannot be decided"

VERDICTS = (REPRODUCED, NOT_REPRODUCED, UNDECIDED)


_NAN = re.compile(r"\bnan\b")


@dataclass(frozen=True)
class Judgement:
    """A verdict, what it rests on in words, and its numbers by name.

    numbers: the same on every machine, to a few percent, so that a later run can be held against
    them; units are in their names. times: measured here and now, which no run is held against.
    """

    verdict: str
    evidence: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    times: Mapping[str, float] = field(default_factory=dict)


def judged(holds: bool, evidence: str, **numbers: float) -> Judgement:
    """Return the judgement of what is either so or not.

    Where a number is NaN, or one that the evidence tells, as of flights that ended early, neither
    is known.
    """
    if any(math.isnan(number) for number in numbers.values()) or _NAN.search(evidence):
        told = f"{evidence}; what is nan is of flights that ended early, or that no step resolved"
        return Judgement(UNDECIDED, told, numbers)
    return Judgement(REPRODUCED if holds else NOT_REPRODUCED, evidence, numbers)


def judged_alike(holds: Iterable[bool], evidence: str, **numbers: float) -> Judgement:
    """Return the judgement of what is so or not with each of the values that it may have."""
    every = list(holds)
    if any(every) == all(every):
        return judged(all(every), evidence, **numbers)
    told = f"{evidence}; that hangs on the step of flights that have not converged"
    return Judgement(UNDECIDED, told, numbers)


def all_of(parts: Sequence[Judgement], note: str = "") -> Judgement:
    """Return the judgement of a sentence from those of its parts: it holds only if all of them do.

    Its evidence tells the parts' verdicts one by one, and ends with the note.
    """
    several = len(parts) > 1
    told = [f"{part.evidence} ({part.verdict})" if several else part.evidence for part in parts]
    told = [sentence_case(text) for text in told]
    numbers = {name: value for part in parts for name, value in part.numbers.items()}
    times = {name: value for part in parts for name, value in part.times.items()}
    evidence = ". ".join([*told, note] if note else told)
    return Judgement(_combined([part.verdict for part in parts]), evidence, numbers, times)


def sentence_case(text: str) -> str:
    """Return a text with a capital at its beginning, but a Greek letter as it is: κ is no K."""
    first = text[:1]
    return first.upper() + text[1:] if first.isascii() else text


def _combined(verdicts: Sequence[str]) -> str:
    if NOT_REPRODUCED in verdicts:
        return NOT_REPRODUCED
    return UNDECIDED if UNDECIDED in verdicts or not verdicts else REPRODUCED
