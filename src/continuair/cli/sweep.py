"""`continuair sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from continuair.cli.application import app
from continuair.cli.terminal import print_table, progress_bar
from continuair.errors import InputError, shown

# Everything else is imported inside the command, so that --help answers at once.
if TYPE_CHECKING:
    import xarray as xr


@app.command(epilog="Example: continuair sweep examples/sweep.toml --out sweep.zarr")
def sweep(
    design: Annotated[str, typer.Argument(help="The path of a design, a .toml file.")],
    out: Annotated[Path, typer.Option(help="The store (zarr): new, or to be continued.")],
    metrics: Annotated[
        str | None, typer.Option(help="Metrics to keep, with commas. Default: all there are.")
    ] = None,
    device: Annotated[str, typer.Option(help="cpu (all its threads), or a CUDA device.")] = "cpu",
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler; its workers see --out too.")
    ] = None,
    shard: Annotated[
        str, typer.Option(help="i/n: do the i-th of n parts, counted from 1, as in a job array.")
    ] = "1/1",
    repair: Annotated[
        bool, typer.Option("--repair", help="Compute damaged units of the store again.")
    ] = False,
) -> None:
    """Simulate every run of a design with several models, and save metrics of their differences.

    To continue an interrupted sweep, repeat the command.
    """
    part = _shard(shard)
    with progress_bar() as progress:
        from continuair.sweeps import sweep as run

        names = None if metrics is None else [name.strip() for name in metrics.split(",")]
        results = run(
            design,
            out,
            metrics=names,
            device=device,
            scheduler=scheduler,
            shard=part,
            repair=repair,
            progress=progress,
        )
    _show(results, out)


def _shard(text: str) -> tuple[int, int]:
    numbers = text.split("/")
    if len(numbers) != 2 or not all(number.isdecimal() for number in numbers):
        raise InputError(
            "shard", f"is {shown(text)}", "give i/n, such as 1/4 for the first of four"
        )
    return int(numbers[0]), int(numbers[1])


def _show(results: xr.Dataset, out: Path) -> None:
    """Show the spread of every metric over the runs that have it, and how the runs ended."""
    import numpy as np

    from continuair.sweeps import METRICS
    from continuair.sweeps.units import REFUSED

    rows = []
    for model in results["model"].to_numpy()[1:]:
        for name in (name for name in METRICS if name in results):
            values = results[name].sel(model=model).to_numpy()
            there = values[~np.isnan(values)]
            spread = np.quantile(there, [0.5, 0.9, 1.0]) if len(there) else []
            cells = [f"{value:.4g}" for value in spread] or ["-"] * 3
            rows.append([str(model), name, *cells, str(len(there))])
    print_table(["model", "metric", "median", "90 %", "largest", "of runs"], rows)
    done, runs = results.attrs["done"], results.attrs["runs"]
    status = results["status"]
    counts = {
        "ended early": int((status > 0).any("model").sum()),
        "could not be flown, as parameters were refused": int(
            (status == REFUSED).any("model").sum()
        ),
    }
    left = "" if done == runs else f", {runs - done} are left"
    told = [f"{count} of them {what}" for what, count in counts.items() if count]
    ended = f"{' and '.join(told)} (see status)" if told else "all of them to the end"
    typer.echo(f"{done} of {runs} runs are done, {ended}{left}; the store is {out}.")
