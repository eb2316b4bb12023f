"""Lyapunov functions along a run, and the ultimate bound that the paper's proof names.

The paper's V = ½ q̇ᵀM q̇ + ½ e_aᵀK_p e_a need not fall, even for a target at rest: its cross term
cancels only if C_d = 0 and C_p + C_s D/σ = 1. The sound one is
V = ½ q̇ᵀM q̇ + elastic energy + ½ eᵀK_pC_p e + Σ (K_pC_s)_ii σ ln cosh(e_i/σ).
For a target at rest it does not increase if K_pC_p is symmetric positive definite, K_pC_s diagonal
and not negative, the symmetric part of K_pC_d not negative, and the control continuous.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair.analysis.metrics import samples
from continuair.controllers.controller import Controller
from continuair.equations.camera import interaction_matrix, to_normalised
from continuair.scenario.scenarios import Scenario
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray


def lyapunov(data: xr.Dataset, vehicle: Vehicle, controller: Controller) -> dict[str, xr.DataArray]:
    """V of the paper and the sound V over time [J], and ‖e_a‖; `data` holds the closed loop."""
    gains = {name: np.asarray(value) for name, value in controller.gains.items()}
    e, e_a = errors(data, vehicle, gains)
    kinetic = data["kinetic_energy"].transpose(..., "time")
    Kp, sigma = gains["Kp"], float(gains["sigma"])
    sliding = np.diag(Kp @ gains["Cs"]) * sigma
    stored = 0.5 * _form(e, Kp @ gains["Cp"]) + _ln_cosh(e / sigma) @ sliding
    named = {
        "lyapunov_paper": (kinetic + 0.5 * _form(e_a, Kp), "J", "½ q̇ᵀM q̇ + ½ e_aᵀK_p e_a"),
        "lyapunov_sound": (
            kinetic + data["elastic_energy"].transpose(..., "time") + stored,
            "J",
            "kinetic and elastic energy and the potential of the image's springs",
        ),
        "servo_error": (kinetic * 0.0 + np.linalg.norm(e_a, axis=-1), "1", "‖e_a‖, Eq. (16)"),
    }
    return {
        name: values.assign_attrs(units=units, long_name=meaning)
        for name, (values, units, meaning) in named.items()
    }


def errors(data: xr.Dataset, vehicle: Vehicle, gains: dict[str, Array]) -> tuple[Array, Array]:
    """e and e_a of Eq. (16), (..., time, 2n), in normalised coordinates, from a closed loop."""

    e = samples(data, "feature_error", "pixel") / np.tile(
        vehicle.camera.focal_length, data.sizes["pixel"] // 2
    )
    seen = to_normalised(vehicle.camera, samples(data, "features", "pixel"))
    L = interaction_matrix(seen, samples(data, "depth", "point"))
    twist = samples(data, "camera_twist", "twist").copy()
    x, y, z, w = np.moveaxis(samples(data, "camera_attitude", "quaternion"), -1, 0)
    axis, moving = np.stack([x, y, z], -1), samples(data, "target_velocity", "axis")
    # The target's velocity in camera axes: rotated by the inverse of the camera's attitude.
    t = 2.0 * np.cross(moving, axis)
    twist[..., :3] -= moving + w[..., None] * t + np.cross(t, axis)
    e_dot = -(L @ twist[..., None])[..., 0]
    sliding = np.tanh(e / gains["sigma"])
    return e, e_dot @ gains["Cd"].T + e @ gains["Cp"].T + sliding @ gains["Cs"].T


def ultimate_bound(scenario: Scenario) -> dict[str, float]:
    """The radius on ‖e_a‖ that the paper's proof ends with, ‖K_p‖ R_max / (√2 λ).

    The proof names no λ: `radius_least` takes the largest that it could be, ‖K_p‖, and
    `radius_provable` λ_min(K_p). R_max adds terms of different units, as printed.
    """
    assert scenario.controller is not None
    gains = {k: np.asarray(v, float) for k, v in scenario.controller.gains.items()}
    norms = {k: float(np.linalg.norm(gains[k], 2)) for k in ("Kp", "Cp", "Cd", "Cs")}
    time = np.linspace(0.0, scenario.duration, 20001)
    L1, L2, L3 = 0.0, 0.0, 0.0
    for target in scenario.targets:
        _, velocity, acceleration = target.path(time)
        jerk = np.gradient(acceleration, time, axis=0)
        sizes = (float(np.linalg.norm(a, axis=1).max()) for a in (velocity, acceleration, jerk))
        L1, L2, L3 = (max(pair) for pair in zip((L1, L2, L3), sizes, strict=True))
    r_max = norms["Cd"] * L3 + norms["Cp"] * L2 + norms["Cs"] / float(gains["sigma"]) * L2
    smallest = float(np.linalg.eigvalsh(gains["Kp"])[0])
    return {
        "target_speed_m_s": L1,
        "target_acceleration_m_s2": L2,
        "target_jerk_m_s3": L3,
        "r_max": r_max,
        "radius_least": r_max / np.sqrt(2.0),
        "radius_provable": norms["Kp"] * r_max / (np.sqrt(2.0) * smallest),
    }


def _form(v: Array, A: Array) -> Array:
    """vᵀA v over the last axis."""
    return np.einsum("...i,ij,...j->...", v, A, v)


def _ln_cosh(x: Array) -> Array:
    size = np.abs(x)
    return np.asarray(size + np.log1p(np.exp(-2.0 * size)) - np.log(2.0))
