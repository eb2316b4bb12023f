"""Judges of sentences, by id."""

from __future__ import annotations

from collections.abc import Callable

from continuair.studies.paper.evidence import Evidence
from continuair.studies.verdicts import Judgement

JUDGES: dict[str, Callable[[Evidence], Judgement]] = {}
