"""How the paper is read: each choice that it leaves open, by name."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from continuair import checks
from continuair.errors import InputError

Array = np.ndarray

Decoupled = Literal["element", "block", "uav blocks", "element, full C"]
Metric = Literal["per axis", "pooled", "rmse"]
Angles = Literal["principal", "continuous", "frenet principal", "frenet continuous", "geodesic"]
Axes = Literal["xy", "xyz"]
Range = Literal["coupled", "joint"]
Kappa = Literal["1/m", "bend angle"]
Damping = Literal["kappa", "bend vector"]


@dataclass(frozen=True)
class Reading:
    """One reading of the paper's open-loop section; the default is that of Table I.

    decoupled: which elements of M and C are kept. "element": the diagonal, as the text says;
    "block": the blocks of UAV and arm; "uav blocks": those of position, attitude and arm;
    "element, full C": the diagonal of M and all of C.
    remark1: whether kappa_s stands for a smaller curvature in kinematics and dynamics.
    metric: of "per axis", the range of each axis divides its own error; of "pooled", the printed
    formula, the sum of all ranges divides that of all errors; "rmse" divides by nothing.
    axes: of the tip position. angles: of the tip rotation. "principal": roll and yaw in (-π, π],
    pitch within ±π/2; "continuous": without jumps; "frenet": of the frame that spins with ψa;
    "geodesic": the angle between the tips.
    range: of the coupled run, or of both runs together.
    force_sign: of J_tᵀ F_e in Eq. (10), printed with -1.
    kappa: unit of the seventh coordinate, of its start 0.1 and of the torque conjugate to it.
    damping: generalised force -d l κ̇ on κ alone, or also -d l κ² ψ̇a on ψa.
    rotary_inertia: whether cross-sections and disks of the arm have a moment of inertia.
    """

    decoupled: Decoupled = "element"
    remark1: bool = True
    metric: Metric = "per axis"
    axes: Axes = "xy"
    angles: Angles = "principal"
    range: Range = "coupled"
    force_sign: Literal[-1, 1] = -1
    kappa: Kappa = "1/m"
    damping: Damping = "kappa"
    rotary_inertia: bool = False

    def __post_init__(self) -> None:
        for name, meant in get_type_hints(type(self)).items():
            if meant is bool:
                checks.flag(name, getattr(self, name))
            elif name != "force_sign":
                checks.choice(name, getattr(self, name), get_args(meant))
        if checks.whole("force_sign", self.force_sign, -1, 1) == 0:
            raise InputError("force_sign", "is 0", "give -1, as printed, or 1")

    def replace(self, **changes: Any) -> Reading:
        """Return the reading with some choices changed."""
        return replace(self, **changes)

    def describe(self) -> dict[str, Any]:
        """Return the choices by name, in types of JSON."""
        return asdict(self)

    @property
    def dynamics(self) -> tuple[Any, ...]:
        """Return the choices that affect the flights; the others concern the metric."""
        return (
            self.decoupled,
            self.remark1,
            self.force_sign,
            self.kappa,
            self.damping,
            self.rotary_inertia,
        )


MODELS = ("coupled", *get_args(Decoupled))
"""Models that can be flown."""


def masks(decoupled: str) -> tuple[Array, Array]:
    """Return the factors (8, 8) on M and on C of a model; "coupled" keeps all elements."""
    every, diagonal = np.ones((8, 8)), np.eye(8)
    groups = {"block": (0, 0, 0, 0, 0, 0, 1, 1), "uav blocks": (0, 0, 0, 1, 1, 1, 2, 2)}
    if decoupled == "coupled":
        return every, every
    if decoupled == "element, full C":
        return diagonal, every
    if decoupled == "element":
        return diagonal, diagonal
    group = np.array(groups[decoupled])
    blocks = (group[:, None] == group).astype(float)
    return blocks, blocks
