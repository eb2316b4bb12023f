"""What a kind of section is: its coordinates, its packing, and what the arm needs of it.

A section has a base, in whose axes it points along -z where it is straight, and a tip, whose axes
are carried along the backbone. Whatever concerns one section goes through its kind: the number of
coordinates, the parameters on the host, and the device code. With a the acceleration of the base,
ω and ω̇ its turning, and q the coordinates of the section,

    force on the base    m a + ω̇×H + F q̈ + f        moment  H×a + I ω̇ + L q̈ + n
    on the coordinates   Fᵀ a + Lᵀ ω̇ + N q̈ + b
    at the tip           a_t = a + ω̇×p + P q̈ + g_a        ω̇_t = ω̇ + W q̈ + g_w

where (f, n, b) and (g_a, g_w) are quadratic in z = (ω, q̇). Of their symmetric forms B(z, z') the
block-decoupled models take parts: z' = (ω', 0), how UAV and frozen arms turn, for the rows of the
UAV, and the rest, z' = z - (ω', 0), for those of the arms.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import Tree, device_types
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section


@dataclass(frozen=True)
class SectionTypes:
    """Types of sections with so many coordinates, and column(m, k) of a matrix of Columns."""

    Coordinates: Any
    Columns: Any
    Square: Any
    Element: Any
    Bias: Any
    Joint: Any
    Carried: Any
    column: Any


@cache
def section_types(numbers: Numbers, tree: Tree, coordinates: int) -> SectionTypes:
    """Return the types of sections with so many coordinates; those of equal numbers share them.

    Parameters
    ----------
    numbers : Numbers
        What device code computes with.
    tree : Tree
        The arms.
    coordinates : int
        The number of coordinates of a section.

    Returns
    -------
    SectionTypes
        The types.
    """
    types = device_types(numbers, tree)
    Real, vec3, mat33 = types.Real, types.vec3, types.mat33
    Coordinates = wp.types.vector(coordinates, Real)
    Columns = wp.types.matrix((3, coordinates), Real)
    Square = wp.types.matrix((coordinates, coordinates), Real)
    Carried = carried_type(numbers, tree)

    @wp.struct
    class Element:
        """First moment H, inertia I, the columns F and L, and N."""

        H: vec3
        I: mat33
        F: Columns
        L: Columns
        N: Square

    @wp.struct
    class Bias:
        """f, n and b."""

        force: vec3
        moment: vec3
        coordinates: Coordinates

    @wp.struct
    class Joint:
        """The tip: its point p [m], R (tip axes to the section's), the columns P and W, and how the
        rates move and turn it: P q̇ and W q̇."""

        p: vec3
        R: mat33
        P: Columns
        W: Columns
        moved: vec3
        turned: vec3

    @wp.func
    def column(m: Columns, k: int):
        return vec3(m[0, k], m[1, k], m[2, k])

    return holding(SectionTypes, locals())


@cache
def carried_type(numbers: Numbers, tree: Tree) -> Any:
    """Return the struct Carried, the same for all kinds."""
    vec3 = device_types(numbers, tree).vec3

    @wp.struct
    class Carried:
        """Acceleration of a point, and of the turning there, that velocities alone cause."""

        base: vec3
        spin: vec3

    return Carried


@dataclass(frozen=True)
class SectionCode:
    """The device code of one section. Functions in brackets are needed by some models alone.

    Shape : struct
        What follows from the coordinates.
    Motion : struct
        What follows from the coordinates and their rates.
    Place : struct
        A point of the backbone: `point` from the base [m] and `turn`, a quaternion, in axes of the
        base; and whatever the functions of a place read.
    shape(y, table, vehicle) -> Shape
        Of a state; table and vehicle: the coefficients that the kind has packed, and their row.
    motion(y, shape) -> Motion
    element(plant, shape, motion) -> Element
    full_bias(shape, element, motion, w) -> Bias
        B(z, z); w: ω.
    [turning_bias(shape, element, motion, w, v) -> Bias]
        Force and moment of B(z, (v, 0)).
    [bending_bias(shape, element, motion, w, v) -> Bias]
        B(z, (v, q̇)).
    [first_bending(shape, element, motion, w) -> Bias]
        The same with v = 0.
    [own_bending(shape, motion) -> Coordinates]
        b of a section on a base at rest.
    joint(plant, shape, motion) -> Joint
    carried(plant, shape, motion) -> Carried
        Acceleration and turning of the tip at ω = 0 and q̈ = 0, in axes of the base.
    place(y, plant, share) -> Place
        At a share of the length, from 0 to 1.
    swept_by(place) -> vec3, turned_by(place) -> vec3
        Its velocity [m/s] and turning [rad/s] as the rates move it, in axes of the base.
    pushed_by(place, force, moment) -> Coordinates
        Jᵀ (force, moment): a wrench at the place, in axes of the base, as a force on the
        coordinates.
    bent(y) -> Real
        The part of the range of the coordinates that is used; above 1 a run ends.
    """

    Shape: Any
    Motion: Any
    Place: Any
    shape: Any
    motion: Any
    element: Any
    full_bias: Any
    turning_bias: Any
    bending_bias: Any
    first_bending: Any
    own_bending: Any
    joint: Any
    carried: Any
    place: Any
    swept_by: Any
    turned_by: Any
    pushed_by: Any
    bent: Any


@dataclass(frozen=True)
class SectionKind:
    """A kind of section, and nothing but what kernels are made for: equal kinds share kernels.

    Kernels hold coordinates in units of their own, and in them what acts on the coordinates.

    Attributes
    ----------
    coordinates : int
        The number of coordinates.
    name : str
        The name of the kind, `Section.kind` of its sections.
    rows, columns : int
        The size of the table of coefficients of a section.
    parameters : tuple of str
        Names of further parameters of a section in the device's `Plant`, one number each.
    polar : bool
        Whether the coordinates are a bend vector, to which κ and ψa of the paper are polar. Of
        other kinds the paper's coordinates are the coordinates themselves.
    """

    coordinates: int

    name: ClassVar[str]
    rows: ClassVar[int] = 0
    columns: ClassVar[int] = 0
    parameters: ClassVar[tuple[str, ...]] = ()
    polar: ClassVar[bool] = False

    @classmethod
    def of(cls, section: Section) -> Self:
        """Return the kind of a section.

        Parameters
        ----------
        section : Section
            A section whose `kind` is the name of this one.

        Returns
        -------
        SectionKind
            The kind.
        """
        return cls(section.coordinates)

    def natural(self, section: Section, runs: int) -> np.ndarray:
        """Return the natural unit of each coordinate, in which errors of steps are measured, as
        those of positions are in arm lengths: a radian over the length, unless a kind overrides it.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates).
        """
        return np.repeat(1.0 / per_run(section.length, runs)[:, None], self.coordinates, axis=1)

    def units(self, section: Section, runs: int) -> np.ndarray:
        """Return what coordinates are multiplied by in kernels.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates).
        """
        raise NotImplementedError

    def stiffness(self, section: Section, runs: int) -> np.ndarray:
        """Return the elastic force per coordinate.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates) in SI units: force per coordinate.
        """
        raise NotImplementedError

    def damping(self, section: Section, runs: int) -> np.ndarray:
        """Return the damping force per rate of each coordinate.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        ndarray
            Of shape (runs, coordinates) in SI units: force per rate.
        """
        raise NotImplementedError

    def pack(self, section: Section, runs: int) -> dict[str, np.ndarray]:
        """Return the further parameters.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        dict of str to ndarray
            Name of each of `parameters`, and its values of shape (runs,).
        """
        return {}

    def table(self, section: Section, runs: int, at: slice) -> np.ndarray:
        """Return the table of coefficients of some runs.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.
        at : slice
            The runs that are asked for.

        Returns
        -------
        ndarray
            Of shape (n, rows, columns).
        """
        raise NotImplementedError

    def symbolic(self, section: Section, base: Any, coordinates: Any, rate: Any, table: Any) -> Any:
        """Return the section in CasADi, or None for a kind that has no such form.

        Parameters
        ----------
        section : Section
            A section of a vehicle.
        base : Frame
            The frame at its base, of sections/symbolic.py.
        coordinates : SX
            Its coordinates.
        rate : DM
            What the rates of the coordinates are of the rates of the vehicle, z.
        table : ndarray
            Its table of coefficients.

        Returns
        -------
        object or None
            An object with `section`, `frame(share)` at a share of the length, `motion` of base and
            coordinates, `inertia` in that, and `bent`, the part of the range that is used.
        """
        return None

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        """Return the device code of a section; the same code for the same arguments.

        Parameters
        ----------
        numbers : Numbers
            What device code computes with.
        tree : Tree
            The arms.
        section : int
            The index of the section among all of the tree.

        Returns
        -------
        SectionCode
            The code.
        """
        raise NotImplementedError
