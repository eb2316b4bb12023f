"""Judges of the parameter study: cases over vehicles and readings, and vehicles drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026.paper import drawn_sweeps
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import parameters, sweep_cases
from amiri2026.sensitivity import task
from amiri2026.sensitivity.once import sweep_once
from amiri2026.verdicts import DEPENDS, HOLDS, MISPRINT, UNDECIDED
from tests.paper import given

Array = np.ndarray


def test_a_force_of_10_hz_repeats_itself_after_a_tenth_of_a_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = parameters.JUDGES["IV-B.4"](given.evidence())
    assert found.verdict == MISPRINT
    # |sin(x + 1) - sin(x)| is at most 2 sin(1/2).
    (change,) = found.numbers.values()
    assert change == pytest.approx(2.0 * np.sin(0.5), rel=1e-5)
    monkeypatch.setattr(task, "FREQUENCY", 20.0 * np.pi)
    assert parameters.JUDGES["IV-B.4"](given.evidence()).verdict == HOLDS


def with_one_sweep(vehicle: str, quick: bool) -> Evidence:
    """Evidence whose sweeps are all that of the UAV mass of the preset `paper`."""
    evidence = Evidence(ca.load_vehicle(vehicle), quick=quick)
    sweep = sweep_once(ca.load_vehicle("paper"), "UAV mass")
    study: Any = type("Study", (), {"results": {"sweeps": dict.fromkeys(task.PARAMETERS, sweep)}})()
    evidence.__dict__ |= {"sensitivity": study, "sensitivity_hertz": study}
    evidence._swept |= {
        (name, parameter, hertz, False): sweep
        for name in ("paper", "table1")
        for parameter in task.PARAMETERS
        for hertz in (False, True)
    }
    return evidence


@pytest.mark.long
@pytest.mark.parametrize("quick", [False, True])
def test_sentences_are_judged_of_two_vehicles_in_both_readings_of_f(quick: bool) -> None:
    found = parameters.JUDGES["IV-B.12"](with_one_sweep("paper", quick))
    assert found.verdict == HOLDS
    assert [(case.vehicle, case.reading) for case in found.cases] == [
        (name, reading)
        for name in ("paper", "table1")
        for reading in (sweep_cases.RADIANS, sweep_cases.HERTZ)
    ]
    alone = sweep_cases.swept(with_one_sweep("table1", quick))
    assert [each.vehicle for each in alone] == ["table1", "table1"]


@pytest.mark.long
def test_a_vehicle_drawn_flies_as_it_does_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measured at every fourth sample."""
    monkeypatch.setattr(drawn_sweeps, "VEHICLES", 2)
    vehicle = ca.load_vehicle("paper")
    drawn = drawn_sweeps.fly_drawn_sweep(vehicle, "arm length", hertz=True)
    assert drawn.usable.all()
    one = parameters._drawn_vehicle(vehicle, drawn, 1)
    assert float(one.uav.mass) == drawn.fields["uav.mass"][1]
    rows = sweep_once(one, "arm length", hertz=True)["rows"]
    errors = [row["models"]["decoupled"]["rmse_xy_m"] for row in rows]
    np.testing.assert_allclose(drawn.measured["error"][1], errors, rtol=0.01)
    swings = [row["oscillation_m"] for row in rows]
    np.testing.assert_allclose(drawn.measured["oscillation_m"][1], swings, rtol=1e-3)


def test_vehicles_that_are_not_resolved_are_not_counted() -> None:
    def judged(holds: list[bool], usable: list[bool]) -> str:
        drawn = drawn_sweeps.DrawnSweep({}, {}, np.array(usable))
        return parameters._share(drawn, np.array(holds)).verdict

    assert judged([True, True, False, False], [True, True, True, False]) == HOLDS
    assert judged([True, True, False, False], [False, False, False, False]) == UNDECIDED


@pytest.mark.long
@pytest.mark.parametrize("name", ["IV-B.9", "IV-B.17", "IV-B.18", "IV-B.27"])
def test_what_depends_holds_for_one_case_and_fails_for_another(name: str) -> None:
    found = parameters.JUDGES[name](_flown())
    assert found.verdict == DEPENDS
    verdicts = [case.found.verdict for case in found.cases]
    assert {"holds", "fails"} <= set(verdicts)


_KEPT: list[Evidence] = []


def _flown() -> Evidence:
    """Evidence of the preset `paper`, with its own sweeps flown once."""
    if not _KEPT:
        evidence = Evidence(ca.load_vehicle("paper"))
        for name, hertz in (("sensitivity", False), ("sensitivity_hertz", True)):
            sweeps = {
                key: sweep_once(evidence.vehicle, key, hertz=hertz) for key in task.PARAMETERS
            }
            study: Any = type("Study", (), {"results": {"sweeps": sweeps}})()
            evidence.__dict__[name] = study
        _KEPT.append(evidence)
    return _KEPT[0]
