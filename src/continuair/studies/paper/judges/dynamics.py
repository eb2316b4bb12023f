"""Judges of the section on dynamics, III-C."""

from __future__ import annotations

import math

import numpy as np

from continuair import equations
from continuair.analysis.shares import percent
from continuair.scenario.paper_tests import OPEN_LOOP_TESTS, open_loop_test
from continuair.studies.extremes import largest
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import coupling_elements
from continuair.studies.paper.judges.agreement import (
    AGREES,
    SLOPES_AGREE,
    apart,
    largest_gap,
    partial,
    random_states,
    rate,
    spin_of,
)
from continuair.studies.paper.judges.coupling_elements import significant, uav_arm_block
from continuair.studies.paper.judges.disks import (
    MASS,
    RADII,
    SPACING,
    errors_of_tests,
    shares_of_energy,
    with_disks,
)
from continuair.studies.paper.judges.elementwise import Elementwise
from continuair.studies.paper.judges.words import NEGLIGIBLE, SAME
from continuair.studies.verdicts import UNDECIDED, Judgement, all_of, judged
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

_BALANCES = 25
"""States at which the balance of power is taken."""


def power_balance(evidence: Evidence) -> Judgement:
    """III-C.3: is the power of Eq. (10) that of τ and of a wrench which acts on the tip?"""
    vehicle = evidence.vehicle.replace(
        {"arm.kappa_s": 0.0, "arm.damping": 0.0, "arm.damping_ratio": None}
    )
    rng = np.random.default_rng(0)
    gaps: dict[int, list[float]] = {-1: [], 1: []}
    for q, qd in random_states(vehicle.arm.length, _BALANCES):
        tau, wrench = rng.normal(size=8), rng.normal(size=6)
        by_torque = float(tau @ qd)
        by_wrench = float(wrench @ equations.jacobian(vehicle, q, vehicle.arm.length) @ qd)
        for sign, found in gaps.items():
            qdd = equations.forward_dynamics(vehicle, q, qd, tau, wrench, tip_wrench_sign=sign)
            gap = power(vehicle, q, qd, qdd) - by_torque - by_wrench
            found.append(abs(gap) / abs(by_wrench))
    closed = {sign: largest_gap(found, AGREES) for sign, found in gaps.items()}
    printed = float(np.median(gaps[-1]))
    return judged(
        closed[-1] <= AGREES,
        f"with −J_tᵀ F_e the change of K + U misses the power of τ and of a wrench F_e exerted on "
        f"the tip, the text's words, by {printed:.2g} times the power of F_e; with +J_tᵀ F_e it "
        f"meets it to {closed[1]:.0e}. The printed sign is that of the wrench which the tip exerts "
        "on the environment",
        gap_over_power_of_F_e_with_the_printed_sign=printed,
        gap_over_power_of_F_e_with_the_other_sign=closed[1],
    )


def power(vehicle: Vehicle, q: Array, qd: Array, qdd: Array) -> float:
    """The rate of K + U of Eqs. (8) and (9) [W], U by its own slopes."""
    mass_rate = np.imag(equations.mass_matrix(vehicle, q + 1e-30j * qd)) / 1e-30
    slopes = [partial(lambda x: equations.potential_energy(vehicle, x), q, i) for i in range(8)]
    M = equations.mass_matrix(vehicle, q)
    return float(qd @ M @ qdd + 0.5 * qd @ mass_rate @ qd + np.array(slopes) @ qd)


def readings_of_decoupled(evidence: Evidence) -> Judgement:
    """III-C.5: do zeroed elements and zeroed blocks give one decoupled model?"""
    model = Elementwise(evidence.vehicle)
    block, element = {}, {}
    for test, flown in evidence.open_loop.datasets.items():
        coupled = flown["tip_position"].sel(model="coupled").transpose("time", "axis")
        coupled = coupled.isel(time=slice(None, None, 10))
        path = model.tip_path(open_loop_test(test), coupled["time"].to_numpy())
        gap = path - coupled.to_numpy()
        element[test] = float(np.sqrt((gap**2).sum(axis=1).mean()))
        block[test] = float(evidence.open_loop.results["tests"][test]["decoupled"]["rmse_t_m"])
    ratios = {test: element[test] / block[test] for test in OPEN_LOOP_TESTS}
    # Where the arm passes straight, in C and D, ψa spins, and the digits hang on the step.
    told = ", ".join(
        f"{test} {ratio:.2g}" if test in "AB" else f"{test} about {ratio:.1g}"
        for test, ratio in ratios.items()
    )
    return judged(
        all(abs(ratio - 1.0) <= SAME for ratio in ratios.values()),
        "the tip's error with every off-diagonal element zeroed is, over that with only the "
        f"blocks between UAV and arm zeroed, {told}. With the elements between position and "
        "attitude zero, the 100 N of Test A do not turn the UAV",
        **{f"error, elements over blocks, Test {test}": ratios[test] for test in "AB"},
    )


def axes_of_the_tip(evidence: Evidence) -> Judgement:
    """III-C.6: is J at s = l_a the tip's twist in axes of the tip?"""
    vehicle = evidence.vehicle.replace({"arm.kappa_s": 0.0})
    s = vehicle.arm.length
    found = {
        frame: [
            apart(equations.jacobian(vehicle, q, s, frame) @ qd, twist(vehicle, q, qd, frame))
            for q, qd in random_states(s)
        ]
        for frame in ("untwisted", "frenet")
    }
    medians = [float(np.median(gaps)) for gaps in found.values()]
    return judged(
        any(max(gaps) <= SLOPES_AGREE for gaps in found.values()),
        "with J_p1 = I the velocity is in axes of the inertial frame, at every attitude; the twist "
        f"in axes of the tip differs from it by {medians[0]:.2g} of its norm in the median, for "
        f"the untwisted frame ({medians[1]:.2g} for that of Eq. (5)): a rotation is missing",
        median_relative_difference=medians[0],
    )


def twist(vehicle: Vehicle, q: Array, qd: Array, frame: str) -> Array:
    """Velocity and angular velocity (6,) of the tip in axes of its frame, by differences."""
    s = vehicle.arm.length

    def axes(at: Array) -> Array:
        return equations.rotation(at) @ equations.section_rotation(vehicle, at, s, frame)

    velocity = rate(lambda at: equations.position(vehicle, at, s), q, qd)
    return np.concatenate([axes(q).T @ velocity, spin_of(axes(q).T @ rate(axes, q, qd))])


def assumption_on_disks(evidence: Evidence) -> Judgement:
    """III-C.15: do disks count for little in the energies and in the errors?"""
    vehicle = evidence.vehicle
    parts = []
    for radius in RADII:
        thick = vehicle.replace({"arm.radius": radius})
        shares = {test: shares_of_energy(thick, test) for test in OPEN_LOOP_TESTS}
        worst = largest(of_arm.larger for of_arm, _ in shares.values())
        of_arm, of_all = (each.kinetic for each in shares["B"])
        name = f"radius {1e3 * radius:g} mm"
        parts.append(
            judged(
                worst < NEGLIGIBLE,
                f"{name}: up to {percent(worst)} of an energy of the arm ({percent(of_all)} of the "
                "vehicle's kinetic energy in free fall)",
                **{f"share of the arm's kinetic energy in Test B, {name}": of_arm},
            )
        )
    bare, full = (errors_of_tests(each) for each in (vehicle, with_disks(vehicle)))
    change = largest(abs(full[test] / bare[test] - 1.0) for test in OPEN_LOOP_TESTS)
    parts.append(
        judged(
            change < NEGLIGIBLE,
            f"errors of Tests A to D change by up to {percent(change)} at "
            f"{1e3 * vehicle.arm.radius:g} mm",
            largest_change_of_an_error=change,
        )
    )
    return all_of(
        parts,
        f"Disks of {1e3 * MASS:.1f} g every {SPACING:.2f} m, of a published arm whose radius is "
        "0.7 mm; the paper prints none",
    )


def effect_of_disks(evidence: Evidence) -> Judgement:
    """III-C.16: do disks only amplify the coupling, and leave the order of the errors?"""
    least, most, middle, bends = factors_of_disks(evidence.vehicle)
    errors = [errors_of_tests(each) for each in (evidence.vehicle, with_disks(evidence.vehicle))]
    smaller = least <= 1.0
    told = "at every state"
    if smaller.any():
        told = (
            f"but in {percent(float(smaller.mean()))} of the states, all bent by more than "
            f"{bends[smaller].min():.2g} rad, one shrinks or changes its sign"
        )
    return all_of(
        [
            judged(
                not smaller.any(),
                "with the disks of III-C.15 the UAV-arm elements grow by a factor of "
                f"{np.median(middle):.2f} in the median ({least.min():.2f} to {most.max():.2f}), "
                f"{told}",
                median_factor=float(np.median(middle)),
                smallest_factor=float(least.min()),
                largest_factor=float(most.max()),
            ),
            order_by_error(*errors),
        ],
    )


def order_by_error(bare: dict[str, float], full: dict[str, float]) -> Judgement:
    """Whether errors of tests without and with disks have one order."""
    ended = [test for test in OPEN_LOOP_TESTS if math.isnan(bare[test] + full[test])]
    if ended:
        told = f"flights of Test {', '.join(ended)} end early and have no place in an order"
        return Judgement(UNDECIDED, told)
    before, after = ("".join(sorted(OPEN_LOOP_TESTS, key=of.__getitem__)) for of in (bare, full))
    return judged(before == after, f"order of Tests A to D by error: {before}, then {after}")


def factors_of_disks(vehicle: Vehicle) -> tuple[Array, Array, Array, Array]:
    """Smallest, largest and median factor by which disks change a UAV-arm element, and the bend.

    Each (states,), of the elements that are above 1 % of the largest; the bend as |κ| l [rad].
    """
    bare = vehicle.replace({"arm.kappa_s": 0.0})
    full = with_disks(bare)
    rows = []
    for q, _ in random_states(vehicle.arm.length):
        before, after = uav_arm_block(bare, q), uav_arm_block(full, q)
        factors = (after / before)[significant(before)]
        rows.append([factors.min(), factors.max(), np.median(factors),
                     abs(q[6]) * vehicle.arm.length])  # fmt: skip
    least, most, middle, bends = np.array(rows).T
    return least, most, middle, bends


JUDGES = {
    "III-C.3": power_balance,
    "III-C.5": readings_of_decoupled,
    "III-C.6": axes_of_the_tip,
    "III-C.15": assumption_on_disks,
    "III-C.16": effect_of_disks,
    **coupling_elements.JUDGES,
}
"""Judge of every sentence of this section and of Appendix B, by its id."""
