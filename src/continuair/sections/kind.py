"""Interface of a kind of section: its coordinates, its packed parameters and its device code.

A section points along -z of the axes at its base if it is straight. The axes at its tip move with
the backbone. With a the acceleration of the base, ω and ω̇ its angular velocity and acceleration,
and q the coordinates of the section,

    force on the base    m a + ω̇×H + F q̈ + f        moment  H×a + I ω̇ + L q̈ + n
    on the coordinates   Fᵀ a + Lᵀ ω̇ + N q̈ + b
    at the tip           a_t = a + ω̇×p + P q̈ + g_a        ω̇_t = ω̇ + W q̈ + g_w

where (f, n, b) and (g_a, g_w) are quadratic in z = (ω, q̇). Block-decoupled models use parts of
their symmetric forms B(z, z'): z' = (ω', 0), the rotation of the UAV with frozen arms, in the rows
of the UAV, and the rest, z' = z - (ω', 0), in those of the arms.
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, Struct, holding
from continuair.device.types import Tree, device_types
from continuair.typing import Array
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section

if TYPE_CHECKING:
    from casadi import DM, SX

    from continuair.sections.symbolic import Frame


@dataclass(frozen=True)
class SectionTypes:
    """Warp types of sections with a number of coordinates; column(m, k) of a matrix of Columns."""

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
    """Return the Warp types of sections with a number of coordinates; equal numbers share them.

    Parameters
    ----------
    numbers : Numbers
        Precision and lanes of device code.
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
        """First moment H, inertia I, columns F and L, and inertia N of the coordinates."""

        H: vec3
        I: mat33
        F: Columns
        L: Columns
        N: Square

    @wp.struct
    class Bias:
        """Bias f, n and b."""

        force: vec3
        moment: vec3
        coordinates: Coordinates

    @wp.struct
    class Joint:
        """Tip: point p [m], R (tip axes to the section's), columns P and W, and its velocity P q̇
        and angular velocity W q̇ from the rates."""

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
    """Return the struct Carried, the same for all kinds of sections."""
    vec3 = device_types(numbers, tree).vec3

    @wp.struct
    class Carried:
        """Linear and angular acceleration of a frame caused by velocities alone."""

        base: vec3
        spin: vec3

    return Carried


@dataclass(frozen=True)
class SectionCode:
    """The device code of one section.

    Parameters
    ----------
    Shape : Struct
        Quantities that depend on the coordinates.
    Motion : Struct
        Quantities that depend on the coordinates and their rates.
    Place : Struct
        A point of the backbone: ``point`` from the base [m] and ``turn``, a quaternion, in axes of
        the base, and fields for the functions of a place.
    shape : wp.Function
        ``shape(y, table, vehicle, w, v) -> Shape``; table and vehicle: the packed coefficients, and
        their row; w and v: those of the bending bias that is asked for later, v = w for the full
        one, for kinds that compute it here.
    motion : wp.Function
        ``motion(y, shape) -> Motion``.
    element : wp.Function
        ``element(plant, shape, motion) -> Element``.
    full_bias : wp.Function
        ``full_bias(shape, element, motion, w) -> Bias``, B(z, z) with w = ω.
    turning_bias : wp.Function or None
        ``turning_bias(shape, element, motion, w, v) -> Bias``, force and moment of B(z, (v, 0)).
        Only block-decoupled models call it.
    bending_bias : wp.Function or None
        ``bending_bias(shape, element, motion, w, v) -> Bias``, B(z, (v, q̇)). Only block-decoupled
        models call it.
    first_bending : wp.Function or None
        ``first_bending(shape, element, motion, w) -> Bias``, the same with v = 0.
    own_bending : wp.Function or None
        ``own_bending(shape, motion) -> Coordinates``, b of a section on a base at rest. Only the
        model "independent" calls it.
    joint : wp.Function
        ``joint(plant, shape, motion) -> Joint``.
    carried : wp.Function
        ``carried(plant, shape, motion) -> Carried``, linear and angular acceleration of the tip at
        ω = 0 and q̈ = 0, in axes of the base.
    place : wp.Function
        ``place(y, plant, share) -> Place`` at a share of the length, from 0 to 1.
    swept_by : wp.Function
        ``swept_by(place) -> vec3``, its velocity from the rates [m/s], in axes of the base.
    turned_by : wp.Function
        ``turned_by(place) -> vec3``, its angular velocity from the rates [rad/s].
    pushed_by : wp.Function
        ``pushed_by(place, force, moment) -> Coordinates``, Jᵀ (force, moment): the generalised
        force of a wrench at the place, in axes of the base.
    bent : wp.Function
        ``bent(y) -> Real``, the used share of the coordinates' range; above 1 the run stops.
    """

    Shape: Struct
    Motion: Struct
    Place: Struct
    shape: wp.Function
    motion: wp.Function
    element: wp.Function
    full_bias: wp.Function
    turning_bias: wp.Function | None
    bending_bias: wp.Function | None
    first_bending: wp.Function | None
    own_bending: wp.Function | None
    joint: wp.Function
    carried: wp.Function
    place: wp.Function
    swept_by: wp.Function
    turned_by: wp.Function
    pushed_by: wp.Function
    bent: wp.Function


class SymbolicSection(Protocol):
    """A section in CasADi.

    section: its parameters. motion: velocity of its base and coordinates, as a matrix times the
    rates z of the vehicle. inertia: its inertia in that motion. bent: used share of the
    coordinates' range. frame(share): the frame at a share of the length.
    """

    section: Section

    def frame(self, share: float = 1.0) -> "Frame": ...

    @property
    def motion(self) -> "SX": ...

    @property
    def inertia(self) -> "SX": ...

    @property
    def bent(self) -> "SX": ...


@dataclass(frozen=True)
class SectionKind:
    """A kind of section, as kernels are compiled for it: equal kinds share kernels.

    Kernels hold coordinates, and the generalised forces on them, in units of their own.

    Parameters
    ----------
    coordinates : int
        Number of coordinates.

    Attributes
    ----------
    name : str
        Name of the kind, `Section.kind` of its sections.
    rows, columns : int
        Size of the table of coefficients of a section.
    parameters : tuple of str
        Names of further parameters of a section in the device's `Plant`, one number each.
    polar : bool
        Whether the coordinates are a bend vector, with the paper's polar coordinates κ and ψa. For
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
            A section whose `kind` is the name of this kind.

        Returns
        -------
        SectionKind
            The kind.
        """
        return cls(section.coordinates)

    @property
    def strains(self) -> tuple[tuple[int, int], ...]:
        """Return the component of the strain and its order, by COMPONENTS, of each coordinate.

        Tendons need it. Empty for a kind whose coordinates are not those of a strain.
        """
        return ()

    def natural(self, section: Section, runs: int) -> Array:
        """Return the natural unit of each coordinate, which scales errors of integration steps.

        By default it is one radian over the length.

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

    def units(self, section: Section, runs: int) -> Array:
        """Return the factor from each coordinate to its unit in kernels.

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

    def stiffness(self, section: Section, runs: int) -> Array:
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

    def damping(self, section: Section, runs: int) -> Array:
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

    @property
    def couples(self) -> tuple[tuple[int, int], ...]:
        """Return the pairs j < k of coordinates between which elastic forces act; by default none.

        Their damping acts between the same coordinates.
        """
        return ()

    def between(self, section: Section, runs: int) -> tuple[Array, Array]:
        """Return stiffness and damping between the coordinates of each of `couples`.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.

        Returns
        -------
        tuple of ndarray
            Of shape (runs, pairs) in SI units: force on the one per other coordinate, and per its
            rate.
        """
        return np.zeros((runs, 0)), np.zeros((runs, 0))

    def pack(self, section: Section, runs: int) -> dict[str, Array]:
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

    def table(self, section: Section, runs: int, at: slice) -> Array:
        """Return the table of coefficients of some runs.

        Parameters
        ----------
        section : Section
            The section of a vehicle or of a batch.
        runs : int
            The number of runs.
        at : slice
            The requested runs.

        Returns
        -------
        ndarray
            Of shape (n, rows, columns).
        """
        raise NotImplementedError

    def symbolic(
        self, section: Section, base: "Frame", coordinates: "SX", rate: "DM", table: Array
    ) -> SymbolicSection | None:
        """Return the section in CasADi, or None for a kind without such a form.

        Parameters
        ----------
        section : Section
            A section of a vehicle.
        base : Frame
            The frame at its base (sections/symbolic.py).
        coordinates : SX
            Its coordinates.
        rate : DM
            Rates of the coordinates, as a matrix times the rates z of the vehicle.
        table : ndarray
            Its table of coefficients.

        Returns
        -------
        SymbolicSection or None
            The section.
        """
        return None

    def device(self, numbers: Numbers, tree: Tree, section: int) -> SectionCode:
        """Return the device code of a section; equal arguments return the same object.

        Parameters
        ----------
        numbers : Numbers
            Precision and lanes of device code.
        tree : Tree
            The arms.
        section : int
            Index of the section among all sections of the tree.

        Returns
        -------
        SectionCode
            The code.
        """
        raise NotImplementedError
