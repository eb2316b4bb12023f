"""Warp types for one kind of numbers and tree of arms, and access to the parts of a state."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding, number_code
from continuair.vehicle.layout import Layout

MAX_BEND_ANGLE = 2.0 * np.pi
"""Largest |k| l [rad] for which the polynomials are valid; beyond it a run stops."""

FULL_LENGTH = MAX_BEND_ANGLE / np.sqrt(2.0)
"""Length of every arc in units of its own λ, the length unit of device code."""


@dataclass(frozen=True)
class Tree:
    """Structure of a vehicle, for which kernels are compiled.

    Parameters
    ----------
    kinds : tuple of tuple of SectionKind
        Kinds of the sections of each arm.
    bodies : bool, default False
        Whether tips carry rigid bodies.
    turned : bool, default False
        Whether the mount of an arm is rotated.
    camera_arm : int, default 0
        Index of the arm that carries the camera.
    terms : tuple of Term, default ()
        Terms that act on the vehicle, without their numbers.
    """

    kinds: tuple[tuple[Any, ...], ...]
    bodies: bool = False
    turned: bool = False
    camera_arm: int = 0
    terms: tuple[Any, ...] = ()

    @property
    def air(self) -> bool:
        """Return whether a term depends on wind."""
        return any(term.in_wind for term in self.terms)

    @property
    def stirred(self) -> bool:
        """Return whether a term depends on moving air of another term."""
        moved = any(term.moves_air for term in self.terms)
        return moved and any(term.in_stream for term in self.terms)

    @property
    def layout(self) -> Layout:
        """Return the columns of states, inputs and logs."""
        widths = tuple(tuple(kind.coordinates for kind in arm) for arm in self.kinds)
        energies = any(term.has_energy for term in self.terms)
        strains = tuple(n for n, kind in enumerate(self._all_kinds) if not kind.polar)
        counts, states, variables = (
            tuple(item for term in self.terms for item in getattr(term, name).items())
            for name in ("counts", "states", "variables")
        )
        return Layout(widths, self.air, energies, counts, states, variables, strains)

    @property
    def sections(self) -> tuple[int, ...]:
        """Return the number of sections of each arm."""
        return tuple(len(arm) for arm in self.kinds)

    def kind_of(self, section: int) -> Any:
        """Return the kind of a section, by its index among all."""
        return self._all_kinds[section]

    @property
    def couples(self) -> tuple[tuple[int, int], ...]:
        """Return the pairs of coordinates, among all, between which elastic forces act."""
        firsts = (where.start for where in self.layout.of_section)
        return tuple(
            (first + j, first + k)
            for first, kind in zip(firsts, self._all_kinds, strict=True)
            for j, k in kind.couples
        )

    @property
    def first_row(self) -> tuple[int, ...]:
        """Return the first row of each section in the table of coefficients, and their number.

        The rows of terms follow.
        """
        rows = [kind.rows for kind in self._all_kinds]
        return tuple(sum(rows[:section]) for section in range(len(rows) + 1))

    @property
    def table_columns(self) -> int:
        """Return the number of columns of the table of coefficients."""
        return room(max((each.columns for each in (*self._all_kinds, *self.terms)), default=0))

    @property
    def table_rows(self) -> int:
        """Return the number of rows of the table of coefficients."""
        return self.first_row[-1] + sum(term.rows for term in self.terms)

    def first_row_of(self, term: Any) -> int:
        """Return the first row of a term in the table of coefficients."""
        before = self.terms[: self.terms.index(term)]
        return self.first_row[-1] + sum(each.rows for each in before)

    @property
    def _all_kinds(self) -> tuple[Any, ...]:
        return tuple(kind for arm in self.kinds for kind in arm)

    @property
    def parameters(self) -> dict[str, tuple[int, ...]]:
        """Return the fields of the Plant that terms read, with the shape of each."""
        found = {k: shape for term in self.terms for k, shape in term.parameters(self).items()}
        width = sum(term.width for term in self.terms)
        return found | ({"term_numbers": (width,)} if width else {})

    @property
    def first(self) -> tuple[int, ...]:
        """Return the first section of each arm, and the number of all sections."""
        return tuple(sum(self.sections[:arm]) for arm in range(len(self.sections) + 1))


@dataclass(frozen=True)
class Types:
    """Types, and functions of a `State` y and of a `Push`, an actuator wrench.

    y holds, in the order of `Layout`, position, attitude, coordinates of the sections, world
    velocity, ω, rates of the coordinates, and rotor speeds. Bends has one number per coordinate. A
    Push is push_of(force, moment, bend): world axes [N], body axes [N m], bend moments [N m²].
    Along holds (cos, sin) of ψa of each section, and last of the roll, on the followed branches;
    two_of and with_two read and change one pair. tilt_of(y) is cos θ (cos φ, sin φ), which relates
    to roll and pitch as b to ψa and κ.
    """

    layout: Layout
    Cell: Any
    Real: Any
    vec2: Any
    vec3: Any
    vec4: Any
    mat33: Any
    quat: Any
    Bends: Any
    Along: Any
    Matrices: Any
    Vectors: Any
    PerSection: Any
    Row: Any
    Table: Any
    State: Any
    Push: Any
    Plant: Any
    position_of: Any
    attitude_of: Any
    bends_of: Any
    bend_rates_of: Any
    velocity_of: Any
    spin_of: Any
    two_of: Any
    with_two: Any
    tilt_of: Any
    state_of: Any
    load_state: Any
    three_of: Any
    push_of: Any
    force_of: Any
    moment_of: Any
    bend_moment_of: Any
    mount_of: Any


def room(count: int) -> int:
    """Return `count`, at least 1: Warp has no empty vectors, for vehicles without arms."""
    return max(count, 1)


@cache
def device_types(numbers: Numbers, tree: Tree) -> Types:
    """Return the types for one kind of numbers and tree of arms."""
    layout, code = tree.layout, number_code(numbers)
    Cell, Real, of_row, of_sample = code.Cell, code.Real, code.of_row, code.of_sample
    vec2, vec3 = wp.types.vector(2, Real), wp.types.vector(3, Real)
    vec4, mat33 = wp.types.vector(4, Real), wp.types.matrix((3, 3), Real)
    quat = wp.types.quaternion(Real)
    Row, State = wp.types.vector(tree.table_columns, Real), wp.types.vector(layout.state, Real)
    Push, Bends = wp.types.vector(layout.push.stop, Real), wp.types.vector(room(layout.bends), Real)
    Table = code.table_of(Row)
    arms, sections = len(tree.sections), layout.sections
    Along = wp.types.matrix((sections + 1, 2), Real)
    PerSection, PerArm = wp.types.vector(room(sections), Real), wp.types.vector(room(arms), Real)
    Vectors, Matrices, Quaternions = (
        wp.types.matrix((room(arms), columns), Real) for columns in (3, 9, 4)
    )
    width, bends, one, two = layout.state, layout.bends, Real(1.0), Real(2.0)
    P, Q, B = layout.position.start, layout.attitude.start, layout.bend.start
    V, W, DB = layout.velocity.start, layout.angular_velocity.start, layout.bend_rate.start
    F, M, BM = layout.force.start, layout.moment.start, layout.bend_moment.start

    class Plant:
        """Parameters of a vehicle, with coordinates of sections in kernel units.

        Per section: threshold κ_s, mass, mass of everything beyond its tip, and reach, the tip
        displacement per unit rotation of the section [arm lengths]. Per arm: mass, mount, turn (arm
        axes to body) and the same as a quaternion; mass, first moment and inertia of the body on
        its tip about the tip, in the axes of the last section there. length: of the longest arm
        [m]. omitted: 1 for each coupling that a partly coupled model omits. Then the parameters of
        kinds of sections, and of each term.
        """

        mass: Real
        uav_mass: Real
        length: Real
        uav_inertia: mat33
        unit: Bends
        stiffness: Bends
        damping: Bends
        threshold: PerSection
        section_mass: PerSection
        beyond: PerSection
        reach: PerSection
        arm_mass: PerArm
        mount: Vectors
        turn: Matrices
        mount_attitude: Quaternions
        body_mass: PerArm
        body_moment: Vectors
        body_inertia: Matrices
        omitted: vec3

    if tree.couples:
        Pairs = wp.types.vector(len(tree.couples), Real)
        Plant.__annotations__ |= {"stiffness_between": Pairs, "damping_between": Pairs}
    for section in range(sections):
        for name in tree.kind_of(section).parameters:
            Plant.__annotations__[name] = PerSection
    for name, shape in tree.parameters.items():
        Plant.__annotations__[name] = _kind(Real, shape)
    Plant = wp.struct(Plant)

    @wp.func
    def position_of(y: State):
        return vec3(y[P], y[P + 1], y[P + 2])

    @wp.func
    def attitude_of(y: State):
        return quat(y[Q], y[Q + 1], y[Q + 2], y[Q + 3])

    @wp.func
    def bends_of(y: State):
        out = Bends()
        for j in range(bends):
            out[j] = y[B + j]
        return out

    @wp.func
    def bend_rates_of(y: State):
        out = Bends()
        for j in range(bends):
            out[j] = y[DB + j]
        return out

    @wp.func
    def velocity_of(y: State):
        return vec3(y[V], y[V + 1], y[V + 2])

    @wp.func
    def spin_of(y: State):
        return vec3(y[W], y[W + 1], y[W + 2])

    @wp.func
    def two_of(along: Along, section: int):
        """Return (cos ψa, sin ψa) of one section."""
        return vec2(along[section, 0], along[section, 1])

    @wp.func
    def with_two(along: Along, section: int, two: vec2):
        along[section, 0] = two[0]
        along[section, 1] = two[1]
        return along

    @wp.func
    def tilt_of(y: State):
        """Return cos θ (cos φ, sin φ): components of the world's vertical along body z and y."""
        q = attitude_of(y)
        return vec2(one - two * (q[0] * q[0] + q[1] * q[1]), two * (q[1] * q[2] + q[0] * q[3]))

    @wp.func
    def state_of(p: vec3, q: quat, b: Bends, v: vec3, w: vec3, db: Bends):
        """Return a state, or its rate, from its parts."""
        out = State()
        for j in range(3):
            out[P + j] = p[j]
            out[V + j] = v[j]
            out[W + j] = w[j]
        for j in range(4):
            out[Q + j] = q[j]
        for j in range(bends):
            out[B + j] = b[j]
            out[DB + j] = db[j]
        return out

    @wp.func
    def load_state(rows: wp.array3d(dtype=Cell), run: int, sample: int, unit: Bends):
        y = State()
        for j in range(width):
            y[j] = of_sample(rows, run, sample, j)
        for j in range(bends):
            y[B + j] = y[B + j] * unit[j]
            y[DB + j] = y[DB + j] * unit[j]
        return y

    @wp.func
    def three_of(rows: wp.array3d(dtype=Cell), row: int, run: int, first: int):
        """Return three columns from the first on."""
        return vec3(
            of_row(rows, row, run, first),
            of_row(rows, row, run, first + 1),
            of_row(rows, row, run, first + 2),
        )

    @wp.func
    def push_of(force: vec3, moment: vec3, bend: Bends):
        out = Push()
        for j in range(3):
            out[F + j] = force[j]
            out[M + j] = moment[j]
        for j in range(bends):
            out[BM + j] = bend[j]
        return out

    @wp.func
    def force_of(push: Push):
        return vec3(push[F], push[F + 1], push[F + 2])

    @wp.func
    def moment_of(push: Push):
        return vec3(push[M], push[M + 1], push[M + 2])

    @wp.func
    def bend_moment_of(push: Push):
        out = Bends()
        for j in range(bends):
            out[j] = push[BM + j]
        return out

    @wp.func
    def mount_of(plant: Plant, arm: int):
        return vec3(plant.mount[arm, 0], plant.mount[arm, 1], plant.mount[arm, 2])

    return holding(Types, locals())


def _kind(Real: Any, shape: tuple[int, ...]) -> Any:
    """Return the type of a parameter by its shape: a number, a vector or a matrix."""
    if len(shape) > 1:
        return wp.types.matrix(shape, Real)
    return wp.types.vector(shape[0], Real) if shape else Real
