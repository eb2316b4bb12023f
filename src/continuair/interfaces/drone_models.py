"""Vehicles by the parameters of drone-models and Crazyflow."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from continuair.errors import InputError, nearest, shown
from continuair.files import printed, read_toml, user_path
from continuair.interfaces.parameter_table import ParameterTable, check_table, listed
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

_REQUIRED = (
    "mass", "J", "L", "mixing_matrix", "rpm2thrust", "rpm2torque", "thrust_min", "thrust_max",
)  # fmt: skip
_GRAVITY = 9.81
_LARGEST_FILE = 2**20


def drone_models_vehicle(
    source: str | os.PathLike[str] | Mapping[str, object], drone: str | None = None
) -> Vehicle:
    """Return the multirotor without arms that parameters of drone-models describe.

    Parameters
    ----------
    source : str, path-like, or mapping of str to object
        A TOML file of physical parameters, one table for each drone, or one such table:
        ``data/params.toml`` of drone-models, ``first_principles/params.toml`` of Crazyflow, or the
        result of their ``load_params("first_principles", drone)``.
    drone : str, optional
        Name of the table in a file, such as ``"cf2x_L250"``. May be left out if there is one table.

    Returns
    -------
    Vehicle
        One vehicle. ``replace({"arm": ...})`` adds arms.

    Raises
    ------
    InputError
        If the file cannot be read, or a parameter is missing, out of range or has no counterpart:
        a thrust at rest, or drag that couples axes.

    Notes
    -----
    Rotors have the model of `thrust_model_factor`, one torque per thrust, and one lag for each
    direction. These are exact for curves without linear terms. Other torque curves and
    `rotor_dyn_coef` are taken at hover. A negative linear term of `rpm2thrust` counts in the speeds
    of hover and of `thrust_max`, and not in the shape of the curve, which changes transients.
    ``prop_inertia`` and all other entries, such as ``gravity_vec`` or ``pwm_max``, are ignored.
    """
    given = _table(source, drone)
    given.require(_REQUIRED)
    return given.vehicle(given.table, given.array("J", (3, 3)), _rotors(given), _drag(given))


def _table(source: Any, drone: str | None) -> ParameterTable:
    if isinstance(source, Mapping):
        return ParameterTable(drone or "drone", source)
    path = user_path("source", source)
    if path.is_file() and path.stat().st_size > _LARGEST_FILE:
        raise InputError(
            "source", f"is {printed(path)}, of more than 1 MiB", "give a file of parameters"
        )
    tables = {name: each for name, each in read_toml(path).items() if isinstance(each, Mapping)}
    if not tables:
        raise InputError("source", f"is {printed(path)}, without a table", "name a file of drones")
    if drone is None and len(tables) == 1:
        drone = next(iter(tables))
    if drone not in tables:
        raise InputError("drone", f"is {shown(drone)}", nearest(str(drone), tables))
    return ParameterTable(drone, check_table(drone, tables[drone]))


def _rotors(given: ParameterTable) -> dict[str, Any]:
    """Return the fields of the rotors; the third row of the matrix holds the torques' signs."""
    mixing, lever = given.array("mixing_matrix", (3, None)), given.number("L", above=0.0)
    hubs = lever * np.column_stack([-mixing[1], mixing[0], np.zeros(mixing.shape[1])])
    least, most = given.span("thrust_min", "thrust_max")
    hovering, full = (_rpm(given, thrust) for thrust in (_share(given, mixing.shape[1]), most))
    thrust, torque = (_polynomial(given, name) for name in ("rpm2thrust", "rpm2torque"))
    per_thrust = _at(torque, hovering) / _at(thrust, hovering)
    if not per_thrust > 0.0:
        raise InputError(
            given.field("rpm2torque"), f"is {shown(torque)}", "give torques above 0 at hover"
        )
    rotors: dict[str, Any] = {
        "rotor": listed(hubs, given.spins("mixing_matrix", mixing[2])),
        "thrust_limits": (least, most),
        "torque_per_thrust": per_thrust,
        "thrust_model_factor": min(1.0, float(thrust[2] * full * full / most)),
        **_lags(given, hovering),
    }
    if given.has("prop_radius"):
        rotors["radius"] = given.number("prop_radius", above=0.0)
    return rotors


def _share(given: ParameterTable, rotors: int) -> float:
    """Return the thrust of one rotor in hover [N]."""
    return _GRAVITY * given.number("mass", above=0.0) / rotors


def _polynomial(given: ParameterTable, name: str) -> Array:
    """Return the coefficients of a polynomial of the speed in rpm, constant first."""
    return given.array(name, (3,))


def _at(coefficients: Array, rpm: float) -> float:
    constant, linear, square = coefficients.tolist()
    return float(constant + (linear + square * rpm) * rpm)


def _rpm(given: ParameterTable, thrust: float) -> float:
    """Return the speed [rpm] of a thrust [N], the larger root of its polynomial."""
    constant, linear, square = _polynomial(given, "rpm2thrust").tolist()
    if constant != 0.0 or not square > 0.0:
        raise InputError(
            given.field("rpm2thrust"),
            f"is {shown([constant, linear, square])}",
            "give 0, a linear term, and a square term above 0",
        )
    return float((-linear + np.sqrt(linear * linear + 4.0 * square * thrust)) / (2.0 * square))


def _lags(given: ParameterTable, rpm: float) -> dict[str, float]:
    """Return the lags of a speed that rises and falls, linearised at a speed [rpm]."""
    if not given.has("rotor_dyn_coef"):
        given.require(("thrust_tau",))
        return {"lag": given.number("thrust_tau", least=0.0)}
    up, up_square, down, down_square = given.array("rotor_dyn_coef", (4,)).tolist()
    rates = [up + 2.0 * up_square * rpm, down + 2.0 * down_square * rpm]
    if not min(rates) > 0.0:
        raise InputError(
            given.field("rotor_dyn_coef"),
            f"has the rates {shown(rates)} at hover",
            "give rates above 0 [1/s]",
        )
    rise, fall = (1.0 / rate for rate in rates)
    return {"lag": rise} if rise == fall else {"lag": rise, "lag_down": fall}


def _drag(given: ParameterTable) -> dict[str, Any] | None:
    """Return the drag, whose matrix times the velocity in body axes is a force."""
    if not given.has("drag_matrix"):
        return None
    matrix = given.array("drag_matrix", (3, 3))
    linear = -np.diag(matrix)
    if np.any(matrix + np.diag(linear)) or (linear < 0.0).any():
        raise InputError(
            given.field("drag_matrix"),
            f"is {shown(matrix)}",
            "give a diagonal matrix without positive entries",
        )
    return {"linear": linear + 0.0} if linear.any() else None
