"""Measured static poses of a clamped arm: tensions of its tendons, and points of markers on it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.analysis.clamped import ClampedArm
from continuair.analysis.equilibria import equilibria
from continuair.errors import InputError, nearest, shown
from continuair.files import printed, user_path
from continuair.identification.csv_rows import numbers_of, rows_of
from continuair.typing import Array, ArrayLike
from continuair.vehicle.arms import ArmChain
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle, check_vehicle

_FARTHER = 1.3
"""Most distance of a marker from the base over the arm's length up to it, which may stretch."""

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Marker:
    """Where a marker sits on an arm.

    Parameters
    ----------
    section : str, optional
        Name or index of its section. Default: the last of the arm.
    distance : float, optional
        Arc length from the section's base [m]. Default: the section's end.
    offset : array_like, shape (3,), optional
        From the backbone, in axes of the cross-section [m]. These are those of the arm's base where
        the arm is straight; -z is its tangent.

    Raises
    ------
    InputError
        If a value is not a number, or the distance is below 0.
    """

    section: str = ""
    distance: float | None = None
    offset: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.distance is not None:
            distance = checks.number("distance", self.distance, least=0.0, otherwise=" [m]")
            object.__setattr__(self, "distance", float(distance))
        object.__setattr__(self, "section", str(self.section))
        object.__setattr__(self, "offset", checks.vector("offset", self.offset, 3))


@dataclass(frozen=True)
class StaticPoses:
    """Poses at which an arm rests on a clamped base, under gravity and tensions of its tendons.

    Parameters
    ----------
    name : str
        Name, for messages.
    tensions : array_like, shape (poses, tendons)
        Tension of every tendon of the arm, in their order there [N]. A vehicle's pretension does
        not count here.
    points : array_like, shape (poses, markers, 3)
        Measured points of the markers [m]; nan where one was not seen.
    markers : sequence of Marker
        Where the markers sit, in the order of the points.
    arm : str, optional
        Name or index of the arm. Default: the first.
    position : array_like, shape (3,), optional
        The arm's base in the axes of the points [m]. Default: their origin.
    attitude : array_like, shape (4,), optional
        Quaternion x y z w from axes of the arm's base to those of the points. A straight arm points
        along -z of its base. Default: the same axes.
    gravity : array_like, shape (3,), optional
        Acceleration of gravity in the axes of the points [m/s²].
    spread : float or array_like (poses,), optional
        Standard deviation of a coordinate of a point [m], for reports.
    labels : sequence of str, optional
        Names of the poses, for messages. Default: their indices.

    Raises
    ------
    InputError
        If a value has another shape, or a tension is below 0 or not finite.

    Notes
    -----
    The arm rests at a minimum of its energy that is reached from its shape without loads as gravity
    and tensions grow together. Tendons have no friction here.
    """

    name: str
    tensions: Array
    points: Array
    markers: Sequence[Marker]
    arm: str = ""
    position: ArrayLike = (0.0, 0.0, 0.0)
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    gravity: ArrayLike = (0.0, 0.0, -9.81)
    spread: ArrayLike | None = None
    labels: Sequence[str] = field(default=())

    def __post_init__(self) -> None:
        tensions = checks.finite_array(self.tensions)
        if tensions is None or tensions.ndim != 2 or not tensions.size or tensions.min() < 0.0:
            raise InputError(
                "tensions",
                f"of the poses is {shown(self.tensions)}",
                "give a row of finite tensions of 0 or more for each pose [N]",
            )
        points, expected = _with_gaps(self.points), (len(tensions), len(self.markers), 3)
        if points is None or points.shape != expected:
            given = shown(self.points) if points is None else f"of shape {points.shape}"
            raise InputError(
                "points", f"of the poses is {given}", f"give numbers or nan of shape {expected}"
            )
        if np.isnan(points).all():
            raise InputError("points", "of the poses holds nan alone", "give what was measured")
        turn = checks.vector("attitude", self.attitude, 4)
        if not np.linalg.norm(turn) > 0.0:
            raise InputError("attitude", f"is {shown(self.attitude)}", "give a unit quaternion")
        labels = tuple(map(str, self.labels or range(len(tensions))))
        if len(labels) != len(tensions):
            raise InputError(
                "labels", f"holds {len(labels)} names of {len(tensions)} poses", "give one each"
            )
        found = {
            "tensions": tensions, "points": points, "labels": labels, "attitude": turn,
            "markers": tuple(self.markers), "spread": _spreads(self.spread, len(tensions)),
            "position": checks.vector("position", self.position, 3),
            "gravity": checks.vector("gravity", self.gravity, 3),
        }  # fmt: skip
        for name, value in found.items():
            object.__setattr__(self, name, value)

    def predict(self, vehicle: Vehicle) -> Array:
        """Return where the markers of resting arms are.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, or a batch.

        Returns
        -------
        ndarray, shape (runs, poses, markers, 3)
            Points in the axes of the measured ones [m]; nan where no stable equilibrium was found.

        Raises
        ------
        InputError
            If arm, sections, tendons or distances are not those of the vehicle.
        """
        chain, runs = self._arm(vehicle), vehicle.runs or 1
        of_section, places = self._places(chain, runs)
        arm = ClampedArm(chain, runs, places)
        if arm.tendons != self.tensions.shape[1]:
            raise InputError(
                "tensions",
                f"has {self.tensions.shape[1]} columns, but arm {chain.name} has {arm.tendons} "
                "tendons",
                "give one for each, group by group",
            )
        poses, turn = len(self.tensions), Rotation.from_quat(np.asarray(self.attitude))
        run = np.repeat(np.arange(runs), poses)
        gravity = np.broadcast_to(turn.inv().apply(np.asarray(self.gravity)), (len(run), 3))
        q = equilibria(arm, run, np.tile(self.tensions, (runs, 1)), gravity)
        points, axes = arm.markers(np.nan_to_num(q), run)
        found = np.empty((len(run), len(self.markers), 3))
        for section, members in enumerate(of_section):
            offsets = np.array([self.markers[each].offset for each in members]).reshape(-1, 3)
            off = (axes[section] @ offsets[..., None])[..., 0]
            found[:, members] = points[section] + off
        found[np.isnan(q[:, 0])] = np.nan
        placed = turn.apply(found.reshape(-1, 3)) + np.asarray(self.position)
        return placed.reshape(runs, poses, len(self.markers), 3)

    @property
    def groups(self) -> int:
        """Return the number of poses."""
        return len(self.points)

    def measured(self, vehicle: Vehicle) -> Array:
        """Return the measured points; raise InputError if they are not those of such a vehicle.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle.

        Returns
        -------
        ndarray, shape (poses, markers, 3)
            Points [m]; nan where one was not seen.
        """
        self.check_reach(vehicle)
        return self.points

    def predictor(self, vehicle: Vehicle) -> Callable[[Vehicle], Array]:
        """Return `predict`, as other recordings of a joint fit do for vehicles like a given one.

        Parameters
        ----------
        vehicle : Vehicle
            One vehicle.

        Returns
        -------
        callable
            From a vehicle or a batch to points (runs, poses, markers, 3) [m].
        """
        return self.predict

    def residuals(self, vehicle: Vehicle) -> Array:
        """Return predicted less measured coordinates of all markers.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, or a batch.

        Returns
        -------
        ndarray, shape (runs, poses * markers * 3)
            Differences [m], pose by pose and marker by marker, without those of points that were
            not measured; nan where no stable equilibrium was found.

        Raises
        ------
        InputError
            If the poses are not those of such a vehicle: as `predict`, or if a point is farther
            from the base than the arm reaches.
        """
        self.check_reach(vehicle)
        found = self.predict(vehicle) - self.points
        return np.asarray(found[:, ~np.isnan(self.points)])

    def check_reach(self, vehicle: Vehicle) -> None:
        """Raise InputError for a point farther from the base than the arm is long up to its marker.

        Parameters
        ----------
        vehicle : Vehicle
            The vehicle, or a batch.
        """
        chain, runs = self._arm(vehicle), vehicle.runs or 1
        lengths = np.array([per_run(each.length, runs).max() for each in chain.section])
        begins = np.concatenate([[0.0], np.cumsum(lengths)])
        of_section, places = self._places(chain, runs)
        most = np.empty(len(self.markers))
        for section, members in enumerate(of_section):
            most[members] = begins[section] + places[section].max(0)
        offsets = np.array([np.linalg.norm(np.asarray(marker.offset)) for marker in self.markers])
        most = _FARTHER * most + offsets + 0.01 * begins[-1]
        far = np.linalg.norm(self.points - np.asarray(self.position), axis=-1)
        wrong = far > most
        if not wrong.any():
            return
        pose, marker = np.argwhere(wrong)[0]
        known = ~np.isnan(far)
        in_metres = (1e-3 * far[known] <= np.broadcast_to(most, far.shape)[known]).all()
        millimetres = in_metres and np.nanmedian(far) > 10.0 * begins[-1]
        raise InputError(
            "points",
            f"has marker {marker} of pose {self.labels[pose]} {far[pose, marker]:.4g} m from the "
            f"base, but the arm reaches {most[marker]:.3g} m up to it",
            "give metres, not millimetres" if millimetres
            else "give the points in metres from the base, in the order of the markers",
        )  # fmt: skip

    def _arm(self, vehicle: Vehicle) -> ArmChain:
        """Return the arm, or raise InputError."""
        arms = check_vehicle(vehicle).arms
        names = [each.name or str(index) for index, each in enumerate(arms)]
        if not arms:
            raise InputError("vehicle", "has no arm", "give one whose arm was measured")
        return arms[_index("arm", self.arm, names) if self.arm else 0]

    def _places(self, chain: ArmChain, runs: int) -> tuple[list[list[int]], list[Array]]:
        """Return the markers of each section, and their distances (runs, n) from its base [m]."""
        names = [each.name or str(index) for index, each in enumerate(chain.section)]
        members: list[list[int]] = [[] for _ in names]
        places: list[list[Array]] = [[] for _ in names]
        for index, marker in enumerate(self.markers):
            where = f"markers.{index}.section"
            own = _index(where, marker.section, names) if marker.section else len(names) - 1
            length = per_run(chain.section[own].length, runs)
            at = length if marker.distance is None else np.full(runs, marker.distance)
            if (at > length * (1.0 + 1e-9)).any():
                raise InputError(
                    f"markers.{index}.distance",
                    f"is {marker.distance}, beyond the end of section {names[own]}",
                    f"give at most its length, {float(length.min()):g} m",
                )
            members[own].append(index)
            places[own].append(at)
        return members, [np.array(each).reshape(-1, runs).T for each in places]


def _index(name: str, given: str, names: list[str]) -> int:
    """Return the index of a name, or of an index as text, or raise InputError."""
    if given in names:
        return names.index(given)
    if given.isdecimal() and int(given) < len(names):
        return int(given)
    raise InputError(name, f"is {given!r}, which the vehicle does not have", nearest(given, names))


def _with_gaps(value: object) -> Array | None:
    """Return finite numbers and nan as an array, or None for anything else."""
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        return None
    if given.dtype.kind not in "iuf":
        return None
    found = np.array(given, float)
    return None if np.isinf(found).any() else found


def _spreads(value: ArrayLike | None, poses: int) -> Array | None:
    if value is None:
        return None
    found = checks.row("spread", value, poses)
    if not (found >= 0.0).all():
        raise InputError("spread", f"is {shown(value)}", "give 0 or more [m]")
    return np.broadcast_to(found, poses).copy()


def load_poses(
    path: str | os.PathLike[str],
    markers: Sequence[Marker],
    *,
    arm: str = "",
    position: ArrayLike = (0.0, 0.0, 0.0),
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    gravity: ArrayLike = (0.0, 0.0, -9.81),
) -> StaticPoses:
    """Read measured static poses from a CSV file, a row per pose.

    Parameters
    ----------
    path : str or path
        File with a line of headings: ``tension_1`` and so on, of every tendon of the arm [N];
        ``x_1``, ``y_1``, ``z_1`` and so on, the points of every marker [m], empty where it was not
        seen; optionally ``pose``, a name, and ``spread``, the standard deviation of a coordinate
        [m].
    markers : sequence of Marker
        Where the markers sit, in the order of the columns.
    arm, position, attitude, gravity : optional
        As in `StaticPoses`.

    Returns
    -------
    StaticPoses
        The poses.

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing, unknown or there twice, or a cell is not a
        number. Row 1 is the first below the headings.
    """
    file = user_path("data", path)
    where, (headings, rows) = printed(file), rows_of("data", file)
    if not rows:
        raise InputError("data", "holds no poses", "give headings and a row per pose").located(
            where
        )
    tendons = sum(name.startswith("tension_") for name in headings)
    tensions = [f"tension_{index + 1}" for index in range(max(tendons, 1))]
    points = [f"{axis}_{index + 1}" for index in range(len(markers)) for axis in _AXES]
    known = ["pose", *tensions, *points, "spread"]
    for name in headings:
        if name not in known:
            raise InputError(
                shown(name), "is no known column", f"name the columns {', '.join(known)}"
            ).located(where)

    wanted = [*tensions, *points, *(["spread"] if "spread" in headings else [])]
    table = numbers_of(where, headings, rows, wanted)
    ends = np.cumsum([len(tensions), len(points)])
    pulled, seen, spread = np.split(table, ends, axis=1)
    pose = headings.index("pose") if "pose" in headings else len(headings)
    try:
        return StaticPoses(
            name=file.name,
            tensions=pulled,
            points=seen.reshape(len(rows), -1, 3),
            markers=markers,
            arm=arm,
            position=position,
            attitude=attitude,
            gravity=gravity,
            spread=spread[:, 0] if spread.size else None,
            labels=[row[pose].strip() for row in rows if pose < len(row)],
        )
    except InputError as error:
        raise error.located(where) from None
