"""The readings of the paper's table: what was flown, and which number was printed.

Coordinates throughout are those of an arm that hangs along -z. An arm that stands up is its mirror
image in z: gravity and the z component of the tip force change sign, and no metric changes.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np

from continuair.vehicle.coordinates import continuous_euler

Array = np.ndarray

DECOUPLED = ("block", "independent")
ARMS = ("down", "up")
BENDS = (1, -1)
TIP_FORCES = ("reversed", "as given", "reversed, z down", "as given, z down")


@dataclass(frozen=True, order=True)
class Flight:
    """What was flown.

    decoupled: "block" (UAV-arm blocks of M and C zero) or "independent" (no cross term at all).
    arm: "down" hangs, "up" stands on the UAV, as Eq. (2) is printed. bend: sign of the initial
    bend; -1 is an initial ψa of π. tip_force (Test D): "reversed" as the equation of motion prints
    -JᵀF, or "as given", in a world whose z points up or down.
    """

    decoupled: str
    arm: str
    bend: int
    tip_force: str

    @property
    def force_signs(self) -> tuple[float, float]:
        """Signs of the printed tip force, across and along z, at the hanging arm."""
        across = -1.0 if self.tip_force.startswith("reversed") else 1.0
        flipped = (self.arm == "up") != self.tip_force.endswith("z down")
        return across, -across if flipped else across


METRICS = ("nrmse", "rmse", "rmse_component", "mean", "max")
"""nrmse: as printed. rmse: of the length of the difference. rmse_component: the same over all
components and samples, rmse/√3. mean: of the length over time, so also its integral over the
second that a flight lasts ("cumulative error"). max: of the length."""

ANGLES = ("euler", "wrapped", "frenet", "frenet wrapped", "geodesic")
"""euler: continuous ZYX angles of the untwisted tip frame. wrapped: the principal ones, with their
jumps. frenet: of the frame that spins with ψa. geodesic: angle of the relative rotation."""


@dataclass(frozen=True)
class Reading:
    """One way to read the table: what was flown, the metric, and the angles of its rotation."""

    flight: Flight
    metric: str
    angles: str

    def describe(self) -> dict[str, Any]:
        """As JSON can hold it."""
        return asdict(self.flight) | {"metric": self.metric, "angles": self.angles}


FLIGHTS = tuple(
    Flight(decoupled, arm, bend, tip_force)
    for decoupled, arm, bend, tip_force in product(DECOUPLED, ARMS, BENDS, TIP_FORCES)
)
"""All kinds of flight."""

READINGS = tuple(
    Reading(flight, metric, angles)
    for flight, metric, angles in product(FLIGHTS, METRICS, ANGLES)
    # Nothing divides an angle of rotation by a range of coordinates.
    if not (metric in ("nrmse", "rmse_component") and angles == "geodesic")
)
"""All readings; gravity acts in each (Test B is a free fall), and a flight lasts 1 s."""


_NOISE = 1e-9
"""Sines below this are those of no angle: flights of a second end with rounding errors of 1e-12."""

AS_PRINTED = Reading(Flight("block", "down", 1, "reversed"), "nrmse", "euler")
"""The reading that takes the paper most nearly at its word."""


@dataclass(frozen=True)
class Tips:
    """Tips of runs at samples: position (runs, samples, 3) [m]; attitude (runs, samples, 4), of the
    untwisted frame times diag(1, -1, -1), 1 if nothing is turned; twist ψa (runs, samples)."""

    position: Array
    attitude: Array
    twist: Array


def translation(coupled: Tips, other: Tips) -> dict[str, Array]:
    """METRICS of the tip's position, each (runs,)."""
    return _metrics(coupled.position, other.position)


def rotation(coupled: Tips, other: Tips) -> dict[tuple[str, str], Array]:
    """(metric, angles) -> (runs,) of the tip's rotation."""
    found: dict[tuple[str, str], Array] = {}
    for frame, turn in (("", False), ("frenet", True)):
        ours, theirs = (_frenet(tips) if turn else tips.attitude for tips in (coupled, other))
        smooth = [continuous_euler(attitude) for attitude in (ours, theirs)]
        cut = [_principal(attitude) for attitude in (ours, theirs)]
        for name, pair in ((frame or "euler", smooth), (f"{frame} wrapped".strip(), cut)):
            found |= {(metric, name): value for metric, value in _metrics(*pair).items()}
    angle = _angle_between(coupled.attitude, other.attitude)
    lengths = _of_length(angle)
    return found | {(metric, "geodesic"): value for metric, value in lengths.items()}


def _metrics(ours: Array, theirs: Array) -> dict[str, Array]:
    difference = theirs - ours
    found = _of_length(np.sqrt(np.sum(difference**2, -1)))
    ranges = np.sqrt(np.sum(np.ptp(ours, axis=1) ** 2, -1))
    with np.errstate(divide="ignore", invalid="ignore"):
        found["nrmse"] = found["rmse"] / ranges
    found["rmse_component"] = found["rmse"] / np.sqrt(3.0)
    return found


def _of_length(length: Array) -> dict[str, Array]:
    return {
        "rmse": np.sqrt(np.mean(length**2, -1)),
        "mean": np.mean(length, -1),
        "max": np.max(length, -1),
    }


def _principal(attitude: Array) -> Array:
    """Roll, pitch and yaw in (-π, π], [-π/2, π/2], (-π, π]."""
    x, y, z, w = np.moveaxis(attitude, -1, 0)
    return np.stack(
        [
            np.arctan2(_not_noise(2.0 * (y * z + w * x)), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)),
            np.arctan2(_not_noise(2.0 * (x * y + w * z)), 1.0 - 2.0 * (y * y + z * z)),
        ],
        -1,
    )


def _not_noise(sine: Array) -> Array:
    """Where rounding alone would choose between -π and π, as in planar flights, it shall be π."""
    return np.where(np.abs(sine) < _NOISE, 0.0, sine)


def _frenet(tips: Tips) -> Array:
    """Attitude of the frame that spins with ψa: the untwisted one, turned by ψa about its z."""
    x, y, z, w = np.moveaxis(tips.attitude, -1, 0)
    s, c = np.sin(0.5 * tips.twist), np.cos(0.5 * tips.twist)
    return np.stack([c * x + s * y, c * y - s * x, c * z + s * w, c * w - s * z], -1)


def _angle_between(a: Array, b: Array) -> Array:
    apart = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return 4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0))
