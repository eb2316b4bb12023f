"""The coupled model as a function of CasADi, for optimal control and estimation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from continuair import checks
from continuair.vehicle.vehicle import check_single_vehicle

if TYPE_CHECKING:
    from casadi import Function


def to_casadi(vehicle: Any) -> Function:
    """The coupled model as a `casadi.Function`: what `continuair.accelerations` says of one run.

    Inputs by name: attitude (4,) x y z w, body to world, of any length above 0; bend (N, 2) [1/m];
    velocity (3,), world axes; angular_velocity (3,), body axes; bend_rate (N, 2); force (3,), world
    axes; moment (3,), body axes; bend_moment (N, 2) [N m²]; tip_wrench (arms, 6), world axes;
    gravity [m/s²]. The attitude must be given; else what is left out of a call by name is 0, and
    gravity 9.81. Outputs: velocity_rate v̇ (3,), world axes, angular_velocity_rate ω̇ (3,), body
    axes, and bend_acceleration k̈ (N, 2).

    All of the vehicle counts as it does there: arms, disks, bodies on tips, drag in air at rest;
    rotors stand still. Values and all derivatives hold at bend 0 too, and are NaN beyond a full
    circle. Raises InputError, for a batch of vehicles too, and without CasADi (extra `mpc`).
    """
    check_single_vehicle(vehicle)
    checks.installed("casadi", "mpc")
    from continuair.interfaces.casadi_dynamics import accelerations

    return accelerations(vehicle)
