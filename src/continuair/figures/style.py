"""How figures look: sizes for a printed page, and one colour and dash per model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import xarray as xr
from matplotlib.figure import Figure

COLUMN_WIDTH, PAGE_WIDTH = 3.5, 7.16
"""Widths of one and of two columns of a journal page [inch]."""

RESOLUTION = 200
"""Resolution of PNG files [dots per inch]."""

# Okabe and Ito's colours, told apart with any colour vision; dashes tell them apart in grey.
MODELS: dict[str, dict[str, Any]] = {
    "coupled": {"color": "#000000", "linestyle": "-", "linewidth": 1.4},
    "decoupled": {"color": "#D55E00", "linestyle": (0, (5, 1.6)), "linewidth": 1.2},
    "independent": {"color": "#0072B2", "linestyle": (0, (1.2, 1.2)), "linewidth": 1.4},
}
"""Line properties of each model, the same in every figure."""

PAPER_COLOUR = "#999999"
"""Colour of numbers that were read off the paper."""

_SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 4),
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
}


@contextmanager
def applied() -> Iterator[None]:
    """Apply the style inside the block, and restore what was set before after it."""
    with matplotlib.rc_context(_SETTINGS):
        yield


def new_figure(width: float = PAGE_WIDTH, height: float = 3.0) -> Figure:
    """Return an empty figure of that size [inch]; it belongs to no window."""
    return Figure(figsize=(width, height), layout="constrained")


def model_legend(figure: Figure, axes: Any) -> None:
    """Put one legend of the models, read off the given axes, above the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))


def line(axes: Any, flight: xr.Dataset, values: Any, model: str) -> None:
    """Draw values over the time of a flight in the style of its model."""
    axes.plot(flight["time"].to_numpy(), values, label=model, **MODELS[model])


def finish(figure: Figure, axes: Any, title: str) -> None:
    """Align labels, and add the legend of the given axes and a title."""
    figure.align_ylabels()
    model_legend(figure, axes)
    if title:
        figure.suptitle(title, fontsize=9, x=0.01, ha="left")


def plain(text: str) -> str:
    """Return text of the user's that figures show as it is: a $ in it begins no formula."""
    return text.replace("$", r"\$")


def save(figure: Figure, name: str, file: Callable[[str], Path]) -> None:
    """Write the figure as PNG and PDF; `file` gives the path of a name."""
    for suffix in ("png", "pdf"):
        save_as(figure, file(f"{name}.{suffix}"))


def save_as(figure: Figure, path: Path) -> None:
    """Write the figure to a path, in the format of its suffix."""
    with applied():
        # Without a date, equal results give equal files.
        metadata = {"CreationDate": None} if path.suffix == ".pdf" else None
        figure.savefig(path, dpi=RESOLUTION, metadata=metadata)
    # The layout is found once, by the first drawing.
    figure.set_layout_engine("none")
