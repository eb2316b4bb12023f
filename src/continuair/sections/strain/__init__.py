"""The section with a strain field: bend, twist, stretch and shear that vary along the arm.

Each component of the strain is a Legendre series along the section (vehicle/strain.py). After F.
Renda et al., IEEE RA-L 5(3), 2020, and F. Boyer et al., IEEE T-RO 37(3), 2021; the frames are found
by collocation at the Gauss nodes of the section's own mass (nodes.py, native.py, element.py).
"""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import warp as wp

from continuair.device.numbers import Numbers, holding
from continuair.device.types import MAX_BEND_ANGLE, Tree, device_types
from continuair.sections.kind import SectionCode, SectionKind, SymbolicSection
from continuair.sections.rod import Rod
from continuair.sections.strain.element import BODIES, element_code
from continuair.sections.strain.nodes import FINE, gathered, gauss, integration
from continuair.sections.strain.place import place_code
from continuair.typing import Array
from continuair.vehicle.runs import per_run
from continuair.vehicle.section import Section
from continuair.vehicle.strain import COMPONENTS, Orders

if TYPE_CHECKING:
    from casadi import DM, SX

    from continuair.sections.symbolic import Frame


@dataclass(frozen=True)
class StrainField(SectionKind):
    """A section whose strain is a polynomial along the arm.

    Kernels hold bend and twist in units of 1/l, stretch and shear as they are.

    Parameters
    ----------
    coordinates : int
        Number of coordinates.
    orders : Orders
        Orders of the components.
    nodes : int
        Number of nodes.
    tapered : bool
        Whether the radius changes along the section, which couples coordinates elastically.
    """

    orders: Orders = Orders(0)
    nodes: int = 6
    tapered: bool = False

    name: ClassVar[str] = "strain"

    @property
    def rows(self) -> int:  # type: ignore[override]
        """Return the rows of the table: integrals to each node and the end, and bodies."""
        return self.nodes + 1 + len(BODIES)

    @property
    def columns(self) -> int:  # type: ignore[override]
        """Return the columns of the table, one per node."""
        return self.nodes

    @property
    def strains(self) -> tuple[tuple[int, int], ...]:
        """Return the component and the order of each coordinate."""
        return self.orders.coordinates

    @classmethod
    def of(cls, section: Section) -> Self:
        """Return the kind of a section.

        Parameters
        ----------
        section : Section
            A section with a strain field.

        Returns
        -------
        StrainField
            The kind.
        """
        return cls(section.coordinates, section.orders, section.node_count, section.tapered)

    def units(self, section: Section, runs: int) -> Array:
        """Return l [m] for bend and twist, and 1 for stretch and shear.

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
        out = np.ones((runs, self.coordinates))
        out[:, : self.orders.turning] = per_run(section.length, runs)[:, None]
        return out

    def natural(self, section: Section, runs: int) -> Array:
        """Return 1/l for bend and twist, and 1 for stretch and shear.

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
        return 1.0 / self.units(section, runs)

    def stiffness(self, section: Section, runs: int) -> Array:
        """Return the elastic force per coordinate: E I l/(2p + 1) of the bend of order p.

        A tapered section has further ones between coordinates, in `between`.

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
        matrix = self._matrix(section, runs)
        return np.ascontiguousarray(np.einsum("rjj->rj", matrix))

    @property
    def couples(self) -> tuple[tuple[int, int], ...]:
        """Return the pairs of coordinates of one component, which a taper couples."""
        if not self.tapered:
            return ()
        each = enumerate(self.orders.coordinates)
        return tuple(
            (j, k)
            for k, (other, _) in each
            for j, (component, _) in enumerate(self.orders.coordinates[:k])
            if component == other
        )

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
            Of shape (runs, pairs): force on the one per other coordinate, and per its rate.
        """
        matrix = self._matrix(section, runs)
        found = [matrix[:, j, k] for j, k in self.couples]
        stiffness = np.stack(found, axis=1) if found else np.zeros((runs, 0))
        return stiffness, self._time(section, runs) * stiffness

    def _matrix(self, section: Section, runs: int) -> Array:
        """Return the stiffness matrix (runs, coordinates, coordinates)."""
        length, rigidities = per_run(section.length, runs), section.rigidities()
        out, first = np.zeros((runs, self.coordinates, self.coordinates)), 0
        present = ((c, count) for c, count in enumerate(self.orders.counts) if count)
        for component, count in present:
            own = slice(first, first := first + count)
            stiff = (per_run(rigidities[component], runs) * length)[:, None, None]
            if self.tapered:
                out[:, own, own] = stiff * section.couplings(component, count)
            else:
                each = np.arange(own.start, own.stop)
                out[:, each, each] = stiff[:, 0] / (2 * np.arange(count) + 1)
        return out

    @staticmethod
    def _time(section: Section, runs: int) -> Array:
        """Return damping over stiffness (runs, 1) [s]."""
        stiffness = per_run(section.bending_stiffness, runs)
        return np.asarray((per_run(section.structural_damping, runs) / stiffness)[:, None])

    def damping(self, section: Section, runs: int) -> Array:
        """Return the damping force per rate, in proportion to the stiffness.

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
        return self._time(section, runs) * self.stiffness(section, runs)

    def table(self, section: Section, runs: int, at: slice) -> Array:
        """Return the integration matrices and the bodies at the nodes.

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
        rod = Rod(section, runs)
        length = rod.length[at]
        backbone = np.stack([part[at] for part in rod.backbone], axis=1)
        disks = np.empty((len(length), len(rod.disks), 4))
        for index, disk in enumerate(rod.disks):
            disks[:, index] = np.stack([part[at] for part in disk], axis=1)
        disks[..., 0] /= length[:, None]
        along = [
            np.broadcast_to(each, (runs, FINE))[at] for each in section.mass_shares(gauss(FINE)[0])
        ]
        nodes, bodies = gathered(
            self.nodes, backbone, disks, (along[0], along[1]) if self.tapered else None
        )
        out = np.zeros((len(length), self.rows, self.columns))
        out[:, : self.nodes + 1] = integration(nodes)
        out[:, self.nodes + 1] = nodes
        out[:, self.nodes + 2 : self.nodes + 5] = np.swapaxes(bodies, 1, 2)
        out[:, self.nodes + 5] = length[:, None]
        return out

    def symbolic(
        self, section: Section, base: "Frame", coordinates: "SX", rate: "DM", table: Array
    ) -> SymbolicSection:
        """Return the section in CasADi.

        Parameters
        ----------
        section : Section
            A section of a vehicle.
        base : Frame
            The frame at its base.
        coordinates : SX
            Its coordinates [1/m; stretch and shear: -].
        rate : DM
            Rates of the coordinates, as a matrix times the rates z of the vehicle.
        table : ndarray
            Its table of coefficients.

        Returns
        -------
        SymbolicSection
            The section.
        """
        from continuair.sections.strain.symbolic import BentRod

        return BentRod(section, base, coordinates, rate, table)

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
        return _device(numbers, tree, self.orders, self.nodes, section)


@cache
def _device(numbers: Numbers, tree: Tree, orders: Orders, nodes: int, section: int) -> SectionCode:
    of = numbers, tree, orders, nodes, section
    of_element, of_place = element_code(*of), place_code(*of)
    types, layout = device_types(numbers, tree), tree.layout
    Real, State, B = types.Real, types.State, layout.bend_of(section).start
    share = Real(1.0 / MAX_BEND_ANGLE)
    of_component = np.cumsum((0, *orders.counts))

    def range_of(component: int) -> Any:
        """Return the function that bounds |strain| of a component, along the section."""
        first, last = int(of_component[component]), int(of_component[component + 1])

        @wp.func
        def bound(y: State):
            found = Real(0.0)
            for c in range(first, last):
                found += wp.abs(y[B + c])
            return found

        return bound

    bend_x, bend_y, twist, stretch, _, _ = map(range_of, range(len(COMPONENTS)))

    @wp.func
    def bent(y: State):
        """Return the larger of |κ|² l² over that of a full circle, and the stretch."""
        x, y_bend, turn = share * bend_x(y), share * bend_y(y), share * twist(y)
        return wp.max(x * x + y_bend * y_bend + turn * turn, stretch(y))

    found = vars(of_element) | vars(of_place) | locals()
    return holding(SectionCode, found)
