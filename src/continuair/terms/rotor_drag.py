"""Drag and lift of rotors that move through the air."""

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
from continuair.terms.rotors import RotorThrusts, rotor_code
from continuair.terms.term import CasadiModel, Term
from continuair.vehicle.runs import per_run
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class RotorDrag(Term):
    """-s (d v₊ + d_z v_z z) + c |v₊|² z at each hub, which goes through the air with v₊ + v_z z.

    z: the rotor's axis; s: its speed over the greatest. d, d_z: `hub_drag`, RotorPy's k_d and k_z
    times the greatest speed [rad/s]; c: `translational_lift`, its k_h. RotorPy: Folk, Paulos and
    Kumar (2023), arXiv 2306.04485, vehicles/multirotor.py. Its flapping moment is left out.

    Parameters
    ----------
    rotors : RotorThrusts
        The rotors.
    """

    field: ClassVar[str] = "uav.rotors.hub_drag"
    in_wind: ClassVar[bool] = True
    flown: ClassVar[tuple[str, ...]] = ("hub_drag", "hub_lift", "drag_hubs", "drag_axes")
    stiff: ClassVar[bool] = False

    rotors: RotorThrusts

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if rotors have drag or lift from their velocity, else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        RotorDrag or None
            The term.
        """
        rotors, term = vehicle.uav.rotors, RotorThrusts.of(vehicle)
        if rotors is None or term is None or not rotors.moved_by_air:
            return None
        return cls(term)

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the fields of drag across and along the axis, lift, hubs and axes.

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field.
        """
        each = (self.rotors.count, 3)
        return {"hub_drag": (2,), "hub_lift": (), "drag_hubs": each, "drag_axes": each}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill these fields.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        rotors, runs = vehicle.uav.rotors, len(plants)
        assert rotors is not None
        plants["hub_drag"] = per_run(rotors.hub_drag, runs, 2)
        plants["hub_lift"] = per_run(rotors.translational_lift, runs)
        plants["drag_hubs"], plants["drag_axes"] = rotors.hubs, rotors.axes

    def device(self, code: Device) -> Acting:
        """Return the device function of drag and lift.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on the UAV.
        """
        return Acting(on_uav=_load(code.numbers, code.tree, self.rotors))

    def casadi(self, model: CasadiModel) -> "SX":
        """Return the lift of rotors that stand still, which have no drag, in CasADi.

        Parameters
        ----------
        model : CasadiModel
            The symbolic vehicle.

        Returns
        -------
        casadi.SX
            Generalised force.
        """
        import casadi

        # Rotors stand still there, which leaves their lift alone.
        rotors, v = model.vehicle.uav.rotors, model.body_velocity
        assert rotors is not None
        force, moment = casadi.SX(3, 1), casadi.SX(3, 1)
        for hub, axis in zip(rotors.hubs, rotors.axes, strict=True):
            local = v + casadi.cross(model.x["angular_velocity"], casadi.DM(hub))
            across = local - casadi.dot(local, casadi.DM(axis)) * casadi.DM(axis)
            lift = rotors.translational_lift * casadi.sumsqr(across) * casadi.DM(axis)
            force, moment = force + lift, moment + casadi.cross(casadi.DM(hub), lift)
        return casadi.vertcat(force, moment, model.none[6:])


def _load(numbers: Numbers, tree: Tree, term: RotorThrusts) -> Any:
    types, Load = device_types(numbers, tree), load_code(numbers, tree).Load
    Flight, wind_at = flight_code(numbers, tree).Flight, wind_code(numbers, tree)
    speeds_of = rotor_code(numbers, tree, term).speeds_of
    State, Push, Along, vec3 = types.State, types.Push, types.Along, types.vec3
    attitude_of, velocity_of, spin_of = types.attitude_of, types.velocity_of, types.spin_of
    rotors = term.count

    @wp.func
    def rotor_drag_load(y: State, along: Along, flight: Flight, row: int, push: Push):
        plant, spin = flight.plant, spin_of(y)
        v = wp.quat_rotate_inv(attitude_of(y), velocity_of(y) - wind_at(flight, row))
        speeds = speeds_of(y, flight, row, push)
        out = Load()
        for i in range(rotors):
            hub = vec3(plant.drag_hubs[i, 0], plant.drag_hubs[i, 1], plant.drag_hubs[i, 2])
            axis = vec3(plant.drag_axes[i, 0], plant.drag_axes[i, 1], plant.drag_axes[i, 2])
            local = v + wp.cross(spin, hub)
            sink = wp.dot(local, axis)
            across = local - sink * axis
            force = -speeds[i] * (plant.hub_drag[0] * across + plant.hub_drag[1] * sink * axis)
            force += plant.hub_lift * wp.length_sq(across) * axis
            out.force += force
            out.moment += wp.cross(hub, force)
        return out

    return rotor_drag_load
