"""Judges of what the conclusions say of the open-loop studies, V.6 to V.12."""

from __future__ import annotations

import numpy as np
import xarray as xr

from continuair import equations
from continuair.analysis.metrics import samples
from continuair.analysis.shares import percent
from continuair.flight.resolution import RESOLVED
from continuair.flight.simulate import simulate
from continuair.kernels.dynamics import PLANTS
from continuair.scenario.paper_tests import open_loop_test
from continuair.studies.extremes import largest, least
from continuair.studies.paper.drawn import MOST
from continuair.studies.paper.evidence import Evidence, NotFlown
from continuair.studies.paper.judges import swing
from continuair.studies.paper.judges.agreement import natural_units
from continuair.studies.paper.judges.errors import (
    errors,
    possible,
    possible_rotations,
    rotations,
)
from continuair.studies.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from continuair.studies.results import by_model
from continuair.studies.sensitivity.findings import column, converged, if_converged, listed
from continuair.studies.sensitivity.measures import apart
from continuair.studies.sensitivity.study import Sensitivity
from continuair.studies.sensitivity.task import PARAMETERS, batch, flight
from continuair.studies.verdicts import Judgement, all_of, judged, judged_alike
from continuair.vehicle.vehicle import Vehicle

ARM = ("arm radius", "arm length", "Young's modulus", "initial bend")
UAV = ("UAV mass", "initial roll")
STRUCTURE = ("arm radius", "arm length", "Young's modulus", "UAV mass")


def structure(evidence: Evidence) -> Judgement:
    """V.6: do at least two of four parameters of the structure change the error twofold?"""
    return _strong(evidence, STRUCTURE, "of the vehicle's structure")


def parameters(evidence: Evidence) -> Judgement:
    """V.8: do at least two of the six parameters change the error twofold?"""
    return _strong(evidence, (*ARM, *UAV), "of the paper's sweeps")


def _strong(evidence: Evidence, names: tuple[str, ...], of: str) -> Judgement:
    sweeps = evidence.sensitivity.results["sweeps"]
    factors = {}
    for name in names:
        errors = column(sweeps[name]["rows"], "error")
        factors[name] = largest(errors) / least(errors)
    known = [name for name in names if converged(sweeps[name])]
    strong = [name for name in known if factors[name] >= PRONOUNCED]
    # Sweeps that hang on the step may turn out either way.
    counts = len(strong), len(strong) + len(names) - len(known)
    told = ", ".join(
        f"{factor:.2g} ({name if name in known else f'{name}, not converged'})"
        for name, factor in factors.items()
    )
    return judged_alike(
        (count >= 2 for count in counts),
        f"largest over least horizontal error of a sweep: {told}; {_from_to(*counts)} of these "
        f"{len(names)} parameters {of} change it at least twofold. The error depends finely on "
        "each of them, and the paper prints neither vehicle nor all values",
        **{f"largest over least error, {name}": factor for name, factor in factors.items()},
    )


def _from_to(low: int, high: int) -> str:
    return f"{high}" if low == high else f"{low} to {high}"


def downward(evidence: Evidence) -> Judgement:
    """V.7: do Appendices A and B put the arm below the UAV?"""
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
    return judged(
        height < 0.0 and errors["below"] < 1e-6 < errors["above"],
        "a half circle ends at the height of its base, from where the slopes of Appendix A lead "
        f"to a straight tip at z = {height:.3g} l. M17 of Appendix B agrees with an arm below to "
        f"{'rounding' if errors['below'] < 1e-6 else percent(errors['below'])}, and is off by up "
        f"to {errors['above']:.2g} times that of an arm above; z points up, as the UAV starts at "
        "5 m. Eq. (2) has the other sign of z",
        height_of_the_straight_tip_over_length=height,
        largest_error_of_m17_for_an_arm_above=errors["above"],
    )


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


def long_arms(evidence: Evidence) -> Judgement:
    """V.9: is the oscillation of the longest arm wrong in the decoupled model?"""
    off = _oscillation(evidence.vehicle, evidence.sensitivity)
    told = ", ".join(
        f"{name} by {_amount(name, long)} (0.5 m: {_amount(name, short)})"
        for name, (short, long) in off.items()
    )
    try:
        hertz = _oscillation(evidence.vehicle, evidence.sensitivity_hertz)
        verdict = _judged_oscillation(evidence.sensitivity_hertz, hertz, "").verdict
        told += f". With f in Hz, sin(2π f t): {verdict}"
    except NotFlown:
        pass
    return _judged_oscillation(
        evidence.sensitivity,
        off,
        "at 1.5 m the decoupled model's oscillation about the centre of mass is off in "
        f"{told}. The length of 0.5 m is ours. IV-B.18 makes the same claim, and there the error "
        "holds the path of the vehicle too",
    )


def _judged_oscillation(
    study: Sensitivity, off: dict[str, tuple[float, float]], evidence: str
) -> Judgement:
    numbers = {f"{name} off by, 1.5 m": long for name, (_, long) in off.items()}
    numbers |= {f"{name} off by, 0.5 m": short for name, (short, _) in off.items()}
    return if_converged(
        [study.results["sweeps"]["arm length"]], judged(_fails(off), evidence, **numbers)
    )


def _oscillation(vehicle: Vehicle, study: Sensitivity) -> dict[str, tuple[float, float]]:
    """How far each property of the oscillation is off at the shortest and at the longest arm."""
    sweep = PARAMETERS["arm length"]
    vehicles, _ = batch(vehicle, flight(), sweep, sweep.values)
    flights = study.datasets[sweep.name]
    both = [swing.swing(vehicles, flights.sel(model=plant)) for plant in PLANTS]
    short, long = (swing.differences(both[0][run], both[1][run]) for run in (0, -1))
    return {name: (short[name], long[name]) for name in long}


def _fails(off: dict[str, tuple[float, float]]) -> bool:
    """Tell whether some property is off by a tenth (a tenth of a radian), more than if short."""
    return any(long > SAME and long > short for short, long in off.values())


def _amount(name: str, value: float) -> str:
    return f"{value:.2g} rad" if name == "phase" else percent(value)


def passive_arm(evidence: Evidence) -> Judgement:
    """V.10: do the models hardly differ with a passive arm, whatever its modulus?"""
    sweep = PARAMETERS["Young's modulus"]
    vehicles, _ = batch(evidence.vehicle, flight(), sweep, sweep.values)
    flights = {test: _both(vehicles, test) for test in "AB"}
    found = {
        "under the force of the sweeps": evidence.sensitivity.datasets[sweep.name],
        "in Test A": flights["A"],
    }
    share = {
        (name, value): share_of_range(data.isel(run=[run]))
        for name, data in found.items()
        for run, value in enumerate(sweep.values)
    }
    fall = [float(np.sqrt(np.mean(row**2))) for row in apart(*_pair(flights["B"]))]
    moduli = ", ".join(f"{1e-9 * value:g}" for value in sweep.values)
    told = ", and ".join(
        f"{', '.join(percent(share[name, value]) for value in sweep.values)} {name}"
        for name in found
    )
    resting = [evidence.sensitivity.results["sweeps"][sweep.name]]
    small = judged(
        largest(share.values()) < NEGLIGIBLE,
        f"with a passive arm of {moduli} GPa the tip's horizontal error is {told}, as share of "
        f"the range of its motion (in Test B, in which the UAV carries nothing, {listed(fall)} m)",
        **{
            f"error over range {name}, {1e-9 * value:g} GPa": part
            for (name, value), part in share.items()
        },
        **{
            f"error in Test B, {1e-9 * value:g} GPa [m]": error
            for value, error in zip(sweep.values, fall, strict=True)
        },
    )
    factors = {
        name: largest(shares) / least(shares)
        for name in found
        for shares in [[share[name, value] for value in sweep.values]]
    }
    told = ", and ".join(f"by a factor of {factor:.3g} {name}" for name, factor in factors.items())
    alike = judged(
        largest(factors.values()) < PRONOUNCED,
        f"over the moduli it changes {told}",
        **{f"largest over least share {name}": factor for name, factor in factors.items()},
    )
    parts = [if_converged(resting, part) for part in (small, alike)]
    return all_of(parts, "The vehicle is ours")


def _both(vehicles: Vehicle, test: str) -> xr.Dataset:
    """An open-loop test with both models, over (model, run, time); NaN where steps do not resolve
    it."""
    scenario = open_loop_test(test)
    flights = by_model(
        {
            model: simulate(vehicles, scenario, model=model, variables=["tip_position"])
            for model in PLANTS
        }
    )
    return flights.where(flights["step_error"] <= RESOLVED)


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
    """V.12: does actuating the UAV tell in rotation, and the arm's torques in position?"""
    drawn, position, (rotation, kind) = evidence.drawn, errors(evidence), rotations(evidence)
    turned, moved = ((of["A"], of["C"]) for of in (rotation, position))
    share_turned = drawn.share(drawn.rotation["A"] > drawn.rotation["C"])
    share_moved = drawn.share(drawn.position["C"] >= PRONOUNCED * drawn.position["A"])
    return all_of(
        [
            judged_alike(
                (
                    each["A"] > each["C"] and share_turned > MOST
                    for each in possible_rotations(evidence)
                ),
                f"the error in rotation{kind} is {listed(turned)} rad in Tests A and C, larger in "
                f"A for {percent(share_turned)} of the vehicles drawn",
                **{
                    "rotation, Test A [rad]": turned[0],
                    "rotation, Test C [rad]": turned[1],
                    "share larger in A": share_turned,
                },
            ),
            judged_alike(
                (
                    each["C"] >= PRONOUNCED * each["A"] and share_moved > MOST
                    for each in possible(evidence)
                ),
                f"that in position is {listed(moved)} m, at least twice as large in C for "
                f"{percent(share_moved)}",
                **{
                    "position, Test A [m]": moved[0],
                    "position, Test C [m]": moved[1],
                    "share twice as large in C": share_moved,
                },
            ),
        ],
        f"Test B, without any actuation, has {rotation['B']:.3g} rad and {position['B']:.3g} m",
    )


JUDGES = {
    "V.6": structure,
    "V.7": downward,
    "V.8": parameters,
    "V.9": long_arms,
    "V.10": passive_arm,
    "V.12": modes_of_actuation,
}
"""Judge of each of these sentences, by its id."""
