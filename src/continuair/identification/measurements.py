"""Measured quantities of a recording: their columns in residuals, first weights and biases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from continuair.identification.recording import Recording
from continuair.typing import Array
from continuair.vehicle.layout import columns


@dataclass(frozen=True)
class Measurement:
    """A group of measurements with one unit and one standard deviation.

    name: field of a recording. key: name of its standard deviation, with the unit. motion: for
    messages. first: standard deviation before that of the residuals is known; scan: that of the
    scan. largest_bias: above which a bias is reported; 0 if the sensor has no bias. width: None for
    as many columns as the recording has.
    """

    name: str
    key: str
    motion: str
    first: float
    scan: float
    largest_bias: float = 0.0
    width: int | None = 3

    def columns_in(self, recording: Recording) -> int:
        """Return the number of its columns in the residuals of a recording; 0 if not measured."""
        found = int(getattr(recording, self.name).shape[1])
        return self.width if self.width is not None and found else found


# A rotation has three columns, a quaternion four. The first deviation of bends is over the reach.
MEASUREMENTS = (
    Measurement("position", "position_m", "position", 0.01, 0.1),
    Measurement("attitude", "attitude_rad", "attitude", 0.01, 0.1),
    Measurement("bend", "bend_per_m", "bends", 0.01, 0.1, width=None),
    Measurement("velocity", "velocity_m_s", "velocity", 0.01, 0.1),
    # Uncalibrated MEMS sensors have biases of up to about these.
    Measurement("gyro", "gyro_rad_s", "angular velocity", 0.01, 0.1, largest_bias=0.2),
    Measurement("accelerometer", "accelerometer_m_s2", "specific force", 0.1, 1.0,
                largest_bias=1.0),
)  # fmt: skip
"""All groups, in the order of their columns in residuals."""


class Measured:
    """The groups that a recording holds, and their columns in its residuals."""

    def __init__(self, recording: Recording) -> None:
        widths = {each.name: each.columns_in(recording) for each in MEASUREMENTS}
        self.groups = tuple(each for each in MEASUREMENTS if widths[each.name])
        self.of: dict[str, slice] = columns((each.name, widths[each.name]) for each in self.groups)
        self.width = sum(widths.values())
        self._biased = [self.of[each.name] for each in self.groups if each.largest_bias]

    @property
    def biases(self) -> int:
        """Number of biases that are estimated."""
        return sum(where.stop - where.start for where in self._biased)

    def of_columns(self, deviations: Array) -> Array:
        """Return the deviation of every column (width,), from those of the groups."""
        found = np.empty(self.width)
        for where, deviation in zip(self.of.values(), deviations, strict=True):
            found[where] = deviation
        return found

    def first(self, reach: float) -> Array:
        """Return deviations of the groups for the first least squares, of arms of this reach."""
        return np.array([e.first / reach if e.name == "bend" else e.first for e in self.groups])

    def scan(self) -> Array:
        """Return deviations of the groups for the scan."""
        return np.array([each.scan for each in self.groups])

    def without_biases(self, difference: Array) -> Array:
        """Return differences (..., rows, width) less the best constant biases of the sensors.

        These are means, as all rows of a column have one weight: the rest is what least squares
        with the biases among the unknowns would leave.
        """
        found = difference.copy()
        for where in self._biased:
            found[..., where] -= found[..., where].mean(axis=-2, keepdims=True)
        return found

    def biases_of(self, difference: Array) -> dict[str, list[float]]:
        """Return biases, measured minus true, of simulated minus measured values (rows, width)."""
        return {
            each.key: (-difference[:, self.of[each.name]].mean(axis=0)).tolist()
            for each in self.groups
            if each.largest_bias
        }


def of_large_biases(biases: Mapping[str, list[float]]) -> tuple[str, ...]:
    """Return a sentence for each sensor whose bias exceeds that of usual ones."""
    doubts = []
    for each in MEASUREMENTS:
        largest = max(map(abs, biases.get(each.key, [0.0])))
        if each.largest_bias and largest > each.largest_bias:
            doubts.append(
                f"the {each.name} has a bias of {largest:.3g} ({each.key}), more than usual "
                "sensors; check units, axes and signs, and fields that are not fitted."
            )
    return tuple(doubts)
