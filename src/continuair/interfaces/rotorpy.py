"""Vehicles by the parameters of RotorPy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from continuair.errors import InputError, shown
from continuair.interfaces.parameter_table import ParameterTable, check_table, listed
from continuair.typing import Array
from continuair.vehicle.rotors import MOST_ROTORS
from continuair.vehicle.vehicle import Vehicle

_REQUIRED = (
    "mass", "Ixx", "Iyy", "Izz", "rotor_pos", "rotor_directions", "rotor_speed_max", "k_eta",
    "k_m", "tau_m",
)  # fmt: skip
_OPTIONAL = (
    "Ixy", "Ixz", "Iyz", "num_rotors", "rotor_radius", "rotor_speed_min", "c_Dx", "c_Dy", "c_Dz",
    "k_d", "k_z", "k_h", "k_flap",
)  # fmt: skip
# Of sensors, of RotorPy's own controllers, and of its ground.
_IGNORED = (
    "rI", "motor_noise_std", "k_w", "k_v", "kp_att", "kd_att", "ground_friction_beta",
)  # fmt: skip


def rotorpy_vehicle(params: Mapping[str, object], *, name: str = "rotorpy") -> Vehicle:
    """Return the multirotor without arms that RotorPy's parameters describe.

    Parameters
    ----------
    params : mapping of str to object
        ``quad_params`` of a module ``rotorpy.vehicles.*_params``: mass, inertia, rotors and drag
        in SI units.
    name : str, default "rotorpy"
        Name of the vehicle.

    Returns
    -------
    Vehicle
        One vehicle. ``replace({"arm": ...})`` adds arms.

    Raises
    ------
    InputError
        If a parameter is missing, unknown or out of range, or `k_flap` is not 0: moments of
        flapping blades are not modelled.

    Notes
    -----
    ``motor_noise_std``, ``rI``, ``ground_friction_beta`` and RotorPy's gains (``k_w``, ``k_v``,
    ``kp_att`` and ``kd_att``) are ignored. RotorPy keeps `rotor_speed_min` always; here the least
    thrust holds under a controller. Folk, Paulos and Kumar (2023), arXiv 2306.04485.

    Examples
    --------
    >>> at = {"r1": (0.1, 0.1, 0), "r2": (0.1, -0.1, 0), "r3": (-0.1, -0.1, 0)}
    >>> at |= {"r4": (-0.1, 0.1, 0)}
    >>> params = {"mass": 0.5, "Ixx": 4e-3, "Iyy": 4e-3, "Izz": 7e-3, "rotor_pos": at}
    >>> params |= {"rotor_directions": [1, -1, 1, -1], "k_eta": 5.57e-6, "k_m": 1.36e-7}
    >>> params |= {"rotor_speed_max": 1500.0, "tau_m": 0.005}
    >>> ca.rotorpy_vehicle(params).uav.rotors.highest.round(4)
    array([12.5325, 12.5325, 12.5325, 12.5325])
    """
    given = ParameterTable("params", check_table("params", params))
    given.only([*_REQUIRED, *_OPTIONAL, *_IGNORED])
    given.require(_REQUIRED)
    if given.number("k_flap") != 0.0:
        raise InputError(
            "params.k_flap",
            f"is {given.number('k_flap'):g}, but moments of flapping blades are not modelled",
            "give 0",
        )
    drag = [given.number(f"c_D{axis}", least=0.0) for axis in "xyz"]
    return given.vehicle(
        name, _inertia(given), _rotors(given), {"quadratic": drag} if any(drag) else None
    )


def _inertia(given: ParameterTable) -> Array:
    xx, yy, zz = (given.number(f"I{each}", above=0.0) for each in ("xx", "yy", "zz"))
    xy, xz, yz = (given.number(f"I{each}") for each in ("xy", "xz", "yz"))
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _rotors(given: ParameterTable) -> dict[str, Any]:
    """Return the fields of the rotors, whose torque has the sign of their direction."""
    positions = _positions(given)
    directions = given.array("rotor_directions", (len(positions),))
    least, most = given.span("rotor_speed_min", "rotor_speed_max")
    thrust = given.number("k_eta", above=0.0)
    along = [given.number(each, least=0.0) * most for each in ("k_d", "k_z")]
    rotors: dict[str, Any] = {
        "rotor": listed(positions, given.spins("rotor_directions", directions)),
        "thrust_limits": (thrust * (least * least), thrust * (most * most)),
        "torque_per_thrust": given.number("k_m", above=0.0) / thrust,
        "lag": given.number("tau_m", least=0.0),
        "hub_drag": along,
        "translational_lift": given.number("k_h", least=0.0),
    }
    if given.has("rotor_radius"):
        rotors["radius"] = given.number("rotor_radius", above=0.0)
    return rotors


def _positions(given: ParameterTable) -> Array:
    """Return the positions of the rotors (rotors, 3) in the order of their names' entries."""
    places = given.entries["rotor_pos"]
    count = given.entries.get("num_rotors")
    if not isinstance(places, Mapping) or not 0 < len(places) <= MOST_ROTORS:
        raise InputError(
            "params.rotor_pos", f"is {shown(places)}", f"give 1 to {MOST_ROTORS} positions by name"
        )
    if count is not None and given.number("num_rotors") != len(places):
        raise InputError(
            "params.num_rotors", f"is {shown(count)}", f"give {len(places)}, as in rotor_pos"
        )
    inside = ParameterTable("params.rotor_pos", places)
    return np.array([inside.array(each, (3,)) for each in places])
