"""Judges of the sections on kinematics, III-A and III-B, and of Appendix A.

The threshold of Remark 1 is off here, and the arm's base sits beside the UAV's centre, so that no
offset is missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import as_printed, near_straight
from amiri2026.paper.judges.agreement import (
    AGREES,
    SLOPES_AGREE,
    apart,
    as_formula,
    largest_gap,
    lowest_powers,
    partial,
    random_states,
    rate,
    spin_of,
)
from amiri2026.verdicts import Judgement, all_of, judged, or_misprint
from continuair import Vehicle, equations
from continuair.equations import skew

Array = np.ndarray

OFFSET = np.array([0.03, -0.05, 0.04])
"""Where the arm's base sits on the UAV here [arm lengths]."""

_STEPS = 500

Columns = Callable[[Array], Array]
"""A Jacobian as a function of q."""

Rate = Callable[[Array, Array], Array]
"""A rate as a function of q and q̇."""


def arc_of_constant_curvature(evidence: Evidence) -> Judgement:
    """Judge III-A.4: are Eqs. (1) and (2) the points of a circular arc?"""
    s = evidence.vehicle.arm.length
    at = np.array([q[6:] for q, _ in random_states(s)])
    arcs = integrated_arcs(s, *at.T)
    worst = largest_gap(
        (
            apart(as_printed.position(s * OFFSET, s, *bend), arc)
            for bend, arc in zip(at, arcs, strict=True)
        ),
        AGREES,
    )
    return judged(
        worst <= AGREES,
        "Eqs. (1) and (2) and the integrated tangent of a circular arc from P_o differ by at most "
        f"{worst:.0e} of the distance. The arc starts along +z of the base frame",
        largest_relative_difference=worst,
    )


def integrated_arcs(s: float, κ: Array, ψa: Array) -> Array:
    """Return points (n, 3) at s [m] of arcs from OFFSET: P' = T, T' = κ N, N' = -κ T, by RK4."""
    nil, one = np.zeros_like(κ), np.ones_like(κ)
    along = np.moveaxis(np.array([[nil, one, nil], [nil, nil, κ], [nil, -κ, nil]]), -1, 0)
    y = np.empty((len(κ), 3, 3))
    y[:, 0], y[:, 1] = s * OFFSET, [0.0, 0.0, 1.0]
    y[:, 2] = np.column_stack([np.cos(ψa), np.sin(ψa), nil])
    h = s / _STEPS
    for _ in range(_STEPS):
        k1 = along @ y
        k2 = along @ (y + h / 2 * k1)
        k3 = along @ (y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + along @ (y + h * k3))
    return y[:, 0]


def velocity_of_a_point(evidence: Evidence) -> Judgement:
    """Judge III-A.6: is the rate of Eq. (1) what Eq. (3) says?"""
    s = evidence.vehicle.arm.length
    at = _printed_point(s)
    worst = largest_gap(
        (
            apart(partial(at, q, 6) * qd[6] + partial(at, q, 7) * qd[7], rate(at, q, qd))
            for q, qd in random_states(s)
        ),
        SLOPES_AGREE,
    )
    return judged(
        worst <= SLOPES_AGREE,
        "with ψ̇a for the rate whose index is missing, Eq. (3) and differences of Eq. (1) in time "
        f"differ by at most {worst:.0e} of the velocity",
        largest_relative_difference=worst,
    )


def jacobian_of_equation_2(evidence: Evidence) -> Judgement:
    """Judge III-A.7: are the entries of Appendix A the derivatives of Eq. (2)?"""
    s = evidence.vehicle.arm.length
    up, hanging = (entry_gaps(s, sign) for sign in (1.0, -1.0))
    agree = [int((gaps <= AGREES).sum()) for gaps in (up, hanging)]
    printed, corrected = float(up.max()), largest_gap(hanging.ravel(), AGREES)
    found = judged(
        agree[0] == 6,
        f"{agree[0]} of the six entries of Appendix A are derivatives of Eq. (2). The other, "
        "∂z/∂κ, has the opposite sign",
        entries_that_agree=float(agree[0]),
        entries_that_agree_if_z_is_reversed=float(agree[1]),
        largest_difference_as_printed_over_column=printed,
        largest_difference_if_z_is_reversed_over_column=corrected,
    )
    return or_misprint(
        found,
        "Eq. (2) with z = −sin(κs)/κ, an arm that hangs, as Appendices A and B have it; the first "
        "column of Eq. (5) then changes its sign too. The largest difference of an entry from the "
        f"derivative is {printed:.2g} of the column as printed, and at most {corrected:.0e} with "
        "this sign",
    )


def entry_gaps(s: float, sign: float) -> Array:
    """Return by entry (3, 2) the largest difference of Appendix A from the slopes of Eq. (2).

    Over the norm of the column, at random states. s [m]; sign: by which z of Eq. (2) is multiplied.
    """
    at = _printed_point(s, sign)
    found = []
    for q, _ in random_states(s):
        slopes = np.column_stack([partial(at, q, index) for index in (6, 7)])
        gaps = np.abs(as_printed.appendix_a(s, q[6], q[7]) - slopes)
        found.append(gaps / np.linalg.norm(slopes, axis=0))
    return np.max(found, axis=0)


def rate_of_a_section(evidence: Evidence) -> Judgement:
    """Judge III-A.8: is the rate of R_s the sum in Eq. (4), and is it in so(3)?"""
    s = evidence.vehicle.arm.length
    sums, rates, products = [], [], []
    for section in (_section(s, frame) for frame in ("frenet", "untwisted")):
        for q, qd in random_states(s):
            turning = rate(section, q, qd)
            summed = sum(partial(section, q, index) * qd[index] for index in (6, 7))
            sums.append(apart(summed, turning))
            rates.append(_symmetric_share(turning))
            products.append(_symmetric_share(turning @ section(q).T))
    worst, product = largest_gap(sums, SLOPES_AGREE), largest_gap(products, SLOPES_AGREE)
    share = float(np.median(rates))
    found = all_of(
        [
            judged(
                worst <= SLOPES_AGREE,
                f"Ṙ_s is the sum in Eq. (4) to {worst:.0e}",
                largest_relative_difference=worst,
            ),
            judged(
                max(rates) <= SLOPES_AGREE,
                "an element of so(3) is skew-symmetric; the symmetric part of Ṙ_s is "
                f"{share:.2g} of its norm (median over two frames; the paper prints no R_s)",
                median_symmetric_share=share,
                largest_symmetric_share_of_the_product=product,
            ),
        ]
    )
    return or_misprint(
        found,
        "Ṙ_s R_sᵀ ∈ so(3), from which Eq. (5) follows. The symmetric part is "
        f"{share:.2g} of Ṙ_s (printed), and at most {product:.0e} of Ṙ_s R_sᵀ",
    )


def rotational_jacobian(evidence: Evidence) -> Judgement:
    """Judge III-A.10: are both columns of Eq. (5) the spin of one frame?"""
    s = evidence.vehicle.arm.length
    worst = {
        (frame, sign): largest_gap(
            (
                apart(as_printed.rotational_columns(s, q[7]), _spin(_section(s, frame, sign), q))
                for q, _ in random_states(s)
            ),
            AGREES,
        )
        for frame in ("frenet", "untwisted")
        for sign in (1.0, -1.0)
    }
    fitting = min(worst, key=lambda reading: worst[reading])
    return judged(
        worst[fitting] <= AGREES,
        "both columns are the angular velocity of the Frenet–Serret frame, which turns about the "
        f"tangent with ψa, for an arm as Eq. (2) prints it (to {worst['frenet', 1.0]:.0e}). For "
        f"the hanging arm of Appendix A they differ by {worst['frenet', -1.0]:.2g} (the first "
        "column changes its sign, III-A.7), and for the untwisted frame of a tendon-driven arm by "
        f"up to {worst['untwisted', 1.0]:.2g}",
        **{
            f"largest relative difference, {frame} frame, arm {'up' if sign > 0 else 'down'}": value
            for (frame, sign), value in worst.items()
        },
    )


def jacobian_of_a_section(evidence: Evidence) -> Judgement:
    """Judge III-B.3: do J_p and J_o as printed give velocity and angular velocity of a section?"""
    vehicle = _regular(evidence.vehicle)
    parts = _parts_of_the_jacobian(vehicle)
    errors = {name: _errors_by_matrix(vehicle.arm.length, *of) for name, of in parts.items()}
    printed = ("T_e⁻¹ in axes of the world", "T_e⁻¹ in axes of the UAV")
    median = {
        (name, axes): float(np.median(errors[name][axes])) for name in parts for axes in printed
    }
    itself = largest_gap(
        (error for name in parts for error in errors[name]["T_e in axes of the world"]),
        SLOPES_AGREE,
    )
    found = judged(
        any(max(max(errors[name][axes]) for name in parts) <= SLOPES_AGREE for axes in printed),
        "with the printed T_e⁻¹ the median error is "
        f"{median['J_p', printed[0]]:.2g} of the velocity from J_p and "
        f"{median['J_o', printed[0]]:.2g} of the angular velocity from J_o, if T_e gives angular "
        f"velocity in axes of the inertial frame, and {median['J_p', printed[1]]:.2g} and "
        f"{median['J_o', printed[1]]:.2g} in axes of the UAV (the second J_p3 is read as J_o3)",
        **{f"median relative error of {name}, {axes}": median[name, axes] for name, axes in median},
        largest_relative_error_with_T_e=itself,
    )
    return or_misprint(
        found,
        "T_e in place of T_e⁻¹ in J_p2 and J_o2, in axes of the inertial frame (or T_e defined as "
        "the inverse, from angular velocity to Euler rates). The median error is "
        f"{median['J_p', printed[0]]:.2g} (J_p) and {median['J_o', printed[0]]:.2g} (J_o) as "
        f"printed; with T_e the largest is {itself:.0e}",
    )


def _parts_of_the_jacobian(vehicle: Vehicle) -> dict[str, tuple[Columns, Rate]]:
    """Return J_p and J_o with T_e in world axes, and the rates that they should give."""
    s = vehicle.arm.length
    section = _section(s, "frenet")

    def turned(q: Array) -> Array:
        return equations.rotation(q) @ section(q)

    def linear(q: Array) -> Array:
        return equations.jacobian(vehicle, q, s)[:3]

    def angular(q: Array) -> Array:
        of_arm = as_printed.rotational_columns(s, q[7])
        R, T = equations.rotation(q), equations.euler_rate_matrix(q)
        return np.hstack([np.zeros((3, 3)), T, R @ of_arm])

    def velocity(q: Array, qd: Array) -> Array:
        return rate(lambda at: equations.position(vehicle, at, s), q, qd)

    def spin(q: Array, qd: Array) -> Array:
        return spin_of(rate(turned, q, qd) @ turned(q).T)

    return {"J_p": (linear, velocity), "J_o": (angular, spin)}


def _errors_by_matrix(s: float, columns: Columns, right: Rate) -> dict[str, list[float]]:
    """Return relative errors of a Jacobian at random states, by the matrix in place of T_e.

    s: the arm's length [m]. columns: the Jacobian with T_e in world axes. right: the rate that it
    should give, of q and q̇.
    """
    return {
        reading: [
            apart(replaced(columns(q), q, matrix(q)) @ qd, right(q, qd))
            for q, qd in random_states(s)
        ]
        for reading, matrix in READINGS_OF_T_E.items()
    }


def replaced(columns: Array, q: Array, matrix: Array) -> Array:
    """Return a Jacobian in which another matrix stands for T_e."""
    changed = columns.copy()
    changed[:, 3:6] = columns[:, 3:6] @ np.linalg.inv(equations.euler_rate_matrix(q)) @ matrix
    return changed


def body_rate_matrix(q: Array) -> Array:
    """Return Euler rates to angular velocity in axes of the UAV."""
    return equations.rotation(q).T @ equations.euler_rate_matrix(q)


READINGS_OF_T_E: dict[str, Callable[[Array], Array]] = {
    "T_e in axes of the world": equations.euler_rate_matrix,
    "T_e⁻¹ in axes of the world": lambda q: np.linalg.inv(equations.euler_rate_matrix(q)),
    "T_e⁻¹ in axes of the UAV": lambda q: np.linalg.inv(body_rate_matrix(q)),
}
"""Factors in the columns of the Euler rates of J_p and J_o, by the reading."""


def euler_rate_mapping(evidence: Evidence) -> Judgement:
    """Judge III-B.5: is the ZYX mapping of Euler rates the one that J_p2 and J_o2 need?"""
    vehicle = _regular(evidence.vehicle)
    s = vehicle.arm.length
    errors: dict[str, list[float]] = {"world": [], "UAV": []}
    for q, qd in random_states(s):
        turning = np.concatenate([np.zeros(3), qd[3:6], np.zeros(2)])
        velocity = rate(lambda q: equations.position(vehicle, q, s), q, turning)
        spin = spin_of(rate(equations.rotation, q, turning) @ equations.rotation(q).T)
        lever = equations.position(vehicle, q, s) - q[:3]
        matrices = {"world": equations.euler_rate_matrix(q), "UAV": body_rate_matrix(q)}
        for axes, T in matrices.items():
            found = np.concatenate([-skew(lever) @ T @ qd[3:6], T @ qd[3:6]])
            errors[axes].append(apart(found, np.concatenate([velocity, spin])))
    worst = largest_gap(errors["world"], SLOPES_AGREE)
    return judged(
        worst <= SLOPES_AGREE,
        "with T_e from ZYX Euler rates to angular velocity in axes of the inertial frame, "
        f"J_p2 = −[R P_s]× T_e and J_o2 = T_e are right to {worst:.0e}. With T_e in axes of the "
        f"UAV the median error is {np.median(errors['UAV']):.2g}",
        largest_relative_error_in_axes_of_the_world=worst,
        median_relative_error_in_axes_of_the_uav=float(np.median(errors["UAV"])),
    )


def appendix_a(evidence: Evidence) -> Judgement:
    """Judge app-A.1: is the matrix the Jacobian of a hanging arm, with finite limits?"""
    s = evidence.vehicle.arm.length
    hangs = largest_gap(entry_gaps(s, -1.0).ravel(), AGREES)
    points_up = float(entry_gaps(s, 1.0).max())
    lowest = lowest_powers(lambda κ: as_printed.appendix_a(s, κ, 0.4), 0.5 / s)
    return judged(
        hangs <= AGREES and float(np.nanmin(lowest)) >= 0.0,
        "for an arm that hangs, as the conclusions say, the six entries are the slopes of a "
        f"point's position to {hangs:.0e} of the column (for one that points up they differ by "
        f"{points_up:.2g}). No entry has a negative power of κ, so the limits are finite; the "
        "column of ψa tends to 0. The text calls the matrix J_pa",
        largest_relative_difference=hangs,
        largest_relative_difference_of_an_arm_that_points_up=points_up,
        lowest_power_of_kappa=float(np.nanmin(lowest)),
    )


def _regular(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle without Remark 1, the arm's base beside the UAV's centre."""
    return vehicle.replace({"arm.kappa_s": 0.0, "uav.mount": vehicle.arm.length * OFFSET})


def _printed_point(s: float, sign: float = 1.0) -> Callable[[Array], Array]:
    """Return Eqs. (1) and (2) as a function of q; with sign -1 the arm hangs."""

    def at(q: Array) -> Array:
        return as_printed.position(s * OFFSET, s, q[6], q[7]) * [1.0, 1.0, sign]

    return at


def _section(s: float, frame: str, sign: float = 1.0) -> Callable[[Array], Array]:
    """R_s as a function of q, of an arm that points up as Eq. (2) draws it, or hangs (sign -1)."""

    def at(q: Array) -> Array:
        nil = 0.0 * q[6]
        bent = equations.rotation(np.array([nil, nil, nil, nil, sign * q[6] * s, q[7]]))
        back = equations.rotation(np.array([nil, nil, nil, nil, nil, -q[7]]))
        return bent @ back if frame == "untwisted" else bent

    return at


def _spin(section: Callable[[Array], Array], q: Array) -> Array:
    """Return angular velocity per rate of κ and of ψa, (3, 2), in axes of the base."""
    return np.column_stack([spin_of(partial(section, q, k) @ section(q).T) for k in (6, 7)])


def _symmetric_share(matrix: Array) -> float:
    """Return the norm of a matrix' symmetric part over that of the matrix."""
    return float(np.linalg.norm(0.5 * (matrix + matrix.T)) / np.linalg.norm(matrix))


JUDGES = {
    "III-A.4": as_formula(arc_of_constant_curvature),
    "III-A.6": as_formula(velocity_of_a_point),
    "III-A.7": jacobian_of_equation_2,
    "III-A.8": rate_of_a_section,
    "III-A.10": as_formula(rotational_jacobian),
    **near_straight.JUDGES,
    "III-B.3": jacobian_of_a_section,
    "III-B.5": as_formula(euler_rate_mapping),
    "App-A.1": as_formula(appendix_a),
}
"""Judge of every sentence of these sections, by its id."""
