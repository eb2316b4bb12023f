"""The command line itself: reporting of errors, warnings and interrupts."""

from __future__ import annotations

import re
import signal
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from continuair.errors import INTERRUPTED, ContinuairWarning, InputError, shortened

_UNUSABLE_INPUT = 2

# A number that stands alone: the index in arm.disks.0 belongs to a field.
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\w.+-]*(?<![.,])")
_LONGEST_KIND = 80

_INTERRUPTION = (
    "Interrupted; what was not yet written is lost. A result folder that was being written to "
    "holds INCOMPLETE.txt, and a sweep goes on where it was if the command is repeated."
)


class Reporting(TyperGroup):
    """Print an InputError as its message, without traceback."""

    def invoke(self, ctx: Any) -> Any:
        with reporting():
            return super().invoke(ctx)


@contextmanager
def reporting() -> Iterator[None]:
    """Print errors, warnings and Ctrl-C of the block as sentences, and exit with their codes."""
    with _interruptible() as interrupts:
        try:
            with _plain_warnings():
                yield
        except (Exception, KeyboardInterrupt) as error:
            # An import that is interrupted may report that as a failure of its own.
            if interrupts or isinstance(error, KeyboardInterrupt):
                typer.echo(_INTERRUPTION, err=True)
                raise typer.Exit(INTERRUPTED) from None
            if isinstance(error, InputError):
                typer.echo(str(error), err=True)
                raise typer.Exit(_UNUSABLE_INPUT) from None
            raise


@contextmanager
def _interruptible() -> Iterator[list[int]]:
    """Raise KeyboardInterrupt at Ctrl-C inside the block; yield the list of those that came."""
    came: list[int] = []

    def interrupt(number: int, _frame: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, before)


app = typer.Typer(
    cls=Reporting,
    help="Simulation of aerial continuum manipulators: a multirotor, and a continuum arm under it.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # joins the lines of a paragraph
    pretty_exceptions_enable=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from continuair import __version__

        typer.echo(f"continuair {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


@contextmanager
def _plain_warnings() -> Iterator[None]:
    """Print the project's own warnings as one line each on standard error.

    Of those that differ in their numbers alone, as those of every flight of a study may, the first
    is printed, and at the end how many followed.
    """
    told = Counter[str]()
    with warnings.catch_warnings():
        show = warnings.showwarning

        def one_line(message: Any, category: type[Warning], *rest: Any, **named: Any) -> None:
            if not issubclass(category, ContinuairWarning):
                show(message, category, *rest, **named)
                return
            text = " ".join(str(message).split())
            kind = _NUMBER.sub("...", text)
            told[kind] += 1
            if told[kind] == 1:
                print(f"warning: {text}", file=sys.stderr)

        warnings.showwarning = one_line
        try:
            yield
        finally:
            for kind, count in told.items():
                if count > 1:
                    like = f"{count - 1} more with other numbers: {shortened(kind, _LONGEST_KIND)}"
                    print(f"warning: {like}", file=sys.stderr)
