"""Device code of forces at points along an arm, and of what they do on the UAV and the bends."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding
from continuair.kernels.arm.tip import tip_code
from continuair.kernels.load import load_code


@dataclass(frozen=True)
class AlongCode:
    """Spot, a struct, and loads_on(arm, shares, Given, force_on).

    That returns the function ``loads(y, plant, through, w, given) -> Load`` of an arm whose base
    moves at `through` [m/s] and turns at w [rad/s], in body axes. shares: places along each
    section, over its length. force_on(section) returns ``force(plant, n, spot, given)``, the force
    [N] at the place n of a section in body axes, where given, of the type Given, is the same for
    all.
    """

    Spot: Any
    loads_on: Any


@cache
def along_code(numbers: Numbers, tree: Tree) -> AlongCode:
    """Return the functions for one kind of numbers and tree of arms."""
    types, tips = device_types(numbers, tree), tip_code(numbers, tree)
    Real, State, Plant = types.Real, types.State, types.Plant
    vec3, layout, mounted = types.vec3, types.layout, tips.mounted
    Load, Tip, MovingTip = load_code(numbers, tree).Load, tips.Tip, tips.MovingTip
    zero, one = Real(0.0), Real(1.0)

    @wp.struct
    class Spot:
        """Point of a backbone in body axes [m], its velocity [m/s], and the tangent there."""

        point: vec3
        velocity: vec3
        along: vec3

    def loads_on(
        arm: int, shares: tuple[float, ...], Given: Any, force_on: Callable[[int], Any]
    ) -> Any:
        first, count, spots = tree.first[arm], tree.sections[arm], len(shares)
        Rows, Shares = wp.types.matrix((count, 3), Real), wp.types.vector(spots, Real)

        @wp.func
        def places_of():
            return Shares()

        def and_place(before: Any, n: int) -> Any:
            # A constant number keeps its digits, a constant vector does not.
            share = Real(shares[n])

            @wp.func
            def found():
                out = before()
                out[n] = share
                return out

            return found

        for n in range(spots):
            places_of = and_place(places_of, n)

        @wp.struct
        class Passage:
            """State of the recursion from base to tip: the current frame and its motion, the sum of
            loads, and the force and moment about the body's origin of each section."""

            on: MovingTip
            load: Load
            forces: Rows
            moments: Rows

        @wp.func
        def begun(y: State, plant: Plant, through: vec3, w: vec3, given: Given):
            out = Passage()
            out.on.tip = mounted(plant, arm)
            return out

        def and_section(before: Any, k: int) -> Any:
            section, force_at = first + k, force_on(first + k)
            code, own = tree.kind_of(section).device(numbers, tree, section), layout.of_section
            place, swept_by, pushed_by = code.place, code.swept_by, code.pushed_by
            begin, width = own[section].start, own[section].stop - own[section].start
            Coordinates, moved_on = wp.types.vector(width, Real), tips.moved_on(section)

            @wp.func
            def found(y: State, plant: Plant, through: vec3, w: vec3, given: Given):
                out = before(y, plant, through, w, given)
                at = out.on.tip
                whole = vec3()
                about = vec3()
                on = Coordinates()
                places = places_of()
                for n in range(spots):
                    part = place(y, plant, places[n])
                    step = wp.quat_rotate(at.attitude, part.point)
                    moved = wp.quat_rotate(at.attitude, swept_by(part))
                    spot = Spot()
                    spot.point = at.point + step
                    v = through + wp.cross(w, spot.point) + out.on.swept
                    spot.velocity = v + wp.cross(out.on.turned, step) + moved
                    spot.along = wp.quat_rotate(at.attitude * part.turn, vec3(zero, zero, one))
                    force = force_at(plant, n, spot, given)
                    whole += force
                    about += wp.cross(spot.point, force)
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
        def loads(y: State, plant: Plant, through: vec3, w: vec3, given: Given):
            """Return the sum of the forces on an arm."""
            found = passage(y, plant, through, w, given)
            out = found.load
            if wp.static(count > 1):
                # Loads of the outer sections on each section.
                at = mounted(plant, arm)
                out = back(out, found, at, out.force, out.moment, y, plant)
            return out

        return loads

    return holding(AlongCode, locals())
