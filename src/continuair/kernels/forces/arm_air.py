"""Device code of the air on the arms: drag across the backbone, in the wash of the rotors."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.kernels.arm.tip import tip_code
from continuair.kernels.flight import flight_code
from continuair.kernels.forces.air import air_code
from continuair.kernels.forces.load import load_code
from continuair.kernels.forces.rotors import rotor_code
from continuair.kernels.numbers import Numbers, number_code
from continuair.kernels.types import Tree, device_types, holding

NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Of Gauss's rule along a section, from -1 to 1."""

EDGE = 0.5
"""Part of a disk's radius, and of its area, over which the wash begins on either side of its edge:
air shears there, and a force that jumped would cost the steps their order."""


@dataclass(frozen=True)
class ArmAirCode:
    """drag_on_arm(arm) gives the function load(y, flight, row, push) of one arm; arms_load is that
    of all."""

    drag_on_arm: Any
    arms_load: Any


@cache
def arm_air_code(numbers: Numbers, tree: Tree, frozen_arm: bool) -> ArmAirCode:
    """Drag of the arms; frozen_arm: bends feel the air on a base that stays as it starts."""
    types, tips, loads = (
        device_types(numbers, tree),
        tip_code(numbers, tree),
        load_code(numbers, tree),
    )
    Flight, wind_at = flight_code(numbers, tree).Flight, air_code(numbers, tree).wind_at
    Real, State, Plant, Push = types.Real, types.State, types.Plant, types.Push
    Load, plus, above = loads.Load, loads.plus, number_code(numbers).above
    vec2, vec3, attitude_of, spin_of = types.vec2, types.vec3, types.attitude_of, types.spin_of
    velocity_of, bend_of, bend_rate_of = types.velocity_of, types.bend_of, types.bend_rate_of
    mounted, end_of, swept_by = tips.mounted, tips.end_of, tips.swept_by
    turned_by, wrench_on_bend = tips.turned_by, tips.wrench_on_bend
    rotors, washes, zero, one = tree.rotors, tree.wash, Real(0.0), Real(1.0)
    low, middle, high = (Real(float(0.5 + 0.5 * x)) for x in NODES)
    outer, inner = (Real(float(0.5 * weight)) for weight in WEIGHTS[:2])
    Induced = types.PerRotor if washes else vec2

    @wp.func
    def no_wash(y: State, flight: Flight, row: int, push: Push):
        return Induced()

    @wp.func
    def unmoved(plant: Plant, point: vec3, induced: Induced):
        return vec3()

    induced_of, washed_at = no_wash, unmoved
    if washes:
        thrusts_of = rotor_code(numbers, tree).thrusts_of
        edge, half, three = Real(EDGE), Real(0.5), Real(3.0)

        @wp.func
        def risen(x: Real):
            """From 0 at -1 to 1 at 1, and flat beyond."""
            part = wp.min(wp.max(half * (x + one), zero), one)
            return part * part * (three - (one + one) * part)

        @wp.func
        def induced_by_thrusts(y: State, flight: Flight, row: int, push: Push):
            """Velocities of the air at the disks, by momentum theory in hover."""
            out = thrusts_of(y, flight, row, push)
            for i in range(rotors):
                out[i] = wp.sqrt(flight.plant.wash * out[i])
            return out

        @wp.func
        def washed(plant: Plant, point: vec3, induced: Induced):
            """The wash at a point: of each rotor below its disk, as much beyond the edge as it
            lacks within."""
            out = vec3()
            thick = edge * wp.sqrt(plant.disk)
            for i in range(rotors):
                axis = vec3(plant.allocation[0, i], plant.allocation[1, i], plant.allocation[2, i])
                from_hub = point - vec3(plant.hubs[i, 0], plant.hubs[i, 1], plant.hubs[i, 2])
                height = wp.dot(from_hub, axis)
                aside = wp.length_sq(from_hub) - height * height
                within = risen((one - aside / plant.disk) / edge) * risen(-height / thick)
                out -= within * induced[i] * axis
            return out

        induced_of, washed_at = induced_by_thrusts, washed

    def on_arm(arm: int) -> Any:
        first, count = tree.first[arm], tree.sections[arm]
        Rows = wp.types.matrix((count, 3), Real)

        @wp.func
        def drag(y: State, plant: Plant, through: vec3, w: vec3, induced: Induced):
            """Of a base that moves through the air, body axes: nodes of a section are ends of
            parts of it."""
            out = Load()
            at = mounted(plant, arm)
            swept = vec3()
            spun = vec3()
            forces = Rows()
            moments = Rows()
            shares = vec3(low, middle, high)
            weights = vec3(outer, inner, outer)
            for k in range(count):
                i = first + k
                b = bend_of(y, i)
                db = bend_rate_of(y, i)
                whole = vec3()
                about = vec3()
                on = vec2()
                for n in range(3):
                    s = shares[n]
                    part = end_of(s * b)
                    unit = s * plant.unit[i]
                    step = wp.quat_rotate(at.attitude, unit * part.point)
                    moved = wp.quat_rotate(at.attitude, swept_by(part, unit, s * b, s * db))
                    point = at.point + step
                    v = through + wp.cross(w, point) + swept + wp.cross(spun, step) + moved
                    v -= washed_at(plant, point, induced)
                    along = wp.quat_rotate(at.attitude * part.turn, vec3(zero, zero, one))
                    v -= wp.dot(v, along) * along
                    force = -(weights[n] * plant.across[i] * wp.length(v)) * v
                    whole += force
                    about += wp.cross(point, force)
                    local = wp.quat_rotate_inv(at.attitude, force)
                    on += s * wrench_on_bend(part, unit, s * b, local, vec3())
                out.bend[2 * i] = on[0]
                out.bend[2 * i + 1] = on[1]
                for j in range(3):
                    forces[k, j] = whole[j]
                    moments[k, j] = about[j]
                end = end_of(b)
                step = wp.quat_rotate(at.attitude, plant.unit[i] * end.point)
                moved = wp.quat_rotate(at.attitude, swept_by(end, plant.unit[i], b, db))
                swept += wp.cross(spun, step) + moved
                spun += wp.quat_rotate(at.attitude, turned_by(end, b, db))
                at.point += step
                at.attitude = at.attitude * end.turn
                out.force += whole
                out.moment += about
            if wp.static(count > 1):
                out = carried_back(y, plant, out, forces, moments)
            return out

        @wp.func
        def carried_back(y: State, plant: Plant, load: Load, forces: Rows, moments: Rows):
            """With what the sections beyond each one do to its bend."""
            beyond = load.force
            about = load.moment
            at = mounted(plant, arm)
            for k in range(count):
                i = first + k
                b = bend_of(y, i)
                end = end_of(b)
                beyond -= vec3(forces[k, 0], forces[k, 1], forces[k, 2])
                about -= vec3(moments[k, 0], moments[k, 1], moments[k, 2])
                at.point += wp.quat_rotate(at.attitude, plant.unit[i] * end.point)
                f = wp.quat_rotate_inv(at.attitude, beyond)
                m = wp.quat_rotate_inv(at.attitude, about - wp.cross(at.point, beyond))
                on = wrench_on_bend(end, plant.unit[i], b, f, m)
                load.bend[2 * i] = load.bend[2 * i] + on[0]
                load.bend[2 * i + 1] = load.bend[2 * i + 1] + on[1]
                at.attitude = at.attitude * end.turn
            return load

        return drag

    def drag_on_arm(arm: int) -> Any:
        drag = on_arm(arm)

        @wp.func
        def load(y: State, flight: Flight, row: int, push: Push):
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

    @wp.func
    def no_load(y: State, flight: Flight, row: int, push: Push):
        return Load()

    def plus_arm(before: Any, arm: int) -> Any:
        of_arm = drag_on_arm(arm)

        @wp.func
        def load(y: State, flight: Flight, row: int, push: Push):
            return plus(before(y, flight, row, push), of_arm(y, flight, row, push))

        return load

    arms_load = no_load
    for arm in range(len(tree.sections)):
        arms_load = plus_arm(arms_load, arm)
    return holding(ArmAirCode, locals())
