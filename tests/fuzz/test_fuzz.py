"""A few seconds of what `make soak` does for hours."""

from pathlib import Path

import pytest

from tests.fuzz.domains import DOMAINS
from tests.fuzz.trial import USED, Tally, attempt_many

FEW = {"vehicles": 300, "designs": 160, "gains": 400, "recordings": 400, "calls": 160,
       "changes": 500}  # fmt: skip
"""Tries of half a second each."""


def assert_clean(domain: str, seeds: range, folder: Path) -> None:
    tally = Tally()
    attempt_many(DOMAINS[domain], seeds, folder, tally)
    assert tally.counts[USED] > 0, "no mutation is used: the tries say nothing"
    assert not tally.found, tally.found[0]


@pytest.mark.parametrize("domain", DOMAINS)
def test_what_comes_in_is_used_or_refused_in_a_sentence(domain: str, tmp_path: Path) -> None:
    assert_clean(domain, range(FEW[domain]), tmp_path)


@pytest.mark.soak
@pytest.mark.parametrize("domain", DOMAINS)
def test_much_that_comes_in_is_used_or_refused(domain: str, tmp_path: Path) -> None:
    assert_clean(domain, range(FEW[domain], 50 * FEW[domain]), tmp_path)
