"""What all tests share."""

from collections.abc import Iterator
from typing import Any

import pytest
import typer
from typer.main import get_command

from continuair.engine import builds


@pytest.fixture(autouse=True)
def _compiling_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether kernels are in the cache changes no output that a test looks at."""
    monkeypatch.setattr(builds, "_SILENCE", 1e6)


@pytest.fixture(scope="session", autouse=True)
def _commands_are_made_once() -> Iterator[None]:
    """Make the commands of an application once; later calls return the same objects."""
    kept: dict[Any, Any] = {}

    def found(app: typer.Typer) -> Any:
        key = app, len(app.registered_commands), len(app.registered_groups)
        if key not in kept:
            kept[key] = get_command(app)
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("typer.testing._get_command", found)
        yield
