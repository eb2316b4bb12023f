"""The open-loop tests of Amiri et al. as scenarios."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from continuair import Scenario, Vehicle, checks
from continuair.errors import InputError, shown
from continuair.flight import still

OPEN_LOOP_TESTS = ("A", "B", "C", "D")
"""The names of the open-loop tests of Amiri et al."""


def open_loop_test(name: str, f1: float = 1.0) -> Scenario:
    """Return one of the paper's open-loop tests.

    Parameters
    ----------
    name : {"A", "B", "C", "D"}
        Letter of the test, see Notes.
    f1 : float, default 1.0
        Frequency of the chirp of test D at 10 s [Hz].

    Returns
    -------
    Scenario
        A scenario of 1 s that starts at rest, 5 m high, with a bend of 0.1 1/m and without lift.

    Raises
    ------
    InputError
        If there is no such test, or `f1` is negative.

    Notes
    -----
    Section on open-loop response of Amiri et al. (2026). A: 100 N in world x. B: free fall. C:
    Q_kappa and Q_psi_a oscillate at 20 rad/s. D: a wrench at the tip, a chirp from 1 Hz to `f1`;
    the paper prints f1 = 1, which is no chirp.

    Rotors of a vehicle hover unless commanded. Studies of these tests stop them:
    ``open_loop_test("B").replace(rotor_command=np.zeros(4))``.
    """
    key = name.strip().upper() if isinstance(name, str) else name
    if not isinstance(key, str) or key not in OPEN_LOOP_TESTS:
        raise InputError(
            "test",
            f"is {shown(name)}, but must be a letter from A to D",
            f"use one of: {', '.join(OPEN_LOOP_TESTS)}",
        )
    f1 = checks.number("f1", f1, least=0.0, otherwise=" [Hz]")
    inputs: dict[str, dict[str, Any]] = {
        "A": {"tau": (100.0, 0, 0, 0, 0, 0, 0, 0)},
        "B": {},
        "C": {"tau": bend_torques},
        "D": {"tip_wrench": functools.partial(tip_chirp, f1=f1), "tip_wrench_sign": -1},
    }
    q = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.1, 0.0)
    return Scenario(f"Test {key}", q, duration=1.0, **inputs[key])


# The models of a comparison all ask for the same times.
@functools.lru_cache(maxsize=1 << 16)
def bend_torques(t: float) -> tuple[float, ...]:
    """Return generalised forces of Test C at time t [s], shape (8,) [N m², N m]; Amiri et al."""
    return 0, 0, 0, 0, 0, 0, 0.1 * math.sin(20 * t + math.pi / 4), 0.1 * math.cos(20 * t)


def tip_chirp(t: float, f1: float = 1.0) -> tuple[float, ...]:
    """Return tip wrench of Test D at time t [s], shape (6,), world axes [N, N m]; Amiri et al."""
    f0, T = 1.0, 10.0
    angle = 2 * math.pi * (f0 * t + (f1 - f0) / (2 * T) * t**2)
    return 10 * math.sin(angle + math.pi / 4), 10 * math.sin(angle), 25, 0, 0, 0


def open_loop_flight(vehicle: Vehicle, letter: str, f1: float = 1.0) -> Scenario:
    """Return an open-loop test of the paper as a vehicle flies it: no lift acts, its rotors rest.

    The paper has one arm of one section. Our choice for others: every section of every arm starts
    with the bend, and has the torques, of the paper's one; the tip wrench acts on the arm that
    carries the camera.
    """
    test = open_loop_test(letter, f1)
    if not vehicle.has_arm_list:
        return test.replace(**still(vehicle))
    sections = (*range(6), *(6, 7) * vehicle.sections)
    of_arm, arms = vehicle.camera_arm, len(vehicle.arms)
    wrench = (*(None,) * 6 * of_arm, *range(6), *(None,) * 6 * (arms - 1 - of_arm))
    return test.replace(
        q=placed(np.ravel(test.q), sections),
        qd=None,
        tau=_placed_input(test.tau, sections),
        tip_wrench=_placed_input(test.tip_wrench, wrench),
        **still(vehicle),
    )


def placed(row: Any, places: Sequence[int | None]) -> tuple[float, ...]:
    """Return the numbers of a row at these places, 0 where there is none."""
    return tuple(0.0 if place is None else float(row[place]) for place in places)


@dataclass(frozen=True)
class Placed:
    """An input of one section or arm over time, for those of a vehicle; places: as in `placed`."""

    given: Callable[[float], Sequence[float]]
    places: tuple[int | None, ...]

    def __call__(self, t: float) -> tuple[float, ...]:
        """Return the vehicle's input at time t [s]."""
        return placed(self.given(t), self.places)

    def describe(self) -> dict[str, Any]:
        """Return what it is, for provenance."""
        given = getattr(self.given, "func", self.given)
        keywords = getattr(self.given, "keywords", {})
        return {"input": given.__qualname__, **keywords, "places": list(self.places)}


def _placed_input(given: Any, places: tuple[int | None, ...]) -> Any:
    """A constant or a function of time, placed; None stays."""
    if given is None:
        return None
    if callable(given):
        return Placed(given, places)
    return placed(np.ravel(given), places)
