"""Judges of the sections on kinematics, III-A and III-B, and of Appendix A.

The threshold of Remark 1 is off here, and the arm's base sits beside the UAV's centre, so that no
offset is missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from continuair import equations
from continuair.equations.kinematics import skew
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import as_printed, near_straight
from continuair.studies.paper.judges.agreement import (
    AGREES,
    SLOPES_AGREE,
    apart,
    largest_gap,
    lowest_powers,
    partial,
    random_states,
    rate,
    spin_of,
)
from continuair.studies.verdicts import Judgement, all_of, judged
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

OFFSET = np.array([0.03, -0.05, 0.04])
"""Where the arm's base sits on the UAV here [arm lengths]."""

_STEPS = 500


def arc_of_constant_curvature(evidence: Evidence) -> Judgement:
    """III-A.4: are Eqs. (1) and (2) the points of a circular arc?"""
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
        "the printed point and the integrated tangent of a circular arc from the offset P_o differ "
        f"by less than {worst:.0e} of the distance; the arc starts along +z of the base frame",
        largest_relative_difference=worst,
    )


def integrated_arcs(s: float, κ: Array, ψa: Array) -> Array:
    """Points (n, 3) at s [m] of arcs from OFFSET: P' = T, T' = κ N, N' = -κ T, by RK4."""
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
    """III-A.6: is the rate of Eq. (1) what Eq. (3) says?"""
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
        f"with ψ̇a for the rate whose index is missing, the sum of Eq. (3) and differences of Eq. "
        f"(1) in time differ by less than {worst:.0e}",
        largest_relative_difference=worst,
    )


def jacobian_of_equation_2(evidence: Evidence) -> Judgement:
    """III-A.7: are the entries of Appendix A the derivatives of Eq. (2)?"""
    s = evidence.vehicle.arm.length
    up, hanging = (_entries_that_agree(evidence.vehicle, s, sign) for sign in (1.0, -1.0))
    return judged(
        up == 6,
        f"{up} of the six entries are derivatives of Eq. (2); ∂z/∂κ has the other sign: Appendix A "
        f"belongs to z = −sin(κs)/κ, an arm that hangs, with which {hanging} agree",
        entries_that_agree=float(up),
        entries_that_agree_if_z_is_reversed=float(hanging),
    )


def _entries_that_agree(vehicle: Vehicle, s: float, sign: float) -> int:
    """How many entries of Appendix A are slopes of Eq. (2), its z times a sign, at every state."""
    vehicle, at = _regular(vehicle), _printed_point(s)
    agree = np.ones((3, 2), bool)
    for q, _ in random_states(s):
        printed, _ = equations.arm_jacobian(vehicle, q, s)
        slopes = np.column_stack([partial(at, q, index) for index in (6, 7)])
        slopes *= np.array([[1.0], [1.0], [sign]])
        agree &= np.abs(printed - slopes) <= AGREES * np.linalg.norm(slopes)
    return int(agree.sum())


def rate_of_a_section(evidence: Evidence) -> Judgement:
    """III-A.8: is the rate of R_s the sum in Eq. (4), and is it in so(3)?"""
    s = evidence.vehicle.arm.length
    sums, rates, products = [], [], []
    for section in (_section(s, frame) for frame in ("frenet", "untwisted")):
        for q, qd in random_states(s):
            found = rate(section, q, qd)
            summed = sum(partial(section, q, index) * qd[index] for index in (6, 7))
            sums.append(apart(summed, found))
            rates.append(_symmetric_share(found))
            products.append(_symmetric_share(found @ section(q).T))
    worst, product = largest_gap(sums, SLOPES_AGREE), largest_gap(products, SLOPES_AGREE)
    share = float(np.median(rates))
    return all_of(
        [
            judged(
                worst <= SLOPES_AGREE,
                f"Ṙ_s is the sum in Eq. (4), to {worst:.0e}",
                largest_relative_difference=worst,
            ),
            judged(
                max(rates) <= SLOPES_AGREE,
                f"so(3) asks for a skew Ṙ_s; its symmetric part is {share:.2g} of it, in the "
                "median of two frames, as the paper prints no R_s",
                median_symmetric_share=share,
            ),
        ],
        f"The other reading, Ṙ_s R_sᵀ, is skew to {product:.0e}",
    )


def rotational_jacobian(evidence: Evidence) -> Judgement:
    """III-A.10: are both columns of Eq. (5) the spin of one frame?"""
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
        "both columns are the spin of the frame that turns about the tangent with ψa, for an arm "
        f"as Eq. (2) draws it (to {worst['frenet', 1.0]:.0e}). They are not that of the hanging "
        f"arm of Appendix A (off by {worst['frenet', -1.0]:.2g}) nor that of a frame that follows "
        f"the material of a tendon-driven arm (off by up to {worst['untwisted', 1.0]:.2g})",
        **{
            f"largest relative difference, {frame} frame, arm {'up' if sign > 0 else 'down'}": value
            for (frame, sign), value in worst.items()
        },
    )


def linear_jacobian(evidence: Evidence) -> Judgement:
    """III-B.3: does J_p as printed give the velocity of a point?"""
    vehicle = _regular(evidence.vehicle)
    s = vehicle.arm.length

    def point(q: Array) -> Array:
        return equations.position(vehicle, q, s)

    def columns(q: Array) -> Array:
        return equations.jacobian(vehicle, q, s)[:3]

    return _with_printed_inverse("J_p", s, columns, lambda q, qd: rate(point, q, qd))


def angular_jacobian(evidence: Evidence) -> Judgement:
    """III-B.4: does J_o as printed give the angular velocity of a section?"""
    s = evidence.vehicle.arm.length
    section = _section(s, "frenet")

    def turned(q: Array) -> Array:
        return equations.rotation(q) @ section(q)

    def columns(q: Array) -> Array:
        of_arm = as_printed.rotational_columns(s, q[7])
        R, T = equations.rotation(q), equations.euler_rate_matrix(q)
        return np.hstack([np.zeros((3, 3)), T, R @ of_arm])

    def spin(q: Array, qd: Array) -> Array:
        return spin_of(rate(turned, q, qd) @ turned(q).T)

    return _with_printed_inverse("J_o (the second J_p3 read as J_o3)", s, columns, spin)


def _with_printed_inverse(
    name: str,
    s: float,
    columns: Callable[[Array], Array],
    right: Callable[[Array, Array], Array],
) -> Judgement:
    """Hold a Jacobian with the printed T_e⁻¹ against a rate: T_e in axes of the world or the UAV.

    s: the arm's length [m]. columns: the Jacobian with T_e itself, in axes of the world, in its
    place.
    """
    worst, medians = {}, {}
    for reading, matrix in READINGS_OF_T_E.items():
        differences = [
            apart(replaced(columns(q), q, matrix(q)) @ qd, right(q, qd))
            for q, qd in random_states(s)
        ]
        worst[reading], medians[reading] = max(differences), float(np.median(differences))
    printed = ("T_e⁻¹ in axes of the world", "T_e⁻¹ in axes of the UAV")
    itself = largest_gap([worst["T_e in axes of the world"]], SLOPES_AGREE)
    return judged(
        any(worst[reading] <= SLOPES_AGREE for reading in printed),
        f"with the printed T_e⁻¹, T_e taking Euler rates to angular velocity, {name} errs by "
        f"{medians[printed[0]]:.2g} of the rate in the median (T_e in axes of the inertial frame) "
        f"or {medians[printed[1]]:.2g} (of the UAV). With T_e itself, in axes of the inertial "
        f"frame, it errs by less than {itself:.0e}",
        **{f"median relative error, {reading}": medians[reading] for reading in printed},
        largest_relative_error_with_T_e=itself,
    )


def replaced(columns: Array, q: Array, matrix: Array) -> Array:
    """A Jacobian in which another matrix stands for T_e."""
    changed = columns.copy()
    changed[:, 3:6] = columns[:, 3:6] @ np.linalg.inv(equations.euler_rate_matrix(q)) @ matrix
    return changed


def body_rate_matrix(q: Array) -> Array:
    """Euler rates to angular velocity in axes of the UAV."""
    return equations.rotation(q).T @ equations.euler_rate_matrix(q)


READINGS_OF_T_E: dict[str, Callable[[Array], Array]] = {
    "T_e in axes of the world": equations.euler_rate_matrix,
    "T_e⁻¹ in axes of the world": lambda q: np.linalg.inv(equations.euler_rate_matrix(q)),
    "T_e⁻¹ in axes of the UAV": lambda q: np.linalg.inv(body_rate_matrix(q)),
}
"""What stands in the columns of the Euler rates of J_p and J_o, by the reading."""


def euler_rate_mapping(evidence: Evidence) -> Judgement:
    """III-B.5: is the ZYX mapping of Euler rates the one that J_p2 and J_o2 need?"""
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
        "T_e, the ZYX mapping from Euler rates to angular velocity in axes of the inertial frame, "
        f"makes J_p2 = −[R P_s]× T_e and J_o2 = T_e right to {worst:.0e}; in axes of the UAV it "
        f"would err by {np.median(errors['UAV']):.2g} in the median",
        largest_relative_error_in_axes_of_the_world=worst,
        median_relative_error_in_axes_of_the_uav=float(np.median(errors["UAV"])),
    )


def appendix_a(evidence: Evidence) -> Judgement:
    """App-A.1: is the matrix the Jacobian of a hanging arm, with finite limits?"""
    vehicle = _regular(evidence.vehicle)
    s = vehicle.arm.length
    worst = {}
    for arm, sign in (("hangs", -1.0), ("points up", 1.0)):
        at = _printed_point(s, sign)
        worst[arm] = max(_entry_error(vehicle, q, at) for q, _ in random_states(s))
    lowest = lowest_powers(
        lambda κ: equations.arm_jacobian(vehicle, np.array([0] * 6 + [κ, 0.4]), s)[0], 0.5 / s
    )
    agrees = largest_gap([worst["hangs"]], SLOPES_AGREE)
    return judged(
        agrees <= SLOPES_AGREE and float(np.nanmin(lowest)) >= 0.0,
        "for an arm that hangs, as the conclusions have it, the six entries are the slopes of the "
        f"point's position to {agrees:.0e}; for one that points up they are off by "
        f"{worst['points up']:.2g}. No entry has a negative power of κ, so the limits are finite, "
        "and that of the column of ψa is 0. The text calls the matrix J_pa",
        largest_relative_difference=agrees,
        largest_relative_difference_of_an_arm_that_points_up=worst["points up"],
        lowest_power_of_kappa=float(np.nanmin(lowest)),
    )


def _entry_error(vehicle: Vehicle, q: Array, at: Callable[[Array], Array]) -> float:
    """Largest difference of an entry of Appendix A from the slope, over the column's length."""
    printed, _ = equations.arm_jacobian(vehicle, q, vehicle.arm.length)
    slopes = np.column_stack([rate(at, q, np.eye(8)[index]) for index in (6, 7)])
    return float((np.abs(printed - slopes) / np.linalg.norm(slopes, axis=0)).max())


def _regular(vehicle: Vehicle) -> Vehicle:
    """The vehicle without Remark 1, the arm's base beside the UAV's centre."""
    return vehicle.replace({"arm.kappa_s": 0.0, "uav.mount": vehicle.arm.length * OFFSET})


def _printed_point(s: float, sign: float = 1.0) -> Callable[[Array], Array]:
    """Eqs. (1) and (2) as a function of q; sign -1 lets the arm hang."""

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
    """Angular velocity per rate of κ and of ψa, (3, 2), in axes of the base."""
    return np.column_stack([spin_of(partial(section, q, k) @ section(q).T) for k in (6, 7)])


def _symmetric_share(matrix: Array) -> float:
    """The norm of a matrix' symmetric part over that of the matrix."""
    return float(np.linalg.norm(0.5 * (matrix + matrix.T)) / np.linalg.norm(matrix))


JUDGES = {
    "III-A.4": arc_of_constant_curvature,
    "III-A.6": velocity_of_a_point,
    "III-A.7": jacobian_of_equation_2,
    "III-A.8": rate_of_a_section,
    "III-A.10": rotational_jacobian,
    **near_straight.JUDGES,
    "III-B.3": linear_jacobian,
    "III-B.4": angular_jacobian,
    "III-B.5": euler_rate_mapping,
    "App-A.1": appendix_a,
}
"""Judge of every sentence of these sections, by its id."""
