"""Whether the flights of the letters hang on their step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from continuair.flight.resolution import RESOLVED
from continuair.kernels.dynamics import PLANTS
from continuair.kernels.step import OK
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.words import NEGLIGIBLE
from continuair.studies.verdicts import UNDECIDED, Judgement


def if_settled(judge: Callable[[Evidence], Judgement]) -> Callable[[Evidence], Judgement]:
    """The judge of what rests on the letters: undecided where steps do not resolve a flight, or
    half of them change the error of one that came to its end by a tenth."""

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
        told = f"{found.evidence}; that hangs on the step of {'; '.join(hang)}"
        return Judgement(UNDECIDED, told, found.numbers, found.times)

    return judged_of


def _hangs(flight: dict[str, Any]) -> bool:
    if flight["step_error"] > RESOLVED:
        return True
    return flight["status"] == OK and not flight["step_halving_error"] < NEGLIGIBLE
