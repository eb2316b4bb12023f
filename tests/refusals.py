"""Assertions about refusals: the field, and one plain sentence with its value and a remedy."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from continuair.errors import InputError


@contextmanager
def refused(
    field: str, kind: type[InputError] = InputError, *, place: str | Path | None = None
) -> Iterator[pytest.ExceptionInfo[InputError]]:
    """Expect an InputError about this field, in this place if one is given, in the block."""
    with pytest.raises(kind) as caught:
        yield caught
    assert caught.value.field == field, str(caught.value)
    assert place is None or caught.value.place == str(place), str(caught.value)
    assert_plain(caught.value)


def assert_plain(error: InputError) -> None:
    """Assert that an error is one sentence for people, with a problem and a remedy."""
    assert len(error.errors) == 1
    assert error.field and error.problem and error.remedy
    _assert_sentence(str(error))


def assert_refused(
    result: Any, field: str, *facts: str, place: str | Path | None = None, stdout: str = ""
) -> None:
    """Assert that a command refused this field in one sentence, which holds these facts.

    Facts are values, names of files and words to type; `place` is what the field is in, "" if it
    is in nothing and None if any will do.
    """
    assert result.exit_code == 2, result.output
    assert result.stdout == stdout
    said = result.stderr.strip()
    before = "(.+: )?" if place is None else re.escape(f"{place}: " if place else "")
    assert re.match(f"{before}{re.escape(field)} ", said), said
    _assert_sentence(said)
    for fact in facts:
        assert fact in said


def numbers_of(text: str) -> list[float]:
    """Return the numbers in a text."""
    return [float(each) for each in re.findall(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?", text)]


def _assert_sentence(text: str) -> None:
    assert "\n" not in text
    assert text.endswith(".") and not text.endswith("..")
    assert not re.search(r"pydantic|https?:|Input should|validation error|Traceback| 0x", text)
