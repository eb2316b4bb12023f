"""The paper, sentence by sentence: claims and verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from amiri2026.paper.evidence import CannotBeFlown, Evidence, Keep
from amiri2026.paper.judging import TABLE_SENTENCE, chosen_sentences, judge
from continuair import Vehicle
from continuair.progress import Progress


def paper(
    vehicle: Vehicle,
    only: Iterable[str] | None = None,
    *,
    quick: bool = False,
    progress: Progress | None = None,
    keep: Keep | None = None,
    before_timing: Callable[[], None] | None = None,
) -> dict[str, Any]:
    """Judge the sentences of the paper by a vehicle; return them with verdicts, JSON-able.

    only: ids of sentences or parts of the paper, such as "III-C.8" or "IV-B". quick: without long
    studies, so that some are not judged. progress, keep, before_timing: as for Evidence. Studies
    run when a sentence first needs them. Raises InputError.
    """
    names = chosen_sentences(only)
    evidence = Evidence(
        vehicle, quick=quick, progress=progress, keep=keep, before_timing=before_timing
    )
    if only is None:
        # The first thing: nothing is being written yet that it would have to wait for.
        with suppress(CannotBeFlown):
            _ = evidence.cost
    found = list(judge(names, evidence))
    table = {"table1": evidence.table} if TABLE_SENTENCE in names else {}
    return {
        "study": "paper",
        "vehicle": vehicle.describe(),
        "quick": quick,
        "counts": dict(Counter(entry["verdict"] for entry in found)),
        **table,
        "sentences": found,
    }
