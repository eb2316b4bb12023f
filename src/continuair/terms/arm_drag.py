"""Aerodynamic drag of the arms, normal to the backbone, in wind and in the rotors' downwash."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load import load_code
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
    types, tips, loads = (
        device_types(numbers, tree),
        tip_code(numbers, tree),
        load_code(numbers, tree),
    )
    Flight, wind_at = flight_code(numbers, tree).Flight, wind_code(numbers, tree)
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    Load, Along = loads.Load, types.Along
    vec3, attitude_of, spin_of = types.vec3, types.attitude_of, types.spin_of
    velocity_of, layout, mounted = types.velocity_of, types.layout, tips.mounted
    Tip, MovingTip = tips.Tip, tips.MovingTip
    zero, one = Real(0.0), Real(1.0)
    low, middle, high = (Real(float(0.5 + 0.5 * x)) for x in DRAG_NODES)
    outer, inner = (Real(float(0.5 * weight)) for weight in DRAG_WEIGHTS[:2])
    streams = [term.stream(numbers, tree) for term in tree.terms if term.moves_air]
    (stream,) = streams or [_still_air(numbers, tree)]
    Induced, induced_of, washed_at = stream.State, stream.begun, stream.velocity

    def on_arm(arm: int) -> Any:
        first, count = tree.first[arm], tree.sections[arm]
        Rows = wp.types.matrix((count, 3), Real)

        @wp.struct
        class Passage:
            """State of the recursion from base to tip: the current frame and its motion, the sum of
            loads, and the force and moment about the body's origin of each section."""

            on: MovingTip
            load: Load
            forces: Rows
            moments: Rows

        @wp.func
        def begun(y: State, plant: Plant, through: vec3, w: vec3, induced: Induced):
            out = Passage()
            out.on.tip = mounted(plant, arm)
            return out

        def and_section(before: Any, k: int) -> Any:
            section = first + k
            code, own = tree.kind_of(section).device(numbers, tree, section), layout.of_section
            place, swept_by, pushed_by = code.place, code.swept_by, code.pushed_by
            begin, width = own[section].start, own[section].stop - own[section].start
            Coordinates, moved_on = wp.types.vector(width, Real), tips.moved_on(section)

            @wp.func
            def found(y: State, plant: Plant, through: vec3, w: vec3, induced: Induced):
                out = before(y, plant, through, w, induced)
                at = out.on.tip
                whole = vec3()
                about = vec3()
                on = Coordinates()
                shares = vec3(low, middle, high)
                weights = vec3(outer, inner, outer)
                for n in range(3):
                    part = place(y, plant, shares[n])
                    step = wp.quat_rotate(at.attitude, part.point)
                    moved = wp.quat_rotate(at.attitude, swept_by(part))
                    point = at.point + step
                    v = through + wp.cross(w, point) + out.on.swept
                    v = v + wp.cross(out.on.turned, step) + moved
                    v -= washed_at(plant, point, induced)
                    along = wp.quat_rotate(at.attitude * part.turn, vec3(zero, zero, one))
                    v -= wp.dot(v, along) * along
                    force = -(weights[n] * plant.across[section] * wp.length(v)) * v
                    whole += force
                    about += wp.cross(point, force)
                    on += pushed_by(part, wp.quat_rotate_inv(at.attitude, force), vec3())
                for j in range(width):
                    out.load.bend[begin + j] = on[j]
                for j in range(3):
                    out.forces[k, j] = whole[j]
                    out.moments[k, j] = about[j]
                out.on = moved_on(out.on, y, plant)
                out.load.force += whole
                out.load.moment += about
                return out

            return found

        passage = begun
        for k in range(count):
            passage = and_section(passage, k)

        @wp.func
        def carried(
            load: Load, found: Passage, at: Tip, beyond: vec3, about: vec3, y: State, plant: Plant
        ):  # fmt: skip
            return load

        def carried_from(rest: Any, k: int) -> Any:
            section = first + k
            code, own = tree.kind_of(section).device(numbers, tree, section), layout.of_section
            place, pushed_by = code.place, code.pushed_by
            begin, width = own[section].start, own[section].stop - own[section].start

            @wp.func
            def carried(
                load: Load, found: Passage, at: Tip, beyond: vec3, about: vec3, y: State,
                plant: Plant,
            ):  # fmt: skip
                end = place(y, plant, one)
                beyond -= vec3(found.forces[k, 0], found.forces[k, 1], found.forces[k, 2])
                about -= vec3(found.moments[k, 0], found.moments[k, 1], found.moments[k, 2])
                at.point += wp.quat_rotate(at.attitude, end.point)
                f = wp.quat_rotate_inv(at.attitude, beyond)
                m = wp.quat_rotate_inv(at.attitude, about - wp.cross(at.point, beyond))
                on = pushed_by(end, f, m)
                for j in range(width):
                    load.bend[begin + j] = load.bend[begin + j] + on[j]
                at.attitude = at.attitude * end.turn
                return rest(load, found, at, beyond, about, y, plant)

            return carried

        back = carried
        for k in reversed(range(count)):
            back = carried_from(back, k)

        @wp.func
        def drag(y: State, plant: Plant, through: vec3, w: vec3, induced: Induced):
            """Return the drag of an arm whose base moves at `through` relative to the air, in body
            axes, summed over nodes along each section."""
            found = passage(y, plant, through, w, induced)
            out = found.load
            if wp.static(count > 1):
                # Loads of the outer sections on each section.
                at = mounted(plant, arm)
                out = back(out, found, at, out.force, out.moment, y, plant)
            return out

        return drag

    def drag_on_arm(arm: int) -> Any:
        drag = on_arm(arm)

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
