"""`python -m research.paper_table`, from the root of a clone."""

from __future__ import annotations

from typing import Annotated

import typer

from continuair.cli.application import reporting
from continuair.cli.options import (
    JsonOption,
    OutOption,
    check_json,
    results_in,
    tell_where,
    write_json,
)
from continuair.cli.terminal import progress_bar

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def paper_table(
    effort: Annotated[int, typer.Option(min=1, help="Search so many times as long.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the search.")] = 0,
    out: OutOption = None,
    json: JsonOption = None,
) -> None:
    """Search for vehicles and readings that give the paper's Table I.

    Ctrl-C ends the search, and the best vehicles found until then are reported.
    """
    with reporting():
        _search(effort, seed, out, json)


def _search(effort: int, seed: int, out: str | None, json: str | None) -> None:
    from continuair.studies.results import as_json

    # Folder and file are checked before the flights: a wrong one is refused at once.
    check_json(json)
    with results_in(out, "paper_table") as folder, progress_bar() as progress:
        from research.paper_table.search import Effort, search
        from research.paper_table.study import as_table, summarise, write

        results = summarise(search(Effort.times(effort), seed, progress), progress)
        if folder is not None:
            write(results, folder)
    typer.echo(as_table(results), err=True, nl=False)
    tell_where(out)
    write_json(as_json(results), json)


if __name__ == "__main__":
    app(prog_name="python -m research.paper_table")
