"""Section of an arm: a backbone of constant curvature with its disks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Self, cast

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from continuair.errors import InputError
from continuair.typing import Array
from continuair.vehicle.disk import Disk, disks_of
from continuair.vehicle.fields import ROUNDING, Count, Finite, Name, NotNegative, Positive
from continuair.vehicle.members import NamedPart, members
from continuair.vehicle.slips import radius_remedy
from continuair.vehicle.strain import CONSTANT, Orders, Strain, mode_shapes
from continuair.vehicle.taper import AREA, MOMENT, Radius, coupled, ends, mean_power, share_of_mean
from continuair.vehicle.tendon import Tendon, check_tendons

DRAG_NODES, DRAG_WEIGHTS = np.polynomial.legendre.leggauss(3)
"""Gauss-Legendre nodes and weights on [-1, 1] by which the drag of a section is integrated."""

EITHER = {"youngs_modulus": "bending_stiffness", "density": "mass_per_length"}
"""Property of the rod's material -> property of the section that can replace it."""

MOST_NODES = 16
"""Most nodes of a section whose strain varies."""

_OF_LIST = "belongs to an arm of a list; write [[arm]], with its sections as [[arm.section]]"


class Section(NamedPart):
    """Section of constant curvature; at bend 0 it points along -z of the axes at its base.

    The material is that of a round, solid rod (radius, density, Young's modulus). A bending
    stiffness and a mass per length can replace it. In a batched vehicle derived properties are
    arrays over the runs. They use products and square roots only, not powers, so that they have the
    same bits alone and in a batch, and on every processor.
    """

    refused: ClassVar[Mapping[str, str]] = {
        "tendons": "is not a known field; write [[arm.tendon]]",
        **dict.fromkeys(("section", "mount", "attitude", "tip"), _OF_LIST),
    }

    name: Name = ""
    """the section's name in an arm's list, by default its index"""

    length: Positive
    """the length of the backbone [m]"""

    given_radius: Radius | None = Field(None, alias="radius")
    """the radius of the round, solid backbone, at most half its length; with a strain that varies
    also 2 numbers, at the base and the tip of a backbone that tapers linearly [m]"""

    given_density: Positive | None = Field(None, alias="density")
    """the density of the backbone [kg/m³]"""

    given_mass_per_length: Positive | None = Field(None, alias="mass_per_length")
    """the backbone's mass per unit length, instead of its density [kg/m]"""

    given_youngs_modulus: Positive | None = Field(None, alias="youngs_modulus")
    """Young's modulus of the backbone [Pa]"""

    given_bending_stiffness: Positive | None = Field(None, alias="bending_stiffness")
    """the bending stiffness, instead of Young's modulus [N m²]"""

    damping: NotNegative | None = None
    """the structural damping per unit length: the bend moment per bend rate [N m² s]"""

    damping_ratio: NotNegative | None = None
    """the damping ratio of the clamped first mode at bend 0, instead of damping [-]"""

    disks: tuple[Disk, ...] = ()
    """the spacer disks and tip masses, a list of tables ([[arm.disks]]), or a table of a count,
    mass and inertia for equal ones at even distances"""

    drag_coefficient: NotNegative | None = None
    """the drag coefficient of the round backbone in air that flows across it [-]"""

    strain: Strain | None = None
    """how bend, twist, stretch and shear vary along the section, a table of orders; by default
    bending = 0, a constant curvature"""

    nodes: Count | None = None
    """the number of nodes at which a strain that varies is integrated, by default 8 for linear
    bending, 2 more per order, 2 more with twist, and 2 more with disks"""

    poisson_ratio: Finite | None = None
    """Poisson's ratio of the backbone, which twist and shear need [-]"""

    tendon: tuple[Tendon, ...] = ()
    """the tendons of a single section, a list of tables ([[arm.tendon]])"""

    kappa_s: NotNegative = 1e-3
    """the curvature below which generalised inputs in polar coordinates use kappa_s in place of
    the curvature they are divided by; Remark 1, Amiri et al. [1/m]"""

    @field_validator("disks", mode="before")
    @classmethod
    def _listed_disks(cls, value: object, info: ValidationInfo) -> object:
        return disks_of(value, info.data.get("length"))

    @field_validator("tendon", mode="before")
    @classmethod
    def _named_tendons(cls, value: object) -> tuple[Tendon, ...]:
        return members(Tendon, value, "tendon") if value else ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_material()
        if self.damping is not None and self.damping_ratio is not None:
            raise InputError(
                "damping",
                f"is {self.damping} while damping_ratio is {self.damping_ratio}",
                "keep one of them",
            )
        owner = "section" if self.name else "arm"
        for index, disk in enumerate(self.disks):
            if disk.position > self.length * (1 + ROUNDING):
                raise InputError(
                    f"disks.{index}.position",
                    f"is {disk.position}, beyond the {owner}'s end",
                    f"give a position from 0 to the {owner}'s length {self.length} [m]",
                )
        if self.drag_coefficient is not None and self.given_radius is None:
            raise InputError(
                "radius",
                "is missing, which drag_coefficient needs",
                "give the backbone's radius [m]",
            )
        self._check_strain()
        self._check_taper()
        check_tendons(self.tendon, (self,))
        self._check_frequency()
        if self.given_radius is not None and (largest := max(self.radii())) > self.length / 2:
            raise InputError(
                "radius",
                f"is {largest}, more than half of length {self.length}",
                (
                    f"give a radius of at most {self.length / 2:g} "
                    f"[m]{radius_remedy(largest, self.length)}"
                ),
            )
        return self

    def _check_material(self) -> None:
        """Raise InputError for both or none of two alternatives, or a material without radius."""
        for material, whole in EITHER.items():
            its, own = getattr(self, f"given_{material}"), getattr(self, f"given_{whole}")
            if its is not None and own is not None:
                raise InputError(whole, f"is {own} while {material} is {its}", "keep one of them")
            if its is None and own is None:
                raise InputError(material, "is missing", f"give it, or {whole} in its place")
            if its is not None and self.given_radius is None:
                raise InputError(
                    "radius",
                    f"is missing, which {material} needs",
                    (
                        f"give the radius of the round, solid backbone [m], or {whole} in "
                        f"place of {material}"
                    ),
                )

    def _check_strain(self) -> None:
        """Raise InputError for a strain field without room, or without what its rigidities need."""
        if self.polar:
            for name in ("nodes", "poisson_ratio"):
                if getattr(self, name) is not None:
                    raise InputError(
                        name,
                        "is not used by a section of constant curvature",
                        "leave it out, or give the section a strain with higher orders",
                    )
            return
        orders = self.orders
        if self.nodes is not None and not orders.least_nodes <= self.nodes <= MOST_NODES:
            raise InputError(
                "nodes",
                f"is {self.nodes}, but {orders.least_nodes} to {MOST_NODES} are possible here",
                "give a number in that range, or leave it out",
            )
        if self.poisson_ratio is None and (orders.twist is not None or orders.shear is not None):
            raise InputError(
                "poisson_ratio",
                "is missing, which twist and shear need",
                "give Poisson's ratio of the backbone, 0.5 for rubber and about 0.3 for metals",
            )
        if self.poisson_ratio is not None and not -1.0 < self.poisson_ratio <= 0.5:
            raise InputError(
                "poisson_ratio",
                f"is {self.poisson_ratio}, but must be above -1 and at most 0.5",
                "give Poisson's ratio of the backbone, 0.5 for rubber and about 0.3 for metals",
            )
        if self.given_radius is None and orders.counts[2:] != (0, 0, 0, 0):
            raise InputError(
                "radius",
                "is missing, which twist, stretch and shear need",
                "give the radius of the round, solid backbone [m]",
            )

    def _check_taper(self) -> None:
        """Raise InputError for two radii where one is needed."""
        if not self.tapered:
            return
        given = list(self.radii())
        if self.polar:
            raise InputError(
                "radius",
                f"is {given}, but a section of constant curvature has one radius",
                "give one number, or the section a strain with higher orders",
            )
        for material, whole in EITHER.items():
            if (value := getattr(self, f"given_{whole}")) is not None:
                raise InputError(
                    whole,
                    f"is {value}, but the radius {given} lets it vary along the section",
                    f"give {material} in its place",
                )
        if self.drag_coefficient is not None:
            raise InputError(
                "drag_coefficient",
                f"is {self.drag_coefficient}, but the radius is {given}",
                "leave it out, or give one radius; drag of a tapered section is not modelled",
            )

    def _check_frequency(self) -> None:
        """Raise InputError if mass or stiffness underflows or overflows in floating point."""
        try:
            usable = self.mass_per_length > 0 and 0 < self.clamped_frequency < math.inf
        except (OverflowError, ZeroDivisionError):
            usable = False
        if not usable:
            names = ("radius", "length", *EITHER, *EITHER.values())
            given = {name: value for name in names if (value := dict(self)[name]) is not None}
            (first, value), *rest = given.items()
            others = [f"{name} {value}" for name, value in rest]
            raise InputError(
                first,
                f"is {value}, which with {', '.join(others[:-1])} and {others[-1]} gives no finite "
                "natural frequency",
                "give all of them in SI units",
            )

    @property
    def coordinates(self) -> int:
        """Return the number of the section's coordinates."""
        return len(self.orders.coordinates)

    @property
    def kind(self) -> str:
        """Return the name of the section's kind: "arc" for constant curvature, else "strain"."""
        return "arc" if self.polar else "strain"

    @property
    def polar(self) -> bool:
        """Return whether the coordinates are a bend vector, with polar coordinates κ and ψa."""
        return self.orders == CONSTANT

    @property
    def orders(self) -> Orders:
        """Return the orders of the section's strain."""
        return CONSTANT if self.strain is None else self.strain.orders

    @property
    def node_count(self) -> int:
        """Return the number of nodes at which a strain that varies is integrated.

        Disks draw nodes to them, which leaves fewer for the backbone between.
        """
        return self.nodes or self.orders.nodes + 2 * bool(self.disks)

    def rigidities(self) -> tuple[float, ...]:
        """Return the stiffness of each component of the strain, the mean of a tapered section.

        Returns
        -------
        tuple of float
            E I twice, G J [N m²], E A and G A twice [N]; 0 where a component is left out.
        """
        bending, orders = self.bending_stiffness, self.orders
        softer = 0.0 if self.poisson_ratio is None else 1.0 / (1.0 + self.poisson_ratio)
        # The square of the radius, for a tapered section that of r⁴ over that of r².
        square: float = (
            self.second_moment / self.area * 4.0
            if self.tapered
            else 0.0
            if self.given_radius is None
            else self.radius * self.radius
        )
        stretch = shear = 0.0
        if orders.stretch is not None:
            stretch = 4.0 * bending / square
        if orders.shear is not None:
            shear = 2.0 * softer * bending / square
        return bending, bending, softer * bending, stretch, shear, shear

    @property
    def tapered(self) -> bool:
        """Return whether the radius changes along the section."""
        return ends(self.given_radius) is not None

    def radii(self) -> tuple[float, float]:
        """Return the radii at base and tip.

        Returns
        -------
        tuple of float
            Two numbers, or arrays over the runs [m].

        Raises
        ------
        InputError
            If there is no radius.
        """
        tapered = ends(self.given_radius)
        return (self.radius, self.radius) if tapered is None else tapered

    @property
    def mean_radius(self) -> float:
        """Return the mean radius of the backbone [m]; raise InputError if no radius is given."""
        return cast(float, mean_power(self.radii(), 1)) if self.tapered else self.radius

    @property
    def radius(self) -> float:
        """Return the radius of the round, solid backbone [m]; raise InputError without it."""
        if self.given_radius is None:
            raise InputError(
                "radius",
                "is missing, but is needed here",
                "give the radius of the round, solid backbone [m]",
            )
        if self.tapered:
            raise InputError(
                "radius",
                "changes along the section, but one radius is needed here",
                "give one number",
            )
        return cast(float, self.given_radius)

    def mass_shares(self, shares: Array) -> tuple[Array, Array]:
        """Return mass and rotary inertia per length over their means, along the section.

        Parameters
        ----------
        shares : ndarray, shape (n,)
            Arc lengths over the length, from 0 to 1.

        Returns
        -------
        tuple of ndarray
            Of mass, and of inertia, of shape (n,) or (runs, n); 1 for a section without taper.
        """
        radii = ends(self.given_radius)
        if radii is None:
            return np.ones(len(shares)), np.ones(len(shares))
        return share_of_mean(radii, AREA, shares), share_of_mean(radii, MOMENT, shares)

    def couplings(self, component: int, count: int) -> Array:
        """Return ∫ P_p P_q k ds/(k̄ l) of a component's stiffness k and its mean k̄.

        Parameters
        ----------
        component : int
            Index in `COMPONENTS`.
        count : int
            The number of coordinates of the component.

        Returns
        -------
        ndarray, shape (count, count) or (runs, count, count)
            Its stiffness matrix over mean stiffness and length: diagonal, 1/(2 p + 1), without
            taper.
        """
        radii = ends(self.given_radius)
        if radii is None:
            return np.diag(1.0 / (2.0 * np.arange(count) + 1.0))
        return coupled(radii, MOMENT if component < 3 else AREA, count)

    @property
    def density(self) -> float:
        """Return the density of the backbone [kg/m³]; raise InputError without a radius."""
        if self.given_density is None:
            return self.mass_per_length / self.area
        return self.given_density

    @property
    def youngs_modulus(self) -> float:
        """Return Young's modulus of the backbone [Pa]; raise InputError without a radius."""
        if self.given_youngs_modulus is None:
            return self.bending_stiffness / self.second_moment
        return self.given_youngs_modulus

    @property
    def area(self) -> float:
        """Return the area of the cross-section, the mean of a tapered section [m²]."""
        if self.tapered:
            return cast(float, math.pi * mean_power(self.radii(), AREA))
        return math.pi * self.radius * self.radius

    @property
    def second_moment(self) -> float:
        """Return the second moment of area about a diameter, I; the mean if it tapers [m⁴]."""
        if self.tapered:
            return cast(float, math.pi / 4 * mean_power(self.radii(), MOMENT))
        square = self.radius * self.radius
        return math.pi / 4 * square * square

    @property
    def bending_stiffness(self) -> float:
        """Return the bending stiffness E I, the mean of a tapered section [N m²]."""
        if self.given_bending_stiffness is None:
            return self.youngs_modulus * self.second_moment
        return self.given_bending_stiffness

    @property
    def mass_per_length(self) -> float:
        """Return the backbone's mass per unit length, rho A; the mean if it tapers [kg/m]."""
        if self.given_mass_per_length is None:
            return self.density * self.area
        return self.given_mass_per_length

    @property
    def transverse_inertia_per_length(self) -> float:
        """Return the rotary inertia about a diameter per unit length, rho I [kg m].

        It is 0 without a radius, and m' r²/4 if a mass per length m' and a radius are given.
        """
        if self.given_mass_per_length is None:
            return self.density * self.second_moment
        radius = 0.0 if self.given_radius is None else self.radius
        return self.mass_per_length * radius * radius / 4

    @property
    def axial_inertia_per_length(self) -> float:
        """Return the rotary inertia about the tangent per unit length [kg m]."""
        return 2 * self.transverse_inertia_per_length

    @property
    def backbone_mass(self) -> float:
        """Return the mass of the backbone without disks [kg]."""
        return self.mass_per_length * self.length

    @property
    def mass(self) -> float:
        """Return the mass of backbone and disks [kg]."""
        return self.backbone_mass + sum(disk.mass for disk in self.disks)

    @property
    def straight_modal_mass(self) -> float:
        """Return the generalised mass of one bend coordinate at bend 0 with clamped base [kg m⁴].

        rho A l⁵/20 + rho I l³/3, plus m s⁴/4 + j_t s² of each disk.
        """
        cube = self.length * self.length * self.length
        backbone = (
            self.mass_per_length * cube * self.length * self.length / 20
            + self.transverse_inertia_per_length * cube / 3
        )
        return backbone + sum(disk.straight_modal_mass for disk in self.disks)

    @property
    def clamped_frequency(self) -> float:
        """Return the natural frequency of the clamped section at bend 0, without gravity [rad/s].

        Constant curvature is stiffer than a true cantilever, whose first mode is 21 % lower; with
        linear bending it is 0.5 % lower.
        """
        if self.orders.bending or self.tapered:
            return self._bending_frequency()
        stiffness = self.bending_stiffness * self.length
        frequency: float = _root(stiffness / self.straight_modal_mass)
        return frequency

    def _bending_frequency(self) -> float:
        """Return the first frequency of a bend that varies along the section [rad/s]."""
        count = self.orders.bending + 1
        nodes, weights = np.polynomial.legendre.leggauss(count + 2 + 2 * self.tapered)
        shares = (1.0 + nodes) / 2.0
        masses, inertias = (each * weights / 2.0 for each in self.mass_shares(shares))
        bodies: list[tuple[Any, Any, Any]] = [
            (share, masses[..., k] * self.backbone_mass,
             inertias[..., k] * self.transverse_inertia_per_length * self.length)
            for k, share in enumerate(shares)
        ]  # fmt: skip
        bodies += [
            (each.position / self.length, each.mass, each.transverse_inertia) for each in self.disks
        ]
        whole: Any = 0.0
        for share, mass, inertia in bodies:
            deflection, slope = mode_shapes(count, np.atleast_1d(share))
            square = np.asarray(self.length * self.length * mass)[..., None, None]
            whole = whole + square * deflection[:, :, None] * deflection[:, None, :]
            turned = np.asarray(inertia)[..., None, None]
            whole = whole + turned * slope[:, :, None] * slope[:, None, :]
        # In coordinates of unit stiffness: E I/l for the bend times l, over 2 p + 1.
        if self.tapered:
            scale = np.linalg.inv(np.linalg.cholesky(self.couplings(0, count)))
            slowest = np.linalg.eigvalsh(scale @ whole @ scale.swapaxes(-1, -2))[..., -1]
        else:
            scale = np.sqrt(2.0 * np.arange(count) + 1.0)
            slowest = np.linalg.eigvalsh(scale[:, None] * whole * scale)[..., -1]
        found: Any = np.sqrt(self.bending_stiffness / (self.length * slowest))
        return found if len(found) > 1 else float(found[0])

    @property
    def structural_damping(self) -> float:
        """Return the structural damping per unit length [N m² s], 0 if none is given."""
        if self.damping_ratio is None:
            return 0.0 if self.damping is None else self.damping
        if self.orders.bending or self.tapered:
            damping: float = (
                2 * self.damping_ratio * self.bending_stiffness / self.clamped_frequency
            )
            return damping
        stiffness = self.bending_stiffness * self.length
        critical: float = 2 * _root(stiffness * self.straight_modal_mass) / self.length
        return self.damping_ratio * critical


def _root(value: Any) -> Any:
    """Return the square root, a float for a float."""
    return np.sqrt(value) if isinstance(value, np.ndarray) else math.sqrt(value)
