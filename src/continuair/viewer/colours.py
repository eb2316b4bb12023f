"""Colours of the drawing, also as numbers."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from continuair.figures.style import MODELS

_BENDS = "viridis"

DARK, GREY, DISK = "#2b3036", "#8d949c", "#5a6570"
"""Of the UAV, its booms and its rotors."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Of feature points, one after the other."""

GROUPS = {
    "push": "#CC79A7",
    "command": "#0072B2",
    "rotor thrusts": "#56B4E9",
    "base reaction": "#E69F00",
    "tip force": "#009E73",
    "contact": "#D55E00",
}
"""Colours of forces."""

HIDDEN = ("base reaction",)
"""Colours of parts that the browser shows on request only."""

MEANINGS = {
    "push": "Inputs of the scenario on the UAV.",
    "command": "What the controller asks for, where no rotors make it.",
    "base reaction": "What the arms do to the UAV.",
    "contact": "What obstacles do to the arms.",
    "obstacles": "What the arms touch.",
    "ghost": "The flight of the other model.",
}
"""Of names that are short."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour as three numbers up to 255."""
    red, green, blue = (round(255 * part) for part in to_rgb(colour))
    return red, green, blue


def bend_colours(angle: Any, largest: float) -> NDArray[np.uint8]:
    """Return colours (..., 3) of bend angles (...), those of `largest` at the end of the scale."""
    share = np.clip(np.asarray(angle) / largest, 0.0, 1.0)
    return scale_of_bends()[(255.0 * share).astype(int)]


@cache
def scale_of_bends() -> NDArray[np.uint8]:
    """Return the colours (256, 3) from straight to the largest bend."""
    return np.asarray(colormaps[_BENDS](np.linspace(0.05, 0.9, 256), bytes=True))[:, :3]


def model_colour(model: str) -> str:
    """Return the colour of a model in figures."""
    return str(MODELS.get(model, MODELS["coupled"])["color"])
