"""Judges of the steps of Theorem 1's proof about V̇: Eq. (19), r(t) and Eq. (20)."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import root

from amiri2026.paper import proof
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.image import AGREES, below
from amiri2026.paper.theorem import (
    SPEED,
    Gains,
    Theorem,
    desired_pose,
    draw_gains,
    offsets,
    triangle,
)
from amiri2026.verdicts import Judgement, all_of, judged, or_misprint
from continuair import Target, Vehicle, paths
from continuair.analysis import percent
from continuair.equations import camera_jacobian

Array = np.ndarray

STATES, SCALES, SETS = 50, (0.01, 0.1, 1.0), 20
"""States at which V̇ is computed, their scale, and sets of gains drawn for it."""

RATES = (0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 1.0)
"""Largest q̇ of those states [m/s, rad/s, 1/(m s), rad/s]."""

MOVING = 0.1
"""Largest entries of v_t, v̇_t and v̈_t before moving targets; m and rad, per s, s² and s³."""

MOTIONS, RATE, TARGET = 15, 0.2, 0.3
"""Motions at which r is tested, with the vehicle at rest and as many with it moving; the largest
entries of q̇ and q̈, and of the target's velocities and their rates (SI units)."""

UNITS = (1.0, 1.0), (1.0, 1000.0), (100.0, 1.0)
"""Units of length in 1 m, and of time in 1 s: m and s, m and ms, cm and s."""

SOUND = (
    "K_pC_p symmetric positive definite, K_pC_s diagonal and not negative, and the symmetric part "
    "of K_pC_d + K_d not negative"
)
"""Conditions on the gains under which the V of STATEMENT does not rise."""

STATEMENT = "V = ½ q̇ᵀMq̇ + ½ eᵀK_pC_pe + Σ(K_pC_s)_ii σ ln cosh(e_i/σ)"

MADE = "gains made for the image"


def fall_of_v(evidence: Evidence) -> Judgement:
    """Judge III-D.15: does V fall by ½ v_cᵀK_dv_c + λ‖e_a‖² - δ at least, with one λ > 0?"""
    found = evidence.theorem
    states = [at for scale in SCALES for at in random_states(found, scale)]
    of_made = falls(found.made, states)
    of_drawn = [falls(gains, states) for gains in found.drawn[:SETS]]
    without = sum(least.min() <= 0.0 for least in of_drawn)
    worst = max(float(np.mean(least <= 0.0)) for least in of_drawn)
    rest = judged(
        bool(of_made.min() > 0.0) and not without,
        f"at {len(states)} states before a target at rest, scaled up to "
        f"{max(SCALES) / min(SCALES):.0f}-fold, λ may be up to {of_made.min():.3g} W with {MADE}. "
        f"For {without} of {SETS} sets drawn at random, all symmetric positive definite, no "
        f"λ > 0 fits: V falls too slowly, or rises, at up to {percent(worst)} of the states",
        largest_lambda_gains_made_w=float(of_made.min()),
        drawn_sets_without_lambda=float(without),
        largest_share_of_states_without_lambda=worst,
    )
    rises, cases = sound_rises(found, states)
    return or_misprint(
        all_of([rest, random_targets(found), constant_velocity(found)]),
        "the proof drops e_aᵀK_p(C_dë + (C_p + C_sD/σ - 1)ė) from V̇, and uses the r of III-D.16. "
        f"Before a target at rest, {STATEMENT} does not rise with {SOUND}. At the same states it "
        f"rises in {rises} of {cases} cases with {SETS} sets drawn under these conditions; "
        f"Eq. (19) has no λ > 0 for {without} of {SETS} sets drawn as printed. Before a moving "
        "target, Eq. (19) also needs the corrected r",
    )


@functools.lru_cache(maxsize=2 * len(SCALES))
def random_states(found: Theorem, scale: float, moving: float = 0.0) -> tuple[proof.State, ...]:
    """Return states off the desired image that move; the same, scaled, whatever the scale.

    moving: largest entries of v_t and its rates, whatever the scale; 0 for a target at rest.
    """
    rng = np.random.default_rng(15)
    q = desired_pose(found.vehicle, found.target) + offsets(rng, np.full(STATES, scale))
    qd = scale * rng.uniform(-1.0, 1.0, (STATES, 8)) * RATES
    targets = moving * rng.uniform(-1.0, 1.0, (STATES, 3, 6))
    seen = np.asarray(found.target.points), found.target.desired
    return tuple(
        proof.state(found.vehicle, q_of, qd_of, *seen, proof.Target(*target))
        for q_of, qd_of, target in zip(q, qd, targets, strict=True)
    )


def falls(gains: Gains, states: list[proof.State]) -> Array:
    """Return the largest λ [W] at each state for δ = 0; none fits where it is not above 0."""
    return np.array([proof.largest_lambda(proof.motion(at, gains), gains) for at in states])


def sound_rises(found: Theorem, states: list[proof.State]) -> tuple[int, int]:
    """Return at how many states, of how many, the V of the sound statement rises."""
    rates = [
        proof.sound_rate(at, proof.motion(at, gains), gains)
        for gains in found.sound[:SETS]
        for at in states
    ]
    return sum(rate > 0.0 for rate in rates), len(rates)


def random_targets(found: Theorem) -> Judgement:
    """Return whether Eq. (19) holds before randomly moving targets, with δ as printed."""
    states = [at for scale in SCALES for at in random_states(found, scale, MOVING)]
    printed, corrected = (
        min(_with_delta(at, found.made, r) for at in states)
        for r in (proof.r_printed, proof.r_corrected)
    )
    return judged(
        printed > 0.0,
        f"at as many states before targets whose v_t, v̇_t and v̈_t have entries of up to "
        f"{MOVING:g} (m, rad, s), λ may be up to {printed:.3g} W with {MADE} and δ as printed, and "
        f"up to {corrected:.3g} W with the corrected r of III-D.16",
        largest_lambda_target_moving_w=printed,
        largest_lambda_target_moving_corrected_r_w=corrected,
    )


def constant_velocity(found: Theorem) -> Judgement:
    """Return whether Eq. (19) holds where the camera follows a target with constant velocity."""
    every = (found.made, *found.drawn[:SETS])
    states = [following(found, gains) for gains in every]
    rates = [abs(proof.motion(at, of).V_rate) for at, of in zip(states, every, strict=True)]
    printed, corrected = (
        [_with_delta(at, gains, r) for at, gains in zip(states, every, strict=True)]
        for r in (proof.r_printed, proof.r_corrected)
    )
    without, of_corrected = (sum(λ <= 0.0 for λ in each) for each in (printed, corrected))
    return judged(
        not without,
        f"if the camera follows a target with {SPEED:g} m/s, V is constant (|V̇| is at most "
        f"{max(rates):.1g} W) and v_c is not 0, but the printed δ is 0: no λ > 0 fits for "
        f"{without} of {len(every)} sets, {MADE} among them, and for {of_corrected} of them with "
        "the corrected r",
        sets_without_lambda_at_constant_velocity=float(without),
        sets_without_lambda_at_constant_velocity_corrected_r=float(of_corrected),
    )


def _with_delta(at: proof.State, gains: Gains, r: Callable[..., Array]) -> float:
    return proof.largest_lambda(proof.motion(at, gains), gains, r(at, gains))


def following(found: Theorem, gains: Gains) -> proof.State:
    """Return the state in which the camera keeps pace with a target, and no force acts.

    Eq. (15) then requires K_p e_a = K_d v_c, which determines e; the desired image is the one with
    that e.
    """
    q, qd = desired_pose(found.vehicle, found.target), SPEED * np.eye(8)[0]
    still = np.zeros(6)
    target = proof.Target(camera_jacobian(found.vehicle, q) @ qd, still, still)
    at = proof.state(
        found.vehicle, q, qd, np.asarray(found.target.points), found.target.desired, target
    )
    e_a = np.linalg.solve(gains["Kp"], gains["Kd"] @ at.J @ qd)

    def off(e: Array) -> Array:
        sliding = gains["Cs"] @ np.tanh(e / gains["sigma"])
        return np.asarray(gains["Cp"] @ e + sliding - e_a)

    return replace(at, e=root(off, np.zeros_like(e_a), tol=1e-12).x)


def bound_of_delta(evidence: Evidence) -> Judgement:
    """Judge III-D.16: is r the target's part of ė_a, and is ‖r‖ at most R_max, in one unit?"""
    rest, moving = (residuals(evidence.vehicle, rate) for rate in (0.0, RATE))
    found = np.concatenate([rest, moving])
    printed, corrected = float(np.median(found[:, 0])), float(found[:, 1].max())
    rng = np.random.default_rng(16)
    shares = [share_of_r_max(rng, metre) for metre in (1.0, 100.0, 1e-3) for _ in range(300)]
    plain, in_ms, in_cm = (np.array(scaled_terms(*units)) for units in UNITS)
    one_unit = all(np.ptp(terms / plain) < 1e-9 for terms in (in_ms, in_cm))
    view = judged(
        bool(found[:, 0].max() < AGREES) and max(shares) <= 1.0 + 1e-9 and one_unit,
        f"the r printed differs from the target's part of ė_a by {percent(printed)} in the median "
        f"of {len(found)} motions, by {percent(float(rest[:, 0].min()))} at least with the vehicle "
        f"at rest. ‖r‖ as printed reaches {max(shares):.2f} of R_max in {len(shares)} draws of "
        f"gains, errors and targets, also in cm and km. The three terms of R_max "
        f"{'have one unit' if one_unit else 'differ in their units'}, which is not that of ė_a",
        median_residual_of_r_as_printed=printed,
        largest_share_of_r_max=max(shares),
    )
    return or_misprint(
        view,
        "the r printed has one derivative of v_t too many and lacks L. From Eq. (12), r = "
        "C_d(Lv̇_t + L̇v_t) + (C_p + C_sD/σ)Lv_t. The residual relative to the target's part of "
        f"ė_a is {percent(printed)} as printed (median) and {below(corrected)} as corrected. Then "
        "R_max = ‖C_d‖(‖L‖L_2 + ‖L̇‖L_1) + (‖C_p‖ + ‖C_s‖/σ)‖L‖L_1. It needs bounds of ‖L‖ and "
        "‖L̇‖: depths that stay away from 0, and a bounded v_c",
    )


def residuals(vehicle: Vehicle, rate: float) -> Array:
    """Return relative residuals of the printed and the corrected r at random motions (MOTIONS, 2).

    rate: largest entries of q̇ and q̈; 0 for a vehicle at rest.
    """
    rng, target = np.random.default_rng(16), Target(paths.hold(), triangle())
    q = desired_pose(vehicle, target) + offsets(rng, np.full(MOTIONS, 0.3))
    found = []
    for each in q:
        qd, qdd = rate * rng.uniform(-1.0, 1.0, (2, 8))
        centre, axis = TARGET * rng.uniform(-1.0, 1.0, (3, 3)), rng.normal(size=3)
        turn, acceleration = TARGET * rng.uniform(-1.0, 1.0, 2)
        course = proof.Course(
            vehicle, each, qd, qdd, np.asarray(target.points), centre, axis / np.linalg.norm(axis),
            (float(turn), float(acceleration)),
        )  # fmt: skip
        found.append(proof.r_residuals(course, target.desired, draw_gains(rng)))
    return np.array(found)


def share_of_r_max(rng: np.random.Generator, metre: float) -> float:
    """Return ‖r‖ / R_max of a random motion that reaches its bounds, lengths in 1/metre m."""
    gains = draw_gains(rng)
    units = np.repeat([metre, 1.0], 3)
    second, third = (units * rng.normal(size=6) for _ in range(2))
    sech = 1.0 / np.cosh(rng.normal(size=6)) ** 2
    of_error = gains["Cs"] / gains["sigma"] * sech
    r = gains["Cd"] @ third + gains["Cp"] @ second + of_error @ second
    return float(np.linalg.norm(r) / sum(r_max_terms(gains, second, third)))


def r_max_terms(gains: Gains, second: Array, third: Array) -> tuple[float, float, float]:
    """Return the three terms of R_max as printed, with L_2 and L_3 the norms of v̇_t and v̈_t."""
    L2, L3 = np.linalg.norm(second), np.linalg.norm(third)
    C_d, C_p, C_s = (np.linalg.norm(gains[name], 2) for name in ("Cd", "Cp", "Cs"))
    return float(C_d * L3), float(C_p * L2), float(C_s / gains["sigma"] * L2)


def scaled_terms(metre: float, second: float) -> tuple[float, float, float]:
    """Return the terms of R_max for one motion and law, in other units; metre, second: units in 1 m
    and 1 s.

    C_p e, C_d ė and C_s tanh(e/σ) are added in e_a, so that C_d alone has a unit of its own, time.
    """
    gains = draw_gains(np.random.default_rng(16))
    gains["Cd"] = gains["Cd"] * second
    return r_max_terms(gains, np.full(6, metre / second**2), np.full(6, metre / second**3))


JUDGES = {"III-D.15": fall_of_v, "III-D.16": bound_of_delta}
"""Judge of every sentence on V̇ and its bound, by its id."""
