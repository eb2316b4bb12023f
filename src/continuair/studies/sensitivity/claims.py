"""The paper's section on parameter sensitivity, sentence by sentence, and what judges each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from continuair.studies.sensitivity.findings import (
    NOT_REPRODUCED,
    REPRODUCED,
    UNDECIDED,
    Check,
    at_least,
    at_most,
    column,
    converged,
    goes_with,
    largest_at_the_end,
    least_spread,
    trend,
    unexamined,
)
from continuair.studies.sensitivity.task import PARAMETERS

NO_CLAIM = "nothing to check"
"""Verdict on a sentence that describes the set-up, or gives a reason and no result."""

FEWEST = 10
"""Values between that must have been flown to the end for a sweep to be judged by."""

SAME = 0.1
"""Numbers within this share of each other count as the same."""

_RADIUS, _MASS, _LENGTH = "arm radius", "UAV mass", "arm length"
_MODULUS, _BEND, _ROLL = "Young's modulus", "initial bend", "initial roll"


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, and the checks of its parts; none for a sentence without a claim."""

    about: str
    sentence: str
    checks: tuple[Check, ...] = ()
    note: str = ""


def verdicts(results: dict[str, Any]) -> list[dict[str, str]]:
    """Return about, sentence, verdict and evidence of every sentence, from the study's sweeps."""
    usable = {
        name: sweep
        for name, sweep in results["sweeps"].items()
        if len(sweep["between"]["value"]) >= FEWEST
    }
    return [_judged(claim, usable) for claim in CLAIMS]


def _judged(claim: Claim, sweeps: dict[str, Any]) -> dict[str, str]:
    try:
        findings = [check(sweeps) for check in claim.checks]
    except KeyError as missing:
        if missing.args[0] not in PARAMETERS:
            raise
        verdict, evidence = UNDECIDED, f"no sweep of the {missing.args[0]} to judge by"
    else:
        verdict = combined([finding.verdict for finding in findings])
        parts = [
            f"{finding.evidence}: {finding.verdict}" if len(findings) > 1 else finding.evidence
            for finding in findings
        ]
        evidence = ". ".join([*parts, claim.note] if claim.note else parts)
    return {
        "about": claim.about,
        "sentence": claim.sentence,
        "verdict": verdict,
        "evidence": evidence,
    }


def combined(parts: Sequence[str]) -> str:
    """Return the verdict on a sentence from those on its parts: it holds only if all of them do."""
    if not parts:
        return NO_CLAIM
    if NOT_REPRODUCED in parts:
        return NOT_REPRODUCED
    return UNDECIDED if UNDECIDED in parts else REPRODUCED


def _mass_times_displacement(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Spread of mass times displacement over the radii: 0 for a payload that only adds mass."""
    rows = sweeps[_RADIUS]["rows"]
    products = [row["mass_kg"] * row["displacement_m"] for row in rows]
    return [max(products) / min(products) - 1], converged(sweeps[_RADIUS])


def _growth(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Error in the last second over that in the first, at the least UAV mass."""
    seconds = sweeps[_MASS]["rows"][0]["models"]["decoupled"]["rmse_xy_by_second_m"]
    return [seconds[-1] / seconds[0]], converged(sweeps[_MASS])


def _ratio_of_changes(measure: str) -> Any:
    """Largest over least of a measure in the sweep of the length, over that of the radius."""

    def value(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
        changes = [
            max(found) / min(found)
            for found in (column(sweeps[name]["rows"], measure) for name in (_LENGTH, _RADIUS))
        ]
        return [changes[0] / changes[1]], True

    return value


def _error_of_oscillation(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Error of the decoupled model over the oscillation, at the longest arm."""
    row = sweeps[_LENGTH]["rows"][-1]
    error = row["models"]["decoupled"]["rmse_xy_m"]
    return [error / row["oscillation_m"]], converged(sweeps[_LENGTH])


def _stiff_over_compliant(sweeps: dict[str, Any]) -> tuple[list[float], bool]:
    """Errors of the stiffer arms over that of the most compliant one."""
    compliant, *stiffer = column(sweeps[_MODULUS]["rows"], "error")
    return [error / compliant for error in stiffer], converged(sweeps[_MODULUS])


CLAIMS = (
    Claim(
        "sensitivity",
        "In addition to the discrepancies observed in the open-loop responses of the decoupled and "
        "coupled models under different actuation profiles and external wrenches, an important "
        "consideration is their sensitivity to physical parameters.",
    ),
    Claim(
        "sensitivity",
        "The significance of the coupling terms is evident in certain prototypes, particularly "
        "when the inertia of the CR is substantial and the overall ACM center of mass undergoes "
        "notable variations.",
        (goes_with("arm_inertia_kg_m2"), goes_with("com_travel_m")),
    ),
    Claim(
        "sensitivity",
        "The results of the parameter sensitivity analysis are illustrated in Fig. 3.",
    ),
    Claim(
        "sensitivity",
        "The figure presents the 2D tip trajectory, projected onto the xy plane of the inertial "
        "frame, corresponding to the following piecewise-defined wrench vector with an excitation "
        "frequency of f = 10 [Hz] and amplitude a_m = 100 [N] over a 5 [s] simulation.",
        note="The wrench is written with sin(f t), which f = 10 Hz would need a factor 2 pi for",
    ),
    Claim(_RADIUS, "The first parameter investigated is the backbone radius."),
    Claim(_RADIUS, "Three values of 1 [mm], 5 [mm], and 10 [mm] are analyzed, as shown in (a)."),
    Claim(
        _RADIUS,
        "Increasing the backbone radius raises the total inertia of the system, resulting in "
        "reduced displacement.",
        (trend(_RADIUS, "arm_inertia_kg_m2", 1), trend(_RADIUS, "displacement_m", -1)),
    ),
    Claim(
        _RADIUS,
        "In this scenario, the CR is not actuated and therefore behaves as an additional payload.",
        (
            at_most(
                _mass_times_displacement,
                SAME,
                "mass times displacement, one number for a mere payload, varies by {}",
            ),
        ),
    ),
    Claim(
        _RADIUS,
        "As a result, for the same input wrench, a larger CR experiences less excitation, and the "
        "overall variation in the center of mass and moment of inertia of the system is smaller "
        "compared to the other cases.",
        tuple(
            trend(_RADIUS, measure, -1)
            for measure in ("largest_bend_1_m", "com_travel_m", "inertia_change")
        ),
    ),
    Claim(
        _RADIUS,
        "This explains why the coupled and decoupled responses are similar for this parameter "
        "value.",
        (trend(_RADIUS, "error", -1),),
        "The section begins with the opposite: coupling matters where the arm's inertia is "
        "substantial",
    ),
    Claim(_MASS, "(b) shows the 2D tip position for UAV masses ranging from 1 to 3 kg."),
    Claim(
        _MASS,
        "Similar to the first scenario, increased inertia results in reduced displacement.",
        (trend(_MASS, "displacement_m", -1),),
    ),
    Claim(
        _MASS,
        "The results indicate that as the masses of the UAV and the robotic CR become more "
        "comparable, the coupling terms become more significant, leading to greater discrepancies "
        "in the system that diverge over time.",
        (
            trend(_MASS, "error", -1),
            at_least(
                _growth,
                1.0,
                "at the least UAV mass the error of the last second is {} times that of the first",
            ),
        ),
        "By this sentence the largest radius, whose arm is the heaviest, should show the largest "
        "error, not the least",
    ),
    Claim(
        _LENGTH,
        "With the emergence of ACM with long arms for delivery and manipulation, another important "
        "physical parameter to investigate is the CR length.",
    ),
    Claim(
        _LENGTH,
        "(c) presents the open-loop task-space Cartesian tip position for different CR lengths.",
    ),
    Claim(
        _LENGTH,
        "Compared to variations in CR radius, changes in total inertia are less pronounced due to "
        "the slender geometry of the CR.",
        tuple(
            at_most(
                _ratio_of_changes(measure),
                1.0,
                f"the factor by which the {name} grows over the lengths is {{}} of that over the "
                "radii",
            )
            for measure, name in (
                ("mass_kg", "vehicle's mass"),
                ("arm_inertia_kg_m2", "arm's inertia"),
            )
        ),
    ),
    Claim(
        _LENGTH,
        "Longer CRs tend to reduce the discrepancies between the coupled and decoupled models, "
        "although the response becomes more oscillatory.",
        (trend(_LENGTH, "error", -1), trend(_LENGTH, "oscillation_m", 1)),
    ),
    Claim(
        _LENGTH,
        "As shown in the graphs corresponding to a CR length of 1.5 [m], neglecting the coupling "
        "terms prevents these oscillations from being captured accurately.",
        (
            at_least(
                _error_of_oscillation,
                SAME,
                "at the longest arm the error is {} of the oscillation",
            ),
        ),
        "The sentence before says the opposite of long arms",
    ),
    Claim(
        _MODULUS,
        "The effect of the backbone material is examined in (d) for three different Young's moduli "
        "corresponding to steel (E = 207 [GPa]), titanium alloys (E = 120 [GPa]), and Nitinol "
        "(E = 40 [GPa]).",
    ),
    Claim(
        _MODULUS,
        "The stiffer arms exhibit only negligible differences in the 2D tip position compared to "
        "those with greater compliance.",
        (
            trend(_MODULUS, "error", -1),
            at_most(
                _stiff_over_compliant,
                SAME,
                "errors of the stiffer arms are {} of that of the most compliant one",
            ),
        ),
    ),
    Claim(
        _MODULUS,
        "However, the influence of this parameter is less significant than that of the other "
        "parameters, particularly when there is no contact or external wrench applied to the "
        "end-effector.",
        (
            least_spread(_MODULUS),
            unexamined("no flight of this study, nor of the paper's, has contact to compare with"),
        ),
    ),
    Claim(
        _BEND,
        "The impact of the initial bending is investigated in Test E. This is illustrated in (e), "
        "where the initial bending κ0 is set to three distinct values.",
        note="The paper does not print the values",
    ),
    Claim(
        _BEND,
        "The results indicate that the larger the initial bending, the larger the deviation "
        "between the coupled and decoupled models in the task-space.",
        (trend(_BEND, "error", 1),),
    ),
    Claim(
        _ROLL,
        "Finally, as a representative study, we also examined the effect of the UAV initial "
        "orientation on the response.",
    ),
    Claim(
        _ROLL,
        "Here, the UAV roll angle is tested against different initial values for φ, as seen in "
        "(f).",
        note="The paper does not print the values",
    ),
    Claim(
        _ROLL,
        "The largest discrepancy between the two approaches is visible for the larger initial UAV "
        "roll angles.",
        (largest_at_the_end(_ROLL),),
    ),
)
"""The section, in the order of the paper. Amiri et al., "Parameter Sensitivity Analysis"."""
