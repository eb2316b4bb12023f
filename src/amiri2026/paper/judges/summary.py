"""Judges of the abstract and of the conclusions on the models, V.1 to V.5."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from amiri2026.extremes import largest, largest_of
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import (
    complexity,
    conclusions,
    near_straight,
    regularised,
    straight,
)
from amiri2026.paper.judges.conclusions import ARM, UAV, share_of_range
from amiri2026.paper.judges.errors import (
    BLOCKS,
    TABLE_VEHICLE,
    TipErrors,
    as_cases,
    tip_errors,
)
from amiri2026.paper.judges.kept import FINE, UNRESOLVED, is_unresolved
from amiri2026.paper.judges.loops import (
    GRAVITY,
    OFF,
    OURS,
    PRINTED_G,
    Loop,
    over_loops,
    reading,
)
from amiri2026.paper.judges.settled import if_settled
from amiri2026.paper.judges.times import (
    by_margin,
    cost_case,
    measured,
    saving,
    seconds,
    unexplained,
)
from amiri2026.paper.judges.words import NEGLIGIBLE, PRONOUNCED, SAME
from amiri2026.sensitivity.findings import column, if_converged, listed
from amiri2026.verdicts import (
    UNDECIDED,
    Case,
    Judgement,
    all_of,
    judged,
    judged_alike,
    over_cases,
)
from continuair import Scenario, equations, forward_dynamics, load_vehicle, simulate
from continuair.analysis import percent, samples
from continuair.kernels import PLANTS
from continuair.warning import untold

Array = np.ndarray


def singularity(evidence: Evidence) -> Judgement:
    """Judge abstract.4: are the dynamics right near the straight arm, for some threshold?"""
    vehicle, table1 = evidence.vehicle, load_vehicle(TABLE_VEHICLE)
    flights = [
        *(regularised.fly_with(vehicle, test, near_straight.FLOWN_KAPPA_S) for test in "BC"),
        *(regularised.fly_with(table1, test, table1.arm.kappa_s) for test in "BD"),
    ]
    return over_cases(
        [*straight.as_cases(vehicle), *map(regularised.as_case, flights)],
        "In Test B the arm swings through straight in its plane; in C and D ψa turns at thousands "
        "of rad/s near straight. The paper prints neither κ_s nor whether it enters before or "
        "after C is derived",
    )


def discrepancies(evidence: Evidence) -> Judgement:
    """Abstract.8: are errors pronounced, most of all with torques on the arm and its parameters?"""

    def view(found: TipErrors) -> Judgement:
        of_arm = (error / found.scale for error in found.position.values())
        told = f" ({', '.join(map(percent, of_arm))} of the arm's length)" * bool(found.units[0])
        return judged_alike(
            (
                each["C"] > NEGLIGIBLE * found.scale and largest_of(each) == "C"
                for each in found.positions
            ),
            f"the error in position is {found.moved()}{told} in Tests A to D, largest in "
            f"{largest_of(found.position)}",
            **found.position_numbers(),
        )

    return over_cases([*as_cases(tip_errors(evidence), view), _spread_over_sweeps(evidence)])


def _spread_over_sweeps(evidence: Evidence) -> Case:
    """Return whether the error varies more over a sweep of the arm than over those of the UAV."""
    sweeps = evidence.sensitivity.results["sweeps"]
    spread = {name: float(np.ptp(column(sweep["rows"], "error"))) for name, sweep in sweeps.items()}
    most, other = (largest_of({name: spread[name] for name in part}) for part in (ARM, UAV))
    found = judged(
        spread[most] > spread[other],
        f"the horizontal error varies by {spread[most]:.2g} m over the sweep of {most}, and by "
        f"{spread[other]:.2g} m over that of {other}",
        **{f"spread over {name} [m]": spread[name] for name in (most, other)},
    )
    reading = f"{BLOCKS}, sweeps of the arm and of the UAV"
    return Case(evidence.vehicle.name, reading, if_converged(sweeps.values(), found))


def on_par(evidence: Evidence) -> Judgement:
    """Abstract.9: are both plants tracked alike to less than a pixel, the decoupled one cheaper?"""
    return over_loops(
        evidence,
        alike_to_a_pixel,
        (OFF, PRINTED_G),
        cases=(cost_case(evidence),),
        note=f"Subpixel is read as below 1 px. {OURS}",
    )


def alike_to_a_pixel(loop: Loop) -> Judgement:
    """Return whether the RMS feature errors of the two plants differ by less than a pixel."""
    off = {
        name: abs(entry["decoupled"]["rms_px"] - entry["coupled"]["rms_px"])
        for name, entry in loop.entries.items()
    }
    return judged(
        largest(off.values()) < 1.0,
        f"the RMS feature errors of the two plants differ by {listed(off.values())} px on "
        f"{', '.join(off)}",
        **{f"difference of the RMS feature errors, {name} [px]": off[name] for name in off},
    )


def cost_of_elasticity(evidence: Evidence) -> Judgement:
    """Judge V.1: does the bending arm take most of the time, and more than the coupling?"""
    taken = complexity.readable_times(evidence.vehicle)
    arm, spring = 1.0 - taken["UAV"] / taken["whole"], taken["spring"] / taken["whole"]
    dynamics = seconds(evidence, "dynamics")
    coupling = 1.0 - dynamics["decoupled"] / dynamics["coupled"]
    view = Judgement(
        by_margin(evidence, min(arm - 0.5, arm - coupling)),
        f"of an evaluation of Eq. (10) in readable form the bending arm takes {percent(arm)}, for "
        "the integrals over its backbone and their slopes. The elastic force alone, which is "
        f"linear in the bend, takes {percent(spring)}. The coupling takes {percent(coupling)} of "
        "the dynamics in compiled form",
        times={f"readable form, {name} [s]": value for name, value in taken.items()}
        | measured(evidence),
    )
    reading = "elastic elements read as the whole bending arm"
    return over_cases([Case(evidence.vehicle.name, reading, view)])


_KEPT = 1e-6
"""A share by which energy and momenta may drift and count as kept."""


@untold("error_estimate")
def mutual_interactions(evidence: Evidence) -> Judgement:
    """Judge V.2: does the coupled model keep energy and both momenta in free flight?"""
    q, qd = (0.0, 0.0, 5.0, 0.1, -0.2, 0.3, 0.5, 0.4), (0.5, -0.3, 0.2, 0.5, 0.4, -0.6, 1.0, 0.8)
    free = Scenario("free flight", q, qd, gravity=0.0)
    undamped = evidence.vehicle.replace({"arm.damping": 0.0, "arm.damping_ratio": None})
    kept = ("kinetic_energy", "elastic_energy", "linear_momentum", "angular_momentum")

    data = simulate(undamped, free, sample=1e-2, variables=kept, rtol=FINE, check=True)
    drifts = {
        "energy": _drift((data[kept[0]] + data[kept[1]]).to_numpy()[:, None]),
        "linear momentum": _drift(samples(data, kept[2], "axis")),
        "angular momentum": _drift(samples(data, kept[3], "axis")),
    }
    worst = largest(drifts.values())
    if is_unresolved(worst, _KEPT, float(data["error_estimate"])):
        return Judgement(UNDECIDED, UNRESOLVED)
    view = judged(
        worst < _KEPT,
        "in 1 s of free flight without gravity and damping, energy and both momenta of the coupled "
        f"model drift by {_bound(worst)} of their size",
        # Smaller ones are rounding.
        **{f"drift of the {name}, share": max(drift, 1e-9) for name, drift in drifts.items()},
    )
    return over_cases([Case(evidence.vehicle.name, "free flight", view)])


def _drift(values: Array) -> float:
    """Largest change from the start of values (time, components), as a share of their norm."""
    return float(np.abs(values - values[0]).max() / np.linalg.norm(values[0]))


def _bound(share: float) -> str:
    return "less than 1e-6" if share < _KEPT else f"{share:.1g}"


def more_complex(evidence: Evidence) -> Judgement:
    """V.3: has the coupled model at least twice the operations, by either meaning of decoupled?"""
    names = {
        "diagonal": "every off-diagonal element zero",
        "block": "blocks between UAV and arm zero",
    }
    count = {mask: complexity.terms(evidence.vehicle, mask) for mask in ("coupled", *names)}
    cases = [
        Case(evidence.vehicle.name, reading, more_terms(count["coupled"], count[mask]))
        for mask, reading in names.items()
    ]
    more = 1.0 / (1.0 - saving(evidence)) - 1.0
    dynamics = seconds(evidence, "dynamics")
    found = over_cases(
        cases,
        "Simulink's times (45 % more) cannot be compared. In compiled form the coupled plant takes "
        f"{percent(abs(more))} {'more' if more > 0.0 else 'less'} time per sampling instant than "
        f"the one with zero blocks, and {dynamics['coupled'] / dynamics['decoupled']:.2f} times "
        "the time for the dynamics alone; these times do not decide",
    )
    return replace(found, times=measured(evidence))


def more_terms(coupled: int, decoupled: int) -> Judgement:
    """Return whether the coupled model has at least twice the terms."""
    return judged(
        coupled >= PRONOUNCED * decoupled,
        f"M q̈ + C q̇ has {coupled} non-zero terms in the coupled model and {decoupled} in the "
        f"decoupled one, {coupled / decoupled:.2f} times as many",
        terms_coupled=float(coupled),
        terms_decoupled=float(decoupled),
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
        name: share_of_range(data, entry["relative_error"] * entry["rmse_t_m"])
        for name, (data, entry) in flights.items()
    }
    letters = evidence.tracking.datasets["nominal"].rename(letter="run")
    estimates = letters["error_estimate"].sel(model=list(PLANTS)).sum("model")
    errors = estimates * evidence.vehicle.arm.length
    closed = {
        str(name): share_of_range(letters.sel(run=[name]), float(errors.sel(run=name)))
        for name in letters["run"].to_numpy()
    }
    told = ", ".join(f"{percent(share)} {name}" for name, share in passive.items())
    name = evidence.vehicle.name
    of_passive = judged(
        largest(passive.values()) < NEGLIGIBLE,
        f"the tip's error is {told} of the range of its horizontal motion",
        **{f"error over range, {each}": share for each, share in passive.items()},
    )
    of_closed = judged(
        largest(closed.values()) < NEGLIGIBLE,
        f"the tip's error is at most {percent(largest(closed.values()))} of that range over the "
        "letters, the start included",
        **{f"error over range, {each}": share for each, share in closed.items()},
    )
    return over_cases(
        [
            Case(name, "passive arm", of_passive),
            Case(name, f"closed loop, {reading(evidence, OFF, GRAVITY)}", of_closed),
            cost_case(evidence),
        ],
        f"The errors include those of the integration. {OURS}",
    )


def what_is_saved(evidence: Evidence) -> Judgement:
    """Judge V.5: do the blocks left out of the dynamics, and nothing else, make the saving?"""
    q, qd = np.array([0.0, 0, 5, 0.1, 0.2, 0.3, 0.8, 0.4]), np.linspace(0.3, 1.0, 8)
    ours = forward_dynamics(evidence.vehicle, q, qd, model="decoupled")
    literal = equations.forward_dynamics(evidence.vehicle, q, qd, mask="block")
    off = float(np.abs(ours - literal).max() / np.abs(literal).max())
    left, saved = unexplained(evidence), saving(evidence)
    literally = judged(
        off < 1e-9,
        "the compiled decoupled model differs from Eq. (10) without the blocks between UAV and arm "
        f"by {'rounding' if off < 1e-9 else percent(off)} only",
    )
    of_times = Judgement(
        by_margin(evidence, min(SAME - abs(left), saved)),
        f"decoupling saves {percent(saved)} of the time per sampling instant. With the saving in "
        f"the dynamics added back, the time differs by {percent(abs(left))} from that of the "
        "coupled plant",
        times=measured(evidence),
    )
    view = all_of([literally, of_times])
    return over_cases([Case(evidence.vehicle.name, "compiled form on this machine", view)])


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
