"""What the tracking study and its search are given: gains of a file, letters, sizes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import continuair as ca
from amiri2026.tracking.tuning import tune
from continuair.controllers.gain_files import Gains, load_gains
from continuair.scenario.tracking_task import chosen_letters
from tests.refusals import refused


@pytest.fixture(scope="module")
def vehicle() -> ca.Vehicle:
    return ca.load_vehicle("paper")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("bandwith = 3\n", "bandwith"),
        ("sigma = 3\n", "bandwidth"),
        ("Kp = 3\n", "Kd"),
        ("bandwidth = 3\nKp = 2\n", "bandwidth"),
        ("bandwidth = \n", "file"),
    ],
)
def test_unusable_gains_are_refused_in_a_sentence(text: str, field: str, tmp_path: Path) -> None:
    file = tmp_path / "gains.toml"
    file.write_text(text, encoding="utf-8")
    with refused(field, place=file):
        load_gains(file)


def test_gains_may_be_given_themselves(vehicle: ca.Vehicle) -> None:
    law = Gains("mine", {"Kp": 40.0, "Kd": 0.04, "compensation": "literal"}).controller(vehicle)
    assert np.array_equal(law.gains["Kp"], 40.0 * np.eye(8))


@pytest.mark.parametrize("letters", ["", "MX", "7"])
def test_unknown_letters_are_refused(letters: str) -> None:
    with refused("letters"):
        chosen_letters(letters)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"candidates": 100}, "candidates"),
        ({"candidates": 0}, "candidates"),
        ({"rounds": 0}, "rounds"),
        ({"seed": -1}, "seed"),
    ],
)
def test_a_search_of_no_size_is_refused(
    options: dict[str, Any], field: str, vehicle: ca.Vehicle
) -> None:
    with refused(field):
        tune(vehicle, **options)
