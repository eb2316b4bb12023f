"""Aerodynamic drag of the UAV, in wind."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
from continuair.kernels.term_sum import Acting
from continuair.kernels.wind import wind_code
from continuair.terms.term import CasadiModel, Term
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class UavDrag(Term):
    """Drag of the UAV, -D v - |v| D₂ v, with v the air-relative velocity in body axes."""

    field: ClassVar[str] = "uav.drag"
    in_wind: ClassVar[bool] = True
    flown: ClassVar[tuple[str, ...]] = ("drag", "square_drag")
    stiff: ClassVar[bool] = False

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if the vehicle has a table [uav.drag], else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        UavDrag or None
            The term.
        """
        return None if vehicle.uav.drag is None else cls()

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the fields ``drag`` [N s/m] and ``square_drag`` [N s²/m²], along the body axes.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field.
        """
        return {"drag": (3,), "square_drag": (3,)}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the fields ``drag`` and ``square_drag``.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        drag, runs = vehicle.uav.drag, len(plants)
        assert drag is not None
        plants["drag"] = per_run(drag.linear, runs, 3)
        plants["square_drag"] = per_run(drag.quadratic, runs, 3)

    def device(self, code: Device) -> Acting:
        """Return the device function of the drag.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on the UAV.
        """
        return Acting(on_uav=_load(code.numbers, code.tree))

    def casadi(self, model: CasadiModel) -> "SX":
        """Return the drag as a generalised force in CasADi.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle.

        Returns
        -------
        SX, shape (6 + 2 N, 1)
            The force.
        """
        import casadi

        drag, v = model.vehicle.uav.drag, model.body_velocity
        force = -(casadi.DM(drag.linear) + model.speed(v) * casadi.DM(drag.quadratic)) * v
        return casadi.vertcat(force, model.none[3:])


def _load(numbers: Numbers, tree: Tree) -> Any:
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Flight, wind_at = flight_code(numbers, tree).Flight, wind_code(numbers, tree)
    State, Push, Along, vec3 = types.State, types.Push, types.Along, types.vec3
    attitude_of, velocity_of = types.attitude_of, types.velocity_of

    @wp.func
    def drag_load(y: State, along: Along, flight: Flight, row: int, push: Push):
        v = wp.quat_rotate_inv(attitude_of(y), velocity_of(y) - wind_at(flight, row))
        speed = wp.length(v)
        linear = flight.plant.drag
        square = flight.plant.square_drag
        force = vec3()
        for j in range(3):
            force[j] = -(linear[j] + speed * square[j]) * v[j]
        out = Load()
        out.force = force
        return out

    return drag_load
