"""Whether the flights of the letters depend on their integration step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from continuair.flight.resolution import RESOLVED
from continuair.kernels.dynamics import PLANTS
from continuair.kernels.step import OK
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.words import NEGLIGIBLE
from continuair.studies.verdicts import UNDECIDED, Judgement


def if_settled(judge: Callable[[Evidence], Judgement]) -> Callable[[Evidence], Judgement]:
    """Return a judge that is undecided where steps do not resolve a flight of the letters.

    They do not if its step_error is large, or if half the step changes the error of a flight that
    came to its end by a tenth.
    """

    def judged_of(evidence: Evidence) -> Judgement:
        found = judge(evidence)
        hang = [
            f"{name}, {plant}"
            for name, entry in evidence.letter.results["letters"].items()
            for plant in PLANTS
            if _hangs(entry[plant])
        ]
        if not hang:
            return found
        note = f"The integration step changes {'; '.join(hang)} too much to decide"
        told = f"{found.evidence}. {note}"
        return replace(
            found,
            verdict=UNDECIDED,
            evidence=told,
            note=". ".join(filter(None, (found.note, note))),
        )

    return judged_of


def _hangs(flight: dict[str, Any]) -> bool:
    if flight["step_error"] > RESOLVED:
        return True
    return flight["status"] == OK and not flight["step_halving_error"] < NEGLIGIBLE
