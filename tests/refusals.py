"""What every refusal has: a field, and one plain sentence with its value and a remedy."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from continuair.errors import InputError


@contextmanager
def refused(field: str, kind: type[InputError] = InputError) -> Iterator[None]:
    """Expect an InputError about this field in the block."""
    with pytest.raises(kind) as caught:
        yield
    assert caught.value.field == field, str(caught.value)
    assert_plain(caught.value)


def assert_plain(error: InputError) -> None:
    """Assert that an error is one sentence for people, with a problem and a remedy."""
    assert len(error.errors) == 1
    text = str(error)
    assert error.field and error.problem and error.remedy
    assert "\n" not in text
    assert text.endswith(".") and not text.endswith("..")
    assert not re.search(r"pydantic|https?:|Input should|validation error|Traceback| 0x", text)
