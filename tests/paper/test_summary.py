"""Judges of abstract and conclusions: other physics, and other results, turn their verdicts."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair import equations
from continuair.studies.open_loop.study import OpenLoop
from continuair.studies.paper.drawn import Drawn, _rotation
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import (
    complexity,
    conclusions,
    open_loop,
    straight,
    summary,
    swing,
)
from continuair.studies.sensitivity.study import Sensitivity
from continuair.studies.tracking.study import Tracking
from continuair.studies.verdicts import NOT_REPRODUCED, REPRODUCED
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


def open_loop_of(position: dict[str, float], rotation: dict[str, float] | None = None) -> OpenLoop:
    turned = rotation or position
    tests = {
        test: {"decoupled": {"rmse_t_m": error, "rmse_r_rad": turned[test]}}
        for test, error in position.items()
    }
    return OpenLoop({"tests": tests}, {})


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
    for row in two.results["sweeps"]["arm radius"]["rows"]:
        row["models"]["decoupled"]["converged"] = False
    assert judged(two) == NOT_REPRODUCED


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
    found = given.evidence(sensitivity=None, sensitivity_hertz=None)
    assert conclusions.long_arms(found).verdict == verdict


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
    def judged(distance: float) -> str:
        flights = given.letters(lambda t, _: 0 * t, lambda t, _: distance + 0 * t)
        runs = flights.isel(letter=slice(0, 3)).rename(letter="run")
        study = Sensitivity({}, {"Young's modulus": runs})
        return conclusions.passive_arm(given.evidence(sensitivity=study)).verdict

    assert judged(0.01) == REPRODUCED
    assert judged(0.2) == NOT_REPRODUCED


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


def test_turns_whose_angles_are_lost_are_judged_by_the_angle_between_tips() -> None:
    """A number that is none is no largest one."""
    few, lost = np.full(10, 0.5), np.full(10, np.nan)
    euler = {"A": lost, "B": few, "C": few, "D": few}
    angle = {"A": 0.1 * few, "B": few, "C": few, "D": 2.0 * few}
    np.testing.assert_array_equal(list(_rotation(euler, angle).values()), list(angle.values()))
    whole = {"A": few, "B": few, "C": few, "D": few}
    np.testing.assert_array_equal(list(_rotation(whole, angle).values()), list(whole.values()))
    study = open_loop_of(dict.fromkeys("ABCD", 1.0), {"A": np.nan, "B": 0.2, "C": 0.3, "D": 0.4})
    for name, value in zip("ABCD", (0.05, 0.2, 0.3, 0.4), strict=True):
        study.results["tests"][name]["decoupled"]["angle_rad"] = value
    drawn = Drawn(whole, _rotation(euler, angle), few)
    found = open_loop.rotation_by_test(given.evidence(open_loop=study, drawn=drawn))
    assert found.verdict == NOT_REPRODUCED
    assert "(as the angle between the tips) is 0.05, 0.2, 0.3, 0.4 rad" in found.evidence
