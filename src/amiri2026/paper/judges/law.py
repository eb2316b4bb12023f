"""Judges of the section on control, III-D: Theorem 1 and the steps of its proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import rate_of_v
from amiri2026.paper.judges.rate_of_v import MADE, SOUND, STATEMENT
from amiri2026.paper.theorem import (
    FAST,
    POINTS,
    SIZE,
    SPEED,
    Flown,
    Gains,
    Theorem,
    desired_pose,
    draw_gains,
    in_the_end,
)
from amiri2026.sensitivity.findings import rank_correlation
from amiri2026.verdicts import (
    UNDECIDED,
    Case,
    Judgement,
    judged,
    or_misprint,
    over_cases,
)
from continuair import Camera
from continuair.analysis import errors, percent, samples
from continuair.equations import image_jacobian, in_view, interaction_matrix, to_normalised
from continuair.flight import RESOLVED

Array = np.ndarray

SETTLED = 1.0
"""Errors below count as none [px]."""

GROWS = 0.5
"""Rank correlation from which on one thing grows with another."""

GONE = 0.01
"""Share of its largest value below which a quantity counts as converged to zero."""

DRAWN = "gains drawn at random"


def theorem(evidence: Evidence) -> Judgement:
    """Judge III-D.13: is the error bounded in the end, from every start and with any gains?"""
    found = evidence.theorem
    made = [flown for flown in found.sets if flown.made]
    drawn = [flown for flown in found.sets if not flown.made]
    (bad, of_made), (diverged, of_drawn) = (
        count(sets, lambda flown: flown.diverged) for sets in (made, drawn)
    )
    whole = [each for each in found.sets if each.resolved.all() and not each.diverged.any()]
    grows = [growth_with_start(each) for each in whole]
    unstable, sound = (float(np.mean(each > 0.0)) for each in (found.growth, found.sound_growth))
    lost, _ = count(made, lambda flown: leaving(flown, found, evidence.vehicle.camera))
    still, moving = (_most_left(flown) for flown in made)
    view = of_resolved(
        list(found.sets),
        not bad + diverged and all(rho < GROWS for rho in grows),
        f"with {POINTS} points, which 6×6 gains need, and {MADE}, {bad} of {of_made} flights "
        f"diverge. The largest error in the end is {_px(still, 2)} before a target at rest and "
        f"{_px(moving, 3)} before a moving one{_related(grows)}. Of {len(found.drawn)} sets drawn "
        f"at random, all symmetric positive definite, {percent(unstable)} make the desired image "
        f"unstable. With the first {len(drawn)} whose error grows by more than {FAST:g} 1/s, "
        f"{diverged} of {of_drawn} flights diverge before a target at rest. Points leave the "
        f"vehicle's own image in {lost} of {of_made} flights, which does not count",
        diverging_flights_gains_made=float(bad),
        sets_drawn_with_flights_that_diverge=sets_with(drawn, lambda flown: flown.diverged),
        share_of_drawn_gains_unstable=unstable,
        share_of_sound_gains_unstable=sound,
        **({"largest_rank_correlation_with_start": max(grows)} if grows else {}),
        error_left_gains_made_target_moving_px=moving,
        flights_that_leave_the_image=float(lost),
    )
    return or_misprint(
        view,
        f"gains that are symmetric positive definite do not suffice. Before a target at rest, "
        f"{STATEMENT} does not rise with {SOUND}. Of {len(found.sound)} sets drawn under these "
        f"conditions {percent(sound)} make the desired image unstable, of {len(found.drawn)} sets "
        f"drawn as printed {percent(unstable)}",
    )


def _related(grows: list[float]) -> str:
    if not grows:
        return ". No set has all its flights resolved to the end, so the start cannot be compared"
    return f", with a rank correlation with the start of at most {max(grows):.2g}"


def count(sets: list[Flown], what: Callable[[Flown], Array]) -> tuple[int, int]:
    """Return how many resolved flights have a property (starts,), and how many are resolved."""
    found = sum(int((flown.resolved & what(flown)).sum()) for flown in sets)
    return found, sum(int(flown.resolved.sum()) for flown in sets)


def sets_with(sets: list[Flown], what: Callable[[Flown], Array]) -> float:
    """Return how many sets have a resolved flight with a property.

    The number of such flights depends on rounding, as the most violent ones are chaotic.
    """
    return float(sum(bool((flown.resolved & what(flown)).any()) for flown in sets))


def of_resolved(sets: list[Flown], holds: bool, evidence: str, **numbers: float) -> Judgement:
    """Return the judgement of a claim about all flights; undecided if it holds for resolved ones
    only."""
    many = sum(int((~flown.resolved).sum()) for flown in sets)
    told = f"{evidence}. Not resolved: {many} more flights" if many else evidence
    found = judged(holds, told, **numbers)
    return replace(found, verdict=UNDECIDED) if holds and many else found


def _most_left(flown: Flown) -> float:
    """Return the largest error at the end of flights [px]; NaN where all stopped early."""
    left = flown.remaining[np.isfinite(flown.remaining)]
    return float(left.max()) if left.size else np.nan


def _px(left: float, digits: int) -> str:
    return f"{left:.{digits}g} px" if np.isfinite(left) else "unknown (all flights stopped early)"


def growth_with_start(flown: Flown) -> float:
    """Return the rank correlation of the error in the end with that at the start."""
    left = np.where(flown.remaining < SETTLED, 0.0, flown.remaining)
    return rank_correlation(flown.error[:, 0].tolist(), left.tolist())


def leaving(flown: Flown, found: Theorem, camera: Camera) -> Array:
    """Return in which flights (starts,) a point leaves the image of a camera."""
    image = to_normalised(found.vehicle.camera, samples(flown.flight, "features", "pixel"))
    seen = in_view(camera, image, samples(flown.flight, "depth", "point"))
    return np.asarray((~seen).any((-2, -1)))


def compact_set(evidence: Evidence) -> Judgement:
    """III-D.17: is the set where V̇ may be positive compact, and does V fall outside of it?"""
    found = evidence.theorem
    q = desired_pose(found.vehicle, found.target)
    unseen = 8 - int(np.linalg.matrix_rank(image_jacobian(found.vehicle, q, found.target.points)))
    name, at_rest = evidence.vehicle.name, "target at rest, set in v_c and e_a"
    of_q = judged(
        unseen == 0,
        f"J_Lq̇ = 0 in {unseen} directions of q̇, in which the set has no bound",
        directions_without_bound=float(unseen),
    )
    return over_cases(
        [
            Case(name, f"{MADE}, {at_rest}", of_rises(found.at_rest[:1])),
            Case(name, f"{DRAWN}, {at_rest}", of_rises(found.at_rest[1:])),
            Case(name, "set in the arguments of V, q̇ and e_a", of_q),
        ],
        "Before a target at rest the set is v_c = 0 and e_a = 0 for any λ, so V must not rise",
    )


def of_rises(sets: list[Flown]) -> Judgement:
    """Return whether V of the paper stays at or below its start in all flights of sets."""
    rising, flights = count(sets, rises)
    return of_resolved(
        sets,
        not rising,
        f"V rises above its start in {rising} of {flights} flights",
        sets_with_a_v_that_rises=sets_with(sets, rises),
    )


def rises(flown: Flown) -> Array:
    """Return in which flights (starts,) V of the paper gets above its start."""
    V = flown.found.over_time["lyapunov_paper"].to_numpy()
    return np.asarray(np.nanmax(V, axis=-1) > (1.0 + RESOLVED) * V[:, 0])


def convergence(evidence: Evidence) -> Judgement:
    """Judge III-D.18: do v_c and e_a converge to the printed set?"""
    found = evidence.theorem
    name, rest, λ = evidence.vehicle.name, "target at rest", lambda_of(found)
    steady = f"{MADE}, target at {SPEED:g} m/s"
    widths = [float(np.sqrt(np.linalg.cond(flown.gains["Kp"]))) for flown in found.sets]
    return over_cases(
        [
            Case(name, f"{MADE}, {rest}", of_excess(found.at_rest[:1], found)),
            Case(name, f"{DRAWN}, {rest}", of_excess(found.at_rest[1:], found)),
            Case(name, f"{steady}, R_max as printed", of_constant_velocity(found, λ)),
            Case(name, f"{steady}, R_max as corrected in III-D.16", within_corrected(found, λ)),
        ],
        "A V that falls outside a set leads into the smallest level set of V around it, which in "
        f"e_a alone is √cond(K_p) = {min(widths):.3g} to {max(widths):.3g} times wider",
    )


def of_excess(sets: list[Flown], found: Theorem) -> Judgement:
    """Return whether the excess of the printed expression over 0 goes to zero before a target at
    rest."""

    def outside(flown: Flown) -> Array:
        return stays_out(flown, found)

    staying, flights = count(sets, outside)
    return of_resolved(
        sets,
        not staying,
        f"the expression stays above the printed bound, 0, in {staying} of {flights} flights",
        sets_with_flights_outside=sets_with(sets, outside),
    )


def stays_out(flown: Flown, found: Theorem) -> Array:
    """Return from which starts (starts,) the printed expression does not go to zero."""
    excess = printed_expression(flown, found, float(np.linalg.norm(flown.gains["Kp"], 2)))
    left = excess[:, in_the_end(flown.flight)].max(-1)
    # NaN after an early end compares as not gone.
    return np.asarray(~(left <= GONE * np.nanmax(excess, axis=-1)))


def of_constant_velocity(found: Theorem, λ: float) -> Judgement:
    """Return whether the printed expression leaves its constant value for the printed bound, 0."""
    flown = found.steady
    bound = float(flown.found.bound["r_max"])
    last = printed_expression(flown, found, λ)[:, in_the_end(flown.flight)]
    stays = (last.min(-1) > (1.0 - GONE) * last.max(-1)) & (last.min(-1) > bound)
    staying, flights = count([flown], lambda _: stays)
    return of_resolved(
        [flown],
        not staying,
        f"R_max is {bound:g}, but v_c is not 0 while the camera follows. In {staying} of {flights} "
        f"flights the expression stays constant to 1 % in the last fifth, at "
        f"{np.median(last):.2g} W in the median",
        flights_outside_at_constant_velocity=float(staying),
    )


def within_corrected(found: Theorem, λ: float) -> Judgement:
    """Return whether the printed expression ends below the bound that the corrected r gives."""
    flown = found.steady
    last = printed_expression(flown, found, λ)[:, in_the_end(flown.flight)].max(-1)
    K_p = np.linalg.norm(flown.gains["Kp"], 2)
    bound = K_p**2 * corrected_r_max(flown, found) ** 2 / (2.0 * λ)
    outside, flights = count([flown], lambda _: ~(last <= bound))
    return of_resolved(
        [flown],
        not outside,
        f"with λ = {λ:.3g} W of III-D.15 the expression ends above the bound of {bound:.2g} W in "
        f"{outside} of {flights} flights",
        flights_outside_corrected_set=float(outside),
    )


def lambda_of(found: Theorem) -> float:
    """Return the largest λ [W] that fits the states of III-D.15 with gains made for the image."""
    states = [at for scale in rate_of_v.SCALES for at in rate_of_v.random_states(found, scale)]
    return float(rate_of_v.falls(found.made, states).min())


def printed_expression(flown: Flown, found: Theorem, λ: float) -> Array:
    """Return ½ v_cᵀK_dv_c + λ‖e_a‖² (starts, time) with v_c = J_L q̇."""
    flight, K_d = flown.flight, flown.gains["Kd"]
    v_c = (matrices(flown, found) @ samples(flight, "camera_twist", "twist")[..., None])[..., 0]
    e_a = flown.found.over_time["servo_error"].to_numpy()
    return np.asarray(0.5 * np.einsum("...i,ij,...j->...", v_c, K_d, v_c) + λ * e_a**2)


def matrices(flown: Flown, found: Theorem) -> Array:
    """Return L along the flights (starts, time, 2n, 6)."""
    image = to_normalised(found.vehicle.camera, samples(flown.flight, "features", "pixel"))
    return np.asarray(interaction_matrix(image, samples(flown.flight, "depth", "point")))


def corrected_r_max(flown: Flown, found: Theorem) -> float:
    """Return the bound of ‖r‖ as corrected, ‖C_d‖ ‖d(Lv_t)/dt‖ + (‖C_p‖ + ‖C_s‖/σ) ‖Lv_t‖.

    With the largest norms along the flights, of a target that does not turn.
    """
    _, e_dot, _ = errors(flown.flight, found.vehicle, flown.gains)
    twist = samples(flown.flight, "camera_twist", "twist")[..., None]
    of_target = e_dot + (matrices(flown, found) @ twist)[..., 0]
    rate = np.gradient(of_target, flown.flight["time"].to_numpy(), axis=-2)
    C_p, C_d, C_s = (np.linalg.norm(flown.gains[name], 2) for name in ("Cp", "Cd", "Cs"))
    first, second = (float(np.linalg.norm(each, axis=-1).max()) for each in (of_target, rate))
    return float(C_d * second + (C_p + C_s / flown.gains["sigma"]) * first)


def bound_of_error(evidence: Evidence) -> Judgement:
    """Judge III-D.19: does a bound of e in the end follow from one of e_a?"""
    rng = np.random.default_rng(19)
    trials = [ultimate_share(draw_gains(rng)) for _ in range(100)]
    found = evidence.theorem
    flown = [share_in_flight(each, found) for each in found.sets if each.made]
    last = f"{np.nanmax(flown):.2f}" if np.isfinite(flown).any() else "an unknown share (all stop)"
    view = of_resolved(
        [each for each in found.sets if each.made],
        max(trials) <= 1.0 and not (np.array(flown) > 1.0).any(),
        "with W = ½ eᵀC_de, Eq. (16) gives ‖e‖ ≤ √cond(C_d) (‖e_a‖ + ‖C_s‖√(2N))/λ_min(C_p) in "
        "the end, for any e(0), v_c and L. The reason given in the paper, a bounded ė, also needs "
        "depths that stay away from 0. An e_a that drives e outwards reaches at most "
        f"{max(trials):.2f} of this bound with {len(trials)} random sets of gains, and flights "
        f"with {MADE} {last}",
        largest_share_of_bound_in_trials=max(trials),
    )
    return over_cases([Case(evidence.vehicle.name, f"{MADE}, and {DRAWN}", view)])


def error_bound(gains: Gains, largest: float) -> float:
    """Return the bound of ‖e‖ in the end for an ‖e_a‖ of at most `largest`."""
    sliding = np.linalg.norm(gains["Cs"], 2) * np.sqrt(SIZE)
    skew = np.sqrt(np.linalg.cond(gains["Cd"]))
    return float(skew * (largest + sliding) / np.linalg.eigvalsh(gains["Cp"])[0])


def ultimate_share(gains: Gains, largest: float = 1.0) -> float:
    """Return the final e from 100 times its bound, as a share of it, under an e_a along e.

    Implicit Euler in the linear terms, stable at any step, until the slowest mode has decayed.
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
    """Return the largest ‖e‖ in the end of flights as a share of the bound from their own e_a.

    NaN where all of them stopped early, or are not resolved.
    """
    e, _, e_a = errors(flown.flight, found.vehicle, flown.gains)
    left = np.linalg.norm(e, axis=-1)[:, in_the_end(flown.flight)].max(-1)
    left = np.where(flown.resolved, left, np.nan)
    largest = np.linalg.norm(e_a, axis=-1).max(-1)
    ended = np.isnan(left)
    if ended.all():
        return np.nan
    of_bound = [error_bound(flown.gains, each) for each in largest[~ended]]
    return float((left[~ended] / of_bound).max())


JUDGES = {
    "III-D.13": theorem,
    **rate_of_v.JUDGES,
    "III-D.17": compact_set,
    "III-D.18": convergence,
    "III-D.19": bound_of_error,
}
"""Judge of every sentence on the theorem and its proof, by its id."""
