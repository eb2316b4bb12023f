"""Judges of abstract and conclusions: other physics, and other results, turn their verdicts."""

import copy
from typing import Any

import numpy as np
import pytest
import xarray as xr

import continuair as ca
from amiri2026.open_loop.study import OpenLoop
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import (
    complexity,
    conclusions,
    straight,
    summary,
)
from amiri2026.paper.judges.loops import Loop
from amiri2026.sensitivity.study import Sensitivity
from amiri2026.tracking.study import Tracking
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, MISPRINT, UNDECIDED
from continuair import equations
from tests.paper import given

Array = np.ndarray

CHEAPER = given.cost((1.0, 0.4, 0.4), (0.6, 0.4, 0.4))
SWEEPS = ("arm radius", "UAV mass", "arm length", "Young's modulus", "initial bend", "initial roll")


def swept(**errors: tuple[float, ...]) -> Sensitivity:
    """Sweeps of a constant error, but those that are named, with _ for spaces."""
    named = {name.replace("_", " "): values for name, values in errors.items()}
    sweeps = {
        name: {
            "rows": [
                {
                    "models": {
                        "coupled": {"converged": True},
                        "decoupled": {"rmse_xy_m": error, "converged": True},
                    }
                }
                for error in named.get(name, (1.0, 1.0, 1.0))
            ]
        }
        for name in SWEEPS
    }
    return Sensitivity({"sweeps": sweeps}, {})


def unsettled(study: Sensitivity, name: str) -> Sensitivity:
    """The study with a row of a sweep that has not converged."""
    results = copy.deepcopy(study.results)
    results["sweeps"][name]["rows"][0]["models"]["decoupled"]["converged"] = False
    return Sensitivity(results, {})


@pytest.mark.long
def test_one_threshold_has_to_keep_the_straight_arm_right_and_finite(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    vehicle = ca.load_vehicle("paper")

    def verdicts() -> list[str]:
        return [case.found.verdict for case in straight.as_cases(vehicle)]

    # Derived terms with κ_s, and κ_s before C is derived.
    assert verdicts() == [HOLDS, FAILS]
    true = straight.without_singularity(vehicle)
    monkeypatch.setattr(straight, "THRESHOLDS", (1e-2, 1e-3))
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true + 50 * k)
    assert verdicts()[0] == HOLDS
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true + 5000 * k)
    assert verdicts() == [FAILS, FAILS]
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true * np.nan)
    assert verdicts() == [FAILS, FAILS]


@pytest.mark.long
def test_a_threshold_in_the_dynamics_is_right_in_the_plane_and_wrong_out_of_it() -> None:
    found = summary.singularity(given.evidence())
    assert found.verdict == DEPENDS
    flights = [(case.vehicle, case.reading[:6], case.found.verdict) for case in found.cases[2:]]
    assert flights == [
        ("paper", "Test B", HOLDS),
        ("paper", "Test C", FAILS),
        ("table1", "Test B", HOLDS),
        ("table1", "Test D", FAILS),
    ]


def test_errors_of_the_threshold_fall_with_it_and_slopes_through_it_fail() -> None:
    vehicle = ca.load_vehicle("paper")
    true = straight.without_singularity(vehicle)
    large, small = (straight.error(straight.with_threshold(vehicle, k), true) for k in (0.1, 1e-3))
    assert large > 10 * small
    lost = straight.with_threshold(vehicle, 1e-3, differentiated=True)
    assert straight.error(lost, true) > 1.0


def test_above_the_threshold_both_coordinates_agree() -> None:
    vehicle = ca.load_vehicle("paper")
    above = np.abs(straight.CURVATURES) > 1e-3
    found = straight.with_threshold(vehicle, 1e-3)[above]
    np.testing.assert_allclose(found, straight.without_singularity(vehicle)[above], rtol=1e-6)


def test_errors_a_pixel_apart_are_not_on_par() -> None:
    def judged(decoupled: float) -> str:
        entry = {"coupled": {"rms_px": 1.0}, "decoupled": {"rms_px": decoupled}}
        letters = Loop("as given", dict.fromkeys(given.LETTERS, entry), xr.Dataset())
        return summary.alike_to_a_pixel(letters).verdict

    assert judged(1.9) == HOLDS
    assert judged(2.1) == FAILS


def test_the_uav_alone_is_the_vehicle_with_an_arm_of_no_weight() -> None:
    q, qd = np.linspace(0.3, 1.0, 8), np.linspace(1.0, 0.3, 8)
    vehicle = ca.load_vehicle("paper").replace({"arm.density": 1e-6})
    light = equations.forward_dynamics(vehicle, q, qd, mask="block")[:6]
    np.testing.assert_allclose(complexity.uav_alone(vehicle, q, qd), light, atol=1e-6)


def test_the_arm_takes_most_of_the_readable_form_unless_the_uav_alone_took_as_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert summary.cost_of_elasticity(given.evidence(cost=CHEAPER)).verdict == HOLDS
    slow = {"whole": 1.0, "spring": 0.01, "UAV": 0.9}
    monkeypatch.setattr(complexity, "readable_times", lambda vehicle: slow)
    assert summary.cost_of_elasticity(given.evidence(cost=CHEAPER)).verdict == DEPENDS


def test_free_flight_keeps_momentum_with_the_coupled_model_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert summary.mutual_interactions(given.evidence()).verdict == HOLDS
    # A short arm is fast.
    short = Evidence(ca.load_vehicle("paper").replace({"arm.length": 0.3}))
    assert summary.mutual_interactions(short).verdict == HOLDS

    def decoupled(*scene: Any, **options: Any) -> Any:
        return ca.simulate(*scene, **options, model="decoupled")

    monkeypatch.setattr(summary, "simulate", decoupled)
    assert summary.mutual_interactions(given.evidence()).verdict == DEPENDS


def test_terms_are_counted_as_they_stand_in_the_equations(monkeypatch: pytest.MonkeyPatch) -> None:
    """x, y and z have a mass each. M₁₇ stands in two rows, and in that of x, M₁₇(Φ, κ, ψa) κ̇ has
    five rates."""
    mass, coupling = np.zeros((8, 8)), np.zeros((8, 8))
    mass[:3, :3] = coupling[0, 6] = coupling[6, 0] = 1.0
    monkeypatch.setitem(equations.MASKS, "mass", mass)
    monkeypatch.setitem(equations.MASKS, "M17", coupling)
    vehicle = ca.load_vehicle("paper")
    assert complexity.terms(vehicle, "mass") == 3
    assert complexity.terms(vehicle, "M17") == 2 + 5
    assert complexity.terms(vehicle, "coupled") > complexity.terms(vehicle, "block")


def test_twice_the_terms_would_be_more_complex_by_both_meanings_of_decoupled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def judged(terms: int) -> str:
        counts = {"coupled": terms, "block": 100, "diagonal": 20}
        monkeypatch.setattr(complexity, "terms", lambda vehicle, mask: counts[mask])
        return summary.more_complex(given.evidence(cost=CHEAPER)).verdict

    assert judged(220) == HOLDS
    assert judged(150) == DEPENDS


def test_two_strong_parameters_make_a_structure_that_matters() -> None:
    def judged(study: Sensitivity) -> str:
        return conclusions.strong(study.results["sweeps"], conclusions.STRUCTURE, "").verdict

    one = swept(arm_radius=(1.0, 1.0, 3.0), initial_bend=(1.0, 9.0))
    two = swept(arm_radius=(1.0, 1.0, 3.0), arm_length=(1.0, 2.5))
    assert judged(two) == HOLDS
    assert judged(one) == FAILS
    # One that has not converged may be strong or not.
    assert judged(unsettled(two, "arm radius")) == judged(unsettled(one, "UAV mass")) == UNDECIDED
    assert judged(unsettled(two, "UAV mass")) == HOLDS
    assert judged(unsettled(swept(), "UAV mass")) == FAILS


def test_an_appendix_of_an_arm_that_points_up_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert conclusions.downward(given.evidence()).verdict == HOLDS
    slopes, printed = equations.arm_jacobian, equations.appendix_b

    def of_arm_above(*state: Any) -> tuple[Array, Array]:
        linear, angular = slopes(*state)
        return linear * np.array([[1.0], [1.0], [-1.0]]), angular

    monkeypatch.setattr(equations, "arm_jacobian", of_arm_above)
    assert conclusions.downward(given.evidence()).verdict == MISPRINT
    monkeypatch.setattr(equations, "arm_jacobian", slopes)
    monkeypatch.setattr(equations, "appendix_b", lambda *state: tuple(-m for m in printed(*state)))
    assert conclusions.downward(given.evidence()).verdict == MISPRINT


def test_a_share_of_the_range_is_that_of_the_horizontal_plane() -> None:
    """1 m apart in x, and more in z, on a way of 3 by 4 m: a fifth."""
    flights = given.letters(lambda t, turns: 0.0 * t, lambda t, turns: 1.0 + 0.0 * t)
    one = flights.sel(letter=["M"]).rename(letter="run").isel(time=slice(0, 2))
    tip = np.zeros((2, 1, 2, 3))
    tip[:, 0, 1] = [3.0, 4.0, -100.0]
    tip[1] += [1.0, 0.0, 7.0]
    one["tip_position"] = (("model", "run", "time", "axis"), tip)
    assert conclusions.share_of_range(one) == pytest.approx(0.2)
    assert conclusions.share_of_range(one, 0.5) == pytest.approx(0.3)


def test_an_arm_that_is_far_off_at_one_modulus_is_not_passive_enough() -> None:
    assert conclusions.small([0.01, 0.09, 0.001]).verdict == HOLDS
    assert conclusions.small([0.01, 0.11, 0.001]).verdict == FAILS
    assert conclusions.small([0.01, float("nan"), 0.001]).verdict == UNDECIDED


def test_both_named_conditions_have_to_be_good() -> None:
    def judged(passive: float, closed: float) -> str:
        of = {
            name: given.letters(lambda t, _: 0 * t, lambda t, _, d=d: d + 0 * t)
            for name, d in {"passive": passive, "closed": closed}.items()
        }
        run = of["passive"].isel(letter=[0]).rename(letter="run")
        entry = {"relative_error": 0.01, "rmse_t_m": passive}
        row = {"models": {"decoupled": entry}}
        return summary.certain_conditions(
            given.evidence(
                sensitivity=Sensitivity(
                    {"sweeps": {"initial roll": {"rows": [row]}}}, {"initial roll": run}
                ),
                open_loop=OpenLoop(
                    {"tests": {"A": {"decoupled": entry}}}, {"A": run.isel(run=0, drop=True)}
                ),
                tracking=Tracking({}, {"nominal": of["closed"]}),
                cost=CHEAPER,
            )
        ).verdict

    assert judged(0.01, 0.01) == HOLDS
    assert judged(0.2, 0.01) == judged(0.01, 0.2) == DEPENDS
