"""Commands and scenarios of other packages, found by their entry points.

A package declares them in its own pyproject.toml, as `amiri2026` does, which is part of this
distribution.

    [project.entry-points."continuair.commands"]
    amiri2026 = "amiri2026.commands:add_commands"

    [project.entry-points."continuair.scenarios"]
    open_loop_test = "amiri2026:open_loop_test"
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from continuair.errors import InputError, shown

if TYPE_CHECKING:
    import typer


def add_commands(app: typer.Typer) -> None:
    """Add the commands of all installed packages; warn about one that fails."""
    for entry in sorted(entry_points(group="continuair.commands"), key=lambda each: each.name):
        try:
            entry.load()(app)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            # Before the command line formats warnings.
            print(f"warning: commands of {entry.name} are left out: {_why(error)}", file=sys.stderr)


def scenario(name: str) -> Callable[..., Any]:
    """Return the function of a package that makes scenarios of a name.

    Raises InputError if no package provides one.
    """
    found = entry_points(group="continuair.scenarios", name=name)
    if not found:
        raise InputError(
            "scenarios",
            f"is {shown(name)}, which no installed package provides",
            "install the one that does",
        )
    try:
        return next(iter(found)).load()
    except Exception as error:
        raise InputError(
            "scenarios", f"{shown(name)} cannot be loaded: {_why(error)}", "reinstall their package"
        ) from None


def _why(error: BaseException) -> str:
    """Return an error as one line of text."""
    return " ".join(f"{type(error).__name__} {error}".split())
