"""Gains of the paper's law from a bandwidth, and the inertias that controllers are tuned by."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from continuair import checks
from continuair.equations import mass_matrix
from continuair.equations.camera import TIP_OF_STRAIGHT_ARM, interaction_matrix, on_body
from continuair.equations.kinematics import skew
from continuair.errors import InputError, shown
from continuair.vehicle.vehicle import Vehicle, check_single_vehicle

_FLOOR = 1e-6
"""What makes W definite in the 2n - 6 directions that no camera motion reaches."""


def design(
    vehicle: Vehicle,
    bandwidth: float,
    *,
    damping_ratio: float = 1.0,
    conditioning: float = 1.5e-3,
    rate_gain: float = 1e-4,
    sliding: float = 1e-6,
    desired: Any = None,
    distance: float = 2.0,
) -> dict[str, Any]:
    """Gains Kp, Kd, Cp, Cd, Cs for `servoing`, that place the poles of the camera's motion.

    bandwidth: ω [rad/s]; damping_ratio: ζ; conditioning: μ, a share of the best seen direction's
    gain, below which a direction gets a slower loop; rate_gain: K_d = rate_gain W; sliding: C_s;
    desired: the image to reach (2n,), normalised, of points `distance` [m] away, our 0.5 m
    square by default, as the paper prints none. Raises InputError.

    With Λ the inertia that the camera feels, L Λ^(-1/2) = Σ s_i u_i v_iᵀ over the directions seen.
    K_p = ω² W = Σ ω_i² / s_i² u_i u_iᵀ and C_d = Σ 2 ζ / ω_i u_i u_iᵀ give direction i the poles of
    p² + 2 ζ ω_i p + ω_i², with ω_i = ω s_i² / (s_i² + μ² s_1²). μ = 0 makes them all equal, and
    K_p = ω² (L⁺)ᵀ Λ L⁺; noise in the image then moves the directions that it hardly determines.
    """
    # NumPy's powers of a number may be infinite, which is refused below; Python's raise.
    ω = np.float64(checks.positive("bandwidth", bandwidth))
    ζ = checks.positive("damping_ratio", damping_ratio)
    μ = checks.number("conditioning", conditioning, least=0.0)
    L = _seen(desired, checks.positive("distance", distance))
    inertia, axes = np.linalg.eigh(camera_inertia(vehicle))
    u, s, _ = np.linalg.svd(L @ (axes / np.sqrt(inertia)) @ axes.T, full_matrices=False)
    share, Cs = checks.positive("rate_gain", rate_gain), checks.positive("sliding", sliding)
    unseen = np.eye(len(L)) - u @ u.T
    with np.errstate(all="ignore"):
        ω_i = ω * s**2 / (s**2 + (μ * s[0]) ** 2)
        W = (u * (ω_i / (ω * s)) ** 2) @ u.T + _FLOOR * np.eye(len(L))
        Kp, Kd = ω**2 * (W + W.T) / 2, share * (W + W.T) / 2
        Cd = (u * (2.0 * ζ / ω_i)) @ u.T + 2.0 * ζ / ω * unseen
    if not np.isfinite([Kp, Kd, Cd]).all():
        raise InputError(
            f"bandwidth is {shown(bandwidth)}, which with damping_ratio {shown(damping_ratio)}, "
            f"conditioning {shown(conditioning)}, rate_gain {shown(rate_gain)} and distance "
            f"{shown(distance)} gives gains that no number holds; give values nearer to 1."
        )
    return {"Kp": Kp, "Kd": Kd, "Cp": 1.0, "Cd": Cd, "Cs": Cs, "points": len(L) // 2}


def _seen(desired: Any, distance: float) -> np.ndarray:
    """The interaction matrix (2n, 6) at the desired image, or InputError if it hides a motion."""
    if desired is None:
        half = 0.25 / distance
        desired = [half, -half, -half, -half, -half, half, half, half]
    image = checks.finite_array(desired)
    if image is None or image.ndim != 1 or len(image) < 6 or len(image) % 2:
        raise InputError(
            f"desired is {shown(desired)}; give finite x and y of each point in turn, normalised, "
            "of 3 points or more."
        )
    with np.errstate(all="ignore"):
        L = interaction_matrix(image, distance)
    if not np.isfinite(L).all():
        raise InputError(
            f"distance is {shown(distance)}, from which the points {shown(desired)} move faster "
            "than numbers reach; give it in metres."
        )
    if np.linalg.matrix_rank(L) < 6:
        raise InputError(
            f"desired is {shown(desired)}, which does not determine the camera's pose; give at "
            "least 4 points that are not on a line (3 suffice only off the singular cylinder)."
        )
    return L


def rigid_inertia(vehicle: Vehicle) -> np.ndarray:
    """Inertia (6, 6) of the vehicle with its arm frozen straight, about B's origin, body axes."""
    check_single_vehicle(vehicle)
    # Polar coordinates have no straight arm: this bend moves the tip by 5e-7 of its length.
    plain, q = vehicle.replace({"arm.kappa_s": 0.0}), np.zeros(8)
    q[6] = 1e-6 / vehicle.arm.length
    return mass_matrix(plain, q)[:6, :6]


def straight_bend_inertia(vehicle: Vehicle) -> float:
    """Inertia of the straight arm's bend about its fixed base, M₇₇ [kg m⁴]."""
    check_single_vehicle(vehicle)
    return float(vehicle.arm.straight_modal_mass)


def camera_inertia(vehicle: Vehicle) -> np.ndarray:
    """Λ (6, 6): inertia that a camera at the tip of the straight, frozen arm feels, in its axes."""
    check_single_vehicle(vehicle)
    R = (TIP_OF_STRAIGHT_ARM @ Rotation.from_quat(vehicle.camera.attitude).as_matrix()).T
    J = np.block([[R, -R @ skew(on_body(vehicle))], [np.zeros((3, 3)), R]])
    inverse = np.linalg.inv(J)
    return np.asarray(inverse.T @ rigid_inertia(vehicle) @ inverse)
