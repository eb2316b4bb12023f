"""The judge of each sentence of the paper, and the content of a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from amiri2026.paper.evidence import CannotBeFlown, Evidence, NotFlown
from amiri2026.paper.judges import (
    closed_loop,
    dynamics,
    image,
    kinematics,
    law,
    open_loop,
    open_loop_errors,
    parameters,
    summary,
)
from amiri2026.sentences import MERGED, PARTS, sentences
from amiri2026.verdicts import UNDECIDED, Judgement, sentence_case
from continuair import checks

NOT_JUDGED = "not judged"
"""Verdict on a sentence whose evidence a quick run leaves out."""

TABLE_SENTENCE = "IV-A.T1"
"""The sentence that is Table I."""

Judge = Callable[[Evidence], Judgement]

JUDGES: dict[str, Judge] = {
    **kinematics.JUDGES,
    **dynamics.JUDGES,
    **image.JUDGES,
    **law.JUDGES,
    **open_loop.JUDGES,
    **open_loop_errors.JUDGES,
    **parameters.JUDGES,
    **closed_loop.JUDGES,
    **summary.JUDGES,
}
"""Judge of every sentence, by its id."""


def chosen_sentences(only: Iterable[str] | None = None) -> list[str]:
    """Return ids of sentences, in the order of the paper: all, or those named, or of parts named.

    only: ids such as "III-C.8", or parts such as "III-C", or "table", the sentence of Table I.
    Raises InputError for an unknown one.
    """
    listed = sentences()
    if only is None:
        return list(listed)
    parts = {name: [id for id in listed if listed[id].part == name] for name in PARTS}
    parts["table"] = [TABLE_SENTENCE]
    named = checks.choices("only", only, [*parts, *listed, *MERGED])
    wanted = {id for name in named for id in parts.get(name, [MERGED.get(name, name)])}
    return [id for id in listed if id in wanted]


def judge(names: Iterable[str], evidence: Evidence) -> Iterator[dict[str, Any]]:
    """Yield each sentence's claim, verdict, evidence and numbers."""
    listed = sentences()
    for name in names:
        sentence = listed[name]
        try:
            found = JUDGES[name](evidence)
        except NotFlown as missing:
            found = Judgement(NOT_JUDGED, f"a quick run leaves out {missing}")
        except CannotBeFlown as reason:
            found = Judgement(UNDECIDED, str(reason))
        yield vars(sentence) | _described(found)


def _described(found: Judgement) -> dict[str, Any]:
    """Return a judgement in types of JSON."""
    cases = [
        {"vehicle": case.vehicle, "reading": case.reading, "verdict": case.found.verdict,
         "evidence": case.found.evidence}
        for case in found.cases
    ]  # fmt: skip
    return vars(found) | {"evidence": sentence_case(found.evidence), "cases": cases}
