"""What other packages add: commands and scenarios, found by their entry points.

A package names them in its own pyproject.toml; `amiri2026`, which comes with this one, is the
first.

    [project.entry-points."continuair.commands"]
    amiri2026 = "amiri2026.commands:add_commands"

    [project.entry-points."continuair.scenarios"]
    open_loop_test = "amiri2026:open_loop_test"
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from continuair.errors import InputError, shown
from continuair.warning import warn

if TYPE_CHECKING:
    import typer


def add_commands(app: typer.Typer) -> None:
    """Add the commands of every package that is installed; one that fails is left out and told."""
    for entry in sorted(entry_points(group="continuair.commands"), key=lambda each: each.name):
        try:
            entry.load()(app)
        except Exception as error:
            warn(f"The commands of {entry.name} are left out, as loading them failed: {error}.", 1)


def scenario(name: str) -> Callable[..., Any]:
    """Return the function that a package provides for making scenarios of this name.

    Raises InputError if none does.
    """
    found = entry_points(group="continuair.scenarios", name=name)
    if not found:
        raise InputError(f"scenario is {shown(name)}, which no installed package provides; "
                         "install the one that does.")  # fmt: skip
    return next(iter(found)).load()
