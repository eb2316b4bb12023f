"""Judges of the sections on open-loop results, IV and IV-A.1 to 8."""

from __future__ import annotations

from itertools import chain

import numpy as np
import xarray as xr

from continuair.analysis.mass import centre_of_mass, mass_distribution
from continuair.analysis.metrics import nrmse, samples
from continuair.analysis.shares import percent
from continuair.equations.dynamics import elastic_vector
from continuair.equations.kinematics import jacobian, rotation, section_rotation
from continuair.flight.resolution import steps_told_of
from continuair.flight.simulate import simulate
from continuair.kernels.dynamics import PLANTS, REFERENCE
from continuair.scenario.paper_tests import OPEN_LOOP_TESTS, bend_torques, open_loop_test, tip_chirp
from continuair.studies.extremes import largest, largest_of
from continuair.studies.open_loop.study import PRINTED
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges.shorter import UNRESOLVED, Losses, left
from continuair.studies.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME, SHORTER
from continuair.studies.sensitivity.task import PARAMETERS
from continuair.studies.verdicts import UNDECIDED, Judgement, all_of, judged
from continuair.vehicle.layout import FIELDS
from continuair.vehicle.vehicle import Vehicle

Array = np.ndarray

DURATION = 1.0
"""Of each test [s]."""

GRAVITY = 9.81
"""[m/s²]; the paper prints no value."""

_FALLS = 1e-6
"""Arm lengths within which the centre of mass falls as it does free."""

_PLACES = ("position", "attitude", "bend")

ANNOUNCED = {
    "arm length",
    "arm radius",
    "Young's modulus",
    "UAV mass",
    "initial bend",
    "initial roll",
}
"""What section IV says that IV-B varies."""


def identical_conditions(evidence: Evidence) -> Judgement:
    """IV.2: is what halving a common step changes small beside the difference of the models?"""
    results = evidence.open_loop.results
    changes, steps = {}, {}
    for letter, entries in results["tests"].items():
        first = (results["coarser_steps"][letter] or [entries])[0]["decoupled"]
        # Of flights that ended early nothing is compared.
        lost = np.isnan(entries["decoupled"]["rmse_t_m"])
        changes[letter] = np.nan if lost else first["step_halving_error"]
        steps[letter] = first["step_s"]
    worst = largest_of(changes)
    others = largest(changes[letter] for letter in changes if letter != worst)
    return judged(
        changes[worst] < NEGLIGIBLE,
        f"halving a step of {1e3 * steps[worst]:g} ms changes the difference of the models by up "
        f"to {percent(changes[worst])}, in Test {worst}, and by at most {percent(others)} in the "
        "others; in Test C Q_ψa is divided by a bend that passes near 0",
        **{f"change at half the step, Test {letter}": changes[letter] for letter in "ABD"},
    )


def announced_excitations(evidence: Evidence) -> Judgement:
    """IV.3: are an impulse, a chirp, an external wrench and a free fall among the inputs?"""
    first, last = frequency_of_test_d(0.0), frequency_of_test_d(DURATION)
    tests = {letter: open_loop_test(letter) for letter in OPEN_LOOP_TESTS}
    found = {
        "an impulse": any(test.jumps for test in tests.values()),
        "a chirp": first != last,
        "an external wrench": tests["D"].tip_wrench is not None,
        "a free fall": all(getattr(tests["B"], name) is None for name in FIELDS),
    }
    missing = [name for name, there in found.items() if not there]
    return judged(
        not missing,
        f"missing of the four: {' and '.join(missing) or 'none'}. Every input of Tests A to D "
        f"lasts the whole test, and the frequency of Test D is {first:g} Hz at its start and "
        f"{last:g} Hz at its end, as f0 = f1",
        start_hz=first,
        end_hz=last,
    )


def frequency_of_test_d(time: float, f0: float = 1.0, f1: float = 1.0, T: float = 10.0) -> float:
    """The frequency [Hz] of Test D's printed force: the derivative of f0 t + (f1 - f0) t²/(2T)."""
    return f0 + (f1 - f0) * time / T


def varied_parameters(_: Evidence) -> Judgement:
    """IV.4: does IV-B vary each of the six parameters?"""
    return judged(
        {parameter.name for parameter in PARAMETERS.values()} == ANNOUNCED,
        f"section IV-B varies {', '.join(PARAMETERS)}, and so does the study of sensitivity here",
        parameters=float(len(PARAMETERS)),
    )


def strong_actuation(evidence: Evidence) -> Judgement:
    """IV-A.3: is Test A's input a strong constant force on the UAV in world x alone?"""
    tau = np.asarray(open_loop_test("A").tau, float)
    ratio = float(tau[0]) / (evidence.vehicle.mass * GRAVITY)
    # τ is conjugate to q: its power is τ q̇, whatever the attitude.
    return judged(
        np.flatnonzero(tau).tolist() == [0] and ratio >= PRONOUNCED,
        f"the force of {tau[0]:g} N has the power {tau[0]:g} N times ẋ at every attitude, reaches "
        f"no other row, and is {ratio:.3g} times the weight of this vehicle",
        force_over_weight=ratio,
    )


def free_fall(evidence: Evidence) -> Judgement:
    """IV-A.4: does the centre of mass fall by ½ g t² in Test B?"""
    vehicle = evidence.vehicle
    flight = evidence.open_loop.datasets["B"].sel(model=[REFERENCE])

    def fly(step: float) -> xr.Dataset:
        with steps_told_of():
            shorter = simulate(vehicle, open_loop_test("B"), step=step, variables=_PLACES)
        return shorter.expand_dims("run")

    flights = chain([flight], map(fly, SHORTER))
    found = left((off_free_fall(vehicle, each) for each in flights), _FALLS * vehicle.arm.length)
    if found.of_the_step:
        return Judgement(UNDECIDED, UNRESOLVED)
    bend, off = samples(flight, "bend", "bend_axis")[0, :, 0], largest(found.losses.values())
    return judged(
        found.kept,
        f"the common centre of mass of the coupled model falls by ½ g t² within "
        f"{max(off, 1e-9):.1g} m; inside the vehicle the arm, bent at the start, swings between "
        f"{bend.min():.2g} and {bend.max():.2g} 1/m",
        least_bend_1_m=float(bend.min()),
        largest_bend_1_m=float(bend.max()),
    )


def off_free_fall(vehicle: Vehicle, flight: xr.Dataset) -> tuple[Losses, float]:
    """How far the centre of mass of a flight (one, time) gets from that of a free fall [m], and its
    step_error."""
    com, _ = mass_distribution(vehicle, samples(flight, "bend", "bend_axis"))
    (places,), time = centre_of_mass(flight, com), flight["time"].to_numpy()
    fall = np.outer(time**2, [0.0, 0.0, -0.5 * GRAVITY])
    off = float(np.abs(places - places[:1] - fall).max())
    return {"fall": off}, float(flight["step_error"].max())


def excitation_of_the_arm(evidence: Evidence) -> Judgement:
    """IV-A.5: are both of Test C's inputs torques in N m, and on the arm alone?"""
    arm = evidence.vehicle.arm
    inputs = np.array([bend_torques(time) for time in np.linspace(0.0, DURATION, 101)])
    static = float(0.1 / (arm.bending_stiffness * arm.length))
    return all_of(
        [
            judged(
                bool((inputs[:, :6] == 0.0).all() and inputs[:, 6:].any()),
                "both inputs reach the arm alone, with 20 rad/s",
                static_bend_1_m=static,
            ),
            judged(
                abs(metres_in_the_force_on_bend(evidence.vehicle) - 1.0) < 1e-6,
                "the rate of κ is in 1/(m s), so what is conjugate to κ is in N m², not in N m; "
                f"read so, the amplitude of 0.1 bends this arm by {static:.2g} 1/m at rest, "
                "without weight",
            ),
        ]
    )


def metres_in_the_force_on_bend(vehicle: Vehicle) -> float:
    """The power of the metre, beside the newton, in what is conjugate to κ: from E I l κ.

    Measured: with all lengths doubled and forces kept, a force in N mⁿ grows by 2ⁿ.
    """
    arm, q = vehicle.arm, np.array([0, 0, 0, 0, 0, 0, 0.1, 0.0])
    doubled = vehicle.replace(
        {
            "arm.length": 2.0 * arm.length,
            "arm.radius": 2.0 * arm.radius,
            "arm.youngs_modulus": arm.youngs_modulus / 4.0,
        }
    )
    return float(np.log2(elastic_vector(doubled, q / 2.0)[6] / elastic_vector(vehicle, q)[6]))


def wrench_at_the_tip(evidence: Evidence) -> Judgement:
    """IV-A.6: is the power of Test D's wrench in Eq. (10) that of a force on the tip?"""
    test = open_loop_test("D")
    q, qd = np.array(test.q), np.array([0.2, -0.1, 0.3, 0.4, -0.2, 0.1, 0.5, -0.3])
    q[3:6] = 0.3, -0.2, 0.5
    J = jacobian(evidence.vehicle, q, evidence.vehicle.arm.length)
    wrench = np.array(tip_chirp(0.4))
    on_tip = float(wrench @ J @ qd)
    tip_axes = rotation(q) @ section_rotation(evidence.vehicle, q, evidence.vehicle.arm.length)
    in_tip_axes = np.concatenate([tip_axes.T @ J[:3] @ qd, tip_axes.T @ J[3:] @ qd])
    as_printed = -float(wrench @ in_tip_axes)
    return judged(
        abs(as_printed / on_tip - 1.0) < 1e-6,
        f"at a random state the force on the tip has a power of {on_tip:.3g} W, and Eq. (10) with "
        f"-J_tᵀ F_e and J_t in the tip frame gives {as_printed:.3g} W; with J_t in inertial axes "
        f"it gives {-on_tip:.3g} W, the power of the tip on what it touches",
        on_the_tip_w=on_tip,
        as_printed_w=as_printed,
    )


def metric(evidence: Evidence) -> Judgement:
    """IV-A.7: has the printed NRMSE no unit, and does the text name the run of its range?"""
    once, doubled = nrmse_of(evidence, "B"), nrmse_of(evidence, "B", 2.0)
    by_range = {
        test: [nrmse_of(evidence, test, reference=model) for model in PLANTS]
        for test in OPEN_LOOP_TESTS
    }
    off = {test: abs(other / own - 1.0) for test, (own, other) in by_range.items()}
    test = largest_of(off)
    coupled, decoupled = by_range[test]
    return all_of(
        [
            judged(
                abs(doubled / once - 1.0) < 1e-12,
                f"it has no unit: {once:.4g} in Test B, also with all lengths doubled",
                nrmse_t_test_b=once,
            ),
            judged(
                abs(decoupled / coupled - 1.0) < 1e-9,
                "W_max and W_min carry no c or d, so the range may be the coupled or the decoupled "
                f"run's, which gives {coupled:.6g} or {decoupled:.6g} in Test {test}",
            ),
        ]
    )


def nrmse_of(
    evidence: Evidence, test: str, scale: float = 1.0, reference: str = REFERENCE
) -> float:
    """The printed metric of the tip's position, lengths times a scale, by the range of a run."""
    flights = evidence.open_loop.datasets[test]
    coupled, decoupled = (
        scale * samples(flights.sel(model=model), "tip_position", "axis") for model in PLANTS
    )
    pair = (coupled, decoupled) if reference == REFERENCE else (decoupled, coupled)
    return float(nrmse(*pair))


def units_of_the_table(evidence: Evidence) -> Judgement:
    """IV-A.8: has the printed metric the units of the table?"""
    entry = evidence.open_loop.results["tests"]["B"]["decoupled"]
    once, doubled = nrmse_of(evidence, "B"), nrmse_of(evidence, "B", 2.0)
    return judged(
        abs(doubled / once - 2.0) < 1e-9,
        "the printed metric divides metres by metres, and the table prints m and rad; in Test B "
        f"it is {entry['nrmse_t']:.3g} where the RMSE is {entry['rmse_t_m']:.3g} m, so the table "
        "may list the RMSE",
        nrmse_t_test_b=entry["nrmse_t"],
        rmse_t_test_b_m=entry["rmse_t_m"],
    )


def table(evidence: Evidence) -> Judgement:
    """IV-A.T1: does this vehicle give the eight numbers under one reading of the metric?"""
    tests = evidence.open_loop.results["tests"]
    readings = {
        "NRMSE as printed": ("nrmse_t", "nrmse_r"),
        "RMSE": ("rmse_t_m", "rmse_r_rad"),
        "RMSE and the angle between attitudes": ("rmse_t_m", "angle_rad"),
    }
    hits = {
        name: sum(
            abs(tests[letter]["decoupled"][key] / PRINTED[letter][printed] - 1.0) <= SAME
            for letter in OPEN_LOOP_TESTS
            for key, printed in zip(keys, ("nrmse_t", "nrmse_r"), strict=True)
        )
        for name, keys in readings.items()
    }
    best = max(hits, key=lambda name: hits[name])
    return judged(
        hits[best] == 8,
        f"read as {best}, {hits[best]} of the eight numbers come out within 10 %; the paper does "
        "not print its vehicle, and a search over thousands of vehicles found none that gives all "
        "eight",
        **{f"numbers within 10 %, {name}": float(count) for name, count in hits.items()},
    )


JUDGES = {
    "IV.2": identical_conditions,
    "IV.3": announced_excitations,
    "IV.4": varied_parameters,
    "IV-A.3": strong_actuation,
    "IV-A.4": free_fall,
    "IV-A.5": excitation_of_the_arm,
    "IV-A.6": wrench_at_the_tip,
    "IV-A.7": metric,
    "IV-A.8": units_of_the_table,
    "IV-A.T1": table,
}
"""Judge of every sentence of these sections, by its id."""
