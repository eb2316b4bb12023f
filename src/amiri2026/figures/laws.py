"""Styles of servoing laws in figures."""

from typing import Any

LAWS: dict[str, dict[str, Any]] = {
    "current": {"color": "#000000", "hatch": "", "marker": "o"},
    "constant": {"color": "#D55E00", "hatch": "//", "marker": "s"},
    "classic": {"color": "#0072B2", "hatch": "..", "marker": "^"},
}
"""Colours, hatches and markers of each law, from the top down."""
