"""Commands and scenarios of other packages are found, and one that fails takes nothing along."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from continuair import extensions
from continuair.errors import InputError
from tests.refusals import refused


def entry(name: str, load: Callable[[], Any]) -> SimpleNamespace:
    return SimpleNamespace(name=name, load=load)


def failing(error: BaseException) -> Callable[[], Any]:
    def load() -> Any:
        raise error

    return load


@pytest.mark.parametrize(
    "error",
    [ImportError("no module\nnamed x"), SystemExit(3), InputError("field", "is wrong", "mend it")],
)
def test_commands_of_a_package_that_fails_are_left_out_and_told_in_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: BaseException
) -> None:
    def add(app: typer.Typer) -> None:
        app.command("greet")(lambda: typer.echo("hello"))
        app.command("part")(lambda: typer.echo("goodbye"))

    entries = [entry("broken", failing(error)), entry("mine", lambda: add)]
    monkeypatch.setattr(extensions, "entry_points", lambda **_: entries)
    app = typer.Typer()
    extensions.add_commands(app)
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith("warning: ") and "broken" in told
    assert CliRunner().invoke(app, ["greet"]).output == "hello\n"


def test_scenarios_come_from_the_package_that_provides_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert extensions.scenario("open_loop_test")("B").name == "Test B"
    with refused("scenarios"):
        extensions.scenario("nothing")
    broken = [entry("x", failing(ImportError("gone")))]
    monkeypatch.setattr(extensions, "entry_points", lambda **_: broken)
    with refused("scenarios"):
        extensions.scenario("x")
