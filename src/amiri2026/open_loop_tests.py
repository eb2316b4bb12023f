"""The open-loop tests of Amiri et al. as scenarios."""

from __future__ import annotations

import functools
import math
from typing import Any

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
        problem = f"test is {shown(name)}, but must be a letter from A to D"
        raise InputError(f"{problem}; use one of: {', '.join(OPEN_LOOP_TESTS)}.")
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
    """Return an open-loop test of the paper for a vehicle, with its rotors at rest."""
    return open_loop_test(letter, f1).replace(**still(vehicle))
