"""Judges of the section on dynamics, III-C."""

from __future__ import annotations

import numpy as np

from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import coupling_elements, disk_effects
from amiri2026.paper.judges.agreement import AGREES, largest_gap, partial, random_states
from amiri2026.paper.judges.errors import BLOCKS, FITS, TABLE_VEHICLE, ablation
from amiri2026.paper.judges.words import SAME
from amiri2026.sensitivity.findings import listed
from amiri2026.table.reading import Decoupled
from amiri2026.table.study import READING
from amiri2026.verdicts import Case, Judgement, judged, or_misprint, over_cases
from continuair import Vehicle, equations

Array = np.ndarray

_BALANCES = 25
"""States at which the balance of power is taken."""

TIP_AXES, INERTIAL_AXES = "J_t in tip axes", "J_t in inertial axes"


def power_balance(evidence: Evidence) -> Judgement:
    """Judge III-C.3: is the power of Eq. (10) that of τ and of a wrench which acts on the tip?"""
    gaps = gaps_in_power(evidence.vehicle)
    median = {reading: float(np.median(found)) for reading, found in gaps.items()}
    corrected = largest_gap(gaps[1, INERTIAL_AXES], AGREES)
    found = judged(
        any(max(gaps[-1, axes]) <= AGREES for axes in (TIP_AXES, INERTIAL_AXES)),
        "with −J_tᵀ F_e the rate of K + U differs from the power of τ and of a wrench F_e exerted "
        f"on the tip by {median[-1, TIP_AXES]:.2g} times the power of F_e (median), if J_t is in "
        f"tip axes and F_e in inertial axes, as IV-A says. It is {median[-1, INERTIAL_AXES]:.2g} "
        "times if J_t is J of III-B at s = l_a, which with J_p1 = I is in inertial axes",
        **{f"median gap over power of F_e, sign {sign:+d}, {axes}": median[sign, axes]
           for sign, axes in ((-1, TIP_AXES), (-1, INERTIAL_AXES), (1, TIP_AXES))},
        largest_gap_over_power_of_F_e_as_corrected=corrected,
    )  # fmt: skip
    return or_misprint(
        found,
        "+J_tᵀ F_e with J_t = J(s = l_a) in inertial axes (or −J_tᵀ F_e with F_e the wrench that "
        f"the tip exerts on the environment). The gap is {median[-1, TIP_AXES]:.2g} times the "
        f"power of F_e as printed, {median[1, TIP_AXES]:.2g} with the other sign alone, "
        f"{median[-1, INERTIAL_AXES]:.2g} with inertial axes alone, and at most {corrected:.0e} "
        "with both",
    )


def gaps_in_power(vehicle: Vehicle) -> dict[tuple[int, str], list[float]]:
    """Return gaps in the balance of power at random states, over the power of F_e.

    By sign and axes of J_tᵀ F_e; without damping, F_e in inertial axes.
    """
    vehicle = vehicle.replace({"arm.kappa_s": 0.0, "arm.damping": 0.0, "arm.damping_ratio": None})
    s = vehicle.arm.length
    rng = np.random.default_rng(0)
    gaps: dict[tuple[int, str], list[float]] = {}
    for q, qd in random_states(s, _BALANCES):
        tau, wrench = rng.normal(size=8), rng.normal(size=6)
        by_wrench = float(wrench @ equations.jacobian(vehicle, q, s) @ qd)
        tip = equations.rotation(q) @ equations.section_rotation(vehicle, q, s, "untwisted")
        # J in tip axes is Rᵀ J, whose transpose times F_e is that of J times R F_e.
        inserted = {INERTIAL_AXES: wrench, TIP_AXES: np.kron(np.eye(2), tip) @ wrench}
        for axes, given in inserted.items():
            for sign in (-1, 1):
                qdd = equations.forward_dynamics(vehicle, q, qd, tau, given, tip_wrench_sign=sign)
                gap = power(vehicle, q, qd, qdd) - float(tau @ qd) - by_wrench
                gaps.setdefault((sign, axes), []).append(abs(gap) / abs(by_wrench))
    return gaps


def power(vehicle: Vehicle, q: Array, qd: Array, qdd: Array) -> float:
    """Return the rate of K + U of Eqs. (8) and (9) [W], U by its derivatives."""
    mass_rate = np.imag(equations.mass_matrix(vehicle, q + 1e-30j * qd)) / 1e-30

    def potential(x: Array) -> Array:
        return np.asarray(equations.potential_energy(vehicle, x))

    slopes = [partial(potential, q, i) for i in range(8)]
    M = equations.mass_matrix(vehicle, q)
    return float(qd @ M @ qdd + 0.5 * qd @ mass_rate @ qd + np.array(slopes) @ qd)


MEANINGS: dict[Decoupled, str] = {
    "element": "every off-diagonal element zero",
    "block": BLOCKS,
    "uav blocks": "position, attitude and arm as three blocks",
    "element, full C": "M diagonal, C whole",
}
"""Meanings of the off-diagonal elements, by the names of `Reading.decoupled`."""


def readings_of_decoupled(evidence: Evidence) -> Judgement:
    """Judge III-C.5: which off-diagonal elements are zero in the model of the paper's results?"""
    cases = []
    for meaning, name in MEANINGS.items():
        table = evidence.table
        found = table if meaning == READING.decoupled else ablation(table, decoupled=meaning)
        ours = listed(found["ours"][0]), listed(found["ours"][1])
        fit = judged(
            found["factor"] <= FITS,
            f"the table is {ours[0]} in translation and {ours[1]} in rotation, a factor of "
            f"{found['factor']:.3g} from the printed one at most",
            largest_factor=found["factor"],
        )
        cases.append(Case(TABLE_VEHICLE, name, fit))
    return over_cases([*cases, _elements_beside_blocks(evidence)])


def _elements_beside_blocks(evidence: Evidence) -> Case:
    """Return whether errors of the tip are those of zeroed blocks with each other meaning, for the
    vehicle."""
    errors = {
        meaning: [
            each["rmse_t_m"]
            for each in evidence.printed(
                evidence.vehicle, READING.replace(decoupled=meaning)
            ).plain().values()
        ]
        for meaning in MEANINGS
        if meaning != "element, full C"
    }  # fmt: skip
    block = np.array(errors["block"])
    ratios = {meaning: np.array(found) / block for meaning, found in errors.items()}
    told = "; ".join(f"{listed(found)} m with {MEANINGS[name]}" for name, found in errors.items())
    found = judged(
        all((abs(each - 1.0) <= SAME).all() for each in ratios.values()),
        f"the tip errs in Tests A to D by {told}",
        # Near straight, in C and D, ψa spins, and digits depend on the machine.
        **{
            f"error over that of zero blocks, {MEANINGS[meaning]}, Test {test}": float(ratio)
            for meaning, each in ratios.items()
            if meaning != "block"
            for test, ratio in zip("AB", each[:2], strict=True)
        },
    )
    return Case(evidence.vehicle.name, "one meaning beside another, Remark 1 as printed", found)


JUDGES = {
    "III-C.3": power_balance,
    "III-C.5": readings_of_decoupled,
    **coupling_elements.JUDGES,
    **disk_effects.JUDGES,
}
"""Judge of every sentence of this section and of Appendix B, by its id."""
