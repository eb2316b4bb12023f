"""The servoing laws that studies compare."""

from __future__ import annotations

from collections.abc import Collection

from continuair import Controller, Gains, Vehicle, classic, load_gains
from continuair.errors import InputError

LAWS = {
    "constant": "the paper's law with gains made for the desired image",
    "current": "the paper's law with gains made anew for the image of now",
    "classic": "classic servoing, v = λ L⁺ e, with an inner loop",
}
"""Laws by name."""

RATE, INNER = 1.5, 6.0
"""Rates of classic servoing and of its inner loop [1/s]."""

_PRESETS = {"constant": "paper", "current": "current"}


def gains_for(gains: Gains) -> str:
    """Return the law that gains are for."""
    return "constant" if gains.constant else "current"


def check_gains(gains: Gains | None, laws: Collection[str]) -> None:
    """Raise InputError for gains that are for none of the laws."""
    if gains is not None and gains_for(gains) not in laws:
        raise InputError(
            "gains",
            f"is {gains.name}, which is for the law {gains_for(gains)}",
            "fly that law, or leave gains out",
        )


def law_of(name: str, vehicle: Vehicle, gains: Gains | None) -> Controller:
    """Return a law by its name, with given gains if they are for it, else with its preset's."""
    if name == "classic":
        return classic(vehicle, RATE, INNER)
    if gains is None or gains_for(gains) != name:
        gains = load_gains(_PRESETS[name])
    return gains.controller(vehicle)
