"""Style of figures: sizes for a printed page, one colour and dash per model, informative titles."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

COLUMN_WIDTH, PAGE_WIDTH = 3.5, 7.16
"""Widths of one and of two columns of a journal page [inch]."""

RESOLUTION = 200
"""Resolution of PNG files [dots per inch]."""

# Okabe and Ito's colours, distinct with any colour vision; dashes distinguish them in grey.
MODELS: dict[str, dict[str, Any]] = {
    "coupled": {"color": "#000000", "linestyle": "-", "linewidth": 1.4},
    "decoupled": {"color": "#D55E00", "linestyle": (0, (5, 1.6)), "linewidth": 1.2},
    "independent": {"color": "#0072B2", "linestyle": (0, (1.2, 1.2)), "linewidth": 1.4},
}
"""Line properties of each model, the same in every figure."""

PAPER_COLOUR = "#999999"
"""Colour of numbers that were read off the paper."""

FAILED_COLOUR = "#B00020"
"""Colour of the words on a flight that failed."""

UNNAMED = "Amiri et al. do not print their vehicle's parameters, so no match is claimed."
"""Note of figures with the paper's numbers."""

_formats: ContextVar[tuple[str, ...]] = ContextVar("formats", default=("png", "svg", "pdf"))

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
    # Type 42 fonts would take three times as long: four subsets of fonts per figure.
    "pdf.fonttype": 3,
    "svg.fonttype": "none",
    # Without a salt the names of clips and markers in an SVG differ from run to run.
    "svg.hashsalt": "continuair",
}

_JOINT = "\xa0"
"""A space at which no line breaks."""

_LINE = 1.3
"""Height of a line of text, in its size."""


@contextmanager
def applied() -> Iterator[None]:
    """Apply the style inside the block, and restore the settings after it."""
    with matplotlib.rc_context(_SETTINGS):
        yield


def new_figure(width: float = PAGE_WIDTH, height: float = 3.0) -> Figure:
    """Return an empty figure of that size [inch]; it belongs to no window."""
    return Figure(figsize=(width, height), layout="constrained")


def model_legend(figure: Figure, axes: Any) -> None:
    """Put one legend of the models, read off the given axes, above the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))


def head(
    figure: Figure,
    finding: str,
    subtitle: str = "",
    notes: Sequence[str] = (),
    handles: Sequence[Any] = (),
) -> None:
    """Put a finding, a small subtitle, words on failed flights and a legend above all panels.

    The figure grows by as much, so that the panels keep their size. handles: of the legend, with
    their labels; one of a label that came before is left out.
    """
    width, height = figure.get_size_inches()
    rows = [(line, 9.0, "bold", "#000000") for line in _wrapped(finding, width, 13.0)]
    rows += [(line, 7.0, "normal", "#555555") for line in _wrapped(subtitle, width, 20.0)]
    for note in notes:
        rows += [(line, 7.0, "bold", FAILED_COLOUR) for line in _wrapped(note, width, 17.0)]
    shown = list({handle.get_label(): handle for handle in reversed(handles)}.values())[::-1]
    columns = max(1, min(len(shown), int(width / 1.15)))
    lines = -(-len(shown) // columns)
    tall = sum(size for _, size, _, _ in rows) * _LINE / 72 + 0.19 * lines + 0.1
    figure.set_size_inches(width, height + tall)
    top = height + tall - 0.04
    for text, size, weight, colour in rows:
        place = (0.06 / width, top / (height + tall))
        figure.text(*place, text, size=size, weight=weight, color=colour, va="top")
        top -= size * _LINE / 72
    if shown:
        place = (0.0, top / (height + tall))
        figure.legend(handles=shown, loc="upper left", bbox_to_anchor=place, ncols=columns)
    figure.set_layout_engine("constrained", rect=(0, 0, 1, height / (height + tall)))
    figure.align_ylabels()


def model_handles(axes: Any) -> list[Any]:
    """Return the legend's handles for the given axes."""
    return list(axes.get_legend_handles_labels()[0])


def short(value: float) -> str:
    """Return a number with two digits as titles print it, 1,200 rather than 1.2e+03."""
    rounded = float(f"{value:.2g}")
    return f"{rounded:,.0f}" if 100.0 <= abs(rounded) < 1e7 else f"{rounded:.2g}"


def grouped(words: dict[str, str]) -> str:
    """Return values of each model, equal ones together, as in "9 Hz coupled and other"."""
    models: dict[str, list[str]] = {}
    for model, text in words.items():
        models.setdefault(text, []).append(model)
    return ", ".join(f"{text} {' and '.join(names)}" for text, names in models.items())


def plain(text: str) -> str:
    """Return text of the user's that figures show as it is: a $ in it begins no formula."""
    return text.replace("$", r"\$")


def save(figure: Figure, name: str, file: Callable[[str], Path]) -> None:
    """Write the figure in every format, PNG, SVG and PDF; `file` gives the path of a name."""
    for suffix in _formats.get():
        save_as(figure, file(f"{name}.{suffix}"))


@contextmanager
def pictures_only() -> Iterator[None]:
    """Make `save` write PNG alone inside the block, a third of the work."""
    before = _formats.set(("png",))
    try:
        yield
    finally:
        _formats.reset(before)


def save_as(figure: Figure, path: Path) -> None:
    """Write the figure to a path, in the format of its suffix."""
    with applied():
        if figure.get_layout_engine() is not None:
            # Found once: every drawing would search it again, twice.
            figure.draw_without_rendering()
            figure.set_layout_engine(None)
        # Without a date, equal results give equal files.
        undated = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
        figure.savefig(path, dpi=RESOLUTION, metadata=undated.get(path.suffix))


def _wrapped(text: str, width: float, letters: float) -> list[str]:
    """Return lines of a text on a figure of that width [inch], at so many letters per inch.

    A number stays with what follows it, which is its unit.
    """
    joined = re.sub(r"(?<=\d) (?=\S)", _JOINT, text)
    lines = textwrap.wrap(joined, int(width * letters), break_long_words=False)
    return [line.replace(_JOINT, " ") for line in lines]
