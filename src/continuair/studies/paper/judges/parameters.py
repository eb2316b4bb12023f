"""Judges of the section on parameter sensitivity, IV-B: by both readings of its f."""

from __future__ import annotations

from continuair.studies.paper.evidence import Evidence, NotFlown
from continuair.studies.sensitivity.claims import CLAIMS, judgement
from continuair.studies.verdicts import Judgement


def _judge(evidence: Evidence, name: str) -> Judgement:
    """By the printed sin(f t); the verdict with f in Hz is told beside it."""
    found = judgement(evidence.sensitivity.results, name)
    try:
        other = judgement(evidence.sensitivity_hertz.results, name)
    except NotFlown:
        return found
    told = f"{found.evidence}. With f in Hz, sin(2π f t): {other.verdict}"
    numbers = {f"sin(f t): {key}": value for key, value in found.numbers.items()}
    numbers |= {f"sin(2π f t): {key}": value for key, value in other.numbers.items()}
    return Judgement(found.verdict, told, numbers)


JUDGES = {name: lambda evidence, name=name: _judge(evidence, name) for name in CLAIMS}
"""Judge of every sentence of the section, by its id."""
