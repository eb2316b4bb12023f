"""Advice: limits bracket the tolerance, light arms may be decoupled, sentences say what follows."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import continuair as ca
import continuair.cli as cli
from continuair.controllers.gain_files import Gains, load_gains
from continuair.figures import advise as figures
from continuair.studies.advise import study as advise
from continuair.studies.advise import tracking
from continuair.studies.advise.excitations import attribute, excite, missed
from continuair.studies.advise.report import as_table
from continuair.studies.advise.tracking import tracking_limit
from continuair.studies.advise.verdicts import verdict
from continuair.studies.results import as_json
from tests.refusals import assert_refused, numbers_of

VEHICLE = ca.load_vehicle("paper")
LIGHT = VEHICLE.replace({"arm.density": 0.1, "arm.youngs_modulus": 207e9 * 0.1 / 7850.0})
"""The arm with 1/78500 of its mass, and the same bending frequency."""


@pytest.fixture(scope="module")
def contact() -> dict[str, Any]:
    return advise.advise(VEHICLE, ["contact"], advise.Tolerance(tip=0.1))


def test_the_error_is_tolerable_up_to_the_limit_and_not_beyond() -> None:
    found = excite(VEHICLE, "moment", 0.02)["models"]["decoupled"]
    hz, errors = np.array(found["hz"]), np.array(found["errors"])
    at = np.flatnonzero(hz == found["limit_hz"])
    assert at.size == 1
    assert (errors[: at[0] + 1] <= 0.02).all()
    assert errors[at[0] + 1] > 0.02
    # The limit is known to a few percent.
    assert hz[at[0] + 1] / hz[at[0]] < 1.05


def test_an_arm_that_weighs_next_to_nothing_may_be_decoupled() -> None:
    heavy, light = (excite(v, "bend", 0.02)["models"]["decoupled"] for v in (VEHICLE, LIGHT))
    assert light["error"] < 0.003 * heavy["error"]
    assert math.isinf(light["limit_hz"])


def test_only_a_fall_carries_the_arm_along() -> None:
    found = {name: attribute(VEHICLE, name) for name in ("release", "fall")}
    assert found["fall"]["carriage"] > 1e-3 > 1e-12 > found["release"]["carriage"]


@pytest.mark.long
def test_slower_targets_are_within_the_limit_and_faster_ones_are_not() -> None:
    found = tracking_limit(VEHICLE, "L", load_gains("paper"), ("decoupled",), 0.7)
    entry = found["models"]["decoupled"]
    speed, ds = np.array(entry["speed_m_s"]), np.array(entry["ds_px"])
    assert found["rms_px"] < 1.0
    assert (ds[speed <= entry["limit_m_s"]] <= 0.7).all()
    assert ds[speed > entry["limit_m_s"]][0] > 0.7


@pytest.mark.long
def test_what_a_slow_law_leaves_of_a_start_is_not_taken_for_the_targets_speed() -> None:
    """An integral brings a start that is off home slowly, and changes the limit by little."""

    def limit(**more: Any) -> float:
        slow = Gains("slow", {"bandwidth": 6.0, "conditioning": 0.002, "gains": "current", **more})
        found = tracking_limit(VEHICLE, "R", slow, ("decoupled",), 0.7)
        return float(found["models"]["decoupled"]["limit_m_s"])

    assert limit(integral=0.4) == pytest.approx(limit(), rel=0.15)


def results(limit: float, tolerable: bool = True) -> dict[str, Any]:
    once = {"limit_hz": None, "tolerable": tolerable, "error": 0.01 if tolerable else 0.1}
    hz = {"limit_hz": limit, "tolerable": True, "hz": [0.5, 3.17], "errors": [0.01, 0.03]}
    return {
        "tracking": {},
        "excitations": {
            "force": {"models": {"decoupled": hz}, "responsible": "inertia"},
            "fall": {"models": {"decoupled": once}, "responsible": "carriage"},
        },
    }


@pytest.mark.parametrize(
    ("limit", "tolerable", "scope", "hz", "missing"),
    [
        (math.inf, True, "all", [3.1], []),
        (2.5, True, "below", [2.5], ["inertia"]),
        (math.nan, True, "none", [], ["inertia"]),
        (math.inf, False, "all", [3.1], ["carriage"]),
        (2.5, False, "below", [2.5], ["inertia", "carriage"]),
    ],
)
def test_the_sentence_follows_from_limits(
    limit: float, tolerable: bool, scope: str, hz: list[float], missing: list[str]
) -> None:
    found = verdict(results(limit, tolerable), "fast-flight", "decoupled")
    assert found["scope"] == scope
    assert ("do not decouple" in found["text"]) == (scope == "none")
    assert ("not in free fall" in found["text"]) == (not tolerable)
    assert numbers_of(found["text"]) == hz
    assert re.findall(r"missing effect: (\w+)", found["text"]) == missing
    # As JSON has null alike for no limit and none tolerable.
    assert list(found["scopes"].values()) == [scope]


def test_what_is_missed_is_found_and_told_of_the_decoupled_model_alone() -> None:
    case = results(2.5, False)
    for part in case["excitations"].values():
        part["models"]["independent"] = part["models"]["decoupled"]
    text = verdict(case, "fast-flight", "independent")["text"]
    assert "2.5 Hz" in text and "not in free fall" in text and "missing" not in text


def test_what_limit_and_exception_both_miss_is_told_once() -> None:
    case = results(2.5, False)
    case["excitations"]["fall"]["responsible"] = "inertia"
    text = verdict(case, "fast-flight", "decoupled")["text"]
    assert "2.5 Hz" in text and "not in free fall" in text and text.count("inertia") == 1


@pytest.mark.parametrize(
    ("name", "errors"),
    [("force", {"errors": [math.nan, 0.03], "limit_hz": math.nan}), ("fall", {"error": math.nan})],
)
def test_where_the_coupled_model_is_lost_nothing_is_decided(
    name: str, errors: dict[str, Any]
) -> None:
    case = results(2.5)
    case["excitations"][name]["models"]["decoupled"] |= errors
    found = verdict(case, "fast-flight", "decoupled")
    assert found["scope"] == "undecided" and "missed" not in found["text"]
    assert "coupled" in found["text"] and name in found["text"]


def test_a_tip_that_is_pushed_harder_the_stiffer_it_is_is_to_be_softer() -> None:
    case = results(2.5)
    tip = {"errors": [math.nan, 0.03], "limit_hz": math.nan, "hz": [1.0, 2.0], "error": math.nan}
    case["excitations"]["tip"] = {"models": {"decoupled": tip}, "amplitude": 357.0}
    text = verdict(case, "contact", "decoupled")["text"]
    assert "its load, 357 N, exceeds" in text and "softer arm" in text


def test_no_coupling_is_blamed_where_flights_without_each_are_lost() -> None:
    assert missed(dict.fromkeys(("carriage", "inertia", "coriolis"), math.inf), math.nan) == ""
    alone = {"carriage": 0.01, "inertia": math.inf, "coriolis": 0.02}
    assert missed(alone, math.inf) == "inertia"


@pytest.mark.long
def test_advice_is_stored_as_strict_json_a_table_and_a_figure(
    contact: dict[str, Any], tmp_path: Path
) -> None:
    stored = json.loads(as_json(contact), parse_constant=lambda name: pytest.fail(name))
    assert stored["study"] == "advise"
    assert stored["verdicts"]["contact"]["decoupled"]["text"] in as_table(contact)
    assert stored["loop"]["controller"]["name"] == "flight controller"
    assert set(stored["step_over_coupled"]) == {"decoupled", "independent"}
    figures.advice(contact).savefig(tmp_path / "advise.png")
    assert (tmp_path / "advise.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "field", "fact"),
    [
        (("papre",), "vehicle", "use paper"),
        (("paper", "--task", "hoover"), "task", "use hover"),
        (("paper", "--tolerance", "-1"), "tolerance", "-1.0"),
        (("paper", "--pixels", "nan"), "pixels", "nan"),
        (("paper", "--gains", "none"), "gains", "'none'"),
        (("paper", "--gains", ""), "gains", "''"),
        (("paper", "--task", "hover", "--gains", "paper"), "gains", "paper"),
        (("paper", "--task", "contact", "--pixels", "1"), "pixels", "--task track:M"),
        (("paper", "--loop", "postion"), "loop", "use position"),
        (("paper", "--loop", "none", "--bandwidth", "8"), "bandwidth", "8"),
        (("paper", "--bandwidth", "0"), "attitude_bandwidth", "0"),
    ],
)
def test_unusable_input_is_refused_in_a_sentence(
    arguments: tuple[str, ...], field: str, fact: str
) -> None:
    assert_refused(CliRunner().invoke(cli.app, ["advise", *arguments]), field, fact)


def test_a_lost_target_decides_nothing() -> None:
    found = {
        "tracking": {
            "track:M": {
                "rms_px": math.nan,
                "gains": "paper",
                "models": {"decoupled": {"limit_m_s": math.nan}},
            }
        },
        "called": "my.toml",
    }
    entry = verdict(found, "track:M", "decoupled")
    assert entry["scope"] == "undecided" and "gains paper" in entry["text"]
    assert "`continuair tune --vehicle my.toml --out gains.toml`" in entry["text"]
    assert "`continuair advise my.toml --gains gains.toml`" in entry["text"]


def test_where_the_coupled_plant_itself_loses_a_target_is_told() -> None:
    found = {"rms_px": 0.1, "gains": "paper", "models": {"decoupled": {"limit_m_s": 0.35}}}
    for lost, told in ((0.4557, [0.35, 0.45]), (math.inf, [0.35])):
        task = {"tracking": {"track:M": found | {"lost_from_m_s": lost}}}
        text = verdict(task, "track:M", "decoupled")["text"]
        assert numbers_of(text) == told


def test_couplings_that_cancel_are_named_together() -> None:
    parts = {"carriage": 0.0, "inertia": 0.4, "coriolis": 0.7}
    assert missed(parts, 0.18).startswith("recoil")
    assert missed(parts, 0.5) == "coriolis"


def test_the_speed_of_a_target_is_that_of_no_draw_of_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With noise |DS| was 0.69 to 0.78 px by the seed, of a vehicle that has 0.32 px without."""
    monkeypatch.setattr(tracking, "SCANNED", 2)
    monkeypatch.setattr(tracking, "REFINED", 1)
    clear = ca.load_vehicle("paper")
    noisy = clear.replace({"camera.noise": 0.5})
    gains = load_gains("paper")
    found, of_noisy = (
        tracking.tracking_limit(each, "L", gains, ("decoupled",), 0.7) for each in (clear, noisy)
    )
    assert of_noisy == found
    assert any("noise of 0.5 px" in each for each in tracking.tracking_notes(noisy))
    assert not any("noise" in each for each in tracking.tracking_notes(clear))
