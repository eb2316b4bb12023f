"""Judges of abstract and conclusions: other physics, and other results, turn their verdicts."""

import copy
from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.studies.open_loop.study import OpenLoop
from continuair.studies.paper.drawn import MOMENT_ON_UAV, Drawn, _rotation
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import (
    complexity,
    conclusions,
    open_loop_errors,
    straight,
    summary,
    swing,
)
from continuair.studies.sensitivity.study import Sensitivity
from continuair.studies.tracking.study import Tracking
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED, UNDECIDED
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


def open_loop_of(position: dict[str, float], rotation: dict[str, float] | None = None) -> OpenLoop:
    turned = rotation or position
    tests = {
        test: {
            "coupled": {"converged": True},
            "decoupled": {
                "rmse_t_m": error,
                "rmse_r_rad": turned[test],
                "angle_rad": turned[test],
                "converged": True,
            },
        }
        for test, error in position.items()
    }
    return OpenLoop({"tests": tests, "coarser_steps": {test: [] for test in tests}}, {})


def hanging(study: OpenLoop, test: str, **coarser: float) -> OpenLoop:
    """The study with a test that has not converged, and its metrics at a coarser step."""
    results = copy.deepcopy(study.results)
    entries = results["tests"][test]
    entries["decoupled"]["converged"] = False
    results["coarser_steps"][test] = [{"decoupled": entries["decoupled"] | coarser}]
    return OpenLoop(results, {})


def test_one_threshold_has_to_keep_the_straight_arm_right_and_finite(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given_vehicle = given.evidence()
    assert summary.singularity(given_vehicle).verdict == REPRODUCED
    true = straight.without_singularity(given_vehicle.vehicle)
    monkeypatch.setattr(straight, "THRESHOLDS", (1e-2, 1e-3))
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true + 50 * k)
    assert summary.singularity(given_vehicle).verdict == REPRODUCED
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true + 5000 * k)
    assert summary.singularity(given_vehicle).verdict == NOT_REPRODUCED
    monkeypatch.setattr(straight, "with_threshold", lambda vehicle, k, **_: true * np.nan)
    assert summary.singularity(given_vehicle).verdict == NOT_REPRODUCED


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


def test_discrepancies_are_pronounced_only_if_torques_and_arm_tell_most() -> None:
    torques = open_loop_of({"A": 0.01, "B": 0.1, "C": 0.3, "D": 0.2})
    force = open_loop_of({"A": 0.01, "B": 0.1, "C": 0.2, "D": 0.3})
    of_arm, of_uav = swept(arm_length=(1.0, 3.0)), swept(UAV_mass=(1.0, 3.0))

    def judged(open_loop: OpenLoop, sensitivity: Sensitivity) -> str:
        found = given.evidence(open_loop=open_loop, sensitivity=sensitivity)
        return summary.discrepancies(found).verdict

    assert judged(torques, of_arm) == REPRODUCED
    assert judged(force, of_arm) == judged(torques, of_uav) == NOT_REPRODUCED
    # Where a coarser step says otherwise of what has not converged, nothing is known.
    assert judged(hanging(torques, "C", rmse_t_m=0.25), of_arm) == REPRODUCED
    assert judged(hanging(torques, "C", rmse_t_m=0.15), of_arm) == UNDECIDED
    assert judged(torques, unsettled(of_arm, "arm length")) == UNDECIDED


def test_errors_a_pixel_apart_are_not_on_par() -> None:
    def judged(decoupled: float) -> str:
        entry = {"coupled": {"rms_px": 1.0}, "decoupled": {"rms_px": decoupled}}
        study = Tracking({"letters": dict.fromkeys(given.LETTERS, entry)}, {})
        return summary.on_par(given.evidence(tracking=study, cost=CHEAPER)).verdict

    assert judged(1.9) == REPRODUCED
    assert judged(2.1) == NOT_REPRODUCED


def test_the_uav_alone_is_the_vehicle_with_an_arm_of_no_weight() -> None:
    q, qd = np.linspace(0.3, 1.0, 8), np.linspace(1.0, 0.3, 8)
    vehicle = ca.load_vehicle("paper").replace({"arm.density": 1e-6})
    light = equations.forward_dynamics(vehicle, q, qd, mask="block")[:6]
    np.testing.assert_allclose(complexity.uav_alone(vehicle, q, qd), light, atol=1e-6)


def test_the_arm_takes_most_of_the_readable_form_unless_the_uav_alone_took_as_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert summary.cost_of_elasticity(given.evidence(cost=CHEAPER)).verdict == REPRODUCED
    slow = {"whole": 1.0, "spring": 0.01, "UAV": 0.9}
    monkeypatch.setattr(complexity, "readable_times", lambda vehicle: slow)
    assert summary.cost_of_elasticity(given.evidence(cost=CHEAPER)).verdict == NOT_REPRODUCED


def test_free_flight_keeps_momentum_with_the_coupled_model_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert summary.mutual_interactions(given.evidence()).verdict == REPRODUCED
    # A short arm is fast: what a step loses is not what the model loses.
    short = Evidence(ca.load_vehicle("paper").replace({"arm.length": 0.3}))
    assert summary.mutual_interactions(short).verdict == REPRODUCED

    def decoupled(*scene: Any, **options: Any) -> Any:
        return ca.simulate(*scene, **options, model="decoupled")

    monkeypatch.setattr(summary, "simulate", decoupled)
    assert summary.mutual_interactions(given.evidence()).verdict == NOT_REPRODUCED


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


def test_twice_the_terms_and_a_clearly_longer_time_would_be_more_complex(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def judged(terms: int, cost: dict[str, Any]) -> str:
        counts = {"coupled": terms, "block": 100}
        monkeypatch.setattr(complexity, "terms", lambda vehicle, mask: counts[mask])
        return summary.more_complex(given.evidence(cost=cost)).verdict

    slower, alike = CHEAPER, given.cost((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert judged(220, slower) == REPRODUCED
    assert judged(150, slower) == judged(220, alike) == NOT_REPRODUCED


def test_two_strong_parameters_make_a_structure_that_matters() -> None:
    def judged(study: Sensitivity) -> str:
        return conclusions.structure(given.evidence(sensitivity=study)).verdict

    one = swept(arm_radius=(1.0, 1.0, 3.0), initial_bend=(1.0, 9.0))
    two = swept(arm_radius=(1.0, 1.0, 3.0), arm_length=(1.0, 2.5))
    assert judged(two) == REPRODUCED
    assert judged(one) == NOT_REPRODUCED
    # One that hangs on the step may be strong or not.
    assert judged(unsettled(two, "arm radius")) == judged(unsettled(one, "UAV mass")) == UNDECIDED
    assert judged(unsettled(two, "UAV mass")) == REPRODUCED
    assert judged(unsettled(swept(), "UAV mass")) == NOT_REPRODUCED


def test_an_appendix_of_an_arm_that_points_up_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert conclusions.downward(given.evidence()).verdict == REPRODUCED
    slopes, printed = equations.arm_jacobian, equations.appendix_b

    def of_arm_above(*state: Any) -> tuple[Array, Array]:
        linear, angular = slopes(*state)
        return linear * np.array([[1.0], [1.0], [-1.0]]), angular

    monkeypatch.setattr(equations, "arm_jacobian", of_arm_above)
    assert conclusions.downward(given.evidence()).verdict == NOT_REPRODUCED
    monkeypatch.setattr(equations, "arm_jacobian", slopes)
    monkeypatch.setattr(equations, "appendix_b", lambda *state: tuple(-m for m in printed(*state)))
    assert conclusions.downward(given.evidence()).verdict == NOT_REPRODUCED


def test_frequency_amplitude_and_phase_are_told_apart() -> None:
    time = np.linspace(0.0, 20.0, 4001)
    one = np.exp(2j * np.pi * time)
    found = swing.differences(one, 1.2 * one * np.exp(0.3j))
    assert found["amplitude"] == pytest.approx(0.2)
    assert found["phase"] == pytest.approx(0.3)
    assert found["frequency"] == pytest.approx(0.0, abs=1e-9)
    assert swing.differences(one, np.exp(2.2j * np.pi * time))["frequency"] == pytest.approx(
        0.1, rel=1e-2
    )


@pytest.mark.parametrize(
    ("short", "long", "verdict"),
    [(0.05, 0.2, REPRODUCED), (0.3, 0.2, NOT_REPRODUCED), (0.01, 0.05, NOT_REPRODUCED)],
)
def test_the_oscillation_is_missed_only_if_off_by_a_tenth_and_more_than_if_short(
    short: float, long: float, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    off = {"frequency": (0.0, 0.0), "amplitude": (0.0, 0.0), "phase": (short, long)}
    monkeypatch.setattr(conclusions, "_oscillation", lambda vehicle, study: off)
    study = swept()
    found = given.evidence(sensitivity=study, sensitivity_hertz=study)
    assert conclusions.long_arms(found).verdict == verdict
    found = given.evidence(sensitivity=unsettled(study, "arm length"), sensitivity_hertz=study)
    assert conclusions.long_arms(found).verdict == UNDECIDED
    off["phase"] = (short, np.nan)
    lost = given.evidence(sensitivity=study, sensitivity_hertz=study)
    assert "sin(2π f t): cannot be decided" in conclusions.long_arms(lost).evidence


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
    def judged(distance: float, sweeps: Sensitivity) -> str:
        flights = given.letters(lambda t, _: 0 * t, lambda t, _: distance + 0 * t)
        runs = flights.isel(letter=slice(0, 3)).rename(letter="run")
        study = Sensitivity(sweeps.results, {"Young's modulus": runs})
        return conclusions.passive_arm(given.evidence(sensitivity=study)).verdict

    assert judged(0.01, swept()) == REPRODUCED
    assert judged(0.2, swept()) == NOT_REPRODUCED
    assert judged(0.01, unsettled(swept(), "Young's modulus")) == UNDECIDED


def test_both_named_conditions_have_to_be_good() -> None:
    def judged(passive: float, closed: float) -> str:
        of = {
            name: given.letters(lambda t, _: 0 * t, lambda t, _, d=d: d + 0 * t)
            for name, d in {"passive": passive, "closed": closed}.items()
        }
        run = of["passive"].isel(letter=[0]).rename(letter="run")
        entry = {"step_halving_error": 0.01, "rmse_t_m": passive}
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

    assert judged(0.01, 0.01) == REPRODUCED
    assert judged(0.2, 0.01) == judged(0.01, 0.2) == NOT_REPRODUCED


def test_actuation_is_judged_by_the_preset_and_by_most_vehicles() -> None:
    def judged(turned: float, moved: float, of_drawn: float) -> str:
        one = np.ones(10)
        drawn = Drawn({"A": one, "C": of_drawn * one}, {"A": of_drawn * one, "C": one}, one)
        study = open_loop_of({"A": 1.0, "B": 0.1, "C": moved}, {"A": turned, "B": 0.1, "C": 1.0})
        return conclusions.modes_of_actuation(given.evidence(open_loop=study, drawn=drawn)).verdict

    assert judged(1.5, 3.0, 3.0) == REPRODUCED
    assert judged(0.9, 3.0, 3.0) == judged(1.5, 1.5, 3.0) == judged(1.5, 3.0, 0.5)
    assert judged(1.5, 3.0, 0.5) == NOT_REPRODUCED


def test_what_hangs_on_the_step_of_a_test_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """IV-A.9 to 13 and V.12 with a Test C that has not converged."""
    one = np.ones(10)
    position = {"A": 0.1 * one, "B": one, "C": 3.0 * one, "D": 2.0 * one}
    turned = position | {"A": 9.0 * one}
    drawn = Drawn(position | {MOMENT_ON_UAV: 0.05 * one}, turned, 10.0 * one)
    study = open_loop_of(
        {"A": 0.01, "B": 0.1, "C": 0.36, "D": 0.2}, {"A": 1.04, "B": 0.1, "C": 0.9, "D": 0.1}
    )

    def judged(judge: Any, **coarser: float) -> str:
        flown = hanging(study, "C", **coarser)
        return str(judge(given.evidence(open_loop=flown, drawn=drawn)).verdict)

    for judge, other in (
        (open_loop_errors.largest_errors, {"rmse_t_m": 0.5}),
        (open_loop_errors.position_by_test, {"rmse_t_m": 0.15}),
        (open_loop_errors.rotation_by_test, {"rmse_r_rad": 1.1}),
        (conclusions.modes_of_actuation, {"rmse_r_rad": 1.1}),
    ):
        assert (judged(judge), judged(judge, **other)) == (REPRODUCED, UNDECIDED)
        # A coarser step that ends the flight early tells nothing.
        assert judged(judge, **dict.fromkeys(other, np.nan)) == UNDECIDED
    study.results["tests"]["C"]["decoupled"] |= {"rmse_t_m": 0.5}
    assert judged(open_loop_errors.position_by_test, rmse_t_m=np.nan) == UNDECIDED
    # What does not ask for Test C is known.
    assert judged(open_loop_errors.actuated_uav, rmse_t_m=9.0) == REPRODUCED
    # A is not last, a moment on the vehicle itself is not harmless.
    study = open_loop_of({"A": 0.03, "B": 0.01, "C": 0.36, "D": 0.2})
    found = given.evidence(open_loop=study, drawn=drawn)
    assert open_loop_errors.position_by_test(found).verdict == NOT_REPRODUCED
    monkeypatch.setattr(open_loop_errors, "error_under_a_moment", lambda vehicle: 0.5)
    assert open_loop_errors.actuated_uav(found).verdict == NOT_REPRODUCED


def test_turns_whose_angles_are_lost_are_judged_by_the_angle_between_tips() -> None:
    """A number that is none is no largest one."""
    few, lost = np.full(10, 0.5), np.full(10, np.nan)
    euler = {"A": lost, "B": few, "C": few, "D": few}
    angle = {"A": 0.1 * few, "B": few, "C": few, "D": 2.0 * few}
    np.testing.assert_array_equal(list(_rotation(euler, angle).values()), list(angle.values()))
    whole = {"A": few, "B": few, "C": few, "D": few}
    np.testing.assert_array_equal(list(_rotation(whole, whole).values()), list(whole.values()))
    # Nor one that ten times the angle is.
    np.testing.assert_array_equal(list(_rotation(whole, angle).values()), list(angle.values()))
    study = open_loop_of(dict.fromkeys("ABCD", 1.0), {"A": np.nan, "B": 0.2, "C": 0.3, "D": 0.4})
    for name, value in zip("ABCD", (0.05, 0.2, 0.3, 0.4), strict=True):
        study.results["tests"][name]["decoupled"]["angle_rad"] = value
    drawn = Drawn(whole, _rotation(euler, angle), few)
    found = open_loop_errors.rotation_by_test(given.evidence(open_loop=study, drawn=drawn))
    assert found.verdict == NOT_REPRODUCED
    assert "(as the angle between the tips) is 0.05, 0.2, 0.3, 0.4 rad" in found.evidence
