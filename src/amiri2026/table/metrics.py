"""Distances between two flights of a tip, in the metrics that the paper's table may use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from amiri2026.table.printed import Flight, PrintedModel
from amiri2026.table.reading import Reading
from continuair.equations import arc_position, arc_rotation
from continuair.vehicle import continuous_euler

Array = np.ndarray

_NOISE = 1e-9
"""Rounding errors of positions [m], angles [rad] and sines, which are no motion and no angle."""


@dataclass(frozen=True)
class Tips:
    """Samples of a tip: position (n, 3) [m]; axes (n, 3, 3), untwisted and of the frame that spins
    with ψa, world axes; both are 1 where nothing is bent or turned."""

    position: Array
    untwisted: Array
    frenet: Array

    def every(self, count: int) -> Tips:
        """Return one of so many samples, the first included."""
        return Tips(self.position[::count], self.untwisted[::count], self.frenet[::count])


def tips(model: PrintedModel, flight: Flight) -> Tips:
    """Return the tip along a flight, with Remark 1 where the reading has it."""
    q = flight.q
    κ = np.where(np.abs(q[:, 6]) <= model.threshold, model.threshold, q[:, 6])
    ψa, length = q[:, 7], model.vehicle.arm.length
    R = np.full((len(q), 3, 3), np.nan)
    flown = np.isfinite(q).all(axis=1)
    R[flown] = Rotation.from_euler("ZYX", q[flown][:, [5, 4, 3]]).as_matrix()
    with np.errstate(divide="ignore", invalid="ignore"):
        at = model.mount + arc_position(κ, ψa, length)
    return Tips(
        q[:, :3] + np.einsum("nij,nj->ni", R, at),
        R @ arc_rotation(κ, ψa, length),
        R @ arc_rotation(κ, ψa, length, "frenet"),
    )


def table_errors(coupled: Tips, other: Tips, reading: Reading) -> tuple[float, float]:
    """Return the errors of translation and rotation, as the table may list them.

    Of "per axis" and "pooled" without unit, of "rmse" in m and rad. NaN of flights that end early,
    inf where an axis differs that has no range to divide by.
    """
    axes = ["xyz".index(name) for name in reading.axes]
    moved = error(coupled.position[:, axes], other.position[:, axes], reading.metric, reading.range)
    if reading.angles == "geodesic":
        return moved, geodesic(coupled, other)
    turned = [euler_angles(each, reading.angles) for each in (coupled, other)]
    return moved, error(turned[0], turned[1], reading.metric, reading.range)


def error(reference: Array, other: Array, metric: str, span: str = "coupled") -> float:
    """Return the error of samples (n, components) in a metric of `Reading`.

    "per axis": √Σᵢ (RMSEᵢ/rangeᵢ)². "pooled": √(Σᵢ RMSEᵢ² / Σᵢ rangeᵢ²), as the paper prints it.
    "rmse": √Σᵢ RMSEᵢ². span: whether the range is that of the reference ("coupled") or of both
    ("joint"). Components that are equal and at rest count 0.
    """
    squares = np.mean((reference - other) ** 2, axis=0)
    squares[squares <= _NOISE**2] = 0.0
    ranged = reference if span == "coupled" else np.concatenate([reference, other])
    ranges = np.ptp(ranged, axis=0)
    ranges[ranges <= _NOISE] = 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        if metric == "per axis":
            found = np.where(squares == 0.0, 0.0, squares / ranges**2).sum()
        elif metric == "pooled":
            total = squares.sum()
            found = np.where(total == 0.0, 0.0, total / (ranges**2).sum())
        else:
            found = squares.sum()
    return float(np.sqrt(found))


def geodesic(coupled: Tips, other: Tips) -> float:
    """Return the RMS angle between the tips [rad]."""
    apart = np.einsum("nji,njk->nik", coupled.untwisted, other.untwisted)
    if not np.isfinite(apart).all():
        return float("nan")
    return float(np.sqrt(np.mean(Rotation.from_matrix(apart).magnitude() ** 2)))


def euler_angles(tip: Tips, angles: str) -> Array:
    """Return ZYX Euler angles (n, 3) of a tip as a reading names them: roll, pitch, yaw [rad]."""
    R = tip.frenet if angles.startswith("frenet") else tip.untwisted
    if not np.isfinite(R).all():
        return np.full((len(R), 3), np.nan)
    if angles.endswith("continuous"):
        return continuous_euler(Rotation.from_matrix(R).as_quat())
    # In planar flights rounding alone would choose between -π and π.
    sines = np.where(np.abs(R) < _NOISE, 0.0, R)
    return np.stack(
        [
            np.arctan2(sines[:, 2, 1], R[:, 2, 2]),
            np.arcsin(np.clip(-R[:, 2, 0], -1.0, 1.0)),
            np.arctan2(sines[:, 1, 0], R[:, 0, 0]),
        ],
        axis=-1,
    )
