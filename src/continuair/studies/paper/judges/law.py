"""Judges of the section on control, III-D: Theorem 1 and the steps of its proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from continuair.analysis.lyapunov import errors
from continuair.analysis.metrics import samples
from continuair.analysis.shares import percent
from continuair.equations import image_jacobian, interaction_matrix
from continuair.equations.camera import in_view, to_normalised
from continuair.flight.resolution import RESOLVED
from continuair.studies.paper import proof
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.theorem import (
    FAST,
    POINTS,
    SIZE,
    Flown,
    Gains,
    Theorem,
    desired_pose,
    draw_gains,
    in_the_end,
    offsets,
)
from continuair.studies.sensitivity.findings import rank_correlation
from continuair.studies.verdicts import REPRODUCED, UNDECIDED, Judgement, judged
from continuair.vehicle.camera import Camera

Array = np.ndarray

SETTLED = 1.0
"""Errors below count as none [px]."""

GROWS = 0.5
"""Rank correlation from which on one thing grows with another."""

GONE = 0.01
"""Share of its largest to which what goes to zero has fallen in the end."""

STATES, SCALES, SETS = 50, (0.01, 0.1, 1.0), 20
"""States that V̇ is computed at, what they are scaled by, and sets of gains drawn for it."""

UNITS = (1.0, 1.0), (1.0, 1000.0), (100.0, 1.0)
"""Units of length in 1 m, and of time in 1 s: m and s, m and ms, cm and s."""

RATES = (0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 1.0)
"""Largest q̇ of those states [m/s, rad/s, 1/(m s), rad/s]."""


def theorem(evidence: Evidence) -> Judgement:
    """III-D.13: is the error bounded in the end, from every start and with any gains?"""
    found = evidence.theorem
    made = [flown for flown in found.sets if flown.made]
    drawn = [flown for flown in found.sets if not flown.made]
    (bad, of_made), (diverged, of_drawn) = (
        count(sets, lambda flown: flown.diverged) for sets in (made, drawn)
    )
    whole = [each for each in found.sets if each.resolved.all() and not each.diverged.any()]
    grows = [growth_with_start(each) for each in whole]
    unstable = float(np.mean(found.growth > 0.0))
    lost, _ = count(made, lambda flown: leaving(flown, found, evidence.vehicle.camera))
    still, moving = (_most_left(flown) for flown in made)
    related = (
        f"rank correlation with the start at most {max(grows):.2g}"
        if grows
        else "with no set did all flights come to their end resolved, to compare with the start"
    )
    return of_resolved(
        list(found.sets),
        not bad + diverged and all(rho < GROWS for rho in grows),
        f"with N = {POINTS} points, as 6×6 gains ask for, and gains made for the image, {bad} of "
        f"{of_made} flights diverge, and at most {_px(still, 2)} are left before a target at "
        f"rest, {_px(moving, 3)} before a moving one ({related}). But of "
        f"{len(found.drawn)} sets drawn at random, all symmetric positive definite, "
        f"{percent(unstable)} make the desired image unstable, and with the first {len(drawn)} "
        f"whose error grows there by more than {FAST:g} 1/s {diverged} of {of_drawn} flights "
        "diverge, though the target rests. The paper prints no gains; points that leave the "
        f"vehicle's own image, in {lost} of {of_made} flights, do not count",
        diverging_flights_gains_made=float(bad),
        sets_drawn_with_flights_that_diverge=sets_with(drawn, lambda flown: flown.diverged),
        share_of_drawn_gains_unstable=unstable,
        **({"largest_rank_correlation_with_start": max(grows)} if grows else {}),
        error_left_gains_made_target_moving_px=moving,
        flights_that_leave_the_image=float(lost),
    )


def count(sets: list[Flown], what: Callable[[Flown], Array]) -> tuple[int, int]:
    """How many resolved flights have what a function tells of each (starts,), and of how many."""
    found = sum(int((flown.resolved & what(flown)).sum()) for flown in sets)
    return found, sum(int(flown.resolved.sum()) for flown in sets)


def sets_with(sets: list[Flown], what: Callable[[Flown], Array]) -> float:
    """With how many sets there is a resolved flight like that: of violent ones the number hangs on
    the last bits."""
    return float(sum(bool((flown.resolved & what(flown)).any()) for flown in sets))


def of_resolved(sets: list[Flown], holds: bool, evidence: str, **numbers: float) -> Judgement:
    """The judgement of what is asked of all flights, of which some may not be resolved."""
    many = sum(int((~flown.resolved).sum()) for flown in sets)
    told = f"{evidence}. {many} more flights are resolved by no step tried" if many else evidence
    found = judged(holds, told, **numbers)
    return replace(found, verdict=UNDECIDED) if holds and many else found


def _most_left(flown: Flown) -> float:
    """The largest error that flights end with [px]; NaN where all ended early."""
    left = flown.remaining[np.isfinite(flown.remaining)]
    return float(left.max()) if left.size else np.nan


def _px(left: float, digits: int) -> str:
    return f"{left:.{digits}g} px" if np.isfinite(left) else "nothing (all flights ended early)"


def growth_with_start(flown: Flown) -> float:
    """Rank correlation of the error that is left with that at the start."""
    left = np.where(flown.remaining < SETTLED, 0.0, flown.remaining)
    return rank_correlation(flown.error[:, 0].tolist(), left.tolist())


def leaving(flown: Flown, found: Theorem, camera: Camera) -> Array:
    """In which flights (starts,) a point leaves the image of a camera."""
    image = to_normalised(found.vehicle.camera, samples(flown.flight, "features", "pixel"))
    seen = in_view(camera, image, samples(flown.flight, "depth", "point"))
    return np.asarray((~seen).any((-2, -1)))


def fall_of_v(evidence: Evidence) -> Judgement:
    """III-D.15: does V fall by ½ v_cᵀK_dv_c + λ‖e_a‖² at least, with one λ > 0 for all states?"""
    found = evidence.theorem
    states = [at for scale in SCALES for at in random_states(found, scale)]
    of_made = falls(found.made, states)
    of_drawn = [falls(gains, states) for gains in found.drawn[:SETS]]
    without = sum(least.min() <= 0.0 for least in of_drawn)
    worst = max(float(np.mean(least <= 0.0)) for least in of_drawn)
    return judged(
        bool(of_made.min() > 0.0) and not without,
        "the proof drops e_aᵀK_p(C_d ë + (C_p + C_s D/σ - 1) ė) from V̇. At "
        f"{len(states)} states before a target at rest, near the desired image and up to "
        f"{max(SCALES) / min(SCALES):.0f} times farther and faster, λ may be up to "
        f"{of_made.min():.3g} W with gains made for the image (J_L with a rotation for T_a⁻¹). For "
        f"{without} of {SETS} sets drawn at random, all symmetric positive definite, there is no "
        f"λ > 0: at up to {percent(worst)} of the states V falls by less than ½ v_cᵀK_dv_c, or "
        "rises",
        largest_lambda_gains_made_w=float(of_made.min()),
        drawn_sets_without_lambda=float(without),
        largest_share_of_states_without_lambda=worst,
    )


def random_states(found: Theorem, scale: float) -> list[proof.State]:
    """States off the desired image that move; the same, scaled, whatever the scale."""
    rng = np.random.default_rng(15)
    q = desired_pose(found.vehicle, found.target) + offsets(rng, np.full(STATES, scale))
    qd = scale * rng.uniform(-1.0, 1.0, (STATES, 8)) * RATES
    seen = found.target.points, found.target.desired
    return [proof.state(found.vehicle, *each, *seen) for each in zip(q, qd, strict=True)]


def falls(gains: Gains, states: list[proof.State]) -> Array:
    """The largest λ [W] at each state; none does where it is not above 0."""
    return np.array([proof.largest_lambda(proof.motion(at, gains), gains) for at in states])


def bound_of_delta(_: Evidence) -> Judgement:
    """III-D.16: is ‖r‖ at most R_max, and do its three terms have one unit?"""
    rng = np.random.default_rng(16)
    shares = [share_of_r_max(rng, metre) for metre in (1.0, 100.0, 1e-3) for _ in range(300)]
    plain, in_ms, in_cm = (np.array(scaled_terms(*units)) for units in UNITS)
    one_unit = all(np.ptp(terms / plain) < 1e-9 for terms in (in_ms, in_cm))
    return judged(
        max(shares) <= 1.0 + 1e-9 and one_unit,
        f"‖r‖ reaches {max(shares):.2f} of R_max in {len(shares)} draws of gains, errors and "
        "target motions, also with lengths in cm and km. In other units of time and length its "
        f"three terms change {'alike' if one_unit else 'unlike'}: m/s² for translation and rad/s² "
        "for turning, where one norm counts 1 m as 1 rad. That r has not the unit of the rate of "
        "e_a, 1/s, is a matter of Eq. (19)",
        largest_share_of_r_max=max(shares),
    )


def share_of_r_max(rng: np.random.Generator, metre: float) -> float:
    """‖r‖ / R_max of a random motion that reaches its bounds, lengths in units of 1/metre [m]."""
    gains = draw_gains(rng)
    units = np.repeat([metre, 1.0], 3)
    second, third = (units * rng.normal(size=6) for _ in range(2))
    sech = 1.0 / np.cosh(rng.normal(size=6)) ** 2
    of_error = gains["Cs"] / gains["sigma"] * sech
    r = gains["Cd"] @ third + gains["Cp"] @ second + of_error @ second
    return float(np.linalg.norm(r) / sum(r_max_terms(gains, second, third)))


def r_max_terms(gains: Gains, second: Array, third: Array) -> tuple[float, float, float]:
    """The three terms of R_max, with L_2 and L_3 the norms of v̇_t and v̈_t."""
    L2, L3 = np.linalg.norm(second), np.linalg.norm(third)
    C_d, C_p, C_s = (np.linalg.norm(gains[name], 2) for name in ("Cd", "Cp", "Cs"))
    return float(C_d * L3), float(C_p * L2), float(C_s / gains["sigma"] * L2)


def scaled_terms(metre: float, second: float) -> tuple[float, float, float]:
    """The terms of R_max for one motion and law, with so many units of length and time in 1 m, 1 s.

    C_p e, C_d ė and C_s tanh(e/σ) are added in e_a, so that C_d alone has a unit of its own, time.
    """
    gains = draw_gains(np.random.default_rng(16))
    gains["Cd"] = gains["Cd"] * second
    return r_max_terms(gains, np.full(6, metre / second**2), np.full(6, metre / second**3))


def compact_set(evidence: Evidence) -> Judgement:
    """III-D.17: is the set where V̇ may be positive compact, and does V fall outside of it?"""
    found = evidence.theorem
    q = desired_pose(found.vehicle, found.target)
    unseen = 8 - int(np.linalg.matrix_rank(image_jacobian(found.vehicle, q, found.target.points)))
    (made, starts), (drawn, of_drawn) = (
        count(sets, rises) for sets in (found.at_rest[:1], found.at_rest[1:])
    )
    return of_resolved(
        found.at_rest,
        unseen == 0 and not made + drawn,
        f"q̇ has {unseen} directions with J_L q̇ = 0, which neither v_c nor e_a holds: the set has "
        "any speed along them in it, and V has no bound on it. Before a target at rest, where "
        "every state with a v_c or an e_a lies outside, V gets above its start in "
        f"{drawn} of {of_drawn} flights with gains drawn at random, and in {made} of {starts} "
        "with gains made for the image",
        directions_without_bound=float(unseen),
        flights_where_v_rises_gains_made=float(made),
        sets_drawn_where_v_rises=sets_with(found.at_rest[1:], rises),
    )


def rises(flown: Flown) -> Array:
    """In which flights (starts,) V of the paper gets above its start."""
    V = flown.found.over_time["lyapunov_paper"].to_numpy()
    return np.asarray(np.nanmax(V, axis=-1) > (1.0 + RESOLVED) * V[:, 0])


def convergence(evidence: Evidence) -> Judgement:
    """III-D.18: do flights before a target at rest enter the set, and is it a level set of V?"""
    found = evidence.theorem

    def outside(flown: Flown) -> Array:
        return stays_out(flown, found)

    (made, starts), (drawn, of_drawn), (moving, of_moving) = (
        count(sets, outside) for sets in (found.at_rest[:1], found.at_rest[1:], found.moving)
    )
    widths = [float(np.sqrt(np.linalg.cond(flown.gains["Kp"]))) for flown in found.sets]
    return of_resolved(
        found.at_rest,
        not made + drawn and max(widths) <= 1.0 + 1e-6,
        "before a target at rest, for which the printed bound is 0, the excess stays above it in "
        f"{made} of {starts} flights with gains made for the image and in {drawn} of "
        f"{of_drawn} with gains drawn at random (before a moving one, with λ = ‖K_p‖, in "
        f"{moving} of {of_moving}; a smaller λ widens the set without limit). Nor does a V that "
        "falls outside a set lead into it, but into the smallest level set of V around it, which "
        f"in e_a alone is √cond(K_p) = {min(widths):.3g} to {max(widths):.3g} times wider",
        flights_outside_gains_made=float(made),
        sets_drawn_with_flights_outside=sets_with(found.at_rest[1:], outside),
        flights_outside_target_moving=float(moving),
        largest_width_of_level_set_over_printed_set=max(widths),
    )


def stays_out(flown: Flown, found: Theorem) -> Array:
    """From which starts (starts,) the excess of the printed expression does not go to zero."""
    excess = np.maximum(0.0, printed_expression(flown, found) - printed_bound(flown))
    left = excess[:, in_the_end(flown.flight)].max(-1)
    # NaN after an early end compares as not gone.
    return np.asarray(~(left <= GONE * np.nanmax(excess, axis=-1)))


def printed_expression(flown: Flown, found: Theorem) -> Array:
    """½ v_cᵀK_dv_c + λ‖e_a‖² (starts, time) with v_c = J_L q̇ and λ = ‖K_p‖."""
    flight, K_d = flown.flight, flown.gains["Kd"]
    image = to_normalised(found.vehicle.camera, samples(flight, "features", "pixel"))
    L = interaction_matrix(image, samples(flight, "depth", "point"))
    v_c = (L @ samples(flight, "camera_twist", "twist")[..., None])[..., 0]
    e_a = flown.found.over_time["servo_error"].to_numpy()
    λ = np.linalg.norm(flown.gains["Kp"], 2)
    return np.asarray(0.5 * np.einsum("...i,ij,...j->...", v_c, K_d, v_c) + λ * e_a**2)


def printed_bound(flown: Flown) -> float:
    """‖K_p‖² R_max²/(2λ) with λ = ‖K_p‖."""
    return float(0.5 * np.linalg.norm(flown.gains["Kp"], 2) * flown.found.bound["r_max"] ** 2)


def bound_of_error(evidence: Evidence) -> Judgement:
    """III-D.19: does a bound of e in the end follow from one of e_a?"""
    rng = np.random.default_rng(19)
    trials = [ultimate_share(draw_gains(rng)) for _ in range(100)]
    found = evidence.theorem
    flown = [share_in_flight(each, found) for each in found.sets if each.made]
    last = f"{np.nanmax(flown):.2f}" if np.isfinite(flown).any() else "none that came to its end"
    return of_resolved(
        [each for each in found.sets if each.made],
        max(trials) <= 1.0 and not (np.array(flown) > 1.0).any(),
        "with W = ½ eᵀC_d e, Eq. (16) gives ‖e‖ ≤ √cond(C_d) (‖e_a‖ + ‖C_s‖ √(2N)) / λ_min(C_p) "
        "in the end, whatever e(0), v_c and L are; the paper's own reason, a bounded ė, would "
        "also need depths that stay away from 0. An e_a that drives e outwards leads to "
        f"{max(trials):.2f} of that bound at the most, with {len(trials)} random sets of gains, "
        f"and flights with gains made for the image to {last}",
        largest_share_of_bound_in_trials=max(trials),
    )


def error_bound(gains: Gains, largest: float) -> float:
    """The bound of ‖e‖ in the end that follows from ‖e_a‖ being at most `largest`."""
    sliding = np.linalg.norm(gains["Cs"], 2) * np.sqrt(SIZE)
    skew = np.sqrt(np.linalg.cond(gains["Cd"]))
    return float(skew * (largest + sliding) / np.linalg.eigvalsh(gains["Cp"])[0])


def ultimate_share(gains: Gains, largest: float = 1.0) -> float:
    """Where e ends from 100 times its bound, as a share of it, under an e_a along e itself.

    Implicit Euler in the linear terms, stable at any step, until what is slowest has decayed.
    """
    bound = error_bound(gains, largest)
    slowest = float(np.linalg.eigvals(np.linalg.solve(gains["Cd"], gains["Cp"])).real.min())
    steps = 400
    h = 20.0 / slowest / steps
    ahead = np.linalg.inv(gains["Cd"] + h * gains["Cp"])
    e = np.full(SIZE, 100.0 * bound / np.sqrt(SIZE))
    for _ in range(steps):
        e_a = largest * e / np.linalg.norm(e)
        drive = e_a - gains["Cs"] @ np.tanh(e / gains["sigma"])
        e = ahead @ (gains["Cd"] @ e + h * drive)
    return float(np.linalg.norm(e) / bound)


def share_in_flight(flown: Flown, found: Theorem) -> float:
    """The largest ‖e‖ in the end of the flights as a share of the bound from their own e_a; NaN
    where all of them ended early, or are not resolved."""
    e, _, e_a = errors(flown.flight, found.vehicle, flown.gains)
    left = np.linalg.norm(e, axis=-1)[:, in_the_end(flown.flight)].max(-1)
    left = np.where(flown.resolved, left, np.nan)
    largest = np.linalg.norm(e_a, axis=-1).max(-1)
    ended = np.isnan(left)
    if ended.all():
        return np.nan
    of_bound = [error_bound(flown.gains, each) for each in largest[~ended]]
    return float((left[~ended] / of_bound).max())


STEPS = {
    "III-D.15": fall_of_v,
    "III-D.16": bound_of_delta,
    "III-D.17": compact_set,
    "III-D.18": convergence,
    "III-D.19": bound_of_error,
}


def conclusion(evidence: Evidence) -> Judgement:
    """III-D.20: do all steps of the proof hold, from every start?"""
    held = [name for name, step in STEPS.items() if step(evidence).verdict == REPRODUCED]
    first = evidence.theorem.sets[0]
    settled, starts = count([first], lambda flown: flown.remaining < SETTLED)
    return of_resolved(
        [first],
        len(held) == len(STEPS) and settled == starts,
        f"{len(held)} of the {len(STEPS)} steps III-D.15 to III-D.19 hold: "
        f"{', '.join(held) or 'none'}. With gains made for the image and a target at rest, flights "
        f"from {settled} of {starts} starts settle to within {SETTLED:g} px",
        steps_that_hold=float(len(held)),
        starts_that_settle=float(settled),
    )


JUDGES = {"III-D.13": theorem, **STEPS, "III-D.20": conclusion}
"""Judge of every sentence on the theorem and its proof, by its id."""
