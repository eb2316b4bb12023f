"""Contact of arms with solid objects at rest: Hunt-Crossley normal forces, and friction.

At depth d and speed of approach v the normal force is k d^1.5 (1 + c v), not below 0 (K. H. Hunt
and F. R. E. Crossley, J. Appl. Mech. 42, 1975). Friction is regularised: μ F v_t/√(v_t² + v_s²).
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import warp as wp

from continuair.device.arguments import arguments
from continuair.device.numbers import Numbers, number_code
from continuair.device.types import Tree
from continuair.kernels.device import Device
from continuair.kernels.flight import flight_code
from continuair.kernels.load_along import along_code
from continuair.kernels.term_sum import Acting
from continuair.scenario.obstacles import SPOTS
from continuair.terms.term import Term

TOUCHED = 1e-3
"""Depth [m] beyond which a flight does not start in contact, but inside an object."""


@dataclass(frozen=True)
class Contact(Term):
    """Contact of all arms with some objects.

    Parameters
    ----------
    numbers : tuple of tuple of float
        Law, position, attitude and sizes of each object.
    radii : tuple of float
        Radius of each section [m].
    shapes : tuple of str
        Shape of each object.
    arms : int
        Number of arms.
    """

    field: ClassVar[str] = "scenario.obstacles"
    has_energy: ClassVar[bool] = True
    kinked: ClassVar[bool] = True

    numbers: tuple[tuple[float, ...], ...]
    radii: tuple[float, ...]
    shapes: tuple[str, ...]
    arms: int

    @property
    def variables(self) -> dict[str, int]:
        """Return the force on each arm, and the number of its places inside an object."""
        return {"contact_force": 3 * self.arms, "contact_inside": self.arms}

    def device(self, code: Device) -> Acting:
        """Return the device functions of the contact.

        Parameters
        ----------
        code : Device
            Types and functions of device code.

        Returns
        -------
        Acting
            Load on each arm, and the energy of the contact.
        """
        loads = [_touching(self, code, arm) for arm in range(self.arms)]
        types, State, Flight = code.types, code.types.State, code.Flight
        Real = types.Real

        @wp.func
        def none(y: State, flight: Flight, row: int):
            return Real(0.0)

        def and_arm(before: Any, arm: int) -> Any:
            stored = loads[arm].stored

            @wp.func
            def found(y: State, flight: Flight, row: int):
                return before(y, flight, row) + stored(y, flight)

            return found

        energy = none
        for arm in range(self.arms):
            energy = and_arm(energy, arm)
        return Acting(on_arm=lambda arm: loads[arm].load, energy=energy)

    def observer(self, numbers: Numbers, tree: Tree) -> wp.Kernel:
        """Return the kernel of forces along a log.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.

        Returns
        -------
        wp.Kernel
            The kernel, which writes the columns ``contact_force`` and ``contact_inside``.
        """
        return _observer(self, Device(numbers, tree))


@dataclass(frozen=True)
class _Touching:
    """Device functions of an arm: load, as of `Acting`; stored(y, flight), the energy [J]; and
    felt(y, flight), the force in world axes [N] and the number of places inside."""

    load: Any
    stored: Any
    felt: Any


def _touching(term: Contact, code: Device, arm: int) -> _Touching:
    types, numbers, tree = code.types, code.numbers, code.tree
    along, above = along_code(numbers, tree), number_code(numbers).above
    Real, vec3, quat, State, Plant = types.Real, types.vec3, types.quat, types.State, types.Plant
    Push, Along, Flight, Spot = types.Push, types.Along, code.Flight, along.Spot
    position_of, attitude_of = types.position_of, types.attitude_of
    velocity_of, spin_of = types.velocity_of, types.spin_of
    law_of, radius_of = code.reader(term.numbers), code.reader(term.radii)
    zero, one, share, touched = Real(0.0), Real(1.0), Real(0.4), Real(TOUCHED)

    @wp.struct
    class Base:
        """Pose of the UAV."""

        position: vec3
        attitude: quat

    @wp.struct
    class Near:
        """Distance of a point from an object [m], negative inside, and the direction out of it."""

        distance: Real
        normal: vec3

    @wp.func
    def away(x: Real, y: Real, z: Real, a: Real, b: Real, c: Real):
        """Return the distance of a point, at x, y, z beyond the faces with normals a, b, c."""
        out = Near()
        u = wp.max(x, zero)
        v = wp.max(y, zero)
        w = wp.max(z, zero)
        outside = wp.sqrt(u * u + v * v + w * w)
        out.distance = outside + wp.min(wp.max(x, wp.max(y, z)), zero)
        # Inside, the nearest face.
        on_x = above(x, wp.max(y, z), one, zero)
        on_y = (one - on_x) * above(y, z, one, zero)
        on_z = one - on_x - on_y
        size = above(outside, zero, outside, one)
        within = above(outside, zero, zero, one)
        out.normal = vec3(
            a * (u / size + within * on_x),
            b * (v / size + within * on_y),
            c * (w / size + within * on_z),
        )
        return out

    @wp.func
    def sign(x: Real):
        return above(zero, x, -one, one)

    @wp.func
    def from_plane(p: vec3, size: vec3):
        out = Near()
        out.distance = p[2]
        out.normal = vec3(zero, zero, one)
        return out

    @wp.func
    def from_sphere(p: vec3, size: vec3):
        out = Near()
        far = wp.length(p)
        out.distance = far - size[0]
        out.normal = p / above(far, zero, far, one)
        return out

    @wp.func
    def from_box(p: vec3, size: vec3):
        x = wp.abs(p[0]) - size[0]
        y = wp.abs(p[1]) - size[1]
        z = wp.abs(p[2]) - size[2]
        return away(x, y, z, sign(p[0]), sign(p[1]), sign(p[2]))

    @wp.func
    def from_cylinder(p: vec3, size: vec3):
        far = wp.sqrt(p[0] * p[0] + p[1] * p[1])
        # Beyond the mantle and beyond the ends; the third face is never the nearest.
        beyond = far - size[0]
        ends = wp.abs(p[2]) - size[1]
        out = away(beyond, ends, wp.min(beyond, ends) - one, one, sign(p[2]), one)
        sideways = above(far, zero, far, one)
        out.normal = vec3(
            out.normal[0] * p[0] / sideways, out.normal[0] * p[1] / sideways, out.normal[1]
        )
        return out

    shapes = {
        "plane": from_plane, "sphere": from_sphere, "box": from_box, "cylinder": from_cylinder,
    }  # fmt: skip

    @wp.struct
    class Touch:
        """Depth of a point in an object [m], the direction out of it, and the elastic force [N]."""

        depth: Real
        normal: vec3
        elastic: Real

    def touch_of(index: int) -> Any:
        near_of = shapes[term.shapes[index]]

        @wp.func
        def touch(plant: Plant, radius: Real, p: vec3):
            n = law_of(plant)
            turn = quat(n[index, 7], n[index, 8], n[index, 9], n[index, 10])
            place = vec3(n[index, 4], n[index, 5], n[index, 6])
            own = wp.quat_rotate_inv(turn, p - place)
            near = near_of(own, vec3(n[index, 11], n[index, 12], n[index, 13]))
            out = Touch()
            out.depth = wp.max(radius - near.distance, zero)
            out.normal = wp.quat_rotate(turn, near.normal)
            out.elastic = n[index, 0] * out.depth * wp.sqrt(out.depth)
            return out

        return touch

    @wp.func
    def pushed(plant: Plant, radius: Real, p: vec3, v: vec3):
        return vec3()

    @wp.func
    def told(plant: Plant, radius: Real, p: vec3, v: vec3):
        return vec3()

    def and_pushed(before: Any, index: int) -> Any:
        touch = touch_of(index)

        @wp.func
        def found(plant: Plant, radius: Real, p: vec3, v: vec3):
            n = law_of(plant)
            at = touch(plant, radius, p)
            speed = wp.dot(v, at.normal)
            size = wp.max(at.elastic * (one - n[index, 1] * speed), zero)
            slip = v - speed * at.normal
            slow = n[index, 3]
            rubbed = n[index, 2] * size / wp.sqrt(wp.dot(slip, slip) + slow * slow)
            return before(plant, radius, p, v) + size * at.normal - rubbed * slip

        return found

    def and_told(before: Any, index: int) -> Any:
        touch = touch_of(index)

        @wp.func
        def found(plant: Plant, radius: Real, p: vec3, v: vec3):
            at = touch(plant, radius, p)
            inside = above(at.depth, touched, one, zero)
            return before(plant, radius, p, v) + vec3(share * at.elastic * at.depth, inside, zero)

        return found

    for index in range(len(term.shapes)):
        pushed, told = and_pushed(pushed, index), and_told(told, index)

    def force_on(section: int) -> Any:
        @wp.func
        def force(plant: Plant, n: int, at: Spot, base: Base):
            radii = radius_of(plant)
            p = base.position + wp.quat_rotate(base.attitude, at.point)
            v = wp.quat_rotate(base.attitude, at.velocity)
            return wp.quat_rotate_inv(base.attitude, pushed(plant, radii[section], p, v))

        return force

    def told_on(section: int) -> Any:
        @wp.func
        def found(plant: Plant, n: int, at: Spot, base: Base):
            radii = radius_of(plant)
            p = base.position + wp.quat_rotate(base.attitude, at.point)
            return told(plant, radii[section], p, at.velocity)

        return found

    loads = along.loads_on(arm, SPOTS, Base, force_on)
    # Energies, and places that are inside, summed as forces are.
    sums = along.loads_on(arm, SPOTS, Base, told_on)

    @wp.func
    def base_of(y: State):
        out = Base()
        out.position = position_of(y)
        out.attitude = attitude_of(y)
        return out

    @wp.func
    def load(y: State, along: Along, flight: Flight, row: int, push: Push):
        through = wp.quat_rotate_inv(attitude_of(y), velocity_of(y))
        return loads(y, flight.plant, through, spin_of(y), base_of(y))

    @wp.func
    def stored(y: State, flight: Flight):
        return sums(y, flight.plant, vec3(), vec3(), base_of(y)).force[0]

    @wp.func
    def felt(y: State, flight: Flight):
        through = wp.quat_rotate_inv(attitude_of(y), velocity_of(y))
        force = loads(y, flight.plant, through, spin_of(y), base_of(y)).force
        inside = sums(y, flight.plant, vec3(), vec3(), base_of(y)).force[1]
        return wp.quat_rotate(attitude_of(y), force), inside

    return _Touching(load, stored, felt)


def _observer(term: Contact, code: Device) -> Any:
    types, numbers, tree = code.types, code.numbers, code.tree
    Cell, Flight, State = types.Cell, code.Flight, types.State
    structs, of = flight_code(numbers, tree), number_code(numbers)
    Vehicles, Drive = structs.Vehicles, arguments(numbers.precision).Drive
    flight_of, load_state = structs.flight_of, types.load_state
    keep, lanes = of.keep, of.lanes
    columns = types.layout.observed
    forces, places = columns["contact_force"].start, columns["contact_inside"].start

    @wp.func
    def nothing(out: wp.array3d(dtype=Cell), sample: int, y: State, flight: Flight):
        pass

    def and_arm(before: Any, arm: int) -> Any:
        felt = _touching(term, code, arm).felt

        @wp.func
        def write(out: wp.array3d(dtype=Cell), sample: int, y: State, flight: Flight):
            before(out, sample, y, flight)
            force, inside = felt(y, flight)
            for j in range(3):
                keep(out, flight.run, sample, forces + 3 * arm + j, force[j])
            keep(out, flight.run, sample, places + arm, inside)

        return write

    write = nothing
    for arm in range(term.arms):
        write = and_arm(write, arm)

    @wp.kernel(enable_backward=False, module="unique", module_options=of.options)
    def contacts(
        vehicles: Vehicles,
        drive: Drive,
        log: wp.array3d(dtype=Cell),
        out: wp.array3d(dtype=Cell),
    ):
        """Write the columns of contact; drive: inputs."""
        pack, sample = wp.tid()
        run = pack * lanes
        flight = flight_of(vehicles, drive, run)
        write(out, sample, load_state(log, run, sample, flight.plant.unit), flight)

    return contacts
