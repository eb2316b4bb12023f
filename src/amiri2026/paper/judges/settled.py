"""Whether the flights of the letters are resolved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from amiri2026.paper.evidence import Evidence
from amiri2026.verdicts import UNDECIDED, Judgement
from continuair.flight import RESOLVED
from continuair.kernels import PLANTS


def if_settled(judge: Callable[[Evidence], Judgement]) -> Callable[[Evidence], Judgement]:
    """Return a judge that is undecided where a flight of the letters is not resolved."""

    def judged_of(evidence: Evidence) -> Judgement:
        found = judge(evidence)
        coarse = [
            f"{name}, {plant}"
            for name, entry in evidence.letter.results["letters"].items()
            for plant in PLANTS
            if entry[plant]["error_estimate"] > RESOLVED
        ]
        if not coarse:
            return found
        note = f"Not resolved, so that nothing is decided: {'; '.join(coarse)}"
        told = f"{found.evidence}. {note}"
        return replace(
            found,
            verdict=UNDECIDED,
            evidence=told,
            note=". ".join(filter(None, (found.note, note))),
        )

    return judged_of
