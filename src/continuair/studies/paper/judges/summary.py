"""Judges of the abstract and of what the conclusions say of the models, V.1 to V.5."""

from __future__ import annotations

import numpy as np

from continuair import equations
from continuair.analysis.accelerations import forward_dynamics
from continuair.analysis.metrics import samples
from continuair.analysis.shares import percent
from continuair.flight.resolution import steps_told_of
from continuair.flight.simulate import simulate
from continuair.kernels.dynamics import PLANTS
from continuair.scenario.scenarios import Scenario
from continuair.studies.extremes import largest, largest_of, least
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import complexity, conclusions, straight
from continuair.studies.paper.judges.conclusions import ARM, UAV, share_of_range
from continuair.studies.paper.judges.errors import errors, possible
from continuair.studies.paper.judges.settled import if_settled
from continuair.studies.paper.judges.shorter import UNRESOLVED, Losses, left
from continuair.studies.paper.judges.times import (
    by_margin,
    cheaper,
    measured,
    saving,
    seconds,
    unexplained,
)
from continuair.studies.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME, SHORTER
from continuair.studies.sensitivity.findings import column, if_converged, listed
from continuair.studies.verdicts import UNDECIDED, Judgement, all_of, judged, judged_alike

Array = np.ndarray


def singularity(evidence: Evidence) -> Judgement:
    """Abstract.4: are the accelerations right near the straight arm, for some threshold?"""
    true = straight.without_singularity(evidence.vehicle)
    errors = {
        threshold: straight.error(straight.with_threshold(evidence.vehicle, threshold), true)
        for threshold in straight.THRESHOLDS
    }
    told = ", ".join(f"{percent(error)} for {threshold:g}" for threshold, error in errors.items())
    sloped = straight.with_threshold(evidence.vehicle, 1e-3, differentiated=True)
    return judged(
        least(errors.values()) <= 0.01,
        "with κ_s for κ in the terms of Eq. (10), but not in the spring, the accelerations of the "
        f"bend are off by up to {told} 1/m as κ_s, for |κ| up to 0.01 1/m in both signs. Put into "
        "the kinematics before C is derived, which then lacks slopes by κ, 0.001 1/m makes errors "
        f"{straight.error(sloped, true):.2g} times the largest acceleration. The paper prints "
        "neither κ_s nor where it stands",
        # Smaller thresholds lose digits, differently on every machine.
        **{f"error for κ_s of {value:g} 1/m, share": errors[value] for value in (1e-2, 1e-3)},
    )


def discrepancies(evidence: Evidence) -> Judgement:
    """Abstract.8: are errors pronounced, most of all with torques on the arm and its parameters?"""
    length, sweeps = evidence.vehicle.arm.length, evidence.sensitivity.results["sweeps"]
    share = {test: error / length for test, error in errors(evidence).items()}
    spread = {name: float(np.ptp(column(sweep["rows"], "error"))) for name, sweep in sweeps.items()}
    most, other = (largest_of({name: spread[name] for name in part}) for part in (ARM, UAV))
    return all_of(
        [
            judged_alike(
                (
                    each["C"] > NEGLIGIBLE * length and largest_of(each) == "C"
                    for each in possible(evidence)
                ),
                f"the tip's error is {listed(share.values())} of the arm's length in Tests "
                f"{', '.join(share)}, largest in {largest_of(share)}",
                **{f"error over length, Test {test}": value for test, value in share.items()},
            ),
            if_converged(
                sweeps.values(),
                judged(
                    spread[most] > spread[other],
                    f"the horizontal error varies by {spread[most]:.2g} m over the sweep of "
                    f"{most}, and by {spread[other]:.2g} m over that of {other}",
                    **{f"spread over {name} [m]": spread[name] for name in (most, other)},
                ),
            ),
        ],
        "The paper prints no vehicle",
    )


def on_par(evidence: Evidence) -> Judgement:
    """Abstract.9: are both plants tracked alike to less than a pixel, the decoupled one cheaper?"""
    off = {
        name: abs(entry["decoupled"]["rms_px"] - entry["coupled"]["rms_px"])
        for name, entry in evidence.tracking.results["letters"].items()
    }
    alike = judged(
        largest(off.values()) < 1.0,
        f"the RMS feature errors of the two plants differ by {listed(off.values())} px on "
        f"{', '.join(off)} (subpixel read as below 1 px; camera, start and gains are ours)",
        **{f"difference of the RMS feature errors, {name} [px]": off[name] for name in off},
    )
    return all_of([alike, cheaper(evidence)])


def cost_of_elasticity(evidence: Evidence) -> Judgement:
    """V.1: does the bending arm take most of the time, and more than the coupling?"""
    taken = complexity.readable_times(evidence.vehicle)
    arm, spring = 1.0 - taken["UAV"] / taken["whole"], taken["spring"] / taken["whole"]
    dynamics = seconds(evidence, "dynamics")
    coupling = 1.0 - dynamics["decoupled"] / dynamics["coupled"]
    return Judgement(
        by_margin(evidence, min(arm - 0.5, arm - coupling)),
        f"of an evaluation of Eq. (10) in readable form the bending arm takes {percent(arm)}: the "
        "integrals over its backbone and their slopes. The elastic force, which is linear in the "
        f"bend, takes {percent(spring)}, and the coupling {percent(coupling)} of the dynamics in "
        "compiled form",
        times={f"readable form, {name} [s]": value for name, value in taken.items()}
        | measured(evidence),
    )


_KEPT = 1e-6
"""A share by which energy and momenta may drift and count as kept."""


def mutual_interactions(evidence: Evidence) -> Judgement:
    """V.2: does the coupled model keep energy and both momenta in free flight?"""
    q, qd = (0.0, 0.0, 5.0, 0.1, -0.2, 0.3, 0.5, 0.4), (0.5, -0.3, 0.2, 0.5, 0.4, -0.6, 1.0, 0.8)
    free = Scenario("free flight", q, qd, gravity=0.0)
    undamped = evidence.vehicle.replace({"arm.damping": 0.0, "arm.damping_ratio": None})
    kept = ("kinetic_energy", "elastic_energy", "linear_momentum", "angular_momentum")

    def drifts(step: float) -> tuple[Losses, float]:
        with steps_told_of():
            data = simulate(undamped, free, step=step, sample=1e-2, variables=kept)
        return {
            "energy": _drift((data[kept[0]] + data[kept[1]]).to_numpy()[:, None]),
            "linear momentum": _drift(samples(data, kept[2], "axis")),
            "angular momentum": _drift(samples(data, kept[3], "axis")),
        }, float(data["step_error"])

    found = left(map(drifts, SHORTER), _KEPT)
    if found.of_the_step:
        return Judgement(UNDECIDED, UNRESOLVED)
    worst = largest(found.losses.values())
    return judged(
        found.kept,
        "in 1 s of free flight without gravity and damping the coupled model keeps energy and the "
        f"six components of both momenta to {_bound(worst)} of their size",
        # Smaller ones are rounding.
        **{f"drift of the {name}, share": max(drift, 1e-9) for name, drift in found.losses.items()},
    )


def _drift(values: Array) -> float:
    """Largest change from the start of values (time, components), as a share of their norm."""
    return float(np.abs(values - values[0]).max() / np.linalg.norm(values[0]))


def _bound(share: float) -> str:
    return "better than 1e-6" if share < _KEPT else f"{share:.1g}"


def more_complex(evidence: Evidence) -> Judgement:
    """V.3: has the coupled model twice the operations, and does it take a tenth more time?"""
    count = {mask: complexity.terms(evidence.vehicle, mask) for mask in ("coupled", "block")}
    ratio = count["coupled"] / count["block"]
    more = 1.0 / (1.0 - saving(evidence)) - 1.0
    dynamics = seconds(evidence, "dynamics")
    return all_of(
        [
            judged(
                ratio >= PRONOUNCED,
                f"M q̈ + C q̇ has {count['coupled']} terms that are not zero if coupled and "
                f"{count['block']} if decoupled, {ratio:.2f} times as many",
                terms_coupled=float(count["coupled"]),
                terms_decoupled=float(count["block"]),
            ),
            Judgement(
                by_margin(evidence, more - 0.1),
                f"in compiled form the coupled plant takes {percent(more)} more time per sampling "
                f"instant, {percent(dynamics['coupled'] / dynamics['decoupled'] - 1)} more for "
                "its dynamics alone (the paper's 32 and 22 ms: 45 %)",
                times=measured(evidence),
            ),
        ]
    )


def certain_conditions(evidence: Evidence) -> Judgement:
    """V.4: is the decoupled model as good with a passive arm and in closed loop, and cheaper?"""
    # The vehicle as it is: the sweep of the initial roll starts with none.
    sweep = evidence.sensitivity.results["sweeps"]["initial roll"]["rows"][0]
    test = evidence.open_loop.results["tests"]["A"]
    flights = {
        "under the force of the sweeps": (
            evidence.sensitivity.datasets["initial roll"].isel(run=[0]),
            sweep["models"]["decoupled"],
        ),
        "in Test A": (evidence.open_loop.datasets["A"].expand_dims("run"), test["decoupled"]),
    }
    passive = {
        name: share_of_range(data, entry["step_halving_error"] * entry["rmse_t_m"])
        for name, (data, entry) in flights.items()
    }
    letters = evidence.tracking.datasets["nominal"].rename(letter="run")
    by_step = (
        letters["step_error"].sel(model=list(PLANTS)).sum("model") * evidence.vehicle.arm.length
    )
    closed = {
        str(name): share_of_range(letters.sel(run=[name]), float(by_step.sel(run=name)))
        for name in letters["run"].to_numpy()
    }
    told = ", ".join(f"{percent(share)} {name}" for name, share in passive.items())
    return all_of(
        [
            judged(
                largest(passive.values()) < NEGLIGIBLE,
                f"with a passive arm the tip's error is {told} of the range of its horizontal "
                "motion",
                **{f"error over range, {name}": share for name, share in passive.items()},
            ),
            judged(
                largest(closed.values()) < NEGLIGIBLE,
                f"in closed loop it is at most {percent(largest(closed.values()))} over the "
                "letters, the start included",
                **{f"error over range, {name}": share for name, share in closed.items()},
            ),
            cheaper(evidence),
        ],
        "What the step adds is included; vehicle, camera and gains are ours",
    )


def what_is_saved(evidence: Evidence) -> Judgement:
    """V.5: do the blocks left out of the dynamics, and nothing else, make the saving?"""
    q, qd = np.array([0.0, 0, 5, 0.1, 0.2, 0.3, 0.8, 0.4]), np.linspace(0.3, 1.0, 8)
    ours = forward_dynamics(evidence.vehicle, q, qd, model="decoupled")
    literal = equations.forward_dynamics(evidence.vehicle, q, qd, mask="block")
    off = float(np.abs(ours - literal).max() / np.abs(literal).max())
    left, saved = unexplained(evidence), saving(evidence)
    return all_of(
        [
            judged(
                off < 1e-9,
                "the compiled decoupled model is Eq. (10) without the blocks between UAV and arm "
                f"to {'rounding' if off < 1e-9 else percent(off)}",
            ),
            Judgement(
                by_margin(evidence, min(SAME - abs(left), saved)),
                f"decoupling saves {percent(saved)} of the time per sampling instant; with what it "
                "saves in the dynamics put back, the time is that of the coupled plant to "
                f"{percent(abs(left))}",
                times=measured(evidence),
            ),
        ]
    )


JUDGES = {
    "Abstract.4": singularity,
    "Abstract.8": discrepancies,
    "Abstract.9": if_settled(on_par),
    "V.1": cost_of_elasticity,
    "V.2": mutual_interactions,
    "V.3": more_complex,
    "V.4": certain_conditions,
    "V.5": what_is_saved,
    **conclusions.JUDGES,
}
"""Judge of every sentence of the abstract and of V, but those on the closed loop, by its id."""
