"""Judges of the conclusions on the open-loop studies, V.6 to V.12."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from amiri2026.extremes import largest, least
from amiri2026.open_loop_tests import open_loop_test
from amiri2026.paper.drawn import MOST
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges.agreement import natural_units
from amiri2026.paper.judges.errors import (
    BLOCKS_IN_UNITS,
    DRAWN,
    TipErrors,
    as_cases,
    by_elements,
    tip_errors,
)
from amiri2026.paper.judges.sweep_cases import other_vehicles, swept
from amiri2026.paper.judges.words import NEGLIGIBLE, PRONOUNCED
from amiri2026.sensitivity.findings import column, converged, if_converged
from amiri2026.sensitivity.measures import apart
from amiri2026.sensitivity.task import PARAMETERS, batch, flight
from amiri2026.verdicts import (
    Case,
    Judgement,
    judged,
    judged_alike,
    or_misprint,
    over_cases,
)
from continuair import Vehicle, equations, simulate
from continuair.analysis import percent, samples
from continuair.flight import RESOLVED
from continuair.kernels import PLANTS
from continuair.studies import by_model
from continuair.warning import untold

ARM = ("arm radius", "arm length", "Young's modulus", "initial bend")
UAV = ("UAV mass", "initial roll")
STRUCTURE = ("arm radius", "arm length", "Young's modulus", "UAV mass")


def structure(evidence: Evidence) -> Judgement:
    """Judge V.6: do at least two of four parameters of the structure change the error twofold?"""
    return _strong(evidence, STRUCTURE, "of the vehicle's structure")


def parameters(evidence: Evidence) -> Judgement:
    """Judge V.8: do at least two of the six parameters change the error twofold?"""
    return _strong(evidence, (*ARM, *UAV), "of the paper's sweeps")


def _strong(evidence: Evidence, names: tuple[str, ...], of: str) -> Judgement:
    cases = [
        Case(found.vehicle, found.reading, strong(found.sweeps, names, of))
        for found in swept(evidence)
    ]
    return over_cases(cases)


def strong(sweeps: dict[str, Any], names: tuple[str, ...], of: str) -> Judgement:
    """Return whether at least two of some parameters change the error twofold over their sweeps."""
    factors = {}
    for name in names:
        errors = column(sweeps[name]["rows"], "error")
        factors[name] = largest(errors) / least(errors)
    known = [name for name in names if converged(sweeps[name])]
    twofold = [name for name in known if factors[name] >= PRONOUNCED]
    # Sweeps that have not converged may turn out either way.
    counts = len(twofold), len(twofold) + len(names) - len(known)
    told = ", ".join(
        f"{factor:.2g} ({name if name in known else f'{name}, not converged'})"
        for name, factor in factors.items()
    )
    return judged_alike(
        (count >= 2 for count in counts),
        f"the largest horizontal error of a sweep over the least is {told}; {_from_to(*counts)} of "
        f"these {len(names)} parameters {of} change it at least twofold",
        **{f"largest over least error, {name}": factor for name, factor in factors.items()},
    )


def _from_to(low: int, high: int) -> str:
    return f"{high}" if low == high else f"{low} to {high}"


def downward(evidence: Evidence) -> Judgement:
    """Judge V.7: do Appendices A and B put the arm below the UAV?"""
    plain = evidence.vehicle.replace({"arm.kappa_s": 0.0})
    length = float(plain.arm.length)
    height = _height_of_straight_tip(plain) / length
    generator = np.random.default_rng(0)
    errors = {"below": 0.0, "above": 0.0}
    for q in natural_units(length) * generator.uniform(0.2, 1.2, (20, 8)):
        printed = length * equations.appendix_b(plain, q, length)[0]
        slope = equations.arm_jacobian(plain, q, length)[0][:, 0]
        for side, sign in (("below", 1.0), ("above", -1.0)):
            column_of_arm = slope * [1.0, 1.0, sign]
            ours = plain.arm.mass_per_length * (equations.rotation(q) @ column_of_arm)[0]
            errors[side] = max(errors[side], abs(printed / ours - 1.0))
    found = judged(
        height < 0.0 and errors["below"] < 1e-6 < errors["above"],
        "∂z/∂κ of Appendix A, integrated from a half circle, whose tip is level with its base, "
        f"puts the straight tip at z = {height:.3g} l. M17 of Appendix B is that of an arm below "
        f"the UAV to {'rounding' if errors['below'] < 1e-6 else percent(errors['below'])}; for an "
        f"arm above it is off by up to {errors['above']:.2g} times. z points up, as the UAV starts "
        "at z = 5 m. Eq. (2) has the other sign of z (III-A.7)",
        height_of_the_straight_tip_over_length=height,
        largest_error_of_m17_for_an_arm_above=errors["above"],
    )
    return or_misprint(found, "an arm above the UAV, as Appendices A and B have it")


def _height_of_straight_tip(vehicle: Vehicle) -> float:
    """z of the straight arm's tip from its base [m]: ∂z/∂κ of Appendix A from a half circle on."""
    length = float(vehicle.arm.length)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = 0.5 * np.pi / length
    curvatures = half * (1.0 + nodes)
    slopes = [
        equations.arm_jacobian(vehicle, np.array([0.0] * 6 + [κ, 0.0]), length)[0][2, 0]
        for κ in curvatures
    ]
    return float(-half * np.dot(weights, slopes))


def passive_arm(evidence: Evidence) -> Judgement:
    """Judge V.10: do the models hardly differ with a passive arm, whatever its modulus?"""
    cases = []
    for found in swept(evidence):
        sweep = found.sweeps[_MODULUS.name]
        pairs = zip(column(sweep["rows"], "error"), sweep["rows"], strict=True)
        view = small([error / row["range_m"] for error, row in pairs])
        cases.append(Case(found.vehicle, found.reading, if_converged([sweep], view)))
    for vehicle in (evidence.vehicle, *other_vehicles(evidence)):
        flights = _both(batch(vehicle, flight(), _MODULUS, _MODULUS.values)[0], "A")
        shares = [share_of_range(flights.isel(run=[run])) for run in range(len(_MODULUS.values))]
        cases.append(Case(vehicle.name, "Test A", small(shares)))
    return over_cases(cases)


_MODULUS = PARAMETERS["Young's modulus"]


def small(shares: list[float]) -> Judgement:
    """Return whether errors over ranges are small at every modulus."""
    labels = [_MODULUS.label(value) for value in _MODULUS.values]
    return judged(
        largest(shares) < NEGLIGIBLE,
        f"the tip's horizontal error is {', '.join(map(percent, shares))} of the range of its "
        f"motion at {', '.join(labels)}",
        **{f"error over range, {label}": x for label, x in zip(labels, shares, strict=True)},
    )


@untold("error_estimate")
def _both(vehicles: Vehicle, test: str) -> xr.Dataset:
    """Return an open-loop test with both models, over (model, run, time); NaN where it is not
    resolved."""
    scenario = open_loop_test(test)
    flights = by_model(
        {
            model: simulate(
                vehicles,
                scenario,
                model=model,
                variables=["tip_position"],
                check=True,
            )
            for model in PLANTS
        }
    )
    return flights.where(flights["error_estimate"] <= RESOLVED)


def share_of_range(flights: xr.Dataset, more: float = 0.0) -> float:
    """RMS horizontal distance of the tips, and `more` [m], over the range of the coupled one's.

    flights: over (model, run, time), of a single run.
    """
    coupled, other = _pair(flights)
    covered = np.ptp(samples(coupled, "tip_position", "axis")[0, :, :2], axis=0)
    distance = np.sqrt(np.mean(apart(coupled, other)[0] ** 2))
    return float((distance + more) / np.linalg.norm(covered))


def _pair(flights: xr.Dataset) -> tuple[xr.Dataset, xr.Dataset]:
    coupled, other = (flights.sel(model=plant) for plant in PLANTS)
    return coupled, other


def modes_of_actuation(evidence: Evidence) -> Judgement:
    """Judge V.12: does actuating the UAV change rotation most, and the arm's torques position?"""

    def view(found: TipErrors) -> Judgement:
        return judged_alike(
            (
                rotation["A"] > rotation["C"] and position["C"] >= PRONOUNCED * position["A"]
                for rotation, position in product(found.rotations, found.positions)
            ),
            f"Tests A and C err by {found.turned('AC')} in rotation and by {found.moved('AC')} in "
            "position",
            **found.rotation_numbers("AC"),
            **found.position_numbers("AC"),
        )

    drawn = evidence.drawn
    turned = drawn.share(drawn.rotation["A"] > drawn.rotation["C"])
    moved = drawn.share(drawn.position["C"] >= PRONOUNCED * drawn.position["A"])
    of_drawn = judged(
        turned > MOST and moved > MOST,
        f"the error in rotation is larger in A for {percent(turned)} of them, and that in position "
        f"at least twice as large in C for {percent(moved)}",
        share_larger_in_a=turned,
        share_twice_as_large_in_c=moved,
    )
    cases = as_cases([*tip_errors(evidence), by_elements(evidence)], view)
    return over_cases([*cases, Case(DRAWN, BLOCKS_IN_UNITS, of_drawn)])


JUDGES = {
    "V.6": structure,
    "V.7": downward,
    "V.8": parameters,
    "V.10": passive_arm,
    "V.12": modes_of_actuation,
}
"""Judge of each of these sentences, by its id."""
