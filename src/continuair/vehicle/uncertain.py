"""Vehicles whose fields are known with an error, and batches drawn from them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import norm, qmc

from continuair import checks
from continuair.errors import InputError, shown
from continuair.immutable import Immutable
from continuair.typing import Array, ArrayLike
from continuair.vehicle.deviations import is_place
from continuair.vehicle.vehicle import UNCERTAINTY, Vehicle, read_vehicle
from continuair.warning import untold

DRAWS = 256
"""Vehicles that are drawn by default."""

_MOST_DRAWS = 100_000


@dataclass(frozen=True)
class UncertainVehicle(Immutable):
    """A vehicle and the covariance of some of its fields.

    A field is log-normal: its value in the vehicle is the median, and the covariance is that of the
    logarithms. Coordinates of mounts and centres, which may be 0, are normal, in metres.

    Parameters
    ----------
    vehicle : Vehicle
        The vehicle of the medians.
    fields : sequence of str
        Dotted names of the uncertain fields, as `Vehicle.replace` takes them.
    covariance : array_like, shape (fields, fields)
        Covariance of logarithms, or of places [m²].
    model_error : float, optional
        Root mean square distance of markers from the fit of these fields [m], the model's error.

    Raises
    ------
    InputError
        If a field is unknown or there twice, also by name and by index, or the covariance is not
        symmetric and positive.
    """

    vehicle: Vehicle
    fields: tuple[str, ...]
    covariance: ArrayLike
    model_error: float | None = None

    def __post_init__(self) -> None:
        count = len(self.fields)
        found = checks.finite_array(self.covariance)
        if not count or found is None or found.shape != (count, count):
            raise InputError(
                "uncertainty.covariance",
                f"is {shown(self.covariance)} for {count} fields",
                "give one row and one column for each field",
            )
        scale = np.sqrt(np.maximum(np.diag(found), 0.0))
        size = np.outer(scale, scale)
        if not np.allclose(found, found.T, rtol=1e-6, atol=1e-9 * size.max()) or (
            np.linalg.eigvalsh(found).min() < -1e-9 * size.max()
        ):
            raise InputError(
                "uncertainty.covariance",
                "is not symmetric and positive",
                "give variances on its diagonal and covariances beside it",
            )
        repeated = [name for name in self.fields if self.fields.count(name) > 1]
        if repeated:
            raise InputError(
                "uncertainty.fields", f"has {repeated[0]} twice", "name every field once"
            )
        medians = [_value_of(self.vehicle, name) for name in self.fields]
        # Fields that cannot be replaced, or are one field by two names, fail here, not at a draw.
        with untold():
            self.vehicle.replace(dict(zip(self.fields, medians, strict=True)))
        object.__setattr__(self, "fields", tuple(self.fields))
        object.__setattr__(self, "covariance", checks.frozen(found))
        object.__setattr__(self, "_medians", checks.frozen(np.array(medians)))

    @property
    def medians(self) -> Array:
        """Return the values (fields,) of the uncertain fields in the vehicle."""
        found: Array = self._medians  # type: ignore[attr-defined]
        return found

    def values(self, draws: int = DRAWS, seed: int = 0) -> Array:
        """Return values of the uncertain fields, by a scrambled Sobol sequence.

        Parameters
        ----------
        draws : int, default 256
            Number of draws; powers of 2 fill the space evenly.
        seed : int, default 0
            Seed of the scrambling.

        Returns
        -------
        ndarray, shape (draws, fields)
            Values in the units of the fields.
        """
        draws = checks.whole("draws", draws, 1, _MOST_DRAWS)
        power = int(np.ceil(np.log2(draws)))
        uniform = qmc.Sobol(len(self.fields), seed=seed).random_base2(power)[:draws]
        covariance = np.asarray(self.covariance)
        values, vectors = np.linalg.eigh(covariance)
        moved = norm.ppf(uniform) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
        places = np.array([is_place(name) for name in self.fields])
        grown = self.medians * np.exp(np.where(places, 0.0, moved))
        found: Array = np.where(places, self.medians + moved, grown)
        return found

    def draws(self, draws: int = DRAWS, seed: int = 0) -> Vehicle:
        """Return a batch of vehicles, a run for each row of `values`.

        Parameters
        ----------
        draws : int, default 256
            Number of draws.
        seed : int, default 0
            Seed of the scrambling.

        Returns
        -------
        Vehicle
            A batch, for `simulate`, `modes` and all that takes batches.

        Raises
        ------
        InputError
            If a drawn vehicle is not valid: its fields are too uncertain.
        """
        rows = self.values(draws, seed)
        with untold():
            return self.vehicle.replace(dict(zip(self.fields, rows.T, strict=True)))


def band(values: ArrayLike, level: float = 0.9) -> Array:
    """Return the limits between which a share of the draws lies, as many below as above.

    Parameters
    ----------
    values : array_like, shape (draws, ...)
        A value for each draw; NaN is left out.
    level : float, default 0.9
        Share of the draws inside.

    Returns
    -------
    ndarray, shape (2, ...)
        Lower and upper limits; NaN where all draws are.

    Raises
    ------
    InputError
        If a value is no number, there are no draws, or the level is not between 0 and 1.
    """
    if not 0.0 < checks.number("level", level) < 1.0:
        raise InputError("level", f"is {level:g}", "give a share between 0 and 1")
    try:
        rows = np.asarray(values, float)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if not rows.ndim or not len(rows):
        raise InputError("values", f"is {shown(values)}", "give a number for each draw")
    tail = 0.5 * (1.0 - level)
    known = ~np.isnan(rows).all(axis=0)
    found = np.full((2, *rows.shape[1:]), np.nan)
    found[:, known] = np.nanquantile(rows[:, known], [tail, 1.0 - tail], axis=0)
    return found


def load_uncertain(name_or_path: str | os.PathLike[str]) -> UncertainVehicle | None:
    """Return the vehicle of a file whose fields have errors; None if none has.

    Parameters
    ----------
    name_or_path : str or path-like
        As for `load_vehicle`. A field may be ``{ value = 0.9, sd = 0.1 }``, its median and its
        standard deviation; a table ``[uncertainty]`` may give ``fields``, their ``covariance`` as
        in `UncertainVehicle`, and ``model_error``, as `fit-release` writes it.

    Returns
    -------
    UncertainVehicle or None
        The vehicle with the errors of its fields.

    Raises
    ------
    InputError
        If the file cannot be used, or an error is no positive number.
    """
    vehicle, deviations, table, file = read_vehicle(name_or_path)
    if not deviations and not table:
        return None
    try:
        unknown = set(table) - {"fields", "covariance", "model_error"}
        if unknown:
            raise InputError(
                UNCERTAINTY, f"has {min(unknown)}", "give fields, covariance and model_error"
            )
        deviations = {_of_matrix(name): sd for name, sd in deviations.items()}
        fields, covariance = _of_table(table)
        both = set(fields) & set(deviations)
        if both:
            raise InputError(min(both), f"has an sd and is in [{UNCERTAINTY}]", "keep one of them")
        count = len(fields)
        every = [*fields, *deviations]
        whole = np.zeros((len(every), len(every)))
        whole[:count, :count] = covariance
        for index, (name, sd) in enumerate(deviations.items(), start=count):
            whole[index, index] = _variance(vehicle, name, sd)
        error = table.get("model_error")
        if error is not None:
            error = checks.number("uncertainty.model_error", error, least=0.0, otherwise=" [m]")
        return UncertainVehicle(vehicle, tuple(every), whole, error)
    except InputError as error:
        raise error.located(file) from None


def _of_matrix(name: str) -> str:
    """Return the name of a field in the vehicle: a file may give an inertia by its diagonal."""
    *_, of, last = ["", *name.split(".")]
    return f"{name}.{last}" if of == "inertia" and last.isdecimal() else name


def _of_table(table: Mapping[str, Any]) -> tuple[tuple[str, ...], Array]:
    """Return the fields of a file's table, and their covariance."""
    fields = table.get("fields", [])
    if not isinstance(fields, list) or not all(isinstance(name, str) for name in fields):
        raise InputError("uncertainty.fields", f"is {shown(fields)}", "give a list of names")
    covariance = checks.finite_array(table.get("covariance", []))
    if covariance is None or covariance.size != len(fields) ** 2:
        raise InputError(
            "uncertainty.covariance",
            f"is {shown(table.get('covariance'))} for {len(fields)} fields",
            "give one row and one column for each field",
        )
    return tuple(fields), covariance.reshape(len(fields), len(fields))


def _variance(vehicle: Vehicle, name: str, sd: object) -> float:
    """Return the variance of a field's logarithm, or of a place [m²]; raise InputError."""
    deviation = checks.positive(f"{name}.sd", sd)
    if is_place(name):
        return deviation**2
    value = _value_of(vehicle, name)
    if deviation > value:
        raise InputError(
            f"{name}.sd",
            f"is {deviation:g}, larger than the value {value:g} of a positive field",
            "give a smaller one, or measure the field",
        )
    return float((deviation / value) ** 2)


def _value_of(vehicle: Vehicle, name: str) -> float:
    """Return the value of a field by its dotted name; raise InputError if it has none to vary."""
    found: Any = vehicle
    for part in name.split("."):
        found = _part(found, part)
        if found is None:
            break
    if not checks.is_number(found) or vehicle.runs is not None:
        raise InputError(
            "uncertainty.fields",
            f"has {shown(name)}, which is no number of the vehicle",
            "name fields as in the file, such as arm.youngs_modulus",
        )
    if found <= 0.0 and not is_place(name):
        raise InputError(
            name, f"is {found:g}, but an uncertain field is positive", "give its value without sd"
        )
    return float(found)


def _part(of: Any, name: str) -> Any:
    """Return a part of a vehicle by its name, or by its index in a list."""
    if isinstance(of, tuple | list | np.ndarray):
        named = [each for each in of if getattr(each, "name", None) == name]
        if named:
            return named[0]
        return of[int(name)] if name.isdecimal() and int(name) < len(of) else None
    if name == "arm" and getattr(of, "has_arm_list", False):
        return of.arms
    return getattr(of, f"given_{name}", None) or getattr(of, name, None)
