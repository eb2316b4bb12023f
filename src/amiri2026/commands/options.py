"""Options and outputs that several of the commands share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from continuair.cli import complete_gains

if TYPE_CHECKING:
    from continuair.progress import Progress
    from continuair.studies import ResultFolder

ModelOption = Annotated[
    list[str] | None,
    typer.Option(help="A model to compare with the coupled one; repeatable. Default: all."),
]

LawOption = Annotated[
    list[str] | None,
    typer.Option(help="A law: constant, current or classic; repeatable. Default: all."),
]
LawGainsOption = Annotated[
    str | None,
    typer.Option(
        help="A .toml file of gains, instead of the preset of their law.",
        autocompletion=complete_gains,
    ),
]
PlantOption = Annotated[
    list[str] | None,
    typer.Option(help="A model as the plant; repeatable. Default: coupled and decoupled."),
]


def keep_in(folder: ResultFolder | None, name: str, study: Any, progress: Progress) -> None:
    """Write a study's results and figures to its folder, if there is one."""
    if folder is not None:
        from amiri2026.report.keeping import keep

        progress(1, 1, "writing results and figures")
        keep(name, study, folder)


def complete_letters(incomplete: str) -> list[str]:
    """Return a word of letters to track, with one more of them."""
    return _longer(incomplete, "MRAL")


def complete_tests(incomplete: str) -> list[str]:
    """Return letters of open-loop tests, with one more of them."""
    return _longer(incomplete, "ABCD")


def _longer(word: str, known: str) -> list[str]:
    return [word + letter for letter in known if letter not in word.upper()]
