"""Verdicts on vehicles whose fields are uncertain."""

import numpy as np
import pytest

import continuair as ca
from continuair.kernels.dynamics import SIMPLER
from continuair.studies.advise.draws import Drawn, deciding
from continuair.studies.advise.study import Tolerance, advise
from continuair.studies.advise.verdicts import TASKS
from continuair.studies.atlas.controlled import controlled_vehicle, sample_vehicles
from continuair.studies.excited_flights import Loop
from continuair.studies.standard_loops import hover_loop
from continuair.typing import Model
from continuair.vehicle.uncertain import DRAWS, UncertainVehicle

FIELDS = ("arm.youngs_modulus", "arm.density")
PAPER = ca.load_vehicle("paper")


def uncertain(stiffness: float, density: float) -> UncertainVehicle:
    return UncertainVehicle(PAPER, FIELDS, np.diag([stiffness**2, density**2]))


@pytest.mark.long
def test_draws_of_a_well_known_vehicle_agree_with_it() -> None:
    known = advise(PAPER, ["fast-flight", "contact"])
    found = advise(uncertain(1e-6, 1e-6), ["fast-flight", "contact"])
    for task, models in found["verdicts"].items():
        for model, entry in models.items():
            assert entry["agree"] == 1.0
            assert entry["scope"] == known["verdicts"][task][model]["scope"]
    for name, models in found["draws"].items():
        for model, part in models.items():
            error = known["excitations"][name]["models"][model]["error"]
            if part["limit_band_hz"] is None and name in ("release", "fall"):
                np.testing.assert_allclose(part["error_band"], error, rtol=1e-2)


@pytest.mark.long
def test_a_tolerance_between_the_draws_is_no_verdict_and_names_the_field_that_matters() -> None:
    # Half of the draws fall less far apart than the median does, which depends on density alone.
    error = advise(PAPER, ["fast-flight"])["excitations"]["fall"]["models"]["decoupled"]["error"]
    found = advise(uncertain(0.02, 0.3), ["fast-flight"], Tolerance(tip=error * 1.001))
    entry = found["verdicts"]["fast-flight"]["decoupled"]
    assert entry["scope"] == "undecided"
    assert entry["text"].startswith("cannot tell")
    assert 0.3 < entry["agree"] < 0.7
    assert (entry["decided_by"], entry["hangs_on"]) == ("fall", "arm.density")


@pytest.mark.long
def test_other_draws_seldom_contradict_a_limit() -> None:
    loop = Loop("position", None, hover_loop(PAPER, "position"))
    known = uncertain(0.2, 0.05)
    median = advise(PAPER, ["hover"])["excitations"]["moment"]["models"]
    part: dict[Model, object] = {model: median[model] for model in SIMPLER}
    limit = Drawn(known, loop, 0.02).excitation("moment", part)["decoupled"]["limit_band_hz"][0]
    errors = Drawn(known, loop, 0.02, seed=1).errors("moment", limit, ("decoupled",))["decoupled"]
    assert 0.9 < np.mean(errors <= 0.02) < 0.99


def flipped(known: UncertainVehicle) -> list[float]:
    """Return, of each verdict that is given, the share of other draws that contradict it."""
    found, tasks = advise(known, [*TASKS]), []
    loop = Loop("position", None, hover_loop(known.vehicle, "position"))
    drawn = Drawn(known, loop, 0.02, seed=1)
    for task, names in TASKS.items():
        for model in SIMPLER:
            entry = found["verdicts"][task][model]
            if entry["scope"] == "undecided":
                continue
            holds, lost = np.ones(DRAWS, bool), np.zeros(DRAWS, bool)
            for name in names:
                part = found["excitations"][name]["models"][model]
                once, none = part["limit_hz"] is None, entry["scope"] == "none"
                if not once and none and not np.isnan(part["limit_hz"]):
                    continue
                below = not once and entry["scope"] == "below"
                at = entry["limit"] if below else deciding(part, drawn.clamped)
                good = np.resize(drawn.errors(name, at, (model,))[model], DRAWS) <= 0.02
                if once:
                    holds &= good == part["tolerable"]
                elif none:
                    lost |= ~good
                else:
                    holds &= good
            tasks.append(float(np.mean(~holds | (entry["scope"] == "none") & ~lost)))
    return tasks


@pytest.mark.soak
def test_verdicts_on_random_vehicles_seldom_flip() -> None:
    """In draws that the verdicts did not see. Fifty vehicles take an hour."""
    rng, shares = np.random.default_rng(0), []
    vehicles = controlled_vehicle(sample_vehicles(50, 1))
    for index in range(50):
        deviations = rng.uniform([0.05, 0.02, 0.1], [0.3, 0.15, 0.5])
        fields = (*FIELDS, "arm.damping_ratio")
        shares += flipped(UncertainVehicle(vehicles.select(index), fields, np.diag(deviations**2)))
    assert len(shares) > 100
    assert np.mean(shares) <= 0.05
