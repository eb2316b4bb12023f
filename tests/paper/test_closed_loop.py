"""Judges of the closed loop: flights that are known give the verdict that they should."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import continuair as ca
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import closed_loop, goals, letter, loops, summary
from amiri2026.paper.judges.loops import GRAVITY, OFF, Loop
from amiri2026.paper.judges.strokes import kinds_of_stroke
from amiri2026.tracking.study import Tracking, tracking
from amiri2026.verdicts import DEPENDS, FAILS, HOLDS, UNDECIDED, Judgement
from continuair import equations
from continuair.equations.camera import to_normalised
from continuair.scenario.tracking_task import SETTINGS, equipped
from continuair.typing import Model
from tests.paper import given


@pytest.fixture(scope="module")
def flown() -> Evidence:
    """Letter M on both plants."""
    found = Evidence(ca.load_vehicle("paper"), quick=True)
    study = tracking(found.vehicle, "M", models=["decoupled"], settings=["nominal"])
    found.__dict__["letter"] = study
    return found


GOOD = {"rms_px": 0.1, "out_of_view_samples": 0, "status": 0, "end_time_s": 50.0}
"""A letter that is tracked to its end."""


def results(coupled: dict[str, float], decoupled: dict[str, float]) -> dict[str, Any]:
    return {letter: {"coupled": coupled, "decoupled": decoupled} for letter in given.LETTERS}


def loop(entries: dict[str, Any], flights: Any = None) -> Loop:
    return Loop("as given", entries, flights)


def tracked(
    ds: Any = lambda t, turns: 0.1 + 0 * t, apart: Any = lambda t, turns: 1e-3 + 0 * t
) -> Loop:
    """Four letters with a given DS [px] and distance of the tips [m], of 10 px feature error."""
    entries = results({"rms_px": 10.0}, {"rms_px": 10.0})
    return loop(entries, given.letters(ds, apart, error=10.0))


def in_turns(t: np.ndarray, turns: np.ndarray) -> np.ndarray:
    return np.where(turns, 1.0, 0.1)


def on_lines(t: np.ndarray, turns: np.ndarray) -> np.ndarray:
    return np.where(turns, 0.1, 1.0)


@pytest.mark.long
def test_the_law_is_one_and_no_error_makes_ds(flown: Evidence) -> None:
    found = closed_loop.one_law(flown)
    assert found.verdict == HOLDS
    ds = found.cases[0].found.numbers["RMS of DS, M [px]"]
    assert ds == pytest.approx(
        loops.rms(
            np.linalg.norm(letter.flown(flown, "coupled")["feature_error"], axis=1)
            - np.linalg.norm(letter.flown(flown, "decoupled")["feature_error"], axis=1)
        )
    )


@pytest.mark.long
def test_another_law_on_one_plant_is_noticed(flown: Evidence) -> None:
    flights = flown.letter.datasets["nominal"].copy(deep=True)
    flights["command"].loc[{"model": "decoupled"}] *= 1.01
    changed = given.evidence(letter=Tracking(flown.letter.results, {"nominal": flights}))
    assert closed_loop.one_law(changed).verdict == DEPENDS


@pytest.mark.long
def test_plants_differ_from_the_first_push_on(
    flown: Evidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert closed_loop.states_and_jacobians(flown).verdict == HOLDS
    monkeypatch.setattr(
        letter,
        "accelerations",
        lambda vehicle, model, **state: ca.accelerations(vehicle, **state),
    )
    assert closed_loop.states_and_jacobians(flown).verdict == DEPENDS


@pytest.mark.long
@pytest.mark.parametrize("turned", [0.0, 0.6])
@pytest.mark.parametrize("plant", ["coupled", "decoupled"])
def test_first_accelerations_are_those_of_the_flights(
    flown: Evidence, plant: Model, turned: float
) -> None:
    """Velocity after 0.1 ms of the push, with a camera that turns how the arm is bent."""
    camera = {"camera.attitude": [0.0, 0.0, np.sin(turned / 2.0), np.cos(turned / 2.0)]}
    evidence = given.evidence(vehicle=flown.vehicle.replace(camera))
    flight = letter.fly(evidence, plant, sample=1e-4, duration=1e-3)
    to_world = Rotation.from_quat(flight["attitude"].to_numpy()[1])
    moved = to_world.apply(flight["velocity"].to_numpy()[1] / 1e-4)
    found = letter.first_acceleration(evidence.vehicle, flight.isel(time=0), plant)
    assert np.linalg.norm(found - moved) < 5e-3 * float(np.linalg.norm(moved))


@pytest.mark.long
def test_columns_of_j_l_are_slopes_of_the_image(flown: Evidence) -> None:
    """Moving the UAV by 0.1 mm along an axis moves the image of points that stay."""
    vehicle = flown.vehicle.replace({"arm.kappa_s": 0.0})
    flight = letter.flown(flown, "coupled").isel(time=slice(5, 6))
    q = flight["q"].to_numpy()[0]
    slopes = letter.image_slopes(flight, vehicle)[0]
    at, R = equations.camera_pose(vehicle, q)
    seen = to_normalised(vehicle.camera, flight["features"].to_numpy()[0]).reshape(-1, 2)
    depth = flight["depth"].to_numpy()[0]
    points = at + np.column_stack([seen * depth[:, None], depth]) @ R.T
    h = 1e-4
    for axis in range(3):
        shift = h * np.eye(8)[axis]
        ahead, behind = (equations.look(vehicle, q + by, points)[0] for by in (shift, -shift))
        np.testing.assert_allclose(slopes[:, axis], (ahead - behind) / (2 * h), atol=1e-7)


@pytest.mark.long
def test_coupling_force_is_that_of_the_blocks_between_uav_and_arm(flown: Evidence) -> None:
    """M_ua q̈_a + C_ua q̇_a and M_uu q̈_u + C_uu q̇_u of the readable form, 50 ms after the start."""
    vehicle = equipped(flown.vehicle, SETTINGS["nominal"])
    coupling, own = letter.forces_on_uav(flown)
    at = 5
    flight = letter.flown(flown, "coupled")
    q = flight["q"].to_numpy()
    again = letter.fly(flown, "coupled", sample=1e-4, duration=0.1, variables=["q"])
    q_dot = np.gradient(again["q"], 1e-4, axis=0)
    rates = q_dot[at * 100]
    accelerations = np.gradient(q_dot, 1e-4, axis=0)[at * 100]
    M, C = equations.mass_matrix(vehicle, q[at]), equations.coriolis_matrix(vehicle, q[at], rates)
    for part, expected in ((slice(6, 8), coupling[at]), (slice(0, 6), own[at])):
        force = M[:3, part] @ accelerations[part] + C[:3, part] @ rates[part]
        assert np.linalg.norm(force) == pytest.approx(expected, rel=0.02)


def test_the_arm_of_the_r_is_half_a_circle_and_the_l_has_only_straight_strokes() -> None:
    assert kinds_of_stroke("L") == {"straight along an axis": 1.0, "inclined": 0.0, "curved": 0.0}
    leg = np.hypot(0.4, 0.5)
    length = 1.0 + 0.4 + 0.25 * np.pi + 0.15 + leg
    share = kinds_of_stroke("R")
    assert share["curved"] == pytest.approx(0.25 * np.pi / length, rel=1e-2)
    assert share["inclined"] == pytest.approx(leg / length, rel=1e-2)


def test_differences_count_where_the_target_turns_and_not_at_the_start() -> None:
    found = closed_loop.in_turns(tracked(in_turns, in_turns))
    assert found.verdict == HOLDS
    # Of a norm of 10 px, 0.1 px.
    assert found.numbers["DS on straight parts, share of the error, M"] == pytest.approx(0.01)
    assert closed_loop.in_turns(tracked(in_turns, on_lines)).verdict == FAILS
    assert closed_loop.in_turns(tracked(on_lines, in_turns)).verdict == FAILS

    def late(t: np.ndarray, turns: np.ndarray) -> np.ndarray:
        return np.where(t < 2.0, 30.0, in_turns(t, turns))

    assert closed_loop.in_turns(tracked(late, late)).verdict == HOLDS


def test_the_limit_of_ds_is_one_of_whole_letters() -> None:
    def judged(early: float, late: float) -> str:
        entry = {"ds_max_px_before_2s": early, "ds_max_px_after_2s": late}
        return closed_loop.below_limit(loop(results({}, entry))).verdict

    assert judged(0.6, 0.6) == HOLDS
    assert judged(0.8, 0.1) == judged(0.1, 0.8) == FAILS


def test_one_letter_that_is_tracked_worse_is_an_impact() -> None:
    def judged(decoupled: float) -> str:
        letters = results({"rms_px": 1.0, "tip_rms_m": 1.0}, {"rms_px": 1.0, "tip_rms_m": 1.0})
        letters["A"] = letters["A"] | {"decoupled": {"rms_px": decoupled, "tip_rms_m": 1.0}}
        return closed_loop.tracked_alike(loop(letters)).verdict

    assert judged(1.05) == HOLDS
    assert judged(0.85) == FAILS


@pytest.fixture
def choices(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A function that gives a sentence's verdict for |DS| from our start, and under all others."""
    entry = {"status": 0, "error_estimate": 1e-5}

    def of(ds: float, other: float, ended: int = 0) -> Judgement:
        def with_ds(ds: float) -> dict[str, Any]:
            decoupled = {"ds_max_px_before_2s": ds, "ds_max_px_after_2s": ds, "status": ended}
            return results(entry, entry | decoupled)

        study = Tracking({"letters": with_ds(ds), "variants": []}, {"nominal": xr.Dataset()})
        monkeypatch.setattr(loops, "varied", lambda *_: loop(with_ds(other)))
        return closed_loop.largest_ds(given.evidence(tracking=study))

    return of


def test_what_holds_from_one_start_and_not_from_another_depends_on_it(choices: Any) -> None:
    assert choices(0.1, 0.1).verdict == HOLDS
    assert choices(28.0, 0.1).verdict == choices(0.1, 28.0).verdict == DEPENDS
    assert len(choices(0.1, 0.1).cases) == 3


def test_other_choices_are_not_flown_where_ours_ends_early(choices: Any) -> None:
    assert len(choices(np.nan, 0.1, ended=2).cases) == 1


@pytest.mark.long
def test_from_the_desired_image_errors_begin_small() -> None:
    vehicle = ca.load_vehicle("paper")
    study = tracking(vehicle, "ML", models=["decoupled"], settings=["nominal"])
    evidence = given.evidence(tracking=study)
    ours = loops.nominal(evidence)
    assert not ours.ended and "3 % damping" in ours.reading
    again = loops.varied(evidence, OFF, GRAVITY)
    for name, entry in again.entries.items():
        for plant in ("coupled", "decoupled"):
            expected = ours.entries[name][plant]["rms_px"]
            assert entry[plant]["rms_px"] == pytest.approx(expected, rel=1e-6)
    aligned = loops.varied(evidence, loops.ALIGNED, GRAVITY)
    early = aligned.flights["feature_error"].sel(time=0.0)
    assert float(np.abs(early).max()) < 1e-6
    assert closed_loop.below_limit(aligned).verdict == HOLDS
    assert closed_loop.below_limit(ours).verdict == FAILS
    literal = loops.varied(evidence, OFF, loops.PRINTED_G)
    assert float(np.abs(literal.flights["bend"]).max()) > float(np.abs(again.flights["bend"]).max())


@pytest.mark.long
def test_ds_that_follows_the_speed_holds_within_one_flight(
    flown: Evidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    def within(ds: Any) -> str:
        pair = [given.letters(ds, ds).sel(letter="M", model=m) for m in ("coupled", "decoupled")]
        monkeypatch.setattr(closed_loop, "_both", lambda _: pair)
        first, second = closed_loop.speed(flown).cases
        # M in 10 s is flown, whatever DS is given.
        assert second.found.verdict == HOLDS
        return first.found.verdict

    def slow_in_turns(t: np.ndarray, turns: np.ndarray) -> np.ndarray:
        return np.asarray(10.0 * np.linalg.norm(ca.paths.letter("M")(t)[1], axis=1))

    assert within(slow_in_turns) == HOLDS
    assert within(lambda t, turns: 0.01 * t) == FAILS


@pytest.mark.long
def test_ds_and_coupling_are_larger_before_convergence(
    flown: Evidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert closed_loop.before_convergence(flown).verdict == HOLDS
    one = np.ones(5001)
    monkeypatch.setattr(letter, "forces_on_uav", lambda evidence: (one, one))
    assert closed_loop.before_convergence(flown).verdict == DEPENDS


@pytest.mark.parametrize("view", [goals.completed, goals.small_errors])
def test_an_error_of_two_pixels_on_one_plant_is_no_success(view: Any) -> None:
    for decoupled, verdict in ((0.5, HOLDS), (2.0, FAILS)):
        letters = results(GOOD, GOOD | {"rms_px": decoupled})
        assert view(loop(letters)).verdict == verdict


@pytest.mark.parametrize("letter", given.LETTERS)
@pytest.mark.parametrize("plant", ["coupled", "decoupled"])
def test_a_flight_that_ended_early_is_no_success_whichever_it_is(letter: str, plant: str) -> None:
    letters = {
        name: {model: dict(GOOD) for model in ("coupled", "decoupled", "independent")}
        for name in given.LETTERS
    }
    letters[letter][plant] |= {"rms_px": np.nan, "status": 2, "end_time_s": 0.006}
    cost = given.cost((30.0, 1.0, 1.0), (20.0, 1.0, 1.0))
    found = given.evidence(
        tracking=Tracking({"letters": letters}, {"nominal": xr.Dataset()}), cost=cost
    )
    done = goals.tasks_done(found)
    assert done.verdict == DEPENDS and "1 of 8 flights" in done.evidence
    assert goals.robust_law(found).verdict == UNDECIDED
    assert summary.on_par(found).verdict == UNDECIDED


def test_a_lost_payload_says_nothing_of_the_two_plants(monkeypatch: pytest.MonkeyPatch) -> None:
    letters = {
        name: dict.fromkeys(("coupled", "decoupled"), GOOD) | {"independent": {"rms_px": np.nan}}
        for name in given.LETTERS
    }
    monkeypatch.setattr(loops, "varied", lambda *_: loop(letters))
    study = Tracking({"letters": letters}, {"nominal": xr.Dataset()})
    found = goals.robust_law(given.evidence(tracking=study))
    assert found.verdict == HOLDS and "does not come to the end" in found.evidence


@pytest.mark.parametrize(("estimate", "verdict"), [(1e-5, HOLDS), (9e-3, UNDECIDED)])
def test_what_rests_on_a_letter_that_is_not_resolved_is_not_known(
    estimate: float, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    well = GOOD | {"error_estimate": 1e-5}
    letters = results(well, well | {"error_estimate": estimate})
    monkeypatch.setattr(loops, "varied", lambda *_: loop(results(well, well)))
    study = Tracking({"letters": letters}, {"nominal": xr.Dataset()})
    found = closed_loop.JUDGES["V.13"](given.evidence(tracking=study, letter=study))
    assert found.verdict == verdict


def test_a_choice_whose_flights_are_not_resolved_is_not_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        loops, "varied", lambda *_: loop(results(GOOD, GOOD | {"error_estimate": 0.1}))
    )
    study = Tracking({"letters": results(GOOD, GOOD)}, {"nominal": xr.Dataset()})
    found = goals.tasks_done(given.evidence(tracking=study))
    assert [case.found.verdict for case in found.cases] == [HOLDS, UNDECIDED]
    assert found.verdict == UNDECIDED


def test_a_lost_point_is_no_success() -> None:
    letters = results(GOOD, GOOD | {"out_of_view_samples": 3})
    assert goals.completed(loop(letters)).verdict == FAILS


def test_a_difference_that_dies_out_is_one_of_the_start() -> None:
    def dying(t: np.ndarray, turns: np.ndarray) -> np.ndarray:
        return np.exp(-t / 5.0)

    assert goals.alike_at_the_end(tracked(dying)).verdict == HOLDS
    growing = tracked(lambda t, _: 1.0 - dying(t, _))
    assert goals.alike_at_the_end(growing).verdict == FAILS
