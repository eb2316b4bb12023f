"""Camera at the tip of an arm."""

from __future__ import annotations

from typing import Literal

from continuair.vehicle.fields import (
    CountPair,
    Name,
    NotNegative,
    Pair,
    Part,
    PositivePair,
    Vector,
)
from continuair.vehicle.inertia import UnitQuaternion


class Camera(Part):
    """Camera at the tip of an arm, with its optical axis along +z of the tip frame, the tangent."""

    arm: Name = ""
    """the name or the index, as text, of the arm that carries the camera; the first by default"""

    focal_length: PositivePair = (800.0, 800.0)
    """the focal lengths along the image's axes, as 2 numbers [px]"""

    principal_point: Pair = (500.0, 500.0)
    """the image coordinates of the optical axis, as 2 numbers [px]"""

    image_size: CountPair = (1000, 1000)
    """the width and height of the image, as 2 whole numbers [px]"""

    position: Vector = (0.0, 0.0, 0.0)
    """the position of the camera in the tip frame, as 3 numbers [m]"""

    attitude: UnitQuaternion = (0.0, 0.0, 0.0, 1.0)
    """the rotation from camera axes to the tip frame, as a unit quaternion (x, y, z, w) [-]"""

    tip_frame: Literal["untwisted", "frenet"] = "untwisted"
    """the tip frame: untwisted, as the material is, or frenet, spinning with the bend direction"""

    noise: NotNegative = 0.0
    """the standard deviation of the feature points' noise [px]"""

    frame_rate: NotNegative = 0.0
    """the frames per second, 0 for one at every control instant [Hz]"""

    latency: NotNegative = 0.0
    """the time from a frame's exposure until the controller has it [s]"""
