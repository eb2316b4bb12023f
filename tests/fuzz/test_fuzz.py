"""A few seconds of what `make soak` does for hours; the longer part is run with the slow tests."""

from pathlib import Path

import pytest

from tests.fuzz.domains import DOMAINS
from tests.fuzz.trial import USED, Tally, attempt_many

FEW = {"vehicles": 1500, "designs": 800, "gains": 2000, "recordings": 2000, "calls": 800,
       "changes": 2500}  # fmt: skip
"""Tries of some two seconds each."""


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
    assert_clean(domain, range(FEW[domain], 10 * FEW[domain]), tmp_path)
