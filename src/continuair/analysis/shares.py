"""How a share is told, in sentences, tables and figures alike."""

from __future__ import annotations


def percent(share: float) -> str:
    """Return a share as texts print it: a part is never printed as all, nor what is over ten times
    as much in digits that nobody reads."""
    if share > 10.0:
        return "over 1000 %"
    if 0.995 <= share < 1.0:
        return "above 99 %"
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"
