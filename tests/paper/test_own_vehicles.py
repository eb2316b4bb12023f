"""Sentences of the paper judged of vehicles of one's own."""

import pytest

import continuair as ca
from continuair.errors import ContinuairWarning
from continuair.studies.paper.evidence import Evidence
from continuair.studies.paper.judges import coupling_elements
from continuair.studies.sensitivity.study import sensitivity
from continuair.studies.sensitivity.task import about
from continuair.studies.verdicts import REPRODUCED


def test_verdicts_on_the_radius_do_not_hang_on_how_a_vehicle_is_written() -> None:
    rod = ca.load_vehicle("paper")
    whole = rod.replace(
        {
            "arm.bending_stiffness": rod.arm.bending_stiffness,
            "arm.mass_per_length": rod.arm.mass_per_length,
        }
    )
    assert coupling_elements.scaling(Evidence(whole)).verdict == REPRODUCED
    swept = sensitivity(whole, ["arm radius"]).results["sweeps"]["arm radius"]["rows"]
    told = sensitivity(rod, ["arm radius"]).results["sweeps"]["arm radius"]["rows"]
    for row, other in zip(swept, told, strict=True):
        error = other["models"]["decoupled"]["rmse_xy_m"]
        assert row["models"]["decoupled"]["rmse_xy_m"] == pytest.approx(error, rel=1e-6)
    assert "arm radius" not in about(whole)
    with pytest.raises(ca.InputError, match="arm.radius is missing, but sentences of the paper"):
        Evidence(whole.replace({"arm.radius": None}))


def test_sentences_are_of_direct_forces_without_drag_and_a_perfect_camera_and_say_so() -> None:
    """Noise, rotors and air would make models differ on which the paper says nothing."""
    plain = ca.load_vehicle("paper")
    noisy = plain.replace({"camera.noise": 0.3, "camera.frame_rate": 60.0, "camera.latency": 0.01})
    rotors = {"layout": "quad_x", "lever": 0.3, "thrust_limits": [0, 30], "torque_per_thrust": 0.02}
    drag = {"uav.drag": {"linear": [0.2, 0.2, 0.4]}, "arm.drag_coefficient": 1.1}
    with pytest.warns(ContinuairWarning, match="judged without uav.rotors, uav.drag, arm.drag_"):
        taken = Evidence(noisy.replace({"uav.rotors": rotors} | drag)).vehicle
    assert taken.describe() == Evidence(plain).vehicle.describe()
