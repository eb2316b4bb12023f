"""Commands of the paper, which the command line of `continuair` lists as its own."""

import typer

from amiri2026.commands.cost import cost
from amiri2026.commands.open_loop import open_loop
from amiri2026.commands.paper import paper, report
from amiri2026.commands.region import region
from amiri2026.commands.robustness import robustness
from amiri2026.commands.sensitivity import sensitivity
from amiri2026.commands.tracking import tracking, tune

# Each with an example, in the order in which --help lists them.
_COMMANDS = (
    (open_loop, "continuair open-loop --tests AB --out results/open_loop"),
    (sensitivity, "continuair sensitivity --out results/sensitivity"),
    (tracking, "continuair tracking --letters MR --out results/tracking"),
    (tune, "continuair tune --vehicle my_drone.toml --out my_gains.toml"),
    (region, "continuair region --law current --out results/region"),
    (robustness, "continuair robustness --law current --mistake heavier"),
    (cost, "continuair cost --vehicle my_drone.toml"),
    (paper, "continuair paper --out results/paper"),
    (report, "continuair report results/tracking"),
)


def add_commands(app: typer.Typer) -> None:
    """Add the paper's commands; an entry point of the group `continuair.commands`."""
    for command, example in _COMMANDS:
        name = command.__name__.replace("_", "-")
        app.command(name, epilog=f"Example: {example}")(command)
