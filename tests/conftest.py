"""What all tests share."""

import pytest

from continuair.engine import builds


@pytest.fixture(autouse=True)
def _compiling_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether kernels are in the cache changes no output that a test looks at."""
    monkeypatch.setattr(builds, "_SILENCE", 1e6)
