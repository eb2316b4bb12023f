"""Differences between two flights: the paper's metric as printed, and metrics with units.

Arrays have samples and components on their last two axes (..., samples, components). Leading axes
are runs; results then hold one number per run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from continuair.analysis.motion import check_turns
from continuair.errors import InputError, shown
from continuair.flight.labels import FIXED, ordered
from continuair.flight.provenance import model_of
from continuair.flight.reading import check_arms_flown
from continuair.flight.resolution import (
    tells_rotation,
    warn_of_lost_angles,
    warn_of_overstated_angles,
)
from continuair.kernels.deviations import ROUNDING
from continuair.kernels.dynamics import REFERENCE
from continuair.typing import Array, ArrayLike
from continuair.vehicle.arc import sections_of
from continuair.vehicle.coordinates import continuous_euler, paper_rates
from continuair.vehicle.following import CHANGE, unfollowed
from continuair.vehicle.layout import Layout
from continuair.vehicle.vehicle import Vehicle
from continuair.warning import warn

_TIP = ("tip_position", "tip_attitude")

_SAME_TIME = 1e-12
"""Relative tolerance of equal sample times, which are rounded."""

_RATES = {"velocity": "axis", "angular_velocity": "axis", "bend_rate": "bend_axis"}
"""Rates without a singularity, and the dimension of each."""

TRANSIENT = 2.0
"""|DS| is evaluated from this time on [s], after the initial transient of a closed loop."""

AXES = ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")
"""Axes in the order of `compare`, with their units."""


def samples(flight: xr.Dataset, name: str, component: str) -> Array:
    """Return a variable with fixed last dimensions.

    Parameters
    ----------
    flight : xarray.Dataset
        The flight.
    name : str
        The variable.
    component : str
        Its dimension of components, such as "axis".

    Returns
    -------
    ndarray, shape (..., time, component)
        The values.

    Raises
    ------
    InputError
        If the flight lacks the variable.
    """
    if name not in flight:
        raise InputError("flight", f"has no {name}", "give one of arcs, simulated with it")
    values: Array = flight[name].transpose(..., "time", component).to_numpy()
    return values


def feature_norm(flight: xr.Dataset) -> Array:
    """Return ‖e‖, the norm of the stacked errors of all feature points.

    Parameters
    ----------
    flight : xarray.Dataset
        Flight with `feature_error`.

    Returns
    -------
    ndarray, shape (..., time)
        The norm [px]; NaN while a point is behind the camera.
    """
    norm: Array = np.linalg.norm(samples(flight, "feature_error", "pixel"), axis=-1)
    return norm


def feature_rms(flight: xr.Dataset) -> float | Array:
    """Return the RMS of the feature errors over coordinates and samples.

    Parameters
    ----------
    flight : xarray.Dataset
        Flight with `feature_error`.

    Returns
    -------
    float or ndarray
        The RMS [px], an array over runs; NaN if a point is behind the camera at a sample.
    """
    error = samples(flight, "feature_error", "pixel")
    return _per_run(np.sqrt(np.mean(error**2, axis=(-2, -1))))


def norm_difference(coupled: xr.Dataset, other: xr.Dataset) -> Array:
    """Return DS = ‖e‖_c - ‖e‖_d of the stacked feature errors, Amiri et al. (2026).

    Parameters
    ----------
    coupled, other : xarray.Dataset
        Flights with `feature_error`.

    Returns
    -------
    ndarray, shape (..., time)
        The difference [px].
    """
    return feature_norm(coupled) - feature_norm(other)


def joint_speed(flight: xr.Dataset) -> Array:
    """Return ‖q̇‖ of one run, of the paper's q = [x y z φ θ ψ κ ψa].

    Parameters
    ----------
    flight : xarray.Dataset
        One run, with `q`, `velocity`, `angular_velocity` and `bend_rate`.

    Returns
    -------
    ndarray, shape (time,)
        The norm in mixed units [m/s, rad/s, 1/(m s), rad/s]; NaN at a pitch of ±π/2, where Euler
        angles have no rates.

    Notes
    -----
    All sections count. ψ̇a is the component of the bend rate across its direction, over κ. It grows
    without bound where the bend passes zero.
    """
    q = samples(flight, "q", "coordinate")
    layout = Layout.of_arcs(sections_of(q))
    state = np.zeros((flight.sizes["time"], layout.state))
    for name, values in zip(_RATES, _rates(flight), strict=True):
        # A velocity is as long in body axes as in the world's.
        state[:, getattr(layout, name)] = values
    norm: Array = np.linalg.norm(paper_rates(q, state), axis=-1)
    return norm


def regular_speed(flight: xr.Dataset) -> Array:
    """Return the norm of velocity, angular velocity and bend rate.

    Parameters
    ----------
    flight : xarray.Dataset
        Flight with `velocity`, `angular_velocity` and `bend_rate`.

    Returns
    -------
    ndarray, shape (..., time)
        The norm in mixed units [m/s, rad/s, 1/(m s)], without the singularities of ‖q̇‖.
    """
    norm: Array = np.linalg.norm(np.concatenate(_rates(flight), axis=-1), axis=-1)
    return norm


def _rates(flight: xr.Dataset) -> list[Array]:
    """Rates of _RATES, each (..., time, components), the bends of all sections in turn."""
    found = []
    for name, dimension in _RATES.items():
        values = samples(flight, name, dimension)
        if "section" in flight[name].dims:
            values = flight[name].transpose(..., "time", "section", dimension).to_numpy()
            values = values.reshape(*values.shape[:-2], -1)
        found.append(values)
    return found


def nrmse(reference: ArrayLike, other: ArrayLike) -> float | Array:
    """Return the normalised root mean square error as the paper prints it.

    Parameters
    ----------
    reference, other : array_like, shape (..., samples, components)
        Values in the same unit.

    Returns
    -------
    float or ndarray
        NRMSE [-]: 0 if the two agree, inf if they differ and the reference is constant, both but
        for rounding.

    Notes
    -----
    "NRMSE_W", Amiri et al. (2026). Both sums are over components and samples; the range of each
    component is that of the reference.
    """
    return _nrmse(reference, other, unit=0.0)


def _nrmse(reference: ArrayLike, other: ArrayLike, *, unit: float) -> float | Array:
    """Return `nrmse` for numbers rounded like those of size `unit`.

    Such as tip positions near the origin, and angles.
    """
    reference, other = np.asarray(reference, float), np.asarray(other, float)
    unsure = ROUNDING * np.maximum(np.max(np.abs(reference), axis=(-2, -1)), unit)
    error = np.sqrt(np.sum((reference - other) ** 2, axis=(-2, -1)) / reference.shape[-2])
    moved = np.sqrt(np.sum(np.ptp(reference, axis=-2) ** 2, axis=-1))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = error / np.where(moved <= unsure, 0.0, moved)
    return _per_run(np.where(error <= unsure, 0.0, ratio))


def rmse(reference: ArrayLike, other: ArrayLike) -> float | Array:
    """Return the RMS over samples of the norm of the difference, in the unit of the input.

    reference, other: (..., samples, components). Its square is the sum of the squares of the axes.
    """
    difference = np.asarray(reference, float) - np.asarray(other, float)
    return _per_run(np.sqrt(np.mean(np.sum(difference**2, axis=-1), axis=-1)))


def tip_euler(dataset: xr.Dataset) -> Array:
    """Return continuous ZYX Euler angles of the tip.

    Parameters
    ----------
    dataset : xarray.Dataset
        Flight with `tip_attitude`.

    Returns
    -------
    ndarray, shape (..., samples, 3)
        Roll, pitch and yaw of R_tip diag(1, -1, -1) [rad]; 0 without bend and rotation.

    Notes
    -----
    Of the two triples of an attitude, and their multiples of 2π, the one nearest to the previous
    sample is taken, so that angles do not jump when passing a pitch of π/2. Flights that pass this
    attitude on different sides may end multiples of 2π apart; `geodesic_angle` is not affected.
    Samples too coarse near this attitude, or for the angular velocity, do not determine the angles;
    `compare` warns of that.
    """
    return euler_angles(samples(dataset, "tip_attitude", "quaternion"))


def euler_angles(tip_attitude: ArrayLike) -> Array:
    """Return the angles of `tip_euler` from quaternions x y z w, shape (..., samples, 4)."""
    angles: Array = continuous_euler(_level(tip_attitude))
    return angles


def _level(tip_attitude: ArrayLike) -> Array:
    """Return attitudes (..., 4) of R_tip diag(1, -1, -1)."""
    x, y, z, w = np.moveaxis(np.asarray(tip_attitude, float), -1, 0)
    # The product with the half turn about x, (1, 0, 0, 0).
    return np.stack([w, z, -y, -x], axis=-1)


def _beside(reference: Array, angles: Array) -> Array:
    """Return continuous angles (..., samples, 3) as the triples that begin nearest to the
    reference's.

    Every attitude has two triples and their multiples of 2π. Flights compared from a later time on
    must not begin on different ones.
    """
    flipped = angles * [1.0, -1.0, 1.0] + np.pi
    triples = [each + 2.0 * np.pi * np.round((reference - each)[..., :1, :] / (2.0 * np.pi))
               for each in (angles, flipped)]  # fmt: skip
    off = [np.sum((each - reference)[..., :1, :] ** 2, axis=-1, keepdims=True) for each in triples]
    return np.where(off[0] <= off[1], *triples)


def rotation_metric(
    entries: Iterable[Mapping[str, float | Array]],
) -> Literal["rmse_r_rad", "angle_rad"]:
    """Return the rotational metric of `compare` that is valid for several flights.

    Parameters
    ----------
    entries : iterable of mapping
        Results of `compare`, or parts with `rmse_r_rad` and `angle_rad`.

    Returns
    -------
    {"rmse_r_rad", "angle_rad"}
        Euler angles, or the angle between tips if samples of any flight do not determine the Euler
        angles, or these overstate the rotation.
    """
    names = ("rmse_r_rad", "angle_rad")
    euler, angle = np.array([[entry[name] for name in names] for entry in entries], float).T
    return "rmse_r_rad" if tells_rotation(euler, angle).all() else "angle_rad"


def geodesic_angle(q1: ArrayLike, q2: ArrayLike) -> Array:
    """Return the angle of the rotation between attitudes.

    Parameters
    ----------
    q1, q2 : array_like, shape (..., 4)
        Unit quaternions x y z w; q and -q are the same attitude.

    Returns
    -------
    ndarray, shape (...)
        Angles, 0 to π [rad].
    """
    q1, q2 = np.asarray(q1, float), np.asarray(q2, float)
    v1, w1, v2, w2 = q1[..., :3], q1[..., 3:], q2[..., :3], q2[..., 3:]
    vector = w1 * v2 - w2 * v1 - np.cross(v1, v2)
    scalar = np.sum(q1 * q2, axis=-1)
    # Accurate for small angles, where the arc cosine of the scalar part loses half the digits.
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=-1), np.abs(scalar))
    return angle


def compare(coupled: xr.Dataset, other: xr.Dataset) -> dict[str, float | Array]:
    """Compare the tip of a flight with that of the coupled flight.

    Parameters
    ----------
    coupled : xarray.Dataset
        The reference flight.
    other : xarray.Dataset
        A flight of the same runs, with the same samples.

    Returns
    -------
    dict of str to float or ndarray
        ``nrmse_t``, ``nrmse_r``: NRMSE of tip position and continuous Euler angles, as printed [-].
        ``rmse_t_m`` [m], ``rmse_r_rad`` [rad]: the same, not normalised. ``angle_rad``: RMS of the
        geodesic angle [rad], the only rotational metric that does not depend on a choice of angles.
        ``rmse_x_m`` … ``rmse_yaw_rad``: per axis. Arrays are over runs, arms, and other dimensions
        that both flights have, in this order.

    Raises
    ------
    InputError
        If the two are not flights of the same runs with the same samples.

    Warns
    -----
    ContinuairWarning
        If results are NaN: for a run that stopped early, and for Euler angles that samples do not
        determine.

    Notes
    -----
    Samples do not determine Euler angles if an angle changes by more than 1 rad between samples, or
    between the first samples of the two flights, or if the tip passes a pitch of ±π/2 on a side
    that samples do not show.
    """
    flights = {"coupled": coupled, "other": other}
    for name, flight in flights.items():
        _check_flight(name, flight)
    coupled, other = (_in_order(flight) for flight in flights.values())
    other = _with_arms_of(coupled, other)
    _check_alike(coupled, other)
    along = _flights_along(coupled)
    coupled, other = (each.transpose(*along, ...) for each in (coupled, other))
    for name, flight in flights.items():
        _warn_of_ended(name, flight)
    found = differences(coupled, other)
    _warn_of_swapped(coupled, other)
    lost = np.isnan(found["nrmse_r"]) & np.isfinite(found["angle_rad"])
    warn_of_lost_angles(lost, float(np.diff(coupled["time"]).max(initial=0.0)), stacklevel=3)
    warn_of_overstated_angles(found["rmse_r_rad"], found["angle_rad"], stacklevel=3)
    return found


def _check_flight(name: str, flight: object) -> None:
    """Raise InputError unless a flight has a tip over time."""
    if not isinstance(flight, xr.Dataset):
        raise InputError(name, f"is {shown(flight)}", "give a Dataset that simulate returned")
    missing = [part for part in ("time", *_TIP) if part not in flight.variables]
    if missing:
        check_arms_flown(name, flight)
        raise InputError(
            name,
            f"has no {' and no '.join(missing)}",
            f"simulate it with variables {' and '.join(_TIP)}",
        )
    if "time" not in flight.dims:
        raise InputError(name, "is one sample of a flight", "give a flight with some over time")
    if not flight.sizes["time"]:
        raise InputError(name, "has no samples", "give a flight with some")


def _in_order(flight: xr.Dataset) -> xr.Dataset:
    """Return the flight with its axes in order."""
    found = ordered(flight, {name: FIXED[name] for name in ("axis", "quaternion")})
    return found.transpose("run", "arm", ..., missing_dims="ignore")


def _flights_along(flight: xr.Dataset) -> list[str]:
    """Return the dimensions along which a Dataset has tips, other than time and axis."""
    return [str(dim) for dim in flight["tip_position"].dims if dim not in ("time", "axis")]


def _with_arms_of(coupled: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """Return the other flight with its arms in the order of the first, if both have the same."""
    if not all("arm" in flight.indexes for flight in (coupled, other)):
        return other
    wanted, given = coupled.indexes["arm"], other.indexes["arm"]
    same = given.is_unique and len(wanted) == len(given) and wanted.isin(given).all()
    return other.sel(arm=wanted) if same else other


def _check_alike(coupled: xr.Dataset, other: xr.Dataset) -> None:
    """Raise InputError unless two flights have the same samples, runs and arms."""
    for name, flight in {"coupled": coupled, "other": other}.items():
        check_turns(f"tip_attitude of {name}", samples(flight, "tip_attitude", "quaternion"))
    wanted, given = (flight["time"].to_numpy() for flight in (coupled, other))
    many = len(wanted) != len(given)
    apart = 0.0 if many else np.abs(given - wanted).max()
    if many or apart > _SAME_TIME * np.abs(wanted).max():
        off = "" if many else f", by up to {apart:.2g} s"
        raise InputError(
            "other",
            f"has {len(given)} samples that differ from those of coupled ({len(wanted)}){off}",
            "simulate both with the same sample and duration",
        )
    for name in dict.fromkeys(("run", "arm", *_flights_along(coupled), *_flights_along(other))):
        _check_same_labels(name, coupled, other)


def _check_same_labels(name: str, coupled: xr.Dataset, other: xr.Dataset) -> None:
    """Raise InputError unless both flights have the same entries, in order, along a dimension."""
    sizes = [flight["tip_position"].sizes.get(name) for flight in (coupled, other)]
    each, along = (name, "") if name in ("run", "arm") else ("flight", f" along {name}")
    of = f"{each}s{along}"
    if sizes[0] != sizes[1]:
        held = [f"a single {each}{along}" if size is None else f"{size} {of}" for size in sizes]
        many = "coupled" if sizes[0] is not None else "other"
        raise InputError(
            "other",
            f"has {held[1]}, but coupled {held[0]}",
            f"give the same {of}, as in {many}.isel({name}=0)",
        )
    if all(name in flight.coords for flight in (coupled, other)):
        given, wanted = (np.ravel(flight[name]) for flight in (other, coupled))
        if not np.array_equal(given, wanted):
            raise InputError(
                "other",
                f"has the {of} {shown(given.tolist())}, but coupled {shown(wanted.tolist())}",
                f"give the same {of} in the same order",
            )


def _warn_of_ended(name: str, flight: xr.Dataset) -> None:
    """Warn of the first run that stopped early, or of missing samples."""
    told = flight[[each for each in ("status", "end_time") if each in flight.variables]]
    # A flight masked by `where` has them at each sample, some of them missing.
    told = told.max("time") if "time" in told.dims else told
    if "status" not in told.variables or not np.any(told["status"] > 0):
        _warn_of_missing(name, flight)
        return
    status = np.ravel(told["status"])
    run = int(np.flatnonzero(status > 0)[0])
    which = f"run {run} of {name}" if status.size > 1 else name
    end = f" at {np.ravel(told['end_time'])[run]:g} s" if "end_time" in told.variables else ""
    warn(
        f"{which} stopped early{end} with status {status[run]:g}; its differences are NaN. "
        "Compare complete runs.",
        stacklevel=3,
    )


def _warn_of_missing(name: str, flight: xr.Dataset) -> None:
    """Warn of samples without a tip."""
    lost = [flight[each].isnull().any(set(flight[each].dims) - {"time"}) for each in _TIP]
    missing = int((lost[0] | lost[1]).sum())
    if missing:
        warn(
            f"{name} lacks the tip at {missing} of {flight.sizes['time']} samples; its "
            "differences are NaN. Give flights without masked samples.",
            stacklevel=4,
        )


def _warn_of_swapped(coupled: xr.Dataset, other: xr.Dataset) -> None:
    """Warn if the second flight is the coupled one."""
    first, second = model_of(coupled), model_of(other)
    if second == REFERENCE and first not in ("", REFERENCE):
        warn(
            f"coupled is a flight of the model {first}, and other of {second}; give the coupled "
            "flight first, as errors are normalised by its range.",
            stacklevel=3,
        )


def at_camera(flight: xr.Dataset, vehicle: Vehicle) -> xr.Dataset:
    """Return a flight with only the arm that carries the camera.

    Parameters
    ----------
    flight : xarray.Dataset
        Flight of one arm or several.
    vehicle : Vehicle
        The vehicle that flew.

    Returns
    -------
    xarray.Dataset
        The flight without the dimension `arm`.
    """
    return flight.isel(arm=vehicle.camera_arm) if "arm" in flight.dims else flight


def differences(coupled: xr.Dataset, other: xr.Dataset) -> dict[str, float | Array]:
    """Return the result of `compare` for matching flights, without warnings.

    Parameters
    ----------
    coupled, other : xarray.Dataset
        Flights of the same runs with the same samples.

    Returns
    -------
    dict of str to float or ndarray
        As `compare`.
    """
    positions = [samples(dataset, "tip_position", "axis") for dataset in (coupled, other)]
    attitudes = [samples(dataset, "tip_attitude", "quaternion") for dataset in (coupled, other)]
    reference, angles = (euler_angles(attitude) for attitude in attitudes)
    turned = reference, _beside(reference, angles)
    lost = _lost(coupled, attitudes[0]) | _lost(other, attitudes[1])
    lost |= (np.abs(turned[1] - reference)[..., 0, :] > CHANGE).any(-1)
    # Tips with equal angles have no difference, even if these cannot be followed.
    lost &= (turned[1] != reference).any((-2, -1))
    turned[1][lost] = np.nan
    result: dict[str, float | Array] = {
        "nrmse_t": _nrmse(*positions, unit=1.0),
        "nrmse_r": _nrmse(*turned, unit=1.0),
        "rmse_t_m": rmse(*positions),
        "rmse_r_rad": rmse(*turned),
        "angle_rad": _per_run(np.sqrt(np.mean(geodesic_angle(*attitudes) ** 2, axis=-1))),
    }
    both = [np.concatenate(pair, axis=-1) for pair in zip(positions, turned, strict=True)]
    for index, axis in enumerate(AXES):
        result[f"rmse_{axis}"] = rmse(*(values[..., index : index + 1] for values in both))
    return result


def _lost(flight: xr.Dataset, tip_attitude: Array) -> NDArray[np.bool]:
    """Return which runs (...) have samples that do not determine the Euler angles of the tip."""
    rows = _level(tip_attitude).reshape(-1, *tip_attitude.shape[-2:])
    lost = unfollowed(rows).any(-1).reshape(tip_attitude.shape[:-2])
    if "tip_angular_velocity" in flight:
        # Whole turns between samples, which attitudes do not show.
        spin = np.linalg.norm(samples(flight, "tip_angular_velocity", "axis"), axis=-1)
        lost |= (np.maximum(spin[..., 1:], spin[..., :-1]) * np.diff(flight["time"]) > np.pi).any(
            -1
        )
    return np.asarray(lost)


def _per_run(value: Array) -> float | Array:
    """Return a number for one run, an array over runs else."""
    return float(value) if np.ndim(value) == 0 else value
