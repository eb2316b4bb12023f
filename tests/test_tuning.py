"""The search for gains: it returns the best that it found, whatever flies, and says what fails."""

import json
import shlex
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
from amiri2026.tracking import tuning
from amiri2026.tracking.candidates import LOST, fly, fly_whole
from amiri2026.tracking.tuning import as_toml, tune
from continuair.cli.commands import app
from continuair.controllers.gain_files import Gains, load_gains
from continuair.equations.camera import facing
from continuair.kernels.dynamics import PLANTS
from continuair.scenario.tracking_task import START_BEND, START_OFFSET, damping_notes
from continuair.vehicle import vehicle_file
from tests.new_user import NEW_USER
from tests.refusals import numbers_of

PAPER = ca.load_vehicle("paper")
LATE = PAPER.replace({"camera.latency": 3.0})
"""With a camera whose frames come so late that every law loses its target."""


def flown(vehicle: ca.Vehicle, law: ca.Controller, path: ca.paths.Path) -> tuple[float, float]:
    """RMS feature error [px] and distance from above the target [m] after 5 s on the coupled plant,
    from where letters start."""
    target = ca.Target(path)
    q = np.zeros(8)
    q[:3], q[3:6] = facing(vehicle, path([0.0])[0][0], target.distance)
    q[:3] += START_OFFSET
    q[6] = START_BEND
    scenario = ca.Scenario(path.name, q, controller=law, target=target, duration=path.duration)
    names = ["feature_error", "camera_position", "target_position"]
    data = ca.simulate(vehicle, scenario, sample=2e-2, variables=names)
    assert data["status"] == 0
    late = data.sel(time=slice(5.0, None))
    off = (late["camera_position"] - late["target_position"]).isel(axis=slice(2))
    return (
        float(np.sqrt((late["feature_error"] ** 2).mean())),
        float(np.sqrt((off**2).sum("axis").mean())),
    )


@pytest.mark.long
def test_a_new_users_vehicle_is_tuned_and_writes_a_letter_and_an_eight(tmp_path: Path) -> None:
    found = tune(NEW_USER, settings=["nominal"], candidates=16, rounds=2)
    assert found["flies"] and not found["remarks"] and not found["record"]["lost"]
    runs = [fly(NEW_USER, [found["gains"]], "M", "nominal", plant) for plant in PLANTS]
    # Of the gains that are written, with their margins taken off.
    assert found["record"]["objective"] == np.mean([run.cost for run in runs])
    file = tmp_path / "gains.toml"
    file.write_text(as_toml(found), encoding="utf-8")
    law = load_gains(file).controller(NEW_USER)
    # What is told is of the whole letter, of which the search flies two fifths.
    pixels, _ = flown(NEW_USER, law, ca.paths.letter("M", duration=50.0))
    assert found["record"]["rms_px"]["nominal.coupled"]["M"] == pytest.approx(pixels, rel=1e-3)
    pixels, metres = flown(NEW_USER, law, ca.paths.letter("R", duration=50.0))
    assert pixels < 1.0 and metres < 0.05
    eight = ca.paths.lissajous(period=40.0, duration=45.0)
    pixels, metres = flown(NEW_USER, law, eight)
    assert pixels < 5.0 and metres < 0.08


@pytest.mark.long
@pytest.mark.parametrize("name", ["slender", pytest.param("two_section", marks=pytest.mark.soak)])
def test_slender_arms_and_arms_of_two_sections_are_tuned(name: str) -> None:
    vehicle = ca.load_vehicle(name)
    found = tune(vehicle, settings=["fast"], candidates=8, rounds=1)
    assert found["flies"] and found["remarks"] == damping_notes(vehicle)
    assert max(each["M"] for each in found["record"]["rms_px"].values()) < 20.0


def test_candidates_of_both_kinds_fly_in_the_first_round() -> None:
    rows = [
        {"gains": gains, "bandwidth": 6.0, "conditioning": μ}
        for μ in (2e-3, 5e-3)
        for gains in ("current", "constant")
    ]
    together = fly(PAPER, rows, ["L"], "fast", "coupled")
    for index, row in enumerate(rows):
        alone = fly(PAPER, [row], ["L"], "fast", "coupled")
        assert alone.pixels[0, 0] == pytest.approx(together.pixels[index, 0], rel=1e-9)
    assert len(np.unique(together.pixels)) == 4


def test_a_search_in_which_every_candidate_is_lost_says_why_and_returns_the_best() -> None:
    found = tune(LATE, ["L"], ["fast"], candidates=2, rounds=1)
    assert not found["flies"] and not found["record"]["rms_px"]
    for plant in ("coupled", "decoupled"):
        assert "lost from view at" in found["record"]["lost"][f"fast.{plant}"]["L"]
        assert any(
            line.startswith(f"fast, {plant}, letter L ") and "0 of 4 candidates" in line
            for line in found["remarks"]
        )
    stored = tomllib.loads(as_toml(found))
    assert stored["record"]["lost"]["fast"]["coupled"] == found["record"]["lost"]["fast.coupled"]
    assert Gains("best", found["gains"]).controller(LATE).integral == 0.0


@pytest.mark.long
def test_one_setting_that_fails_is_told_and_the_others_are_flown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def failing(flies: Any) -> Any:
        def outcomes_of(*arguments: Any) -> Any:
            outcomes = flies(*arguments)
            if arguments[3] != "camera":
                return outcomes
            lost = np.full(outcomes.pixels.shape, LOST)
            why = np.full(lost.shape, "not finite at 2 s", dtype=object)
            return type(outcomes)(lost, lost, 0.0 * lost, why)

        return outcomes_of

    monkeypatch.setattr(tuning, "fly", failing(fly))
    monkeypatch.setattr(tuning, "fly_whole", failing(fly_whole))
    found = tune(PAPER, ["L"], ["fast", "camera"], candidates=4, rounds=1)
    assert found["flies"]
    assert set(found["record"]["rms_px"]) == {"fast.coupled", "fast.decoupled"}
    told = found["remarks"][len(damping_notes(PAPER)) :]
    assert [line.split(",")[:2] for line in told] == [
        ["camera", " coupled"],
        ["camera", " decoupled"],
    ]
    assert all(numbers_of(line) == [2.0, 0.0, 8.0, 20.0] for line in told)


@pytest.mark.long
@pytest.mark.parametrize("calls", [0, 1, 3])
def test_an_interrupted_search_returns_the_best_so_far(
    calls: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def interrupted(*arguments: Any) -> Any:
        if len(made) == calls:
            raise KeyboardInterrupt
        made.append(0)
        return fly(*arguments)

    monkeypatch.setattr(tuning, "fly", interrupted)
    search = (PAPER, ["L"], ["fast"])
    if not calls:
        with pytest.raises(KeyboardInterrupt):
            tune(*search, candidates=4, rounds=2)
        return
    found = tune(*search, candidates=4, rounds=2)
    assert found["interrupted"] and found["flies"]
    assert "interrupted" in found["remarks"][1]
    assert not found["record"]["lost"]
    run = fly_whole(PAPER, found["gains"], ["L"], "fast", "coupled")
    assert found["record"]["rms_px"]["fast.coupled"]["L"] == pytest.approx(run.pixels[0, 0])


@pytest.mark.long
def test_rotors_that_cannot_push_in_any_direction_are_left_out_and_told() -> None:
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0]}
    flat = NEW_USER.replace({"uav.rotors": rotors | {"lag": 0.03, "torque_per_thrust": 0.02}})
    found = tune(flat, settings=["nominal"], candidates=2, rounds=1)
    assert "without rotors" in found["remarks"][0] and "twist_servoing" in found["remarks"][0]


@pytest.mark.parametrize(
    ("interrupted", "flies", "code"), [(False, True, 0), (False, False, 1), (True, True, 130)]
)
def test_the_command_writes_the_gains_tells_what_they_lose_and_ends_with_its_code(
    interrupted: bool, flies: bool, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = {"rms_px": {"fast.coupled": {"L": 2.0}}, "lost": {}, "seed": 0}
    found = {
        "gains": {"gains": "current", "bandwidth": 5.0}, "record": record,
        "remarks": ["fast, decoupled, letter L is lost."],
        "interrupted": interrupted, "flies": flies,
    }  # fmt: skip
    monkeypatch.setattr(tuning, "tune", lambda *_, **__: found)
    out = tmp_path / "gains.toml"
    result = CliRunner().invoke(app, ["tune", "--vehicle", "two_section", "--out", str(out)])
    assert result.exit_code == code
    assert load_gains(out).settings == found["gains"]
    assert ["fast", "coupled", "L", "2"] in [line.split() for line in result.stderr.splitlines()]
    assert "letter L is lost" in result.stderr and "# fast, decoupled" in out.read_text("utf-8")
    assert "continuair tracking --vehicle two_section --gains" in result.stderr
    assert json.dumps(found["gains"]["gains"]) in out.read_text("utf-8")


def test_the_command_names_one_that_flies_the_vehicle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`tracking` refuses rotors that cannot push in any direction; `advise` leaves them out."""
    found = {
        "gains": {"gains": "current", "bandwidth": 5.0}, "interrupted": False, "flies": True,
        "record": {"rms_px": {}, "lost": {}, "seed": 0}, "remarks": [],
    }  # fmt: skip
    monkeypatch.setattr(tuning, "tune", lambda *_, **__: found)
    rotors = {"layout": "quad_x", "lever": 0.25, "thrust_limits": [0.0, 15.0]}
    flat = NEW_USER.replace({"uav.rotors": rotors | {"torque_per_thrust": 0.02}})
    for vehicle, command in ((flat, "advise"), (NEW_USER, "tracking")):
        file, out = tmp_path / f"my {command}.toml", tmp_path / f"{command}_gains.toml"
        file.write_text(vehicle_file.as_toml(vehicle), encoding="utf-8")
        result = CliRunner().invoke(app, ["tune", "--vehicle", str(file), "--out", str(out)])
        asked = result.stderr.partition("fly them with: ")[2].strip()
        words = [command, *(["--vehicle"] if command == "tracking" else []), str(file)]
        assert shlex.split(asked)[1 : len(words) + 1] == words
