"""Tendons of an arm: where they run, and what pulls them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, field_validator, model_validator

from continuair.errors import InputError, shown
from continuair.vehicle.fields import (
    Finite,
    Name,
    NotNegative,
    NotNegativePair,
    Pair,
    Positive,
    finite,
)
from continuair.vehicle.members import NamedPart

MOST_TENDONS = 16
"""Most tendons of a group."""

FRICTION_STIFFNESS = 2e4
"""Stiffness of a tendon against its guides before it slides [N/m], where none is given."""


def _angles(value: object) -> tuple[float, ...]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, (list, tuple)) or not 0 < len(value) <= MOST_TENDONS:
        raise ValueError(f"must hold 1 to {MOST_TENDONS} angles, one for each tendon")
    try:
        return tuple(finite(angle) for angle in value)
    except ValueError as error:
        raise ValueError(f"must hold angles, and each {error}") from None


def _offsets(value: object) -> tuple[float, float]:
    given = value.tolist() if isinstance(value, np.ndarray) else value
    both = list(given) if isinstance(given, (list, tuple)) else [given, given]
    try:
        base, end = (finite(each) for each in both)
    except ValueError:
        raise ValueError("must be a distance, or those at the base and at the end") from None
    if not base > 0.0 or not end >= 0.0:
        raise ValueError("must be above 0 at the base, and not below 0 at the end")
    return base, end


def _as_text(value: object) -> object:
    """Return an index as text, as names are."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Place = Annotated[Name, BeforeValidator(_as_text)]
Angles = Annotated[tuple[float, ...], BeforeValidator(_angles)]
Offsets = Annotated[tuple[float, float], BeforeValidator(_offsets)]


class Tendon(NamedPart):
    """Group of equal tendons at several angles, from the arm's base to the section they end in.

    Their motors ride on the UAV at the arm's base. A command of 0 holds the pretension.
    """

    name: Name = ""
    """the group's name, its index by default"""

    angles: Angles
    """the angle of each tendon about the backbone, from x of the section's axes towards y [rad]"""

    offset: Offsets
    """the distance of the tendons from the backbone: one number, or 2 of tendons that converge, at
    the arm's base and at their end [m]"""

    turn: Finite = 0.0
    """the angle by which helical tendons turn about the backbone from the arm's base to their end,
    at a constant rate per arc length; 0 for tendons that do not turn [rad]"""

    section: Place = ""
    """the name or index of the section in which the tendons end, the last by default"""

    end: Positive | None = None
    """the arc length in that section at which they end, by default its length [m]"""

    guides: Literal["channel", "disks"] = "channel"
    """"channel": they run along the backbone everywhere; "disks": straight from disk to disk, and
    through a guide at each section's end"""

    command: Literal["tension", "length"] = "tension"
    """what the motors follow: "tension", added to the pretension, or "length", what a winch takes
    in of the tendon"""

    pretension: NotNegative = 0.0
    """the tension of a straight arm at a command of 0 [N]"""

    limits: NotNegativePair | None = None
    """the minimum and the maximum tension that motors exert, as 2 numbers; without limits from 0
    [N]"""

    lag: NotNegative = 0.0
    """the time constant with which motors follow their commands, a first-order lag; 0 for none
    [s]"""

    rate: Positive | None = None
    """the greatest rate of the motors, needs a lag [N/s, m/s]"""

    stroke: Pair | None = None
    """the least and the greatest length that a winch takes in, as 2 numbers [m]"""

    stiffness: Positive | None = None
    """the stiffness of tendon and motor in series, for lengths [N/m]"""

    damping: NotNegative = 0.0
    """the damping of tendon and motor in series, for lengths [N s/m]"""

    friction: NotNegative = 0.0
    """the coefficient of friction between tendon and guides [-]"""

    friction_stiffness: Positive = FRICTION_STIFFNESS
    """the stiffness with which guides hold a tendon before it slides [N/m]"""

    @field_validator("limits", "stroke")
    @classmethod
    def _ascending(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and not value[0] < value[1]:
            raise ValueError("must ascend")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        by_length = self.command == "length"
        if by_length and self.stiffness is None:
            raise InputError(
                "stiffness",
                "is missing, which tendons with commanded lengths need",
                "give the stiffness of tendon and motor in series [N/m]",
            )
        of_lengths = {"stiffness": None, "damping": 0.0, "stroke": None}
        for name, absent in of_lengths.items():
            if not by_length and getattr(self, name) != absent:
                raise InputError(
                    name,
                    f"is {shown(getattr(self, name))}, but the tensions are commanded",
                    "leave it out, or give command = 'length'",
                )
        if self.rate is not None and self.lag == 0.0:
            raise InputError(
                "lag",
                f"is 0, but rate is {self.rate:g}",
                "give the time constant with which the motors follow [s]",
            )
        if self.stroke is not None and not self.stroke[0] <= 0.0 <= self.stroke[1]:
            raise InputError(
                "stroke",
                f"is {shown(self.stroke)}, but winches start at 0",
                "give a range that holds 0 [m]",
            )
        least, most = self.limits or (0.0, math.inf)
        if not least <= self.pretension <= most:
            raise InputError(
                "pretension",
                f"is {self.pretension:g}, beyond the limits {shown(self.limits)}",
                "give one within them [N]",
            )
        return self

    @property
    def count(self) -> int:
        """Return the number of tendons of the group."""
        return np.shape(self.angles)[-1]

    @property
    def rubs(self) -> bool:
        """Return whether the tendons have friction, in any run."""
        return bool(np.any(self.friction))

    @property
    def turns(self) -> bool:
        """Return whether the tendons are helical, in any run."""
        return bool(np.any(self.turn))

    @property
    def lags(self) -> bool:
        """Return whether motors follow with a lag, in any run."""
        return bool(np.any(self.lag))

    @property
    def tension_limits(self) -> Any:
        """Return the least and the greatest tension, 2 numbers or an array (runs, 2) [N]."""
        return (0.0, math.inf) if self.limits is None else self.limits

    @property
    def strokes(self) -> Any:
        """Return the range of the winches, 2 numbers or an array (runs, 2) [m]."""
        return (-math.inf, math.inf) if self.stroke is None else self.stroke


def section_of(tendon: Tendon, names: list[str]) -> int:
    """Return the index of the section in which a group ends, among sections with these names.

    Parameters
    ----------
    tendon : Tendon
        A group of tendons.
    names : list of str
        Names of the arm's sections, from its base.

    Returns
    -------
    int
        The index.

    Raises
    ------
    InputError
        If no section has that name or index.
    """
    if not tendon.section:
        return len(names) - 1
    if tendon.section in names:
        return names.index(tendon.section)
    if tendon.section.isdecimal() and int(tendon.section) < len(names):
        return int(tendon.section)
    raise InputError(
        "section",
        f"is {tendon.section!r}, but the arm's sections are {', '.join(names)}",
        "give one of them, at whose end the tendons end",
    )


def check_tendons(tendons: tuple[Tendon, ...], sections: tuple[Any, ...]) -> None:
    """Raise InputError unless groups of tendons fit the sections of their arm.

    Parameters
    ----------
    tendons : tuple of Tendon
        The groups.
    sections : tuple of Section
        The sections, from the arm's base.

    Raises
    ------
    InputError
        If a group ends beyond its section, or needs disks that a section does not have.
    """
    names = [each.name or str(index) for index, each in enumerate(sections)]
    for index, tendon in enumerate(tendons):
        where = f"tendon.{tendon.name or index}."
        try:
            last = section_of(tendon, names)
        except InputError as error:
            raise error.within(where) from None
        length = sections[last].length
        if tendon.end is not None and np.any(np.asarray(tendon.end) > length):
            raise InputError(
                f"{where}end",
                f"is {shown(tendon.end)}, beyond the end of section {names[last]}",
                f"give at most its length, {shown(length)} m",
            )
        without = [name for name, each in zip(names, sections, strict=True) if not each.disks]
        if tendon.guides == "disks" and set(without) & set(names[: last + 1]):
            raise InputError(
                f"{where}guides",
                f"is 'disks', but section {without[0]} has none",
                "give guides = 'channel', or the section disks",
            )
