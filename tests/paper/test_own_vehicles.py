"""Sentences of the paper judged of vehicles of one's own."""

from typing import Any

import pytest

import continuair as ca
from amiri2026.paper.evidence import Evidence
from amiri2026.paper.judges import (
    coupling_elements,
    dynamics,
    image,
    kinematics,
    open_loop,
    summary,
)
from amiri2026.paper.judging import judge
from amiri2026.sensitivity.study import sensitivity
from amiri2026.sensitivity.task import about
from amiri2026.verdicts import DEPENDS, HOLDS, UNDECIDED
from continuair.errors import ContinuairWarning
from tests.refusals import refused


@pytest.mark.long
def test_verdicts_on_the_radius_do_not_hang_on_how_a_vehicle_is_written() -> None:
    rod = ca.load_vehicle("paper")
    whole = rod.replace(
        {
            "arm.bending_stiffness": rod.arm.bending_stiffness,
            "arm.mass_per_length": rod.arm.mass_per_length,
        }
    )
    assert coupling_elements.scaling(Evidence(whole)).verdict == HOLDS
    swept = sensitivity(whole, ["arm radius"]).results["sweeps"]["arm radius"]["rows"]
    told = sensitivity(rod, ["arm radius"]).results["sweeps"]["arm radius"]["rows"]
    for row, other in zip(swept, told, strict=True):
        error = other["models"]["decoupled"]["rmse_xy_m"]
        assert row["models"]["decoupled"]["rmse_xy_m"] == pytest.approx(error, rel=1e-6)
    assert "arm radius" not in about(whole)
    with refused("arm.radius"):
        Evidence(whole.replace({"arm.radius": None}))


def test_sentences_are_of_direct_forces_without_drag_and_a_perfect_camera_and_say_so() -> None:
    """Noise, rotors and air would make models differ on which the paper says nothing."""
    plain = ca.load_vehicle("paper")
    noisy = plain.replace({"camera.noise": 0.3, "camera.frame_rate": 60.0, "camera.latency": 0.01})
    rotors = {"layout": "quad_x", "lever": 0.3, "thrust_limits": [0, 30], "torque_per_thrust": 0.02}
    drag = {"uav.drag": {"linear": [0.2, 0.2, 0.4]}, "arm.drag_coefficient": 1.1}
    with pytest.warns(ContinuairWarning, match="uav.rotors, uav.drag, arm.drag_"):
        taken = Evidence(noisy.replace({"uav.rotors": rotors} | drag)).vehicle
    assert taken.describe() == Evidence(plain).vehicle.describe()


SIMILAR: dict[str, dict[str, Any]] = {
    "gram": {
        "arm.length": 0.01, "arm.radius": 5e-5, "uav.mass": 2e-6,
        "uav.inertia": [2.4e-12, 2.4e-12, 4.7e-12], "arm.youngs_modulus": 2e9,
    },
    "long": {"arm.length": 12.0, "arm.radius": 0.03},
    "thick": {"arm.length": 0.05, "arm.radius": 0.01},
}  # fmt: skip


FORMULAS: dict[str, Any] = kinematics.JUDGES | coupling_elements.JUDGES
FORMULAS |= {"III-C.3": dynamics.JUDGES["III-C.3"]}
FORMULAS["III-D.12"] = image.JUDGES["III-D.12"]


def verdicts_on_formulas(**changes: Any) -> dict[str, str]:
    evidence = Evidence(ca.load_vehicle("paper").replace(changes))
    return {key: judge_of(evidence).verdict for key, judge_of in FORMULAS.items()}


@pytest.fixture(scope="module")
def of_the_preset() -> dict[str, str]:
    return verdicts_on_formulas()


@pytest.mark.long
@pytest.mark.parametrize("name", ["gram", "long"])
def test_verdicts_on_formulas_do_not_hang_on_how_long_the_arm_is(
    name: str, of_the_preset: dict[str, str]
) -> None:
    assert verdicts_on_formulas(**SIMILAR[name]) == of_the_preset


STUB = {"arm.length": 0.02, "uav.mass": 0.02, "uav.inertia": [4e-6, 4e-6, 8e-6]}


@pytest.mark.long
@pytest.mark.parametrize("other", [SIMILAR["thick"], STUB])
def test_fast_arms_keep_energy_and_momenta_in_free_flight(other: dict[str, Any]) -> None:
    """The stub has a mode at 24 kHz, of which short steps leave nothing out."""
    vehicle = ca.load_vehicle("paper").replace(other)
    assert summary.mutual_interactions(Evidence(vehicle)).verdict == HOLDS


def test_a_heavy_arm_below_a_light_uav_falls_freely(monkeypatch: pytest.MonkeyPatch) -> None:
    light = {"arm.radius": 0.02, "uav.mass": 0.5, "uav.inertia": [0.002, 0.002, 0.003]}
    evidence = Evidence(ca.load_vehicle("paper").replace(light))
    fall = open_loop.JUDGES["IV-A.4"]
    assert fall(evidence).verdict == HOLDS
    monkeypatch.setattr(open_loop, "GRAVITY", 9.8)
    assert fall(evidence).verdict == DEPENDS


def test_a_camera_that_looks_sideways_has_no_theorem_and_says_so() -> None:
    """Where the UAV pitches by a quarter turn, Euler angles have no rates, and M is singular."""
    sideways = ca.load_vehicle("paper").replace({"camera.attitude": [0.0, 0.5**0.5, 0.0, 0.5**0.5]})
    (found,) = judge(["III-D.17"], Evidence(sideways))
    assert found["verdict"] == UNDECIDED
    assert "amera.attitude is" in found["evidence"] and "90°" in found["evidence"]
