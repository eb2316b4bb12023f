"""The sentences of the paper that claim something, as sentences.toml lists them."""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass
from importlib import resources


@dataclass(frozen=True)
class Sentence:
    """A sentence of Amiri et al.: its place, a short quotation, and its criterion.

    id: part of the paper and number of the sentence in it. claims, measure, criterion: in our words
    its claim, the quantity measured, and when that reproduces it.
    """

    id: str
    quote: str
    claims: str
    measure: str
    criterion: str

    @property
    def part(self) -> str:
        """The part of the paper that it stands in."""
        return self.id.partition(".")[0]


PARTS = {
    "Abstract": "Abstract",
    "III-A": "Single-Section CR Differential Kinematics",
    "III-B": "ACM Differential Kinematics",
    "III-C": "ACM Dynamics",
    "III-D": "DPD-SM-IBVS Control Design",
    "IV": "Results",
    "IV-A": "Open-Loop Response Analysis",
    "IV-B": "Parameter Sensitivity Analysis",
    "IV-C": "Closed-loop Visual Tracking Analysis",
    "V": "Conclusions",
    "App-A": "The geometric Jacobian of the CR",
    "App-B": "The off-diagonal elements of the dynamics matrices",
}
"""Parts of the paper with their titles, in order."""

MERGED = {
    "III-B.4": "III-B.3",
    "III-C.6": "III-C.3",
    "IV-A.6": "III-C.3",
    "App-B.2": "App-B.1",
    "III-D.20": "III-D.13",
    "V.9": "IV-B.18",
}
"""Names of sentences that share a misprint or a claim with another -> the name of that one."""


@functools.cache
def sentences() -> dict[str, Sentence]:
    """Return the sentences by id, in the order of the paper."""
    text = resources.files("amiri2026").joinpath("sentences.toml").read_text("utf-8")
    return {row["id"]: Sentence(**row) for row in tomllib.loads(text)["sentence"]}
