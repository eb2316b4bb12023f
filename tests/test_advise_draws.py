"""Verdicts on vehicles whose fields are uncertain."""

import numpy as np
import pytest

import continuair as ca
from continuair.kernels.dynamics import SIMPLER
from continuair.studies.advise.draws import Drawn
from continuair.studies.advise.study import Tolerance, advise
from continuair.studies.excited_flights import Loop
from continuair.studies.standard_loops import hover_loop
from continuair.typing import Model
from continuair.vehicle.uncertain import UncertainVehicle

pytestmark = pytest.mark.long

FIELDS = ("arm.youngs_modulus", "arm.density")
PAPER = ca.load_vehicle("paper")


def uncertain(stiffness: float, density: float) -> UncertainVehicle:
    return UncertainVehicle(PAPER, FIELDS, np.diag([stiffness**2, density**2]))


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


def test_a_tolerance_between_the_draws_is_no_verdict_and_names_the_field_that_matters() -> None:
    # Half of the draws fall less far apart than the median does, which depends on density alone.
    error = advise(PAPER, ["fast-flight"])["excitations"]["fall"]["models"]["decoupled"]["error"]
    found = advise(uncertain(0.02, 0.3), ["fast-flight"], Tolerance(tip=error * 1.001))
    entry = found["verdicts"]["fast-flight"]["decoupled"]
    assert entry["scope"] == "undecided"
    assert entry["text"].startswith("cannot tell")
    assert 0.3 < entry["agree"] < 0.7
    assert (entry["decided_by"], entry["hangs_on"]) == ("fall", "arm.density")


def test_other_draws_seldom_contradict_a_limit() -> None:
    loop = Loop("position", None, hover_loop(PAPER, "position"))
    drawn = Drawn(uncertain(0.2, 0.05), loop, 0.02)
    median = advise(PAPER, ["hover"])["excitations"]["moment"]["models"]
    part: dict[Model, object] = {model: median[model] for model in SIMPLER}
    limit = drawn.excitation("moment", part)["decoupled"]["limit_band_hz"][0]
    drawn.batch = drawn.uncertain.draws(256, seed=1)
    drawn.clamped = np.asarray(drawn.batch.arm.clamped_frequency) / (2.0 * np.pi)
    errors = drawn.errors("moment", limit, ("decoupled",))["decoupled"]
    assert 0.9 < np.mean(errors <= 0.02) < 0.99
