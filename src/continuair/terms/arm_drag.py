"""Aerodynamic drag of the arms, normal to the backbone, in wind and in the rotors' downwash."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load_along import along_code
from continuair.kernels.term_sum import Acting
from continuair.kernels.wind import wind_code
from continuair.terms.term import CasadiModel, Stream, Term
from continuair.vehicle.rotors import AIR_DENSITY
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import DRAG_NODES, DRAG_WEIGHTS
from continuair.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from casadi import SX


@dataclass(frozen=True)
class ArmDrag(Term):
    """Drag of the arms, -½ ρ C_d 2r |v| v per length.

    v is the component of the air-relative velocity normal to the backbone.
    """

    field: ClassVar[str] = "drag_coefficient"
    in_wind: ClassVar[bool] = True
    in_stream: ClassVar[bool] = True
    stiff: ClassVar[bool] = False

    @classmethod
    def of(cls, vehicle: Vehicle) -> Self | None:
        """Return the term if a section has a drag coefficient, else None.

        Parameters
        ----------
        vehicle : Vehicle
            Vehicle, plain or batched.

        Returns
        -------
        ArmDrag or None
            The term.
        """
        sections = (section for arm in vehicle.arms for section in arm.section)
        return cls() if any(each.drag_coefficient is not None for each in sections) else None

    def parameters(self, tree: Tree) -> dict[str, tuple[int, ...]]:
        """Return the field ``across``, drag per squared velocity of each section [N s²/m²].

        Parameters
        ----------
        tree : Tree
            The arms.

        Returns
        -------
        dict of str to tuple of int
            Shape of each field.
        """
        return {"across": (sum(tree.sections),)}

    def pack(self, plants: np.ndarray, vehicle: Vehicle) -> None:
        """Fill the field ``across``.

        Parameters
        ----------
        plants : structured ndarray, shape (runs,)
            Parameters of the vehicles, changed in place.
        vehicle : Vehicle
            The vehicle.
        """
        runs = len(plants)
        sections = (section for arm in vehicle.arms for section in arm.section)
        for index, section in enumerate(sections):
            if section.drag_coefficient is not None:
                width = 2.0 * per_run(section.radius, runs)
                share = 0.5 * AIR_DENSITY * per_run(section.drag_coefficient, runs)
                plants["across"][:, index] = share * width * per_run(section.length, runs)

    def device(self, code: Device) -> Acting:
        """Return the device functions of the drag.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on each arm.
        """
        return Acting(on_arm=_drag_on_arm(code.numbers, code.tree, code.frozen_arm))

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
        found = model.none
        for bent in (each for arm in model.arms for each in arm.sections):
            if bent.section.drag_coefficient is not None:
                found += _drag_in_casadi(model, bent)
        return found


def _drag_in_casadi(model: Any, bent: Any) -> Any:
    section, found = bent.section, model.none
    across = AIR_DENSITY * section.drag_coefficient * section.radius * section.length
    for node, weight in zip(DRAG_NODES, DRAG_WEIGHTS, strict=True):
        moves = bent.frame(0.5 + 0.5 * node).moves
        v = moves @ model.rates
        v[2] = 0
        found -= 0.5 * weight * across * moves.T @ (model.speed(v) * v)
    return found


def _still_air(numbers: Numbers, tree: Tree) -> Stream:
    types, Flight = device_types(numbers, tree), flight_code(numbers, tree).Flight
    State, Push, Plant, vec2, vec3 = types.State, types.Push, types.Plant, types.vec2, types.vec3

    @wp.func
    def begun(y: State, flight: Flight, row: int, push: Push):
        return vec2()

    @wp.func
    def velocity(plant: Plant, point: vec3, still: vec2):
        return vec3()

    return Stream(vec2, begun, velocity)


def _drag_on_arm(numbers: Numbers, tree: Tree, frozen_arm: bool) -> Callable[[int], Any]:
    """Return the function that makes the device function of an arm's drag.

    frozen_arm: whether the base of the arm stays at its initial pose for the load on the bends.
    """
    types, along = device_types(numbers, tree), along_code(numbers, tree)
    Flight, wind_at = flight_code(numbers, tree).Flight, wind_code(numbers, tree)
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    Along, Spot, vec3 = types.Along, along.Spot, types.vec3
    attitude_of, spin_of, velocity_of = types.attitude_of, types.spin_of, types.velocity_of
    outer, inner = (Real(float(0.5 * weight)) for weight in DRAG_WEIGHTS[:2])
    streams = [term.stream(numbers, tree) for term in tree.terms if term.moves_air]
    (stream,) = streams or [_still_air(numbers, tree)]
    Induced, induced_of, washed_at = stream.State, stream.begun, stream.velocity
    shares = tuple(float(0.5 + 0.5 * node) for node in DRAG_NODES)

    def force_on(section: int) -> Any:
        @wp.func
        def force(plant: Plant, n: int, at: Spot, induced: Induced):
            weights = vec3(outer, inner, outer)
            v = at.velocity
            v -= washed_at(plant, at.point, induced)
            v -= wp.dot(v, at.along) * at.along
            return -(weights[n] * plant.across[section] * wp.length(v)) * v

        return force

    def drag_on_arm(arm: int) -> Any:
        drag = along.loads_on(arm, shares, Induced, force_on)

        @wp.func
        def load(y: State, along: Along, flight: Flight, row: int, push: Push):
            plant = flight.plant
            wind = wind_at(flight, row)
            induced = induced_of(y, flight, row, push)
            through = wp.quat_rotate_inv(attitude_of(y), velocity_of(y) - wind)
            out = drag(y, plant, through, spin_of(y), induced)
            if wp.static(frozen_arm):
                held = wp.quat_rotate_inv(flight.frozen.attitude, -wind)
                out.bend = drag(y, plant, held, vec3(), induced).bend
            return out

        return load

    return drag_on_arm
