"""Routes of groups of tendons, for which kernels are compiled, and where their numbers are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from continuair.device.types import Tree

NUMBERS = (
    "pretension", "stiffness", "damping", "least", "most", "lag", "rate", "least_taken",
    "most_taken", "friction", "holding", "slip_unit", "straight",
)  # fmt: skip
"""Numbers of a group of tendons in the device's Plant, in order."""


@dataclass(frozen=True)
class Route:
    """Path of a group of equal tendons, for which kernels are compiled.

    Parameters
    ----------
    sections : tuple of int
        Section of each stretch, among those of all arms.
    counts : tuple of int
        Pieces of each stretch.
    highest : int
        Highest order of a strain along the path.
    tendons : int
        Number of tendons.
    straight : bool
        Whether they run straight from disk to disk.
    by_length : bool
        Whether winches command their lengths.
    lags, prompt, damps, rubs, turns : bool
        Whether, in some runs, motors lag, do not lag, tendons are damped, rub, and are helical.
    """

    sections: tuple[int, ...]
    counts: tuple[int, ...]
    highest: int
    tendons: int
    straight: bool
    by_length: bool
    lags: bool
    prompt: bool
    damps: bool
    rubs: bool
    turns: bool

    @property
    def pieces(self) -> int:
        """Return the number of pieces of a tendon."""
        return sum(self.counts)

    @property
    def rows(self) -> int:
        """Return the number of rows of the group in the table of coefficients."""
        return self.tendons * self.pieces

    @property
    def motors(self) -> int:
        """Return the number of states of motors."""
        return self.tendons * self.lags

    @property
    def slips(self) -> int:
        """Return the number of states of friction."""
        return self.tendons * len(self.counts) * self.rubs


@dataclass(frozen=True)
class Place:
    """Where the numbers of a route are.

    group: row of `plant.tendon`. tendon: its first tendon. row: its first row in the table. motor,
    slip: first columns of its states.
    """

    group: int
    tendon: int
    row: int
    motor: int
    slip: int


def places_of(tree: Tree, term: Any, routes: Sequence[Route]) -> list[Place]:
    """Return the places of all routes of a term, in order."""
    row, tendon = tree.first_row_of(term), 0
    motor, slip = (tree.layout.of_state[name].start for name in ("tendon_motor", "tendon_slip"))
    found = []
    for group, route in enumerate(routes):
        found.append(Place(group, tendon, row, motor, slip))
        row, tendon = row + route.rows, tendon + route.tendons
        motor, slip = motor + route.motors, slip + route.slips
    return found
