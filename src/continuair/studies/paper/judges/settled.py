"""Whether the flights of the letters hang on their step."""

from __future__ import annotations

from collections.abc import Callable

from continuair.kernels.dynamics import PLANTS
from continuair.kernels.step import OK
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.words import NEGLIGIBLE
from continuair.studies.verdicts import UNDECIDED, Judgement


def if_settled(judge: Callable[[Evidence], Judgement]) -> Callable[[Evidence], Judgement]:
    """The judge of what rests on the letters: undecided where half the step changes the error of a
    flight that came to its end by a tenth."""

    def judged_of(evidence: Evidence) -> Judgement:
        found = judge(evidence)
        hang = [
            f"{name}, {plant}"
            for name, entry in evidence.letter.results["letters"].items()
            for plant in PLANTS
            if entry[plant]["status"] == OK and not entry[plant]["step_halving_error"] < NEGLIGIBLE
        ]
        if not hang:
            return found
        told = f"{found.evidence}; that hangs on the step of {'; '.join(hang)}"
        return Judgement(UNDECIDED, told, found.numbers, found.times)

    return judged_of
