"""Device code of the arms' tips: pose, motion, and the generalised force of a wrench on one.

An arm is evaluated section by section from its mount, in body axes, each by the code of its kind
(sections/kind.py). The tip's axes are the last section's, rotated by π about x.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import warp as wp

from continuair.device.numbers import Numbers
from continuair.device.types import Tree, device_types, holding


@dataclass(frozen=True)
class TipCode:
    """Structs and functions of the arms' tips, defined below.

    tip_of(arm), moving_tip_of(arm), world_tip_of(arm) and wrench_on(arm) return the functions of
    one arm. moved_on(section) returns the function that moves a MovingTip from the base of a
    section to its tip, in rotated axes or not. points_of_tips: of all arms.
    """

    Tip: Any
    MovingTip: Any
    mounted: Any
    moved_on: Any
    tip_of: Any
    moving_tip_of: Any
    world_tip_of: Any
    wrench_on: Any
    points_of_tips: Any


@cache
def tip_code(numbers: Numbers, tree: Tree) -> TipCode:
    """Return the functions for one kind of numbers and tree."""
    types = device_types(numbers, tree)
    Real, State, Plant, Bends = types.Real, types.State, types.Plant, types.Bends
    Vectors = types.Vectors
    vec3, quat, mount_of = types.vec3, types.quat, types.mount_of
    position_of, attitude_of = types.position_of, types.attitude_of
    velocity_of, spin_of = types.velocity_of, types.spin_of
    zero, one, turned, layout = Real(0.0), Real(1.0), tree.turned, types.layout

    @wp.struct
    class Tip:
        """Tip of an arm in body axes: point [m] and tip frame."""

        point: vec3
        attitude: quat

    @wp.struct
    class MovingTip:
        """Tip with its velocity [m/s] and angular velocity [rad/s] from bend rates."""

        tip: Tip
        swept: vec3
        turned: vec3

    @wp.struct
    class WorldTip:
        """Tip in world axes: position [m], velocity [m/s], angular velocity [rad/s], tip frame."""

        position: vec3
        velocity: vec3
        turning: vec3
        attitude: quat

    @wp.func
    def mounted(plant: Plant, arm: int):
        """Return the frame of an arm's mount."""
        out = Tip()
        out.point = mount_of(plant, arm)
        t = plant.mount_attitude
        out.attitude = quat(t[arm, 0], t[arm, 1], t[arm, 2], t[arm, 3])
        return out

    @wp.func
    def half_turn(attitude: quat):
        """Return the tip frame, with z out of the arm, from axes in which the arm is along -z."""
        return attitude * quat(one, zero, zero, zero)

    # A vehicle without arms has a tip at its mount, for the camera.
    def sections_of(arm: int) -> range:
        return range(tree.first[arm], tree.first[arm + 1]) if tree.sections else range(0)

    def rotates(arm: int) -> bool:
        """Return whether the base of a section of an arm is rotated from the body."""
        return turned or len(sections_of(arm)) > 1

    def at_mount(arm: int) -> Any:
        @wp.func
        def begun(y: State, plant: Plant):
            return mounted(plant, arm)

        return begun

    def tip_of(arm: int) -> Any:
        rotated = rotates(arm)

        def and_section(before: Any, section: int) -> Any:
            place = tree.kind_of(section).device(numbers, tree, section).place

            @wp.func
            def found(y: State, plant: Plant):
                out = before(y, plant)
                end = place(y, plant, one)
                if wp.static(rotated):
                    out.point += wp.quat_rotate(out.attitude, end.point)
                    out.attitude = out.attitude * end.turn
                else:
                    out.point += end.point
                    out.attitude = end.turn
                return out

            return found

        unturned = at_mount(arm)
        for section in sections_of(arm):
            unturned = and_section(unturned, section)

        @wp.func
        def tip(y: State, plant: Plant):
            """Return the Tip of this arm."""
            out = unturned(y, plant)
            out.attitude = half_turn(out.attitude)
            return out

        return tip

    def moved_on(section: int, rotated: bool = True) -> Any:
        code = tree.kind_of(section).device(numbers, tree, section)
        place, swept_by, turned_by = code.place, code.swept_by, code.turned_by

        @wp.func
        def moved(on: MovingTip, y: State, plant: Plant):
            at = on.tip
            end = place(y, plant, one)
            step = end.point
            moved = swept_by(end)
            spin = turned_by(end)
            turn = end.turn
            if wp.static(rotated):
                step = wp.quat_rotate(at.attitude, step)
                moved = wp.quat_rotate(at.attitude, moved)
                spin = wp.quat_rotate(at.attitude, spin)
                turn = at.attitude * turn
            on.swept += wp.cross(on.turned, step) + moved
            on.turned += spin
            on.tip.point += step
            on.tip.attitude = turn
            return on

        return moved

    def moving_tip_of(arm: int) -> Any:
        rotated, at_base = rotates(arm), at_mount(arm)

        @wp.func
        def begun(y: State, plant: Plant):
            out = MovingTip()
            out.tip = at_base(y, plant)
            return out

        def and_section(before: Any, section: int) -> Any:
            moved = moved_on(section, rotated)

            @wp.func
            def found(y: State, plant: Plant):
                return moved(before(y, plant), y, plant)

            return found

        unturned = begun
        for section in sections_of(arm):
            unturned = and_section(unturned, section)

        @wp.func
        def moving_tip(y: State, plant: Plant):
            """Return the MovingTip of this arm, in body axes."""
            out = unturned(y, plant)
            out.tip.attitude = half_turn(out.tip.attitude)
            return out

        return moving_tip

    def world_tip_of(arm: int) -> Any:
        moving_tip = moving_tip_of(arm)

        @wp.func
        def world_tip(y: State, plant: Plant):
            """Return the WorldTip of this arm."""
            q, w, moving = attitude_of(y), spin_of(y), moving_tip(y, plant)
            point, out = moving.tip.point, WorldTip()
            out.position = position_of(y) + wp.quat_rotate(q, point)
            out.velocity = velocity_of(y) + wp.quat_rotate(q, wp.cross(w, point) + moving.swept)
            out.turning = wp.quat_rotate(q, w + moving.turned)
            out.attitude = q * moving.tip.attitude
            return out

        return world_tip

    def wrench_on(arm: int) -> Any:
        rotated = rotates(arm)

        @wp.func
        def none(
            out: Bends, at: Tip, y: State, plant: Plant, tip: Tip, force: vec3, moment: vec3
        ):  # fmt: skip
            return out

        def before(beyond: Any, section: int) -> Any:
            code, own = tree.kind_of(section).device(numbers, tree, section), layout.of_section
            place, pushed_by = code.place, code.pushed_by
            first, count = own[section].start, own[section].stop - own[section].start

            @wp.func
            def wrench(
                out: Bends, at: Tip, y: State, plant: Plant, tip: Tip, force: vec3, moment: vec3
            ):  # fmt: skip
                end = place(y, plant, one)
                f = force
                m = moment
                if wp.static(rotated):
                    at.point += wp.quat_rotate(at.attitude, end.point)
                    f = wp.quat_rotate_inv(at.attitude, force)
                    m = wp.quat_rotate_inv(
                        at.attitude, moment + wp.cross(tip.point - at.point, force)
                    )
                    at.attitude = at.attitude * end.turn
                on = pushed_by(end, f, m)
                for j in range(count):
                    out[first + j] = on[j]
                return beyond(out, at, y, plant, tip, force, moment)

            return wrench

        on_sections = none
        for section in reversed(sections_of(arm)):
            on_sections = before(on_sections, section)

        @wp.func
        def wrench(y: State, plant: Plant, tip: Tip, force: vec3, moment: vec3):
            """Return Jᵀ (force, moment), the forces on all coordinates of a wrench in body axes."""
            return on_sections(Bends(), mounted(plant, arm), y, plant, tip, force, moment)

        return wrench

    @wp.func
    def no_points(y: State, plant: Plant):
        return Vectors()

    def plus_point(before: Any, arm: int) -> Any:
        tip = tip_of(arm)

        @wp.func
        def points(y: State, plant: Plant):
            """Return the tips in body axes [m], arm by arm."""
            out = before(y, plant)
            at = tip(y, plant).point
            for j in range(3):
                out[arm, j] = at[j]
            return out

        return points

    points_of_tips = no_points
    for arm in range(len(tree.sections)):
        points_of_tips = plus_point(points_of_tips, arm)
    return holding(TipCode, locals())
