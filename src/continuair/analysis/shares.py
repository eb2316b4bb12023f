"""Format of shares in sentences, tables and figures."""

from __future__ import annotations


def percent(share: float) -> str:
    """Return a share as text in per cent.

    Parameters
    ----------
    share : float
        The share; 1 is 100 %.

    Returns
    -------
    str
        Rounded text. A share below 1 is never printed as 100 %, and one above 10 is "over 1000 %".
    """
    if share > 10.0:
        return "over 1000 %"
    if 0.995 <= share < 1.0:
        return "above 99 %"
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"
