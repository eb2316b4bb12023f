"""Motion of a vehicle over a flight: position, attitude, and points along its arms."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair import checks
from continuair.analysis.backbone import along, along_at, parts, placed, stations
from continuair.errors import InputError, shown
from continuair.flight.labels import in_order
from continuair.flight.reading import vehicle_of, vehicles_of
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle, check_has_arms, check_single_vehicle

_NEEDED = {"position": "axis", "attitude": "quaternion"}
"""Variables that give the base's configuration, and the dimension of each."""

_OF_ARMS = {"bend": "bend_axis", "strain": "strain_coordinate"}
"""Variables of which one gives that of the arms, and the dimension of each."""


_OFF_UNIT = 1e-3
"""Tolerance of the norm of a quaternion."""

_OFF_TIP = 1e-6
"""Tolerance between a logged tip and the backbone's end, in arm lengths."""

_OFF_FEW_NODES = 2e-2
"""The same of a section with fewer nodes than by default: with the fewest, its tip is off by up to
0.011 of its length."""


@dataclass(frozen=True)
class Motion:
    """One flight up to its end; rows are samples.

    time (n,) [s], position (n, 3) [m], attitude (n, 4) x y z w, bend (n, bends): the
    coordinates of all sections; dataset: all logged variables, up to the same end.
    """

    vehicle: Vehicle
    time: Array
    position: Array
    attitude: Array
    bend: Array
    dataset: xr.Dataset

    def at(self, rate: float) -> Motion:
        """Return the motion with at most `rate` samples per second, the last one included."""
        return self.rows(evenly(self.time, rate))

    def rows(self, chosen: NDArray[np.int64] | slice) -> Motion:
        """Return the motion at some of its samples."""
        return Motion(
            self.vehicle, self.time[chosen], self.position[chosen], self.attitude[chosen],
            self.bend[chosen], self.dataset.isel(time=chosen),
        )  # fmt: skip


def backbone(vehicle: Vehicle, flight: xr.Dataset, points: int = 41) -> xr.DataArray:
    """Return points along the arms over a flight, in world axes.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle with arms, that of the flight.
    flight : xarray.Dataset
        Flight of `simulate`, with position, attitude and bend.
    points : int, optional
        Points per arm, evenly spaced from its mount, point 0, to its tip.

    Returns
    -------
    xarray.DataArray
        Points [m] over (..., time, arm, point, axis), without `arm` for a vehicle with an [arm]
        table; coordinate `arc_length` [m]. NaN after a run has stopped.

    Raises
    ------
    InputError
        If an argument cannot be used, or the flight is of another vehicle.

    Notes
    -----
    Each section is an arc of constant curvature, Eqs. (1) and (2), Amiri et al. (2026).
    """
    check_has_arms(check_single_vehicle(vehicle, strain=True))
    count = int(checks.number("points", points, least=2))
    place, attitude, bend = poses(flight, vehicle)
    flight = in_order(flight, vehicle)
    bodies = [along(arm, part, count)[0] for arm, part in parts(vehicle, bend)]
    world = np.stack([placed(place, attitude, points) for points in bodies], axis=-3)
    lengths = np.stack([stations(arm, count) for arm in vehicle.arms])
    leading = [
        str(dim) for dim in flight["attitude"].transpose(..., "time", "quaternion").dims[:-1]
    ]
    labels: dict[Hashable, object] = {
        name: flight[name] for name in (*leading, "axis") if name in flight.coords
    }
    if vehicle.has_arm_list:
        labels["arm"] = [arm.name for arm in vehicle.arms]
        return _labelled(world, [*leading, "arm", "point", "axis"], labels, lengths)
    return _labelled(world[..., 0, :, :], [*leading, "point", "axis"], labels, lengths[0])


def motion_of(flight: object, vehicle: Vehicle | None = None) -> Motion:
    """Return the motion of a result; InputError unless it is that of one flight.

    vehicle: by default the one stored in the result.
    """
    given = over_time(flight)
    _check_one_flight(given)
    given = given.transpose("time", "arm", "section", ..., missing_dims="ignore")
    flown = vehicle_of(given) if vehicle is None else check_single_vehicle(vehicle, strain=True)
    given = in_order(given, flown)
    position, attitude, bend = poses(given, flown)
    time = given["time"].to_numpy()
    valid = np.isfinite(np.column_stack([position, attitude, bend]))
    end = int(np.argmin(np.append(valid.all(axis=1), False)))
    if end == 0:
        raise InputError(
            "flight", "has no finite sample at its start", "give a flight that did not fail at once"
        )
    return Motion(flown, time, position, attitude, bend, given).rows(slice(end))


def poses(flight: xr.Dataset, vehicle: Vehicle) -> tuple[Array, Array, Array]:
    """Return position (..., time, 3), attitude (..., time, 4) and bend (..., time, bends).

    Raises InputError if it is not a flight of this vehicle.
    """
    flight = in_order(over_time(flight), vehicle)
    place = flight["position"].transpose(..., "time", "axis")
    attitude = flight["attitude"].transpose(..., "time", "quaternion")
    bends = coordinates_of(flight.transpose(..., "time", "section", missing_dims="ignore"), vehicle)
    position, turns = (np.asarray(each, float) for each in (place, attitude))
    check_turns("attitude", turns)
    _check_tips(flight, vehicle, position, turns, bends)
    return position, turns, bends


def arm_variable(flight: xr.Dataset) -> str:
    """Return the name of the variable that gives the configuration of the arms in a flight."""
    return "strain" if "strain" in flight else "bend"


def coordinates_of(flight: xr.Dataset, vehicle: Vehicle) -> Array:
    """Return the coordinates of all sections (..., bends) in a flight, InputError without them."""
    name = "strain" if vehicle.layout.strains else "bend"
    if name not in flight:
        raise InputError(
            "flight",
            f"has no {name}, which describes the sections of vehicle {shown(vehicle.name)}",
            "give the vehicle that was simulated",
        )
    if vehicle.layout.strains:
        found = flight["strain"].transpose(..., "strain_coordinate").to_numpy()
        count, has = found.shape[-1], f"{found.shape[-1]} coordinates of strain"
    else:
        bend = flight["bend"]
        bend = bend if "section" in bend.dims else bend.expand_dims(section=1, axis=-1)
        bend = bend.transpose(..., "section", "bend_axis")
        count, has = int(np.prod(bend.shape[-2:])), f"{bend.sizes['section']} sections"
        found = bend.to_numpy().reshape(*bend.shape[:-2], -1)
    if count != vehicle.layout.bends:
        raise InputError(
            "flight",
            f"has {has}, but vehicle {shown(vehicle.name)} has {vehicle.sections} sections",
            "give the vehicle that was simulated",
        )
    return np.asarray(found, float)


def evenly(times: Array, rate: float, least: int = 0) -> NDArray[np.int64]:
    """Return the indices of samples nearest to evenly spaced times, the last one included.

    rate: at most so many per second; least: number of indices, if there are as many samples.
    """
    count = max(int(np.ceil((times[-1] - times[0]) * rate)) + 1, least)
    if count >= len(times):
        return np.arange(len(times))
    wanted = np.linspace(times[0], times[-1], count)
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    earlier = wanted - times[after - 1] < times[after] - wanted
    return np.unique(after - earlier).astype(np.int64)


def over_time(flight: object) -> xr.Dataset:
    """Return a flight with position, attitude and bend; InputError for anything else.

    The position may be among the coordinates q.
    """
    if not isinstance(flight, xr.Dataset):
        raise InputError("flight", f"is {shown(flight)}", "give a Dataset of continuair.simulate")
    if "position" not in flight and "q" in flight:
        q = flight["q"]
        place = q.isel(coordinate=slice(3))
        if "coordinate" in q.coords:
            # In this order, however they were selected.
            place = q.isel(coordinate=q.indexes["coordinate"].get_indexer(list("xyz")))
            if place["coordinate"].to_numpy().tolist() != list("xyz"):
                raise InputError(
                    "flight", "lacks coordinates x, y or z", "give all that was simulated"
                )
        place = place.rename(coordinate="axis").assign_coords(axis=list("xyz"))
        flight = flight.assign(position=place)
    if "bend" not in flight and any(not vehicle.arms for vehicle in vehicles_of(flight)):
        bend = np.zeros((*flight["time"].shape, 0, 2))
        flight = flight.assign(bend=(("time", "section", "bend_axis"), bend))
    of_arms = arm_variable(flight)
    for name, last in (_NEEDED | {of_arms: _OF_ARMS[of_arms]}).items():
        if name not in flight or not {"time", last} <= set(flight[name].dims):
            raise InputError(
                "flight",
                f"has no {name} over time",
                "give a result of continuair.simulate with position, attitude and bend",
            )
    _check_times(flight)
    return flight


def _check_times(flight: xr.Dataset) -> None:
    """Raise InputError unless times are finite and increasing."""
    times = np.asarray(flight.coords.get("time", np.empty(0)), float)
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        at = int(np.argmin(np.append(True, np.diff(times) > 0.0) & np.isfinite(times)))
        raise InputError(
            "time",
            f"is {times[at]:.6g} at sample {at}, but must be finite and increasing",
            "sort the samples, as with flight.sortby('time')",
        )


def check_turns(name: str, attitude: Array) -> None:
    """Raise InputError for quaternions not of unit length, such as means or interpolated values.

    NaN passes, as after a run has stopped.
    """
    length = np.linalg.norm(attitude, axis=-1)
    if (np.abs(length - 1.0) > _OFF_UNIT).any():
        odd = float(length[np.abs(length - 1.0) > _OFF_UNIT][0])
        raise InputError(name, f"has a quaternion of length {odd:.4g}", "give unit quaternions")


def _check_tips(
    flight: xr.Dataset, vehicle: Vehicle, place: Array, attitude: Array, bend: Array
) -> None:
    """Raise InputError unless the tips agree with the logged ones."""
    if "tip_position" not in flight:
        _check_arms(flight, vehicle)
        return
    said = flight["tip_position"]
    said = said if "arm" in said.dims else said.expand_dims("arm")
    logged = said.transpose(..., "time", "arm", "axis").to_numpy()
    ends = [along(arm, own, 2)[0] for arm, own in parts(vehicle, bend)]
    tips = np.stack([placed(place, attitude, points)[..., -1, :] for points in ends], axis=-2)
    rounding = 4.0 * np.finfo(logged.dtype).eps * np.nan_to_num(np.abs(logged)).max(initial=0.0)
    sections = [section for arm in vehicle.arms for section in arm.section]
    few = any(each.nodes and each.nodes < each.orders.nodes for each in sections)
    allowed = (_OFF_FEW_NODES if few else _OFF_TIP) * float(vehicle.reach) + rounding
    same = logged.shape == tips.shape
    off = float(np.nan_to_num(np.abs(logged - tips)).max(initial=0.0)) if same else np.inf
    if off > allowed:
        raise InputError(
            "vehicle",
            (
                f"is {shown(vehicle.name)}, whose tips are {off:.3g} m from the flight's "
                "tip_position"
            ),
            "give the vehicle that was simulated",
        )


def _check_arms(flight: xr.Dataset, vehicle: Vehicle) -> None:
    """Raise InputError unless the arms have the lengths and mounts of those in the result, if
    stored."""
    given, allowed = _ends(vehicle), _OFF_TIP * float(vehicle.reach)
    for flown in map(_ends, vehicles_of(flight)):
        same = flown.shape == given.shape
        off = float(np.abs(flown - given).max(initial=0.0)) if same else np.inf
        if off > allowed:
            raise InputError(
                "vehicle",
                (
                    f"is {shown(vehicle.name)}, whose straight arms end {off:.3g} m from "
                    "those of the flight"
                ),
                "give the vehicle that was simulated",
            )


def _ends(vehicle: Vehicle) -> Array:
    """Return the ends of each section of each straight arm (n, 3) [m], body axes."""
    straight = parts(vehicle, np.zeros(vehicle.layout.bends))
    joints = [np.cumsum([0.0, *(each.length for each in arm.section)]) for arm in vehicle.arms]
    found = [along_at(arm, bend, s)[0] for (arm, bend), s in zip(straight, joints, strict=True)]
    return np.concatenate([np.zeros((0, 3)), *found])


def _check_one_flight(flight: xr.Dataset) -> None:
    """Raise InputError unless a dataset is of one run of one model, with a coordinate time."""
    dims = [str(dim) for dim in flight[arm_variable(flight)].dims]
    extra = [dim for dim in dims if dim not in ("time", "section", *_OF_ARMS.values())]
    if extra:
        count = " and ".join(f"{flight.sizes[dim]} by {dim}" for dim in extra)
        given = ", ".join(f"{dim}=0" for dim in extra)
        raise InputError("flight", f"has {count}", f"select one, as in flight.isel({given})")
    if "time" not in flight.coords:
        raise InputError("flight", "has no coordinate time", "keep it")


def _labelled(
    values: Array, dims: list[str], labels: dict[Hashable, object], lengths: Array
) -> xr.DataArray:
    """Return points as a DataArray with the coordinate arc_length."""
    measured = (dims[-1 - lengths.ndim : -1], lengths, {"units": "m"})
    told = {"units": "m", "long_name": "points along the arms, world axes"}
    return xr.DataArray(values, labels | {"arc_length": measured}, dims, "backbone", told)
