"""The benchmark of Rao et al. (2021): where its sub-segment Cosserat model puts the tip."""

from typing import Any

import numpy as np
import pytest

import continuair as ca
from continuair.identification import Marker, StaticPoses

TIP = np.array([0.129371, 0.145941, 0.334201])
"""From SvenLilge/tdcr-modeling, whose z points along the straight robot [m]."""


def tip(changes: dict[str, Any]) -> np.ndarray:
    """Return the tip of the preset with changes of its sections, under the benchmark's tensions."""
    vehicle = ca.load_vehicle("rao")
    sections = {f"arm.robot.section.{each}.{name}": value
                for each in ("proximal", "distal") for name, value in changes.items()
                if name != "guides"}  # fmt: skip
    guides = {f"arm.robot.tendon.{each}.guides": changes.get("guides", "disks")
              for each in ("proximal", "distal")}  # fmt: skip
    poses = StaticPoses(
        "benchmark", np.array([[4.0, 0.0, 0.0, 0.0, 2.0, 0.0]]), np.zeros((1, 1, 3)),
        [Marker("distal")], gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    found: np.ndarray = poses.predict(vehicle.replace(sections | guides))[0, 0, 0]
    return found * [1.0, 1.0, -1.0]


@pytest.mark.parametrize(
    "changes", [{}, {"strain": {"bending": 1}}, {"strain": {"bending": 2, "stretch": 0}}]
)
def test_the_tip_is_within_a_fifth_of_a_millimetre_with_disks(changes: dict[str, Any]) -> None:
    assert np.linalg.norm(tip(changes) - TIP) < 2e-4


def test_tendons_in_a_channel_miss_by_millimetres() -> None:
    assert np.linalg.norm(tip({"guides": "channel"}) - TIP) == pytest.approx(3.76e-3, abs=2e-5)
