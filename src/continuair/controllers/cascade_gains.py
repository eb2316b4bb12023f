"""Gains of the flight controller's cascade from bandwidths."""

from __future__ import annotations

from typing import Any

import numpy as np

from continuair.controllers.hover import Hover

Array = np.ndarray

ABOVE_SERVO = 3.0
"""How many times faster than its servo a bend is made, where its spring is softer."""


def position_gains(bandwidth: float, damping_ratio: float, share: float) -> tuple[float, ...]:
    """Return k_p [1/s], k_v [1/s] and k_i [1/s²] with the poles of (s² + 2ζω s + ω²)(s + share ω).

    The loop is s³ + (k_v s + k_i)(s + k_p): k_p is a root of k_v k_p² - (ω² + 2ζω α) k_p + ω² α,
    the larger one, which is real for a share up to 1/4 at ζ = 1.
    """
    w, slow = bandwidth, share * bandwidth
    k_v = 2.0 * damping_ratio * w + slow
    linear, product = w * w + 2.0 * damping_ratio * w * slow, w * w * slow
    k_p = (linear + np.sqrt(linear * linear - 4.0 * k_v * product)) / (2.0 * k_v)
    return float(k_p), k_v, float(product / k_p)


def real_gains(damping_ratio: float, share: float) -> bool:
    """Return whether the gains of `position_gains` are real."""
    linear = 1.0 + 2.0 * damping_ratio * share
    return linear * linear >= 4.0 * (2.0 * damping_ratio + share) * share


def attitude_gains(
    bandwidth: float, yaw_bandwidth: float, damping_ratio: float
) -> dict[str, Array]:
    """Return ω_n² and 2 ζ ω_n of roll, pitch and yaw."""
    rates = np.array([bandwidth, bandwidth, yaw_bandwidth])
    return {"attitude": rates**2, "spin": 2.0 * damping_ratio * rates}


def bend_gains(
    hover: Hover, rates: Array, damping_ratio: float, period: float
) -> dict[str, Array | float]:
    """Return gains of the bends' references and servos.

    rates (bends,): of the references [1/s]; damping_ratio: of the bends about their references.
    A section whose rate is 0 gets no moment.
    """
    held = rates > 0.0
    M = hover.free_bends
    own = hover.stiffness / np.diag(M)
    slowest = np.sqrt(own[held].min()) if held.any() else 0.0
    stiff = max(slowest, ABOVE_SERVO * float(rates.max(initial=0.0)))
    return {
        "bend_inertia": np.where(np.outer(held, held), M, 0.0),
        "bend_stiffness": np.where(held, hover.stiffness, 0.0),
        "bend_stiffer": stiff**2 - slowest**2,
        "bend_damper": 2.0 * damping_ratio * stiff,
        "bend_servo": per_period(rates, period),
    }


def per_period(rates: Any, period: float) -> Any:
    """Rates [1/s] which give the lags of first order of some rates when taken by the period."""
    return -np.expm1(-np.asarray(rates) * period) / period
