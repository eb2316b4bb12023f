"""The coupled model as a function of CasADi, for optimal control and estimation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from continuair import checks
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

if TYPE_CHECKING:
    from casadi import Function


def to_casadi(vehicle: Vehicle) -> Function:
    """Return the coupled model as a CasADi function.

    Parameters
    ----------
    vehicle : Vehicle
        One vehicle (no batch).

    Returns
    -------
    casadi.Function
        Accelerations of a state, with named inputs and outputs, see Notes.

    Raises
    ------
    InputError
        If `vehicle` is a batch, or CasADi is not installed (extra ``mpc``).

    See Also
    --------
    continuair.accelerations : The same quantities from the kernels, of one run.

    Notes
    -----
    Inputs: ``attitude`` (4,) x y z w, body to world, of any length above 0; ``bend`` (N, 2) [1/m];
    ``velocity`` (3,), world axes [m/s]; ``angular_velocity`` (3,), body axes [rad/s]; ``bend_rate``
    (N, 2) [1/(m s)]; ``force`` (3,), world axes [N]; ``moment`` (3,), body axes [N m];
    ``bend_moment`` (N, 2) [N m²]; ``tip_wrench`` (arms, 6), world axes [N, N m]; ``gravity``
    [m/s²]. ``attitude`` is required. In a call by name, other inputs default to 0, and gravity to
    9.81.

    Outputs: ``velocity_rate`` v̇ (3,), world axes; ``angular_velocity_rate`` ω̇ (3,), body axes;
    and ``bend_acceleration`` k̈ (N, 2). With a section whose strain varies, ``strain``,
    ``strain_rate``, ``strain_force`` and ``strain_acceleration`` (M,) of all sections replace
    those of the bends.

    Arms, disks, bodies on tips and drag in air at rest are included; rotors stand still. Values and
    all derivatives are valid at bend 0 too, and NaN beyond a full circle.
    """
    check_single_vehicle(vehicle, strain=True)
    checks.installed("casadi", "mpc")
    from continuair.interfaces.casadi_dynamics import accelerations

    return accelerations(vehicle)
