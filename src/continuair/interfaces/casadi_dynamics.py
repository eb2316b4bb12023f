"""The equation of motion in CasADi, whose derivatives of the momenta give the velocity terms.

With z = (v, ω, k̇), M(k) and the momenta π = M z, all about B's origin in body axes, at v = 0,

    M ż + (∂π/∂k) k̇ + (ω×π_v, ω×π_ω, -½ ∂(zᵀπ)/∂k) = f,

where v̇ is the acceleration of B minus gravity, and f the generalised forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import DM, SX, Function

from continuair.errors import InputError, shown
from continuair.interfaces.casadi_arm import Arm, arms_of, body_inertia
from continuair.sections import kind_of
from continuair.terms import name_of, terms_of
from continuair.vehicle.arc import COORDINATES
from continuair.vehicle.vehicle import Vehicle

_SLOW = 1e-12
"""Speed [m/s] below which drag goes with the velocity, so that it has derivatives at rest."""


_OF_STRAIN = {"bend": "strain", "bend_rate": "strain_rate", "bend_moment": "strain_force"}
"""Names of arguments for arms with a section whose strain varies."""


@dataclass(frozen=True)
class Model:
    """The symbolic vehicle: x, the arguments by name; R, body to world; the arms."""

    vehicle: Vehicle
    x: dict[str, SX]
    R: SX
    arms: list[Arm]

    @property
    def none(self) -> SX:
        """A generalised force (6 + M,) of nothing."""
        return SX(self.vehicle.layout.coordinates, 1)

    @property
    def body_velocity(self) -> SX:
        """Of B's origin in body axes."""
        return self.R.T @ self.x["velocity"]

    @property
    def rates(self) -> SX:
        """z (6 + M,)."""
        bending = _flat(self.x["bend_rate"])
        return ca.vertcat(self.body_velocity, self.x["angular_velocity"], bending)

    @staticmethod
    def speed(v: SX) -> SX:
        """Return the length of a velocity, with derivatives at rest."""
        return ca.sqrt(ca.sumsqr(v) + _SLOW**2)


def accelerations(vehicle: Vehicle) -> Function:
    """Return the function that `to_casadi` of interfaces/casadi_model.py describes."""
    x = _inputs(vehicle)
    R, arms = _rotation(x["attitude"]), arms_of(vehicle, _flat(x["bend"]))
    bodies, model = _bodies(vehicle, arms), Model(vehicle, x, R, arms)
    forces = _of_terms(model) + _springs(x, arms) - _velocity_terms(bodies, x)
    M = sum(S.T @ E @ S for S, E in bodies)
    found = ca.ldl_solve(forces, *ca.ldl(M, False)) * _valid(arms)
    v_rate = R @ found[:3] - ca.vertcat(0, 0, x["gravity"])
    outputs = {
        "velocity_rate": v_rate,
        "angular_velocity_rate": found[3:6],
    }
    if vehicle.layout.strains:
        outputs["strain_acceleration"] = found[6:]
    else:
        outputs["bend_acceleration"] = ca.reshape(found[6:], COORDINATES, -1).T
    options = {"cse": True, "default_in": [9.81 if name == "gravity" else 0.0 for name in x]}
    names = [_OF_STRAIN.get(name, name) if vehicle.layout.strains else name for name in x]
    return Function("accelerations", [*x.values()], [*outputs.values()], names, [*outputs], options)


def _of_terms(model: Model) -> SX:
    found = model.none
    for term in terms_of(model.vehicle):
        force = term.casadi(model)
        if force is None:
            raise InputError(
                "vehicle",
                f"{shown(model.vehicle.name)} has {name_of(term)}, which has no form in CasADi",
                "leave it out",
            )
        found += force
    return found


def _inputs(vehicle: Vehicle) -> dict[str, SX]:
    """Return symbols of the arguments of `continuair.accelerations`, in their order."""
    layout, arms = vehicle.layout, (len(vehicle.arms), 6)
    sections = (layout.bends, 1) if layout.strains else (layout.sections, COORDINATES)
    shapes = {
        "attitude": (4, 1), "bend": sections, "velocity": (3, 1), "angular_velocity": (3, 1),
        "bend_rate": sections, "force": (3, 1), "moment": (3, 1), "bend_moment": sections,
        "tip_wrench": arms, "gravity": (1, 1),
    }  # fmt: skip
    return {name: SX.sym(name, *shape) for name, shape in shapes.items()}


def _rotation(attitude: SX) -> SX:
    """Return body to world (3, 3) of a quaternion x y z w of any length above 0."""
    v, w = attitude[:3], attitude[3]
    turned = (w * w - ca.sumsqr(v)) * DM.eye(3) + 2 * v @ v.T + 2 * w * ca.skew(v)
    return turned / ca.sumsqr(attitude)


def _bodies(vehicle: Vehicle, arms: list[Arm]) -> list[tuple[SX, SX]]:
    """Return the motion of every body by z, and its inertia: UAV, sections, bodies on tips."""
    n = vehicle.layout.coordinates
    inertia = ca.diagcat(vehicle.uav.mass * DM.eye(3), DM(np.array(vehicle.uav.inertia)))
    found = [(DM.eye(n)[:6, :], inertia)]
    for arm in arms:
        found += [(section.motion, section.inertia) for section in arm.sections]
        if arm.chain.tip:
            found.append((arm.tip.motion, DM(body_inertia(arm.chain.tip))))
    return found


def _velocity_terms(bodies: list[tuple[SX, SX]], x: dict[str, SX]) -> SX:
    bend, rate, ω = _flat(x["bend"]), _flat(x["bend_rate"]), x["angular_velocity"]
    z = ca.vertcat(SX(3, 1), ω, rate)
    momenta = sum(S.T @ (E @ (S @ z)) for S, E in bodies)
    energy = ca.dot(z, momenta) / 2
    turned = [ca.cross(ω, momenta[:3]), ca.cross(ω, momenta[3:6]), -ca.gradient(energy, bend)]
    return ca.jtimes(momenta, bend, rate) + ca.vertcat(*turned)


def _springs(x: dict[str, SX], arms: list[Arm]) -> SX:
    sections = [each.section for arm in arms for each in arm.sections]
    stiff, damped = (
        DM(
            np.hstack(
                [np.zeros(0), *(getattr(kind_of(each), name)(each, 1)[0] for each in sections)]
            )
        )
        for name in ("stiffness", "damping")
    )
    return ca.vertcat(SX(6, 1), -stiff * _flat(x["bend"]) - damped * _flat(x["bend_rate"]))


def _valid(arms: list[Arm]) -> SX:
    """Return 1, or NaN where a section is bent beyond the model's range."""
    bent = [0, *(each.bent for arm in arms for each in arm.sections)]
    return ca.if_else(ca.mmax(ca.vertcat(*bent)) > 1, np.nan, 1)


def _flat(per_section: SX) -> SX:
    """Return (M,) of (N, 2) or (M, 1), section by section."""
    return ca.vec(per_section.T)
