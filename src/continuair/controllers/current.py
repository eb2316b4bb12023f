"""The paper's law, Eqs. (15) and (16), with gains K_p, K_d, C_d recomputed for the current image.

With L Λ^(-1/2) = Σ s_i u_i v_iᵀ at the current image, Λ the inertia at the camera, and
ω_i = ω s_i² / (s_i² + ε), the gains are, in the visible directions,

    K_p = c Σ ω_i²/s_i² u_i u_iᵀ,  K_d = k Σ ω_i²/(ω s_i)² u_i u_iᵀ,  C_d = 1/c Σ 2ζ/ω_i u_i u_iᵀ,

and C_p = 1. They are symmetric positive definite with any positive values in the 2n - 6 other
directions, which Lᵀ maps to zero. The factor c limits large errors, equally in all directions; it
is 1 near the target. The wrench on the camera needs no singular values. With H = LᵀL + ε Λ, the
displacement ξ = H⁻¹ Lᵀ (e + C_s tanh(e/σ)) estimated from the image, and the visible share of a
motion, P = 1 - ε H⁻¹ Λ,

    Lᵀ (K_p e_a - K_d L v_c) = Λ P (c ω² ξ + 2ζω (v_t - v_c) - k P v_c).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from continuair import checks
from continuair.controllers.definite import definite_code
from continuair.controllers.inertias import camera_inertia
from continuair.errors import InputError, shown
from continuair.kernels.sensing.sense import LawCode
from continuair.vehicle.vehicle import Vehicle

CAP = (0.5, 0.5)
"""Displacement of the camera from where it is to be beyond which errors pull no harder [m, rad]."""

# Where too few points are in view, the motions that they do not show stay as they are.
_LEAST = 1e-10


@dataclass(frozen=True, eq=False)
class CurrentGains:
    """K_p, K_d and C_d as functions of the current image, as `design` returns them.

    inertia (6, 6): Λ, at the camera, in its axes; floor: ε = μ² s_1² of the desired image; cap:
    displacement [m, rad] beyond which K_p falls, by one factor for all directions.
    """

    inertia: np.ndarray
    bandwidth: float
    damping_ratio: float
    rate_gain: float
    floor: float
    cap: tuple[float, float]

    def fields(self) -> dict[str, Any]:
        """Return the values of the law's `Gains`."""
        ω = self.bandwidth
        return {
            "inertia": self.inertia,
            "stiffness": ω**2,
            "damping": 2.0 * self.damping_ratio * ω,
            "rate_gain": self.rate_gain,
            "floor": self.floor,
            "farthest": self.cap[0],
            "widest": self.cap[1],
        }

    def describe(self) -> dict[str, Any]:
        """Return the settings recorded as provenance."""
        names = ("bandwidth", "damping_ratio", "rate_gain", "floor", "cap")
        return {"gains": "current", **{name: getattr(self, name) for name in names}}


def current_gains(
    vehicle: Vehicle, L: np.ndarray, ω: float, ζ: float, μ: float, share: float, cap: Any
) -> CurrentGains:
    """Return current gains of a vehicle; L (2n, 6): at the desired image; rest: as in `design`."""
    inertia = camera_inertia(vehicle)
    felt, axes = np.linalg.eigh(inertia)
    largest = np.linalg.norm(L @ (axes / np.sqrt(felt)), 2)
    with np.errstate(over="ignore"):
        floor = np.maximum(np.square(μ), _LEAST) * largest**2
        made = np.isfinite([np.square(ω), floor, 2.0 * ζ * ω]).all()
    if not made:
        raise InputError(
            "bandwidth",
            (
                f"is {shown(ω)}, which with damping_ratio {shown(ζ)} and conditioning "
                f"{shown(μ)} gives gains that no number holds"
            ),
            "give values nearer to 1",
        )
    return CurrentGains(inertia, float(ω), ζ, share, float(floor), _cap(cap))


def _cap(given: Any) -> tuple[float, float]:
    found = checks.finite_array(given)
    if found is None or found.shape != (2,) or not (found > 0.0).all():
        raise InputError(
            "cap", f"is {shown(given)}", "give a distance [m] and an angle [rad], both above 0"
        )
    return float(found[0]), float(found[1])


def current_fields(code: LawCode) -> dict[str, Any]:
    """Return the types of the gains' fields: Λ, ω², 2ζω, k, C_s, ε and the caps of c."""
    names = ("stiffness", "damping", "rate_gain", "sliding", "floor", "farthest", "widest")
    inertia = definite_code(code).Matrix
    return {"inertia": inertia} | dict.fromkeys(names, code.Real)


def current_wrench(code: LawCode, Gains: Any) -> Any:
    """Return the law's wrench on the camera as a function of (sense, gains)."""
    Real, Twist, Sense, interaction = code.Real, code.Twist, code.Sense, code.interaction
    above, tanh, rows = code.above, code.tanh, 2 * code.points
    definite = definite_code(code)
    Matrix, factored, solved = definite.Matrix, definite.factored, definite.solved
    zero, one = Real(0.0), Real(1.0)

    @wp.func
    def share_within(x: Real, y: Real, z: Real, most: Real):
        """Factor that limits the length of a vector of three."""
        size = wp.sqrt(x * x + y * y + z * z)
        return above(size, most, most / above(size, zero, size, one), one)

    @wp.func
    def shown(H: Matrix, gains: Gains, motion: Twist):
        """P motion."""
        return motion - gains.floor * solved(H, gains.inertia * motion)

    @wp.func
    def wrench_of(sense: Sense, gains: Gains):
        L = interaction(sense.sight)
        e = wp.cw_mul(sense.sight.seen, sense.desired - sense.sight.image)
        for i in range(rows):
            e[i] = e[i] + gains.sliding * tanh(e[i] / gains.sigma)
        H = factored(wp.transpose(L) * L + gains.floor * gains.inertia)
        xi = solved(H, wp.transpose(L) * e)
        near = wp.min(
            share_within(xi[0], xi[1], xi[2], gains.farthest),
            share_within(xi[3], xi[4], xi[5], gains.widest),
        )
        behind = gains.feed_forward * sense.target_twist - sense.camera_twist
        damped = sense.camera_twist - gains.on_feature_rate * sense.target_twist
        wanted = near * gains.stiffness * xi + gains.damping * behind
        wanted -= gains.rate_gain * shown(H, gains, damped)
        return gains.inertia * shown(H, gains, wanted)

    return wrench_of
