"""Advice under a controller of the user's, and where the cost of a step decides before anything."""

from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.controllers.gain_files import load_gains
from continuair.scenario.tracking_task import SETTINGS, equipped
from continuair.studies.advise import excitations, frequencies, step_cost, study, tracking
from continuair.studies.advise.excitations import excite
from continuair.studies.advise.own_law import own_loop
from continuair.studies.advise.report import as_table
from continuair.studies.advise.verdicts import cost_verdict
from continuair.studies.excited_flights import SWELL, Loop, excited, flown_errors
from tests.own_law import law
from tests.refusals import numbers_of, refused

VEHICLE = ca.load_vehicle("paper").replace({"arm.damping_ratio": 0.05})


def mine(goal: float = 0.0, rate: float = 3.0) -> ca.Controller:
    inertia = np.diag(ca.rigid_inertia(VEHICLE))[3:]
    gains = {"goal": [0.0, 0.0, goal], "mass": VEHICLE.mass, "inertia": inertia, "rate": rate}
    return ca.Controller("mine", law, gains | {"turn_rate": 2.0 * rate}, looks=False)


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frequencies, "SCAN", np.array([0.4, 0.5, 0.8]))
    monkeypatch.setattr(excitations, "REFINED", 1)
    monkeypatch.setattr(study, "step_cost", lambda *_: {"decoupled": 1.1, "independent": 0.6})


@pytest.mark.long
def test_the_products_own_controller_given_is_the_loop_that_it_closes() -> None:
    controller = ca.flight_controller(VEHICLE, bend_bandwidth=0.0)
    given = own_loop(VEHICLE, controller)
    np.testing.assert_allclose(given.asked, 0.0, rtol=0, atol=1e-12)
    for name in ("moment", "release"):
        own, standard = (
            flown_errors(VEHICLE, name, 0.5, loop) for loop in (given, Loop("position"))
        )
        for model, error in standard.items():
            np.testing.assert_allclose(own[model], error, rtol=1e-9)


@pytest.mark.long
def test_what_a_controller_asks_of_the_arm_is_left_out_of_what_holds_it() -> None:
    """Gravity bends the arm, which the law's weight carries already."""
    loop = own_loop(VEHICLE, mine())
    start = excited(VEHICLE, "tip", 0.5, loop)
    flight = ca.simulate(VEHICLE, start, duration=1e-3, sample=1e-3, variables=["command"])
    asked = flight["command"].to_numpy()[0, 6:]
    assert np.abs(asked).min() > 0.01
    held = np.asarray(excited(VEHICLE, "tip", 0.5, Loop("position")).bend_moment)
    np.testing.assert_allclose(np.asarray(start.bend_moment) + asked, held, rtol=1e-9)


@pytest.mark.long
def test_errors_are_those_of_flights_under_the_controller(short: None) -> None:
    """Of flights that are written out here."""
    loop = own_loop(VEHICLE, mine())
    error = excite(VEHICLE, "tip", 0.02, loop)["models"]["decoupled"]["error"]
    clamped = VEHICLE.arm.clamped_frequency
    lasts = 10.0 * 2.0 * np.pi / clamped
    size = 0.2 * 2.0 * VEHICLE.arm.bending_stiffness / VEHICLE.arm.length**2

    def push(t: float) -> list[float]:
        swell = np.sin(0.5 * np.pi * min(t / (SWELL * lasts), 1.0)) ** 2
        return [size * swell * np.sin(0.5 * clamped * t), 0, 0, 0, 0, 0]

    start = excited(VEHICLE, "tip", 0.5, loop)
    scenario = ca.Scenario(
        "mine", start.q, duration=lasts, controller=mine(), tip_wrench=push,
        bend_moment=start.bend_moment,
    )  # fmt: skip
    names = ["tip_position", "tip_attitude"]
    flights = [
        ca.simulate(VEHICLE, scenario, model=model, variables=names, sample=2e-3, rtol=1e-6)
        for model in ("coupled", "decoupled")
    ]
    found = ca.compare(*(each.sel(time=slice(SWELL * lasts, None)) for each in flights))
    direct = max(found["rmse_t_m"] / VEHICLE.arm.length, found["angle_rad"])
    assert error == pytest.approx(direct, rel=0.02)
    other = excite(VEHICLE, "tip", 0.02, Loop("position"))["models"]["decoupled"]["error"]
    assert abs(other / error - 1.0) > 0.1, "the loop makes a difference here"


@pytest.mark.long
def test_advice_names_the_controller_and_begins_with_the_cost(short: None) -> None:
    results = ca.advise(VEHICLE, ["contact"], controller=mine())
    assert results["loop"]["name"] == "own"
    assert results["loop"]["controller"]["name"] == "mine"
    cost = results["cost_verdict"]
    assert numbers_of(cost)[:2] == [1.1, 0.6], "slower decoupled, cheaper independent"
    assert results["verdict"].startswith(f"{cost} contact: ")
    lines = as_table(results).splitlines()
    assert lines[2].startswith(cost[:40])
    assert any("Loop: " in line and "mine" in line for line in lines)
    assert any("Outside the atlas" in line and "mine" in line for line in lines)


@pytest.mark.long
def test_the_command_begins_with_the_cost(short: None) -> None:
    result = CliRunner().invoke(cli.app, ["advise", "paper", "--task", "contact"])
    assert result.exit_code == 0
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    said = [place for place, line in enumerate(lines) if "1.10 times" in line]
    table = next(place for place, line in enumerate(lines) if "verdict" in line)
    assert len(said) == 1 and said[0] < table


@pytest.mark.parametrize(("ratio", "reason"), [(0.5, True), (0.89, True), (0.95, False)])
def test_a_tenth_of_a_steps_time_is_a_reason(ratio: float, reason: bool) -> None:
    assert (cost_verdict({"decoupled": ratio, "independent": 0.4}) == "") == reason


@pytest.mark.long
def test_a_controller_that_looks_tracks_in_place_of_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tracking, "SCANNED", 2)
    monkeypatch.setattr(tracking, "REFINED", 1)
    monkeypatch.setattr(study, "step_cost", lambda *_: {"decoupled": 0.5, "independent": 0.4})
    gains = load_gains("paper")
    of_gains = ca.advise(VEHICLE, ["track:L"], gains=gains)
    controller = gains.controller(equipped(VEHICLE, SETTINGS["nominal"]))
    given = ca.advise(VEHICLE, ["track:L"], controller=controller)
    own, others = (each["tracking"]["track:L"] for each in (given, of_gains))
    assert own["models"] == others["models"] and own["rms_px"] == others["rms_px"]
    assert own["gains"] == "" and own["controller"] == controller.name
    assert f"track:L, controller {controller.name}" in as_table(given)
    assert given["loop"]["name"] == "position" and given["cost_verdict"] == ""


LOOKING = load_gains("paper").controller(VEHICLE)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"controller": 3}, "controller"),
        ({"controller": ca.stack([mine(), mine()])}, "controller"),
        ({"controller": mine(), "loop": "none"}, "loop"),
        ({"controller": mine(), "bandwidth": 8.0}, "bandwidth"),
        ({"controller": mine(), "tasks": ["track:M"]}, "controller"),
        ({"controller": LOOKING, "tasks": ["hover"]}, "controller"),
        ({"controller": LOOKING, "gains": load_gains("paper")}, "gains"),
        ({"controller": mine(goal=3.0), "tasks": ["hover"]}, "controller"),
        ({"controller": mine(rate=2000.0), "tasks": ["hover"]}, "controller"),
    ],
)
def test_a_controller_that_no_task_flies_is_refused_in_a_sentence(
    arguments: dict[str, Any], field: str
) -> None:
    with refused(field):
        ca.advise(VEHICLE, **arguments)


def test_the_time_of_a_step_is_that_of_a_flight_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The independent model's step is far shorter, which what prepares a flight would hide."""
    monkeypatch.setattr(step_cost, "_REPEATS", 3)
    cost = step_cost.step_cost(VEHICLE)
    assert set(cost) == {"decoupled", "independent"}
    assert 0.0 < cost["independent"] < min(1.0, cost["decoupled"])
