"""Conditions of Theorem 1, of its proof, and of a sound statement, each with a number.

The law is that of Eqs. (15) and (16), Amiri et al. (2026). For a target at rest ė = -J_L q̇, and
then, with u = C_p + C_s D/σ, D = diag(sech²(e_i/σ)),

    d/dt (½ q̇ᵀM q̇ + ½ e_aᵀK_p e_a) = -ėᵀK_d ė + e_aᵀK_p (C_d ë + (u - 1) ė).

The proof drops the last term, which vanishes for every motion only if C_d = 0 and u = 1. The first
contradicts the theorem, which requires C_d to be positive definite. So does the second for every
e, as it requires C_s = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from continuair.analysis.metrics import samples
from continuair.analysis.target_motion import largest_norms
from continuair.flight.provenance import model_of
from continuair.kernels.dynamics import PLANTS
from continuair.kernels.step import UNSEEN
from continuair.scenario.scenarios import Scenario
from continuair.typing import Array
from continuair.vehicle.vehicle import Vehicle

Gains = Mapping[str, Array]

_ROUNDING = 1e-13
"""Relative rounding error of products of gains."""


@dataclass(frozen=True)
class Condition:
    """A condition of a statement: a description and value of its measure, and whether it holds."""

    name: str
    measure: str
    value: float
    holds: bool


def conditions_of(
    vehicle: Vehicle, scenario: Scenario, gains: Gains, flight: xr.Dataset | None
) -> dict[str, tuple[Condition, ...]]:
    """Return the conditions of Theorem 1, of its proof besides, and of the sound statement.

    theorem: as printed. proof: additional conditions that it needs and does not state. sound: if
    all hold, V_sound does not increase. flight: adds the conditions that only a flight shows.
    """
    shared = (_width(gains), _continuous(scenario), *_of_flight(flight))
    return {
        "theorem": (*_positive_gains(gains), *_printed_law(gains), *shared),
        "proof": _cross_term(gains),
        "sound": (_at_rest(scenario), *_sound_gains(gains), _bend(vehicle, gains), *shared),
    }


def _positive_gains(gains: Gains) -> list[Condition]:
    """Return whether each gain matrix is symmetric positive definite."""
    letters = {"Kp": "K_p", "Kd": "K_d", "Cp": "C_p", "Cd": "C_d", "Cs": "C_s"}
    return [
        _positive_definite(letter, gains[name], _norm(gains[name]))
        for name, letter in letters.items()
    ]


def _printed_law(gains: Gains) -> list[Condition]:
    """Return the conditions under which the law is Eqs. (15) and (16)."""
    return [
        _equal(
            "G cancelled in full, compensation literal",
            "share of the spring that is cancelled",
            gains["spring"],
            1.0,
        ),
        _equal(
            "damping on J_L q̇, damping camera",
            "share of L v_t in the damping",
            gains["on_feature_rate"],
            0.0,
        ),
        _equal(
            "ė holds the target, feed_forward on",
            "share of L v_t in ė",
            gains["feed_forward"],
            1.0,
        ),
        _equal("no posture damping", "posture damping [N m³ s]", gains["posture"], 0.0),
    ]


def _cross_term(gains: Gains) -> tuple[Condition, ...]:
    # C_p + C_s D/σ is linear in D, which runs from 0 to 1: the two ends decide.
    """Return the conditions under which the term that the proof drops vanishes."""
    one = np.eye(len(gains["Cp"]))
    far, near = gains["Cp"] - one, gains["Cp"] + gains["Cs"] / gains["sigma"] - one
    off = max(_norm(far), _norm(near))
    return (
        _equal("C_d = 0", "‖C_d‖ [s]", _norm(gains["Cd"]), 0.0),
        Condition(
            "C_p + C_s D/σ = 1 at every e",
            "largest ‖C_p + C_s D/σ - 1‖",
            off,
            off <= _ROUNDING * max(1.0, _norm(gains["Cp"])),
        ),
    )


def _sound_gains(gains: Gains) -> list[Condition]:
    """Return whether the forces on e have a potential, and the damping of e is not negative.

    The law dissipates -ėᵀ(K_pC_d + K_d)ė of V_sound.
    """
    Kp, Kd, Cd = gains["Kp"], gains["Kd"], gains["Cd"]
    damping = Kp @ Cd + Kd
    least = _least_eigenvalue(damping)
    return [
        _positive_definite("K_p C_p", Kp @ gains["Cp"], _norm(Kp) * _norm(gains["Cp"])),
        _sliding(Kp @ gains["Cs"], _norm(Kp) * _norm(gains["Cs"])),
        Condition(
            "symmetric part of K_p C_d + K_d not negative",
            "least eigenvalue",
            least,
            least >= -_ROUNDING * (_norm(Kp) * _norm(Cd) + _norm(Kd)),
        ),
    ]


def _sliding(A: Array, size: float) -> Condition:
    """Return whether K_p C_s is diagonal and not negative."""
    name = "K_p C_s diagonal, not negative"
    apart = _norm(A - np.diag(np.diag(A)))
    if apart > _ROUNDING * size:
        return Condition(name, "off-diagonal share of ‖K_p‖ ‖C_s‖", apart / size, False)
    least = float(np.diag(A).min())
    return Condition(name, "least diagonal entry", least, least >= 0.0)


def _positive_definite(name: str, A: Array, size: float) -> Condition:
    """Return whether a matrix is symmetric positive definite; size: norm that asymmetry is compared
    with."""
    name = f"{name} symmetric positive definite"
    asymmetry = _norm(A - A.T)
    if asymmetry > _ROUNDING * size:
        return Condition(name, f"asymmetry, share of {size:.3g}", asymmetry / size, False)
    least = _least_eigenvalue(A)
    return Condition(name, "least eigenvalue", least, least > 0.0)


def _bend(vehicle: Vehicle, gains: Gains) -> Condition:
    """Return whether the damping of the bend is not negative."""
    damping = vehicle.arm.structural_damping * vehicle.arm.length + float(gains["posture"])
    name = "damping of the bend not negative"
    return Condition(name, "d l + posture damping [N m³ s]", damping, damping >= 0)


def _width(gains: Gains) -> Condition:
    """Return whether σ is positive."""
    σ = float(gains["sigma"])
    return Condition("σ positive", "σ", σ, σ > 0.0)


def _continuous(scenario: Scenario) -> Condition:
    """Return whether the controller updates continuously."""
    period = scenario.control_period or 0.0
    return _equal("control continuous, control_period None", "control period [s]", period, 0.0)


def _at_rest(scenario: Scenario) -> Condition:
    """Return whether all targets are at rest."""
    speed = float(largest_norms(scenario)[:, 0].max())
    return _equal("target at rest", "its largest speed [m/s]", speed, 0.0)


def _of_flight(flight: xr.Dataset | None) -> tuple[Condition, ...]:
    """Return whether a flight keeps every point in view, and is of a plant with a free base."""
    if flight is None:
        return ()
    seen = samples(flight, "in_view", "point").sum(-1)
    # NaN after the end of a run; ignored unless the run ended because it lost a point.
    lost = bool((flight["status"] == UNSEEN).any())
    fewest, points = 0 if lost else int(np.nanmin(seen)), flight.sizes["point"]
    return (
        Condition("every point in view", f"fewest of {points}", fewest, fewest == points),
        _equal("plant coupled or decoupled", "1 if so", float(model_of(flight) in PLANTS), 1.0),
    )


def _equal(name: str, measure: str, value: float | Array, wanted: float) -> Condition:
    """Return whether a value equals the wanted one."""
    return Condition(name, measure, float(value), float(value) == wanted)


def _norm(A: Array) -> float:
    """Return the spectral norm."""
    return float(np.linalg.norm(A, 2))


def _least_eigenvalue(A: Array) -> float:
    """Return the least eigenvalue of the symmetric part."""
    return float(np.linalg.eigvalsh((A + A.T) / 2)[0])
